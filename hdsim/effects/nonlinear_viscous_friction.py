"""Viscous friction that is not in proportion to speed: of grease that thins, of lubricant that churns."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@element
def power_law(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -D (w/w_r) (sqrt(w^2 + w_s^2)/w_r)^(n - 1) on the motor. Parameters: D, n, w_r, w_s."""
    speed = inputs[MOTOR_VELOCITY]
    square = speed * speed + parameters[3] * parameters[3]
    further = parameters[1] - 1.0
    coefficient = parameters[0] / parameters[2] * math.pow(math.sqrt(square) / parameters[2], further)
    torque = coefficient * speed
    slope = coefficient * (1.0 + further * speed * speed / square)
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= slope
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque + slope * speed
    outputs[INPUT_FRICTION] += torque


class NonlinearViscousFriction(Effect):
    """T = -D |w_m/w_r|^n sign(w_m), on top of the drive's Coulomb and viscous friction.

    The exponent n is below 1 where the grease thins under shear or is warmed in its film, and near 2 where
    the lubricant's inertia resists: it is thrown about, or turbulent. At n = 1 it is the drive's own viscous
    friction. Within w_s of rest it is smooth, |w| becoming sqrt(w^2 + w_s^2); any n > 0 brakes.
    """

    title: ClassVar[str] = "nonlinear viscous friction"
    source: ClassVar[str] = (
        "Waiboer, Aarts and Jonker 2005, ECCOMAS Multibody Dynamics (geared joints: viscous friction is "
        "a power of speed); Wolf and Iskandar 2018, IEEE ICRA (a harmonic drive's is not linear); churning: "
        "Changenet and Velex 2007, J. Mech. Des. 129:128; the level, of the no-load running torque, and "
        "exponents of 0.3 to 2 are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("velocity", "direction"),
        channels=("motor_torque",),
        confused_with={
            "stribeck_friction": "its extra friction is gone at speeds above v_s; a power of speed goes on, "
            "so runs at twice the speed tell them apart",
            "lugre_friction": "the same, and it lags after a change of speed",
            "input_coulomb_viscous": "friction there is a straight line over speed",
            "thermal_friction": "decays over minutes at constant speed; a power of speed does not",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"drag_nm": 0.01}),),
            (Shape("speed_exponent", (0.5, 2.0), least=0.25, most=3.0),),
            beyond=("drive.friction.viscous_nm_s_per_rad",),
        ),
    )

    drag_nm: Annotated[
        float, Plausible(2e-3, 1.0, "up to the no-load torque at 3500 rpm", of="motor_rated_torque")
    ] = Field(0.01, ge=0)
    """Friction D at the motor shaft at the reference speed, N m."""
    speed_exponent: Annotated[
        float, Plausible(0.3, 2.0, "0.3 to 1 of greases that thin under shear, 2 of churning")
    ] = Field(2.0, gt=0, le=5)
    """Exponent n of the speed; 1 is linear."""
    reference_speed_rad_per_s: Annotated[float, FIXED] = Field(100.0, gt=0)
    """Motor speed w_r at which the friction is D, rad/s."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s below which the power is smoothed, rad/s."""

    def contribute(self, build: Builder) -> None:
        """Add the friction torque to the motor."""
        build.element(
            power_law,
            [
                self.drag_nm,
                self.speed_exponent,
                self.reference_speed_rad_per_s,
                self.smoothing_velocity_rad_per_s,
            ],
        )
