"""Kernels, and what their angles are, that more than one effect uses."""

from __future__ import annotations

import math
from typing import Any, Literal

from hdsim.kernel import (
    DISSIPATED,
    INPUT_FRICTION,
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    OUTPUT_ANGLE,
    element,
    twist,
)

#: Radians in one minute of arc.
ARCMIN = math.pi / 10800.0

#: What an order counts: turns of the wave generator, of the output, or of the first against the second.
Turn = Literal["wave_generator_turn", "output_turn", "relative_turn"]


def factors(order: float, per: Turn) -> tuple[float, float]:
    """Factors a and b of an order's angle, a theta_m + b theta_l."""
    if per == "output_turn":
        return 0.0, order
    return order, -order if per == "relative_turn" else 0.0


@element
def coulomb_viscous(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """T = -(T_c tanh(w/w_s) + b w) on one body.

    Parameters: body (row of its torque: MOTOR_TORQUE, RING_TORQUE or OUTPUT_TORQUE), T_c, b, w_s.
    """
    row = int(parameters[0])
    column = 2 * row + 1
    speed = inputs[column]
    sign = math.tanh(speed / parameters[3])
    torque = parameters[1] * sign + parameters[2] * speed
    slope = parameters[1] * (1.0 - sign * sign) / parameters[3] + parameters[2]
    outputs[row] -= torque
    jacobian[row * columns + column] -= slope
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + column] += torque + slope * speed
    if row == MOTOR_TORQUE:
        outputs[INPUT_FRICTION] += torque


@element
def periodic_friction(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """T = -sum A (1 + sin(a theta_m + b theta_l + phi)) tanh(w_m/w_s) on the motor.

    Parameters: w_s, number of terms, then A (N m), a, b, phi (rad) of each.
    """
    speed = inputs[MOTOR_VELOCITY]
    sign = math.tanh(speed / parameters[0])
    level = by_motor = by_output = 0.0
    for i in range(int(parameters[1])):
        amplitude = parameters[2 + 4 * i]
        a = parameters[3 + 4 * i]
        b = parameters[4 + 4 * i]
        angle = a * inputs[MOTOR_ANGLE] + b * inputs[OUTPUT_ANGLE] + parameters[5 + 4 * i]
        level += amplitude * (1.0 + math.sin(angle))
        by_motor += amplitude * a * math.cos(angle)
        by_output += amplitude * b * math.cos(angle)
    torque = level * sign
    torque_w = level * (1.0 - sign * sign) / parameters[0]
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= torque_w
    jacobian[MOTOR_TORQUE * columns + MOTOR_ANGLE] -= by_motor * sign
    jacobian[MOTOR_TORQUE * columns + OUTPUT_ANGLE] -= by_output * sign
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque_w * speed + torque
    jacobian[DISSIPATED * columns + MOTOR_ANGLE] += by_motor * sign * speed
    jacobian[DISSIPATED * columns + OUTPUT_ANGLE] += by_output * sign * speed
    outputs[INPUT_FRICTION] += torque


@twist
def harmonics(motor_angle: float, output_angle: float, parameters: Any, error: Any) -> None:
    """Add e = sum A sin(a theta_m + b theta_l + phi).

    Parameters: number of terms, then A (rad), a, b, phi (rad) of each.
    """
    for i in range(int(parameters[0])):
        amplitude = parameters[1 + 4 * i]
        a = parameters[2 + 4 * i]
        b = parameters[3 + 4 * i]
        angle = a * motor_angle + b * output_angle + parameters[4 + 4 * i]
        value = amplitude * math.sin(angle)
        slope = amplitude * math.cos(angle)
        error[0] += value
        error[1] += a * slope
        error[2] += b * slope
        error[3] -= a * a * value
        error[4] -= a * b * value
        error[5] -= b * b * value
