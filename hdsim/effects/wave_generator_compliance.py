"""Radial compliance of the wave generator, felt as wind-up in series with the torsion spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Inverse, Plausible, Shape
from hdsim.parts import Builder, Effect, Signature

if TYPE_CHECKING:
    from hdsim.parts import Array


class WaveGeneratorCompliance(Effect):
    """d = sign(tau_w) (1 - exp(-C_w |tau_w|)) / (C_w K_w) / |i|, with tau_w = tau/i at the wave generator.

    It integrates d tau_w / K(tau_w) with a stiffness that grows exponentially, K = K_w exp(C_w |tau_w|), and
    refers the angle to the output. It rises monotonically to 1/(C_w K_w |i|), with the slope 1/(K_w i^2) at
    zero. The source writes K_w as N K_w0. There tau_w also holds the wave generator's friction, which opens a
    hysteresis loop: neglected here, because friction acts on the motor and the loop has its own effects.
    """

    title: ClassVar[str] = "wave-generator compliance"
    source: ClassVar[str] = (
        "Zhang, Ahmad and Liu 2015, IEEE/ASME Trans. Mechatronics 20:178 (wave-generator part); the numbers"
        " are estimates, K_w i^2 = 8e4 N m/rad for the bearing's race"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque",),
        channels=("output_angle", "output_torque"),
        confused_with={
            "flexspline_stiffening": "stiffens with the square of torque, hardly below half of rated torque",
            "stiffness_nonlinearity": "stiffens with the square of twist",
            "output_backlash": "no stiffness at all over a fixed gap, gone under a bias torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Inverse("stiffness_nm_per_rad", 8.0),),
            # Taken up within less of the torque it would be a play.
            (Shape("coefficient_per_nm", (0.4, 1.2, 3.6), "motor_side_torque_nm", most=8.0),),
        ),
    )

    stiffness_nm_per_rad: Annotated[
        float, Plausible(1.0, 300.0, "estimate: in series with a drive of K1", of="motor_stiffness_k1")
    ] = Field(8.0, gt=0)
    """Stiffness K_w at zero torque, at the wave generator, N m/rad (at the output: times ratio squared)."""
    coefficient_per_nm: Annotated[
        float,
        Plausible(
            0.2, 8.0, "stiffens within the drive's torques, later than a play", of="per_motor_rated_torque"
        ),
    ] = Field(2.0, gt=0)
    """Coefficient C_w, per N m of wave-generator torque: the stiffness grows e-fold over 1/C_w."""

    def contribute(self, build: Builder) -> None:
        """Put the compliance in series with the torsion spring."""
        ratio = abs(build.ratio)

        def wind_up(torque: Array) -> Array:
            import numpy as np

            load = self.coefficient_per_nm * np.abs(torque) / ratio
            limit = 1.0 / (self.coefficient_per_nm * self.stiffness_nm_per_rad * ratio)
            return -np.sign(torque) * np.expm1(-load) * limit

        build.series_compliance(wind_up)
