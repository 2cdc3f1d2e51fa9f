"""Eccentricity of the output member: an error once per output turn."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible
from hdsim.effects._kernels import harmonics
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


class OutputEccentricity(Effect):
    """e = (d / r) sin(theta_l + phase): run-out d of the output's coupling circle of radius r."""

    title: ClassVar[str] = "output eccentricity"
    source: ClassVar[str] = (
        "first-order kinematics of an eccentric circle (angle d/r); the default of 2 um, 0.55 arcmin peak to "
        "peak, is an estimate: what the catalogue's accuracy of 1 arcmin leaves room for"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("output_angle",),
        channels=("output_angle",),
        orders=(0.01,),
        confused_with={
            "sensors": "an eccentric output encoder gives the same order: it moves with the encoder when "
            "re-clocked and two opposed heads cancel it, with no torque",
            "unbalance": "an unbalance at the output scales with gravity and shows in the motor torque",
            "kinematic_error": "its order 1 per output turn is the same trace: one of the two is enough",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting((Harmonic("eccentricity_um", "phase_deg", 2.0),)),)

    # Two millimetres cannot be assembled.
    eccentricity_um: Annotated[float, Plausible(0.5, 100.0, "run-out of a turned seat, a few to 100 um")] = (
        Field(2.0, ge=0, le=2000)
    )
    """Run-out (offset of the centres) d, um."""
    radius_mm: Annotated[float, FIXED] = Field(25.0, gt=0)
    """Radius r on which the torque passes to the output, mm."""
    phase_deg: Annotated[float, FIXED] = 0.0
    """Phase at zero output angle, degrees."""

    def contribute(self, build: Builder) -> None:
        """Add order 1 per output turn to the mesh twist."""
        amplitude = self.eccentricity_um * 1e-3 / self.radius_mm
        build.twist(harmonics, [1.0, amplitude, 0.0, 1.0, math.radians(self.phase_deg)])
