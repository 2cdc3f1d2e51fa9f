"""Compiled functions of motor commands and loads."""

from __future__ import annotations

import math
from typing import Any

from hdsim.kernel import (
    COMMANDED_TORQUE,
    DELIVERED,
    LOAD_TORQUE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    OUTPUT_ANGLE,
    OUTPUT_TORQUE,
    OUTPUT_VELOCITY,
    STORED,
    SUPPLIED,
    element,
)

#: Inputs of a canonical controller: three of the reference, then motor and output angle and velocity.
CONTROLLER_INPUTS = 7

#: Numbers before the matrices of a canonical controller.
CONTROLLER_HEADER = 4


@element
def motor_torque(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Motor torque over time. Parameters: column of the signal."""
    column = int(parameters[0])
    torque = inputs[column]
    velocity = inputs[MOTOR_VELOCITY]
    outputs[MOTOR_TORQUE] += torque
    outputs[COMMANDED_TORQUE] += torque
    outputs[SUPPLIED] += torque * velocity
    jacobian[MOTOR_TORQUE * columns + column] += 1.0
    jacobian[SUPPLIED * columns + column] += velocity
    jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += torque


@element
def held_torque(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Motor torque held between two samples of a controller. Parameters: the torque (N m)."""
    torque = parameters[0]
    outputs[MOTOR_TORQUE] += torque
    outputs[COMMANDED_TORQUE] += torque
    outputs[SUPPLIED] += torque * inputs[MOTOR_VELOCITY]
    jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += torque


@element
def controller(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Continuous controller: x' = A x + B w + L (T - u), u = C x + D w, T = u limited to +-limit.

    Parameters: number of states, column of the reference signal, derivative order of that signal as an
    angle (0 angle, 1 velocity), torque limit (N m), then A, B (n by 7), C, D and L, row-major. w holds the
    reference angle, velocity and acceleration, motor angle and velocity, output angle and velocity.
    """
    n = int(parameters[0])
    column = int(parameters[1])
    order = int(parameters[2])
    limit = parameters[3]
    a = CONTROLLER_HEADER
    b = a + n * n
    c = b + n * CONTROLLER_INPUTS
    d = c + n
    tracking = d + CONTROLLER_INPUTS

    torque = 0.0
    for i in range(n):
        torque += parameters[c + i] * inputs[own + i]
    for j in range(order, CONTROLLER_INPUTS):
        if j < 3:
            source = column + j - order
        elif j < 5:
            source = j - 3
        else:
            source = j - 1
        torque += parameters[d + j] * inputs[source]
    excess = 0.0
    slope = 1.0
    if torque > limit:
        excess = limit - torque
        slope = 0.0
    elif torque < -limit:
        excess = -limit - torque
        slope = 0.0
    torque += excess

    velocity = inputs[MOTOR_VELOCITY]
    outputs[MOTOR_TORQUE] += torque
    outputs[COMMANDED_TORQUE] += torque
    outputs[SUPPLIED] += torque * velocity
    jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += torque
    for i in range(n):
        rate = parameters[tracking + i] * excess
        row = (own + i) * columns
        for k in range(n):
            entry = parameters[a + i * n + k]
            rate += entry * inputs[own + k]
            jacobian[row + own + k] += entry - parameters[tracking + i] * (1.0 - slope) * parameters[c + k]
        for j in range(order, CONTROLLER_INPUTS):
            if j < 3:
                source = column + j - order
            elif j < 5:
                source = j - 3
            else:
                source = j - 1
            entry = parameters[b + i * CONTROLLER_INPUTS + j]
            rate += entry * inputs[source]
            jacobian[row + source] += entry - parameters[tracking + i] * (1.0 - slope) * parameters[d + j]
        outputs[own + i] += rate
        gain = slope * parameters[c + i]
        jacobian[MOTOR_TORQUE * columns + own + i] += gain
        jacobian[SUPPLIED * columns + own + i] += gain * velocity
    for j in range(order, CONTROLLER_INPUTS):
        if j < 3:
            source = column + j - order
        elif j < 5:
            source = j - 3
        else:
            source = j - 1
        gain = slope * parameters[d + j]
        jacobian[MOTOR_TORQUE * columns + source] += gain
        jacobian[SUPPLIED * columns + source] += gain * velocity


@element
def load_torque(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """External torque on the output over time. Parameters: column of the signal."""
    column = int(parameters[0])
    torque = inputs[column]
    velocity = inputs[OUTPUT_VELOCITY]
    outputs[OUTPUT_TORQUE] += torque
    outputs[LOAD_TORQUE] += torque
    outputs[DELIVERED] -= torque * velocity
    jacobian[OUTPUT_TORQUE * columns + column] += 1.0
    jacobian[DELIVERED * columns + column] -= velocity
    jacobian[DELIVERED * columns + OUTPUT_VELOCITY] -= torque


@element
def gravity_arm(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Gravity on a pendulum at the output. Parameters: m g l (N m), angle at which it hangs (rad)."""
    moment = parameters[0]
    angle = inputs[OUTPUT_ANGLE] - parameters[1]
    outputs[OUTPUT_TORQUE] -= moment * math.sin(angle)
    outputs[STORED] += moment * (1.0 - math.cos(angle))
    jacobian[OUTPUT_TORQUE * columns + OUTPUT_ANGLE] -= moment * math.cos(angle)
