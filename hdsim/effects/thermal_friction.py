"""Friction that falls as the drive warms up: one thermal node and the lubricant's viscosity."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, element
from hdsim.number import FIXED
from hdsim.parts import INPUT_FRICTION_HEAT, Builder, Effect, Signature, State


@element
def warming(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Change of friction with temperature, and the thermal node; runs last, to see all the heat.

    Parameters: column of the temperature (0: the own state, degC), C, R, ambient, reference, b, beta, beta_c,
    number of Coulomb frictions, then T_c, w_s of each.
    """
    node = parameters[0] == 0.0
    column = own if node else int(parameters[0])
    speed = inputs[MOTOR_VELOCITY]
    above = inputs[column] - parameters[4]
    left = math.exp(-parameters[6] * above)
    torque = parameters[5] * (left - 1.0) * speed
    torque_w = parameters[5] * (left - 1.0)
    torque_t = -parameters[6] * parameters[5] * left * speed
    left = math.exp(-parameters[7] * above)
    for i in range(int(parameters[8])):
        coulomb = parameters[9 + 2 * i]
        sign = math.tanh(speed / parameters[10 + 2 * i])
        torque += coulomb * (left - 1.0) * sign
        torque_w += coulomb * (left - 1.0) * (1.0 - sign * sign) / parameters[10 + 2 * i]
        torque_t -= parameters[7] * coulomb * left * sign
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= torque_w
    jacobian[MOTOR_TORQUE * columns + column] -= torque_t
    outputs[INPUT_FRICTION] += torque
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque_w * speed + torque
    jacobian[DISSIPATED * columns + column] += torque_t * speed
    if node:
        warmer = inputs[own] - parameters[3]
        outputs[own] += (outputs[DISSIPATED] - warmer / parameters[2]) / parameters[1]
        for c in range(columns):
            jacobian[own * columns + c] += jacobian[DISSIPATED * columns + c] / parameters[1]
        jacobian[own * columns + own] -= 1.0 / (parameters[2] * parameters[1])


class ThermalFriction(Effect):
    """C dT/dt = P - (T - T_a)/R; viscous friction b exp(-beta (T - T_0)), Coulomb likewise with beta_c.

    P is all the heat of the model. The motor shaft's friction (the drive's own and that of other effects)
    holds at the reference temperature T_0, and this effect multiplies it: whatever the temperature, it takes
    away no more than is there. Where a temperature is given (the measured one, in a diagnosis) the friction
    follows that, and C, R, T_a and the start are not used. beta = 0.033/K reproduces, with T_c constant, the
    temperature dependence of Palmgren's lubricant friction fitted to a size 20 drive from -10 to 40 degC.
    """

    title: ClassVar[str] = "temperature-dependent friction"
    source: ClassVar[str] = (
        "Wolf and Iskandar 2018, IEEE ICRA (temperature dominates joint friction); viscosity: Reynolds' "
        "exponential law; beta from Palmgren's lubricant term, nu^(2/3); heat capacity and resistance are "
        "estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("temperature", "time", "velocity"),
        channels=("motor_torque", "temperature"),
        confused_with={
            "input_coulomb_viscous": "does not change in a soak at constant speed, where this decays in "
            "minutes to an hour and collapses on exp(-beta dT)",
            "sensors": "a sensor's offset leaves the friction's dependence on speed alone",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"viscosity_coefficient_per_k": 0.033}, signed=False),),
            (Shape("heat_capacity_j_per_k", (5.0, 450.0)),),
            unless=("temperature",),
        ),
        Fitting(
            (Amplitude({"viscosity_coefficient_per_k": 0.033}, signed=False),),
            label="at the measured temperature",
            follows=("temperature",),
        ),
    )

    heat_capacity_j_per_k: Annotated[
        float,
        Plausible(10.0, 5e3, "20 g to 10 kg of steel: the wave generator's bearing alone, or the joint"),
    ] = Field(450.0, gt=0)
    """Heat capacity C of drive and housing, J/K (about 1 kg of steel)."""
    thermal_resistance_k_per_w: float = Field(1.5, gt=0)
    """Thermal resistance R to the ambient, K/W."""
    ambient_degc: Annotated[float, FIXED] = Field(20.0, ge=-60, le=150)
    """Ambient temperature T_a, degC."""
    initial_degc: Annotated[float | None, FIXED] = Field(None, ge=-60, le=150)
    """Temperature at the start, degC (null: ambient)."""
    reference_degc: Annotated[float, FIXED] = Field(20.0, ge=-60, le=150)
    """Temperature T_0 at which the drive's friction is given, degC."""
    viscosity_coefficient_per_k: Annotated[
        float, Plausible(0.01, 0.06, "Palmgren's nu^(2/3) with mineral oils and greases")
    ] = Field(0.033, ge=0, le=0.2)
    """Relative decay of viscous friction, beta, 1/K."""
    viscous_nm_s_per_rad: float | None = Field(None, ge=0)
    """Part of the motor shaft's viscous friction at T_0 that changes, b, N m s/rad (null or more: all)."""
    coulomb_nm: float = Field(0.0, ge=0)
    """Part of the motor shaft's Coulomb friction at T_0 that changes, N m; more than it has: all of it. That
    of ``lugre_friction`` does not change."""
    coulomb_coefficient_per_k: float = Field(0.01, ge=0, le=0.2)
    """Relative decay of that part, beta_c, 1/K."""

    def contribute(self, build: Builder) -> None:
        """Add the change of friction and the temperature."""
        frictions = build.input_frictions
        viscous = sum(friction.viscous_nm_s_per_rad for friction in frictions)
        if self.viscous_nm_s_per_rad is not None:
            viscous = min(viscous, self.viscous_nm_s_per_rad)
        coulomb = sum(friction.coulomb_nm for friction in frictions)
        share = min(1.0, self.coulomb_nm / coulomb) if coulomb > 0 else 0.0
        changing = [
            (share * friction.coulomb_nm, friction.smoothing_velocity_rad_per_s)
            for friction in frictions
            if share * friction.coulomb_nm > 0
        ]
        given = build.external("temperature")
        numbers = [
            float(given or 0),
            self.heat_capacity_j_per_k,
            self.thermal_resistance_k_per_w,
            self.ambient_degc,
            self.reference_degc,
            viscous,
            self.viscosity_coefficient_per_k,
            self.coulomb_coefficient_per_k,
            float(len(changing)),
            *(number for pair in changing for number in pair),
        ]
        states: tuple[State, ...] = ()
        if given is None:
            start = self.ambient_degc if self.initial_degc is None else self.initial_degc
            states = (State("temperature", "degC", start, 10.0, "temperature of the drive"),)
        build.element(warming, numbers, states=states, last=True, heat=INPUT_FRICTION_HEAT)
