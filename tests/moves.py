"""Drives that a controller in cascade moves: to and fro with rests between the moves, and as a sine."""

from collections.abc import Iterable
from typing import Any

#: Standard deviations of good sensors, SI units.
NOISE = {"motor_angle": 3e-5, "output_angle": 4e-6, "motor_torque": 3e-3}


#: A load's torque that swells and ebbs: loops in loops.
SWELL: dict[str, Any] = {
    "type": "multisine",
    "amplitude_nm": 30.0,
    "frequencies_hz": [0.25, 0.6],
    "phases_deg": [0.0, 0.0],
}


def positioned(trajectory: dict[str, Any], *, position_gain_per_s: float = 30.0) -> dict[str, Any]:
    """A command that moves the output of a drive of size 20 along a trajectory."""
    return {"motor": {
        "type": "position",
        "at": "output",
        "trajectory": trajectory,
        "controller": {
            "type": "cascade",
            "position_gain_per_s": position_gain_per_s,
            "velocity_gain_nm_s_per_rad": 0.025,
            "velocity_integral_gain_nm_per_rad": 0.5,
        },
    }}  # fmt: skip


def to_and_fro(
    distances_deg: Iterable[float], velocity_deg_per_s: float, acceleration: float, jerk: float
) -> dict[str, Any]:
    """A trajectory of moves with rests of 0.3 s after them; acceleration and jerk in degrees and seconds."""
    moves: list[dict[str, Any]] = []
    for distance_deg in distances_deg:
        moves += [
            {
                "type": "s_curve",
                "distance_deg": distance_deg,
                "maximum_velocity_deg_per_s": velocity_deg_per_s,
                "maximum_acceleration_deg_per_s2": acceleration,
                "maximum_jerk_deg_per_s3": jerk,
            },
            {"type": "hold", "duration_s": 0.3},
        ]
    return {"type": "sequence", "moves": moves}


#: Between the moves the motor is held by its friction, and creeps to where it is to be.
MOVES = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": positioned(to_and_fro((60, -90, 45, -15), 90, 500, 8000)),
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 6.0, "sample_rate_hz": 1000.0},
}  # fmt: skip

#: It sticks for some milliseconds at each reversal, where the arm's weight is far from balanced.
SWINGING = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": positioned(
        {"type": "sine", "amplitude_deg": 20.0, "frequency_hz": 0.7, "phase_deg": -90, "offset_deg": 20.0}
    ),
    "load": {"inertia_kg_m2": 0.3, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
    "run": {"duration_s": 8.0, "sample_rate_hz": 500.0},
}  # fmt: skip
