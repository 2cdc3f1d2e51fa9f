"""Compiled function of the damper that lets a prediction's load come to rest before its record begins."""

from __future__ import annotations

from typing import Any

from hdsim.kernel import MOTOR_VELOCITY, OUTPUT_TORQUE, OUTPUT_VELOCITY, TIME, element


@element
def lead_in_damper(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -c (1 - (t / t_end)^2)^2 (w_output - w_motor / i) on the output, until t_end.

    Parameters: c (N m s/rad), t_end (s), 1 / i.
    """
    passed = inputs[TIME] / parameters[1]
    if passed >= 1.0:
        return
    left = 1.0 - passed * passed
    damping = parameters[0] * left * left
    slips = inputs[OUTPUT_VELOCITY] - inputs[MOTOR_VELOCITY] * parameters[2]
    outputs[OUTPUT_TORQUE] -= damping * slips
    jacobian[OUTPUT_TORQUE * columns + OUTPUT_VELOCITY] -= damping
    jacobian[OUTPUT_TORQUE * columns + MOTOR_VELOCITY] += damping * parameters[2]
    jacobian[OUTPUT_TORQUE * columns + TIME] += 4.0 * parameters[0] * left * passed / parameters[1] * slips
