"""Eccentricity of the wave generator: the lobes share the load unequally, once a turn."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible
from hdsim.effects._kernels import harmonics
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


class WaveGeneratorEccentricity(Effect):
    """e = (beta d / r) sin(theta_m + phase).

    The fixed spline sits off the wave generator's axis by d. Lobe 1 (share (1+beta)/2 of the load) and
    lobe 2 (share (1-beta)/2) meet it at opposite points, so its tangential offset d sin(theta_m) turns the
    output by (+(1+beta)/2 - (1-beta)/2) d sin(theta_m) / r: with equal lobes nothing is left, with an
    imbalance the share beta.
    """

    title: ClassVar[str] = "wave-generator eccentricity"
    source: ClassVar[str] = (
        "derived above from the balance of two lobes; order: Yao et al. 2022 (kinematic error spectrum of "
        "harmonic drives); numbers are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle",),
        channels=("output_angle", "motor_torque"),
        orders=(1.0,),
        confused_with={
            "sensors": "an eccentric motor encoder gives order 1 too, but divided by the ratio and without "
            "torque; it moves when the encoder is re-clocked",
            "unbalance": "a motor unbalance is a torque: it shows in the current, and not in the "
            "quasi-static transmission error",
            "kinematic_error": "the dominant order is 2",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Harmonic("eccentricity_um", "phase_deg", 10.0),), turns=1.0),
    )

    # Five millimetres cannot be assembled.
    eccentricity_um: Annotated[
        float,
        Plausible(
            1.0,
            300.0,
            "run-out of shaft and bore: at the lobes' imbalance of 0.02 only their product is seen",
        ),
    ] = Field(10.0, ge=0, le=5000)
    """Offset d of the axes of wave generator and fixed spline, um."""
    lobe_imbalance: float = Field(0.02, ge=0, le=1)
    """Difference of the two lobes' shares of the load, beta (0: equal)."""
    pitch_radius_mm: Annotated[float, FIXED] = Field(25.0, gt=0)
    """Radius on which the teeth meet, mm."""
    phase_deg: Annotated[float, FIXED] = 0.0
    """Phase at zero motor angle, degrees."""

    def contribute(self, build: Builder) -> None:
        """Add order 1 per wave-generator turn to the mesh twist."""
        amplitude = self.lobe_imbalance * self.eccentricity_um * 1e-3 / self.pitch_radius_mm
        build.twist(harmonics, [1.0, amplitude, 1.0, 0.0, math.radians(self.phase_deg)])
