"""Kernels of the tabulated curves: a torque on one row, an angle in the mesh."""

from __future__ import annotations

import math
from typing import Any

from hdsim.kernel import DELIVERED, DISSIPATED, STORED, SUPPLIED, element, twist


@element
def tabulated_torque(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """T = f(x), or f(x) tanh(v/w_s), on one row.

    Parameters: row, column of x, column of the speed v that takes the power, w_s (0: none), booking, period
    (0: none), n, then n + 1 edges, then c0, c1, c2, c3 and the integral up to the start of each of n cells.
    """
    row = int(parameters[0])
    x_column = int(parameters[1])
    v_column = int(parameters[2])
    period = parameters[5]
    n = int(parameters[6])
    coefficients = 8 + n
    x = inputs[x_column]
    area = 0.0
    if period > 0.0:
        turns = math.floor((x - parameters[7]) / period)
        x -= turns * period
        last = coefficients + 5 * (n - 1)
        h = parameters[7 + n] - parameters[6 + n]
        area = turns * (
            parameters[last + 4]
            + h
            * (
                parameters[last]
                + h
                * (
                    parameters[last + 1] / 2.0
                    + h * (parameters[last + 2] / 3.0 + h * parameters[last + 3] / 4.0)
                )
            )
        )
    beyond = 0.0
    if x < parameters[7]:
        beyond = x - parameters[7]
        x = parameters[7]
    elif x > parameters[7 + n]:
        beyond = x - parameters[7 + n]
        x = parameters[7 + n]
    low = 0
    high = n
    while high - low > 1:
        middle = (low + high) // 2
        if parameters[7 + middle] <= x:
            low = middle
        else:
            high = middle
    at = coefficients + 5 * low
    s = x - parameters[7 + low]
    c0 = parameters[at]
    c1 = parameters[at + 1]
    c2 = parameters[at + 2]
    c3 = parameters[at + 3]
    value = c0 + s * (c1 + s * (c2 + s * c3))
    slope = 0.0
    if beyond == 0.0:
        slope = c1 + s * (2.0 * c2 + s * 3.0 * c3)
    area += parameters[at + 4] + s * (c0 + s * (c1 / 2.0 + s * (c2 / 3.0 + s * c3 / 4.0))) + beyond * value

    speed = inputs[v_column]
    sign = 1.0
    steepness = 0.0
    if parameters[3] > 0.0:
        sign = math.tanh(speed / parameters[3])
        steepness = (1.0 - sign * sign) / parameters[3]
    torque = value * sign
    by_x = slope * sign
    by_v = value * steepness
    outputs[row] += torque
    jacobian[row * columns + x_column] += by_x
    jacobian[row * columns + v_column] += by_v
    booking = int(parameters[4])
    if booking == 0:
        outputs[STORED] -= area
        return
    power = torque * speed
    account = SUPPLIED
    factor = 1.0
    if booking == 3:
        account = DELIVERED
        factor = -1.0
    elif booking == 1 and power < 0.0:
        account = DISSIPATED
        factor = -1.0
    outputs[account] += factor * power
    jacobian[account * columns + x_column] += factor * by_x * speed
    jacobian[account * columns + v_column] += factor * (torque + by_v * speed)


@twist
def tabulated_angle(motor_angle: float, output_angle: float, parameters: Any, error: Any) -> None:
    """Add e = f(x). Parameters: 1 if x is the output's angle, else 0, period, n, edges, cells as above."""
    of_output = parameters[0] > 0.0
    period = parameters[1]
    n = int(parameters[2])
    x = output_angle if of_output else motor_angle
    if period > 0.0:
        x -= math.floor((x - parameters[3]) / period) * period
    inside = 1.0
    if x < parameters[3]:
        x = parameters[3]
        inside = 0.0
    elif x > parameters[3 + n]:
        x = parameters[3 + n]
        inside = 0.0
    low = 0
    high = n
    while high - low > 1:
        middle = (low + high) // 2
        if parameters[3 + middle] <= x:
            low = middle
        else:
            high = middle
    at = 4 + n + 5 * low
    s = x - parameters[3 + low]
    c1 = parameters[at + 1]
    c2 = parameters[at + 2]
    c3 = parameters[at + 3]
    error[0] += parameters[at] + s * (c1 + s * (c2 + s * c3))
    slope = inside * (c1 + s * (2.0 * c2 + s * 3.0 * c3))
    bend = inside * (2.0 * c2 + 6.0 * c3 * s)
    if of_output:
        error[2] += slope
        error[5] += bend
    else:
        error[1] += slope
        error[3] += bend
