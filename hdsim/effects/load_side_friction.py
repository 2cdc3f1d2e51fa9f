"""Coulomb and viscous friction of the output bearing and seal."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.effects._kernels import coulomb_viscous
from hdsim.kernel import OUTPUT_TORQUE
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


class LoadSideFriction(Effect):
    """T = -(T_c tanh(w_l/w_s) + b w_l) on the output."""

    title: ClassVar[str] = "load-side friction"
    source: ClassVar[str] = (
        "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30:1083; the numbers are estimates "
        "for a cross-roller bearing"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("direction", "velocity"),
        channels=("motor_torque", "output_torque", "output_angle"),
        confused_with={
            "input_coulomb_viscous": "friction on the input winds nothing up; this one shifts the "
            "transmission error by T_c/K at each reversal",
            "torsional_hysteresis_maxwell": "with the wave generator locked and the torque applied at the "
            "ring it is absent; behind the torque sensor it shows as a "
            "difference of sensor and load torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"coulomb_nm": 1.0}), Amplitude({"viscous_nm_s_per_rad": 0.5}))),
    )

    coulomb_nm: Annotated[
        float, Plausible(2e-3, 0.3, "estimate: cross-roller bearing with seal", of="rated_torque")
    ] = Field(1.0, ge=0)
    """Coulomb friction T_c at the output, N m."""
    viscous_nm_s_per_rad: Annotated[
        float, Plausible(5e-4, 0.3, "estimate: cross-roller bearing with seal", of="rated_torque")
    ] = Field(0.5, ge=0)
    """Viscous friction b at the output, N m s/rad."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.005, gt=0)
    """Output speed w_s over which the sign is smoothed, rad/s."""

    def contribute(self, build: Builder) -> None:
        """Add the friction torque to the output."""
        numbers = [
            OUTPUT_TORQUE,
            self.coulomb_nm,
            self.viscous_nm_s_per_rad,
            self.smoothing_velocity_rad_per_s,
        ]
        build.element(coulomb_viscous, numbers)
