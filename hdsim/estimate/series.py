"""A measured channel that is compared: its samples, who may see them, and what they weigh."""

from __future__ import annotations

from collections.abc import Sequence
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

    def __post_init__(self) -> None:
        #: Noise of the sensor alone, whatever else is heard.
        self.sensor = self.noise


class Counted:
    """What counts of some series, and by how much, to be put back where a trial with less has failed.

    Args:
        series: as they are now.

    Attributes:
        trained: samples of each that fits saw, shape (n,) each.
    """

    def __init__(self, series: Sequence[Series]) -> None:
        self._series = tuple(series)
        self._kept = [(one.train, one.hold, one.sigma) for one in series]
        self.trained = [one.train for one in series]

    def put_back(self) -> None:
        """Every series counts as it did."""
        self.weigh_as_before()
        for one, (train, hold, _) in zip(self._series, self._kept, strict=True):
            one.train, one.hold = train, hold

    def weigh_as_before(self) -> None:
        """What counts is divided by what it was divided by."""
        for one, (_, _, sigma) in zip(self._series, self._kept, strict=True):
            one.sigma = sigma
