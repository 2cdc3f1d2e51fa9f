"""Coulomb and viscous friction on the motor shaft, on top of the drive's own."""

from __future__ import annotations

from dataclasses import astuple
from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.effects._kernels import coulomb_viscous
from hdsim.kernel import MOTOR_TORQUE
from hdsim.number import FIXED
from hdsim.parts import INPUT_FRICTION_HEAT, Builder, Effect, InputFriction, Signature


class InputCoulombViscous(Effect):
    """T = -(T_c tanh(w_m/w_s) + b w_m) on the motor: bearings, seal and gearing before the wave generator."""

    title: ClassVar[str] = "Coulomb and viscous friction, input"
    source: ClassVar[str] = (
        "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30:1083; level fitted to the "
        "starting torque of 37 mN m and no-load running torques of 105 and 160 mN m at 2000 and 3500 rpm of"
        " a size 20 drive"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("velocity", "direction"),
        channels=("motor_torque",),
        confused_with={
            "load_side_friction": "reaches the motor divided by the ratio and winds the drive up on the way",
            "thermal_friction": "decays over minutes at constant speed; Coulomb and viscous friction do not",
            "load_dependent_loss": "the offset between the directions grows with the load",
            "torsional_hysteresis_maxwell": "a cycle with the wave generator locked excludes friction on "
            "the input",
        },
    )
    adds_to: ClassVar[tuple[tuple[str, str], ...]] = (("coulomb_nm", "friction.coulomb_nm"),)
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"coulomb_nm": 0.032}), Amplitude({"viscous_nm_s_per_rad": 3.5e-4})),
            covered_by=("drive.friction.coulomb_nm", "drive.friction.viscous_nm_s_per_rad"),
        ),
    )

    coulomb_nm: Annotated[
        float,
        Plausible(
            5e-3,
            0.5,
            "starting torque is 7 % of the rated one at size 20, ratio 100",
            of="motor_rated_torque",
        ),
    ] = Field(0.032, ge=0)
    """Coulomb friction T_c at the motor shaft, N m."""
    viscous_nm_s_per_rad: Annotated[
        float,
        Plausible(
            5e-5, 5e-3, "no-load torque at 2000 and 3500 rpm: 7e-4 s at size 20", of="motor_rated_torque"
        ),
    ] = Field(3.5e-4, ge=0)
    """Viscous friction b at the motor shaft, N m s/rad."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s."""

    def contribute(self, build: Builder) -> None:
        """Add the friction torque to the motor."""
        friction = InputFriction(
            self.coulomb_nm, self.viscous_nm_s_per_rad, self.smoothing_velocity_rad_per_s
        )
        build.element(coulomb_viscous, [MOTOR_TORQUE, *astuple(friction)], heat=INPUT_FRICTION_HEAT)
        build.declare_input_friction(friction)
