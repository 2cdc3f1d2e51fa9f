"""A measured channel that is compared: its samples, who may see them, and what they weigh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.records import Array, Mask


@dataclass
class Series:
    """One predicted channel of one record.

    Attributes:
        record: index of the record's predictor.
        channel: name of the channel.
        measured: shape (n,).
        train: samples that fits may see.
        hold: samples that only the proof sees.
        block: shape (n,), number of the block that each sample belongs to, unique over all records.
        noise: standard deviation of the channel's noise.
        reading: the same of a single reading, where a sample is the mean of several.
        sigma: standard deviation by which residuals are divided.
        own_zero: whether a fit lets its zero differ from those of other records.
    """

    record: int
    channel: str
    measured: Array
    train: Mask
    hold: Mask
    block: NDArray[np.int64]
    noise: float
    reading: float
    sigma: float = 1.0
    own_zero: bool = False
