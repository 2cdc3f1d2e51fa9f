"""Friction that falls as the drive warms up: one thermal node and the lubricant's viscosity."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Shape
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature, State


@element
def warming(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Change of friction with temperature and the thermal node; runs last, to see all the heat.

    Parameters: C, R, ambient, reference, b, beta, T_c, beta_c, w_s; own state: temperature, degC.
    """
    speed = inputs[MOTOR_VELOCITY]
    above = inputs[own] - parameters[3]
    viscous = parameters[4] * math.exp(-parameters[5] * above)
    coulomb = parameters[6] * math.exp(-parameters[7] * above)
    sign = math.tanh(speed / parameters[8])
    torque = (viscous - parameters[4]) * speed + (coulomb - parameters[6]) * sign
    torque_w = viscous - parameters[4] + (coulomb - parameters[6]) * (1.0 - sign * sign) / parameters[8]
    torque_t = -parameters[5] * viscous * speed - parameters[7] * coulomb * sign
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= torque_w
    jacobian[MOTOR_TORQUE * columns + own] -= torque_t
    outputs[INPUT_FRICTION] += torque
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque_w * speed + torque
    jacobian[DISSIPATED * columns + own] += torque_t * speed

    outputs[own] += (outputs[DISSIPATED] - (inputs[own] - parameters[2]) / parameters[1]) / parameters[0]
    for column in range(columns):
        jacobian[own * columns + column] += jacobian[DISSIPATED * columns + column] / parameters[0]
    jacobian[own * columns + own] -= 1.0 / (parameters[1] * parameters[0])


class ThermalFriction(Effect):
    """C dT/dt = P - (T - T_a)/R; viscous friction b exp(-beta (T - T_0)), Coulomb likewise with beta_c.

    P is all the heat of the model. The drive's own friction holds at the reference temperature T_0; this
    effect adds the change only. beta = 0.033/K reproduces, with T_c constant, the temperature dependence of
    Palmgren's lubricant friction fitted to a size 20 drive between -10 and 40 degC.
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
        ),
    )

    heat_capacity_j_per_k: float = Field(450.0, gt=0)
    """Heat capacity C of drive and housing, J/K (about 1 kg of steel)."""
    thermal_resistance_k_per_w: float = Field(1.5, gt=0)
    """Thermal resistance R to the ambient, K/W."""
    ambient_degc: Annotated[float, FIXED] = Field(20.0, ge=-60, le=150)
    """Ambient temperature T_a, degC."""
    initial_degc: Annotated[float | None, FIXED] = Field(None, ge=-60, le=150)
    """Temperature at the start, degC (null: ambient)."""
    reference_degc: Annotated[float, FIXED] = Field(20.0, ge=-60, le=150)
    """Temperature T_0 at which the drive's friction is given, degC."""
    viscosity_coefficient_per_k: float = Field(0.033, ge=0, le=0.2)
    """Relative decay of viscous friction, beta, 1/K."""
    viscous_nm_s_per_rad: float | None = Field(None, ge=0)
    """Viscous friction b at T_0 at the motor shaft, N m s/rad (null: the drive's own)."""
    coulomb_nm: float = Field(0.0, ge=0)
    """Part of the input's Coulomb friction at T_0 that changes with temperature, N m; at most all of it."""
    coulomb_coefficient_per_k: float = Field(0.01, ge=0, le=0.2)
    """Relative decay of that part, beta_c, 1/K."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed over which the sign of Coulomb friction is smoothed, rad/s; as in the drive."""

    def contribute(self, build: Builder) -> None:
        """Add the change of friction and the temperature."""
        viscous = self.viscous_nm_s_per_rad
        numbers = [
            self.heat_capacity_j_per_k,
            self.thermal_resistance_k_per_w,
            self.ambient_degc,
            self.reference_degc,
            build.viscous_friction_nm_s_per_rad if viscous is None else viscous,
            self.viscosity_coefficient_per_k,
            self.coulomb_nm,
            self.coulomb_coefficient_per_k,
            self.smoothing_velocity_rad_per_s,
        ]
        start = self.ambient_degc if self.initial_degc is None else self.initial_degc
        state = State("temperature", "degC", start, 10.0, "temperature of the drive")
        build.element(warming, numbers, states=(state,), last=True)
