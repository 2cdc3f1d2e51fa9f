"""Kernels that more than one effect uses."""

from __future__ import annotations

import math
from typing import Any

from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, element, twist

#: Radians in one minute of arc.
ARCMIN = math.pi / 10800.0


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
