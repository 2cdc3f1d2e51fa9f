"""What goes into a drive and what comes out.

Motor and load torque are two states of the model that never change by themselves. A torque that is a state
has its column in the exact Jacobian, so the input matrix of the linearised drive is read off and not found by
differences; and whoever closes a loop around the drive sets the two states.
"""

from __future__ import annotations

from typing import Any

from hdsim.kernel import (
    COMMANDED_TORQUE,
    DELIVERED,
    LOAD_TORQUE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    OUTPUT_TORQUE,
    OUTPUT_VELOCITY,
    SUPPLIED,
    element,
)
from hdsim.parts import Builder, Part, State

#: The inputs, in the order of their states.
INPUTS = ("motor_torque", "load_torque")

#: What a plant can give out, with units; the ring only where it is a degree of freedom.
OUTPUT_UNITS = {
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "ring_angle": "rad",
    "ring_velocity": "rad/s",
    "output_angle": "rad",
    "output_velocity": "rad/s",
    "output_torque": "N m",
    "transmission_error": "rad",
}

#: Units of the inputs.
INPUT_UNITS = dict.fromkeys(INPUTS, "N m")


@element
def torque_inputs(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """The first own state acts on the motor, the second on the output."""
    motor = inputs[own]
    load = inputs[own + 1]
    outputs[MOTOR_TORQUE] += motor
    outputs[COMMANDED_TORQUE] += motor
    outputs[SUPPLIED] += motor * inputs[MOTOR_VELOCITY]
    outputs[OUTPUT_TORQUE] += load
    outputs[LOAD_TORQUE] += load
    outputs[DELIVERED] -= load * inputs[OUTPUT_VELOCITY]
    jacobian[MOTOR_TORQUE * columns + own] += 1.0
    jacobian[OUTPUT_TORQUE * columns + own + 1] += 1.0
    jacobian[SUPPLIED * columns + own] += inputs[MOTOR_VELOCITY]
    jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += motor
    jacobian[DELIVERED * columns + own + 1] -= inputs[OUTPUT_VELOCITY]
    jacobian[DELIVERED * columns + OUTPUT_VELOCITY] -= load


class TorqueInputs(Part):
    """Torque of the motor and torque on the output, in place of the scenario's command and load torque."""

    def contribute(self, build: Builder) -> None:
        """Add the two states and what they do."""
        rated = build.rated_torque_nm
        states = [
            State("motor_torque_input", "N m", 0.0, rated / abs(build.ratio)),
            State("load_torque_input", "N m", 0.0, rated),
        ]
        build.element(torque_inputs, [0.0], states=states)
