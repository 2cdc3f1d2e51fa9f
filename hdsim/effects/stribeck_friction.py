"""Stribeck friction: static friction above Coulomb, decaying with speed as the lubricant film builds."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@element
def stribeck(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -dT exp(-|w/v_s|^d) tanh(w/w_s) on the motor. Parameters: dT, v_s, w_s, d."""
    speed = inputs[MOTOR_VELOCITY]
    power = math.pow(abs(speed) / parameters[1], parameters[3])
    level = parameters[0] * math.exp(-power)
    sign = math.tanh(speed / parameters[2])
    torque = level * sign
    # At rest the sign's slope is all: |w|^(d - 1) tanh(w/w_s) vanishes there for any d.
    falls = parameters[3] * power / speed if speed != 0.0 else 0.0
    slope = level * ((1.0 - sign * sign) / parameters[2] - falls * sign)
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= slope
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque + slope * speed
    outputs[INPUT_FRICTION] += torque


#: Exponent of a finer formula: a little beyond what sources have, so that their ends are no ends of a fit.
STRIBECK_EXPONENT = Shape("stribeck_exponent", (0.8, 1.3), least=0.4, most=3.0)
_TERMS = (Amplitude({"extra_static_nm": 0.008}),)
# Ten at most in the sources; a fall over more speed is another law of the viscous friction.
_SPEED = Shape("stribeck_velocity_rad_per_s", (1.5, 5.0, 14.0), most=15.0)


class StribeckFriction(Effect):
    """T = -(T_s - T_c) exp(-|w_m/v_s|^d) tanh(w_m/w_s), on top of the drive's Coulomb friction T_c.

    The exponent d tells how sharply the film builds: 2 is the Gaussian form, 1 Tustin's, 0.5 to 1 what Bo and
    Pavelescu measured. Any d > 0 brakes.
    """

    title: ClassVar[str] = "Stribeck friction"
    source: ClassVar[str] = (
        "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30:1083 (Gaussian form of Tustin's "
        "curve); exponents of 0.5 to 1: Bo and Pavelescu 1982, Wear 82:277; v_s of 1-10 rad/s and T_s/T_c of "
        "1-1.5 are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("velocity", "direction"),
        channels=("motor_torque", "output_angle"),
        confused_with={
            "lugre_friction": "a function of speed alone: no presliding displacement and no lag after a "
            "change of speed",
            "input_coulomb_viscous": "friction there never falls with speed, so slow motion does not stick "
            "and slip",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting(_TERMS, (_SPEED,)),)
    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(_TERMS, (_SPEED, STRIBECK_EXPONENT), label="whose exponent is not 2"),
    )

    extra_static_nm: Annotated[
        float, Plausible(1e-3, 0.3, "T_s/T_c of 1 to 1.5, times the starting torque", of="motor_rated_torque")
    ] = Field(0.008, ge=0)
    """Static minus Coulomb friction at the motor shaft, T_s - T_c, N m."""
    stribeck_velocity_rad_per_s: Annotated[
        float, Plausible(1.0, 10.0, "estimate in the literature of drives: 1 to 10 rad/s of the motor")
    ] = Field(5.0, gt=0)
    """Motor speed v_s over which the extra friction decays, rad/s."""
    stribeck_exponent: Annotated[
        float, Plausible(0.5, 2.0, "0.5 to 1 (Bo and Pavelescu), 1 (Tustin), 2 (Gaussian)")
    ] = Field(2.0, gt=0, le=10)
    """Exponent d of the decay: 2 for the Gaussian form, 1 for Tustin's."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s; well below v_s, or the bump is lost."""

    def contribute(self, build: Builder) -> None:
        """Add the bump to the motor's friction."""
        build.element(
            stribeck,
            [
                self.extra_static_nm,
                self.stribeck_velocity_rad_per_s,
                self.smoothing_velocity_rad_per_s,
                self.stribeck_exponent,
            ],
        )
