"""Compiled function of an arm as a load: its terms over time, in pieces of equal length."""

from __future__ import annotations

import math
from typing import Any

from hdsim.kernel import DELIVERED, OUTPUT_ANGLE, OUTPUT_TORQUE, OUTPUT_VELOCITY, TIME, element

#: Terms of the torque: constant, cosine and sine of the angle, of twice the angle, and the inertia.
TERMS = 6
#: Numbers before the pieces.
HEADER = 5


@element
def arm_torque(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -(c0 + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q) - M' w - (M - J) (w - x)/T_f, x' = (w - x)/T_f.

    Parameters: time at which the first piece begins, length of a piece (s), number of pieces, T_f (s) or 0
    where the inertia stands still and there is no state, inertia J that the model has (kg m^2); then for
    each piece and term four coefficients of a cubic in the time since its begin.
    """
    step = parameters[1]
    pieces = int(parameters[2])
    lag = parameters[3]
    elapsed = inputs[TIME] - parameters[0]
    piece = max(min(math.floor(elapsed / step), pieces - 1), 0)
    u = elapsed - piece * step
    moving = 1.0
    if elapsed <= 0.0 or elapsed >= pieces * step:
        # Before and after, the other joints stand as at the ends.
        moving = 0.0
        u = 0.0 if elapsed <= 0.0 else step
    angle = inputs[OUTPUT_ANGLE]
    velocity = inputs[OUTPUT_VELOCITY]
    torque = 0.0
    turned = 0.0
    later = 0.0
    at = HEADER + 4 * TERMS * piece
    for k in range(TERMS - 1):
        order = (k + 1) // 2
        phase = order * angle
        wave = math.cos(phase)
        slope = -order * math.sin(phase)
        if k > 0 and k % 2 == 0:
            slope = order * wave
            wave = math.sin(phase)
        p = at + 4 * k
        value = parameters[p] + u * (parameters[p + 1] + u * (parameters[p + 2] + u * parameters[p + 3]))
        rate = parameters[p + 1] + u * (2.0 * parameters[p + 2] + 3.0 * u * parameters[p + 3])
        torque -= value * wave
        turned -= value * slope
        later -= moving * rate * wave
    if lag > 0.0:
        p = at + 4 * (TERMS - 1)
        inertia = parameters[p] + u * (parameters[p + 1] + u * (parameters[p + 2] + u * parameters[p + 3]))
        inertia -= parameters[4]
        rate = moving * (parameters[p + 1] + u * (2.0 * parameters[p + 2] + 3.0 * u * parameters[p + 3]))
        bend = moving * (2.0 * parameters[p + 2] + 6.0 * u * parameters[p + 3])
        acceleration = (velocity - inputs[own]) / lag
        torque -= rate * velocity + inertia * acceleration
        later -= bend * velocity + rate * acceleration
        faster = -rate - inertia / lag
        outputs[own] += acceleration
        jacobian[own * columns + OUTPUT_VELOCITY] += 1.0 / lag
        jacobian[own * columns + own] -= 1.0 / lag
        jacobian[OUTPUT_TORQUE * columns + OUTPUT_VELOCITY] += faster
        jacobian[OUTPUT_TORQUE * columns + own] += inertia / lag
        jacobian[DELIVERED * columns + OUTPUT_VELOCITY] -= faster * velocity
        jacobian[DELIVERED * columns + own] -= inertia / lag * velocity
    outputs[OUTPUT_TORQUE] += torque
    outputs[DELIVERED] -= torque * velocity
    jacobian[OUTPUT_TORQUE * columns + OUTPUT_ANGLE] += turned
    jacobian[OUTPUT_TORQUE * columns + TIME] += later
    jacobian[DELIVERED * columns + OUTPUT_ANGLE] -= turned * velocity
    jacobian[DELIVERED * columns + OUTPUT_VELOCITY] -= torque
    jacobian[DELIVERED * columns + TIME] -= later * velocity
