"""Where the zeros of both encoders lie: at which angle of the output the gear was assembled to the motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.records import Record

if TYPE_CHECKING:
    from hdsim.parts import Builder


class Zero:
    """A gear whose output stands at an angle where motor angle / ratio is zero, without any twist.

    Args:
        angle: of the output, rad.
    """

    def __init__(self, angle: float) -> None:
        self.angle = angle

    def contribute(self, build: Builder) -> None:
        """Add the angle to the mesh twist."""
        from hdsim.effects._kernels import harmonics

        build.twist(harmonics, [1.0, self.angle, 0.0, 0.0, 0.5 * np.pi])


def between_zeros(record: Record, ratio: float) -> tuple[int, float]:
    """How far the encoders' zeros lie apart: whole turns of the motor, and the rest as an output angle.

    Weights, and errors of the output's own, lie at angles of the output's encoder, those of the wave
    generator at angles within a turn of the motor's, which counts turns from where it was switched on.

    Args:
        record: the measured run, with both angles.
        ratio: the model's signed ratio.

    Returns:
        Turns to be added to the motor's reading, and the angle of the output beyond motor angle / ratio, rad.
    """
    both = record.trusted["motor_angle"] & record.trusted["output_angle"]
    if not both.any():
        return 0, 0.0
    apart = float(np.median((record.channels["output_angle"] - record.channels["motor_angle"] / ratio)[both]))
    turns = round(apart * ratio / (2.0 * np.pi))
    return turns, apart - 2.0 * np.pi * turns / ratio
