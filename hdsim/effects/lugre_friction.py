"""LuGre friction: bristles that bend before they slip, on the motor shaft."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.effects.stribeck_friction import STRIBECK_EXPONENT
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, STORED, element
from hdsim.parts import INPUT_FRICTION_HEAT, Builder, Effect, InputFriction, Signature, State


@element
def bristles(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """LuGre friction on the motor. Parameters: s_0, s_1, s_2, T_c, T_s, v_s, v_d, d; own state: z, rad."""
    s0 = parameters[0]
    speed = inputs[MOTOR_VELOCITY]
    z = inputs[own]
    magnitude = abs(speed)
    direction = math.copysign(1.0, speed)

    power = math.pow(magnitude / parameters[5], parameters[7])
    bump = (parameters[4] - parameters[3]) * math.exp(-power)
    level = parameters[3] + bump
    # |w| times the level's slope: at rest the slope alone has no limit where d < 1.
    falls = -parameters[7] * power * bump * direction
    rate = speed - s0 * magnitude * z / level
    rate_z = -s0 * magnitude / level
    rate_w = 1.0 - s0 * direction * z / level + s0 * z * falls / (level * level)

    fading = speed / parameters[6]
    s1 = parameters[1] * math.exp(-fading * fading)
    s1_w = -2.0 * fading / parameters[6] * s1
    torque = s0 * z + s1 * rate + parameters[2] * speed
    torque_z = s0 + s1 * rate_z
    torque_w = s1_w * rate + s1 * rate_w + parameters[2]

    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= torque_w
    jacobian[MOTOR_TORQUE * columns + own] -= torque_z
    outputs[own] += rate
    jacobian[own * columns + MOTOR_VELOCITY] += rate_w
    jacobian[own * columns + own] += rate_z
    outputs[DISSIPATED] += torque * speed - s0 * z * rate
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque_w * speed + torque - s0 * z * rate_w
    jacobian[DISSIPATED * columns + own] += torque_z * speed - s0 * (rate + z * rate_z)
    outputs[STORED] += 0.5 * s0 * z * z
    outputs[INPUT_FRICTION] += torque


def _way(label: str, *further: Shape) -> Fitting:
    return Fitting(
        (Amplitude({"coulomb_nm": 0.02, "static_nm": 0.0201}), Amplitude({"static_nm": 0.02})),
        (
            Shape("stribeck_velocity_rad_per_s", (2.0, 8.0), most=25.0),
            Shape("stiffness_nm_per_rad", (6.0,)),
            *further,
        ),
        {"damping_nm_s_per_rad": 1e-3},
        label=label,
        cumulative=True,
    )


class LugreFriction(Effect):
    """T = -(s_0 z + s_1(w) z' + s_2 w), z' = w - s_0 |w| z / g(w), g = T_c + (T_s - T_c) exp(-|w/v_s|^d).

    It replaces the drive's Coulomb friction: set the drive's own to zero, or it counts twice.
    The stored energy is s_0 z^2/2, and the heat, power in minus its rate, is with s = s_0 z sign(w)/g

        |w| g s^2 + s_1(w) w^2 (1 - s) + s_2 w^2.

    With a constant s_1 it can be negative at speed (Barabanov and Ortega 2000). So s_1(w) = s_1
    exp(-(w/v_d)^2), the remedy of Olsson 1996; then s_1(w)|w| never exceeds s_1 v_d / sqrt(2 e), and s_1 v_d
    / sqrt(2 e) <= 4 T_c keeps the heat non-negative in every state, because (s - 1)/s^2 <= 1/4.
    """

    title: ClassVar[str] = "LuGre friction"
    source: ClassVar[str] = (
        "Canudas de Wit, Olsson, Astrom and Lischinsky 1995, IEEE Trans. Automatic Control 40:419; "
        "passivity: Barabanov and Ortega 2000, IEEE TAC 45:830; fading s_1: Olsson 1996, thesis, Lund; "
        "exponent d: as of stribeck_friction; "
        "default numbers are estimates around T_c = 32 mN m and a presliding displacement of 3 mrad"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("velocity", "time_since_reversal", "direction"),
        channels=("motor_torque", "motor_angle", "output_angle"),
        confused_with={
            "stribeck_friction": "no presliding displacement: the shaft creeps instead of springing back",
            "torsional_hysteresis_maxwell": "a cycle with the wave generator locked excludes it; it opens "
            "with the motor's displacement, not with the twist",
            "output_backlash": "the free play there carries no torque at all, the presliding zone a spring's",
        },
    )
    adds_to: ClassVar[tuple[tuple[str, str], ...]] = (("coulomb_nm", "friction.coulomb_nm"),)
    fittings: ClassVar[tuple[Fitting, ...]] = (_way(""),)
    finer: ClassVar[tuple[Fitting, ...]] = (_way("whose exponent is not 2", STRIBECK_EXPONENT),)

    stiffness_nm_per_rad: Annotated[
        float,
        Plausible(
            2.0, 200.0, "presliding of 1e-3 to 1e-2 rad under the starting torque", of="motor_rated_torque"
        ),
    ] = Field(10.0, gt=0)
    """Bristle stiffness s_0 at the motor shaft, N m/rad."""
    damping_nm_s_per_rad: float = Field(0.003, ge=0)
    """Bristle damping s_1 at zero speed, N m s/rad."""
    viscous_nm_s_per_rad: float = Field(0.0, ge=0)
    """Viscous friction s_2 on top of the drive's own, N m s/rad."""
    coulomb_nm: Annotated[
        float, Plausible(5e-3, 0.5, "as of input_coulomb_viscous", of="motor_rated_torque")
    ] = Field(0.032, gt=0)
    """Coulomb friction T_c, N m."""
    static_nm: Annotated[
        float, Plausible(5e-3, 0.7, "1 to 1.5 times the Coulomb friction", of="motor_rated_torque")
    ] = Field(0.040, gt=0)
    """Static friction T_s, N m."""
    stribeck_velocity_rad_per_s: Annotated[
        float, Plausible(1.0, 10.0, "estimate in the literature of drives: 1 to 10 rad/s of the motor")
    ] = Field(5.0, gt=0)
    """Stribeck speed v_s of the motor, rad/s."""
    stribeck_exponent: Annotated[float, Plausible(0.5, 2.0, "as of stribeck_friction")] = Field(
        2.0, gt=0, le=10
    )
    """Exponent d of the Stribeck curve: 2 for the Gaussian form, 1 for Tustin's."""
    damping_velocity_rad_per_s: float | None = Field(None, gt=0)
    """Speed v_d over which the bristle damping fades, rad/s (null: v_s, or less as passivity asks)."""

    @model_validator(mode="after")
    def _passive(self) -> LugreFriction:
        if self.static_nm < self.coulomb_nm:
            raise ValueError(
                f"static_nm must not be below coulomb_nm, found {self.static_nm} < {self.coulomb_nm}"
            )
        given = self.damping_velocity_rad_per_s
        if given is not None and given > self._passive_velocity:
            raise ValueError(
                f"damping_velocity_rad_per_s must not exceed {self._passive_velocity:.4g} "
                f"(4 sqrt(2e) coulomb_nm / damping_nm_s_per_rad), or friction creates energy, found {given}"
            )
        return self

    @property
    def _passive_velocity(self) -> float:
        """Largest v_d at which the heat is never negative, rad/s."""
        limit = 4.0 * math.sqrt(2.0 * math.e) * self.coulomb_nm
        return limit / self.damping_nm_s_per_rad if self.damping_nm_s_per_rad > 0 else math.inf

    def contribute(self, build: Builder) -> None:
        """Add the friction torque and the bristle deflection."""
        fading = self.damping_velocity_rad_per_s or min(
            self.stribeck_velocity_rad_per_s, self._passive_velocity
        )
        numbers = [self.stiffness_nm_per_rad, self.damping_nm_s_per_rad, self.viscous_nm_s_per_rad]
        numbers += [self.coulomb_nm, self.static_nm, self.stribeck_velocity_rad_per_s]
        numbers += [fading, self.stribeck_exponent]
        size = self.static_nm / self.stiffness_nm_per_rad
        state = State(
            "bristle_deflection", "rad", 0.0, size, "mean deflection of the LuGre bristles, motor shaft"
        )
        build.element(bristles, numbers, states=(state,), heat=INPUT_FRICTION_HEAT)
        # The bristles' torque depends on how far they are bent: nothing that another part could scale.
        build.declare_input_friction(InputFriction(0.0, self.viscous_nm_s_per_rad, 1.0))
