"""Readings of an encoder whose steps are larger than its noise, while its shaft stands still.

They all have the same error, uniform over a step (Widrow and Kollar 2008, Quantization Noise, ch. 5): a
thousand of them say as much as one. Taken for a thousand, the errors of a few rests are a law of the angle
that repeats itself wherever the shaft comes back to them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.noise import step_of
from hdsim.estimate.records import Array, Mask
from hdsim.log.outliers import runs_of

if TYPE_CHECKING:
    from hdsim.estimate.predict import Predictor

#: Part of a step within which a shaft stands still: a steady motion goes a whole one in each run of readings.
WITHIN = 0.25
#: Equal readings that are no rest yet: as many as a motion may leave within one step by chance (chosen).
FEW = 4
#: Part of a run of equal readings that must lie so near its middle: of a steady motion half of it does.
MOSTLY = 0.75


def fresh(predictor: Predictor, channel: str) -> Mask:
    """Samples of a compared channel that do not repeat a reading at rest, shape (n,)."""
    record = predictor.record
    if channel != "output_angle" or predictor.plan.motion != "motor_angle":
        return np.ones(len(record.time), dtype=bool)
    course = predictor.motor_angle / predictor.ratio
    return once_at_rest(record.filled(channel), course, step_of(record, channel))


def once_at_rest(values: Array, course: Array, step: float) -> Mask:
    """Samples without those that repeat a reading at rest, shape (n,); of each rest the middle one is kept.

    Args:
        values: readings of the encoder, shape (n,).
        course: how its shaft moves, by another sensor, shape (n,); same unit.
        step: of the encoder; 0: none.
    """
    found = np.ones(len(values), dtype=bool)
    if step <= 0.0:
        return found
    same = np.abs(np.diff(values)) < 0.5 * step
    for first, last in runs_of(same):
        run = slice(first, last + 1)
        middle = (first + last) // 2
        still = np.abs(course[run] - course[middle]) < WITHIN * step
        if still.sum() > FEW and still.mean() > MOSTLY:
            found[run] &= ~still
            found[middle] = True
    return found
