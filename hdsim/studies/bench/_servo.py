"""The position loop of the bench, tuned to the drive's inertia, and moves for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hdsim.drive.parameters import Drive

#: Bandwidths of the cascade, 1/s: position loop, velocity loop, integral over velocity gain.
_POSITION, _VELOCITY, _INTEGRAL = 40.0, 200.0, 20.0


def position_loop(
    drive: Drive, load_inertia_kg_m2: float, moves: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """A collocated cascade (motor encoder) on moves of the output, as ``command.motor``.

    The gains are the bandwidths times the inertia at the motor, load included; the motor's encoder closes the
    loop, so that what the gear does wrong stays in the output angle, as in a joint with one encoder.
    """
    inertia = drive.inertia.rotor_kg_m2 + load_inertia_kg_m2 / drive.ratio**2
    return {
        "type": "position",
        "at": "output",
        "trajectory": {"type": "sequence", "moves": [dict(move) for move in moves]},
        "controller": {
            "type": "cascade",
            "position_gain_per_s": _POSITION,
            "velocity_gain_nm_s_per_rad": _VELOCITY * inertia,
            "velocity_integral_gain_nm_per_rad": _VELOCITY * _INTEGRAL * inertia,
            "acceleration_feedforward_nm_s2_per_rad": inertia,
        },
    }


def moves_between(
    positions_deg: Sequence[float], *, ratio: float, motor_rpm: float, dwell_s: float
) -> tuple[list[dict[str, Any]], float]:
    """Moves from 0 through positions with a dwell at each, and how long they take, s.

    Args:
        positions_deg: output angles in order, no two neighbours equal.
        ratio: motor angle / output angle.
        motor_rpm: largest motor speed.
        dwell_s: rest at each position.
    """
    from hdsim.actuation.shapes import SCurve

    velocity = 6.0 * motor_rpm / abs(ratio)
    limits = {"velocity": velocity, "acceleration": 8.0 * velocity, "jerk": 200.0 * velocity}
    moves: list[dict[str, Any]] = []
    seconds, before = 0.0, 0.0
    for position in positions_deg:
        move: dict[str, Any] = {"type": "s_curve", "distance_deg": position - before}
        move["maximum_velocity_deg_per_s"] = limits["velocity"]
        move["maximum_acceleration_deg_per_s2"] = limits["acceleration"]
        move["maximum_jerk_deg_per_s3"] = limits["jerk"]
        moves += [move, {"type": "hold", "duration_s": dwell_s}]
        shape = SCurve(distance=position - before, **{f"maximum_{k}": v for k, v in limits.items()})
        seconds += shape.move().duration + dwell_s
        before = position
    return moves, seconds
