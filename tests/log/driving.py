"""A made-up run with the channels of a simulated one."""

from __future__ import annotations

import numpy as np

from hdsim.recording import Column, Event, Recording, Table

UNITS = {
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "motor_torque": "N m",
    "output_angle": "rad",
    "output_velocity": "rad/s",
    "output_torque": "N m",
    "load_torque": "N m",
    "ring_angle": "rad",
    "reference_angle": "rad",
    "tracking_error": "rad",
    "transmission_error": "rad",
    "kinematic_error": "rad",
    "twist": "rad",
    "input_friction_torque": "N m",
    "engaged_share": "1",
}


def drive_run(duration: float = 4.0, rate: float = 500.0, teeth_every: int = 10) -> Recording:
    """A sine move with hysteresis; 200 teeth of which those near the major axis carry load."""
    n = int(duration * rate) + 1
    time = np.arange(n) / rate
    reference = 0.5 * np.sin(2 * np.pi * time / duration)
    error = 3e-4 * np.tanh(np.cos(2 * np.pi * time / duration) / 0.1)
    output = reference + error
    motor = -100.0 * reference
    state = {
        "motor_angle": motor,
        "motor_velocity": np.gradient(motor, time),
        "motor_torque": 0.3 * np.cos(2 * np.pi * time / duration),
        "output_angle": output,
        "output_velocity": np.gradient(output, time),
        "output_torque": 25.0 * np.sin(6 * np.pi * time / duration),
        "load_torque": np.full(n, -20.0),
        "ring_angle": output,
        "reference_angle": reference,
        "tracking_error": error,
        "transmission_error": error,
        "kinematic_error": 1e-4 * np.sin(2 * motor),
        "twist": 2e-3 * np.sin(6 * np.pi * time / duration - 0.3),
        "input_friction_torque": 0.03 * np.sign(motor),
        "engaged_share": 0.3 * np.abs(np.sin(6 * np.pi * time / duration)),
    }
    rows = slice(None, None, teeth_every)
    angle = np.arange(200) * (2 * np.pi / 200) + (output - motor)[rows, None]
    force = (
        60.0 * np.maximum(0.0, np.cos(2 * angle) - 0.6) * np.abs(state["output_torque"][rows, None]) / 25.0
    )
    return Recording(
        {
            "state": Table(time, {name: Column(values, UNITS[name]) for name, values in state.items()}),
            "teeth": Table(time[rows], {"normal_force": Column(force, "N"), "angle": Column(angle, "rad")}),
        },
        static={"tooth_half_gap": Column(np.linspace(0, 1e-6, 200), "m")},
        events=[
            Event(0.0, "info", "run", "begins"),
            Event(duration / 3, "warning", "mesh", "output inside the gap"),
        ],
        metadata={"scenario": "preset: seed-2021\n"},
    )
