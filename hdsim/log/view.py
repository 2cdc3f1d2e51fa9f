"""Decimation for viewers: few enough samples to plot at once, and no peak lost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEFAULT_VIEW_RATE_HZ = 1000.0

VIEW_SAMPLES = 20_000
"""Samples of the state in the view of one run: what a viewer plots without a wait."""


def view_rate(duration: float) -> float:
    """Rate in Hz at which the view of a run of ``duration`` s holds 20,000 samples."""
    return VIEW_SAMPLES / duration if duration > 0 else np.inf


class MinMaxView:
    """Thins a stream of rows to at most ``rate`` a second, keeping every column's minima and maxima.

    Time is cut into equal slots. A slot with more than two rows becomes two, at the times of its first and
    its last row; in each column they hold the slot's smallest and largest number, in the order in which
    the slot goes (so a rising column keeps rising). NaN is left out unless a slot has nothing else. Rows of
    one slot are held back until the next begins, so the result doesn't depend on how the stream was cut.

    Args:
        rate: rows a second, > 0; infinite passes everything.
    """

    def __init__(self, rate: float) -> None:
        self._slots_per_second = rate / 2.0
        self._slot: float | None = None
        self._time: list[Array] = []
        self._columns: list[list[Array]] = []

    def feed(self, time: Array, columns: Sequence[Array]) -> tuple[Array, list[Array]]:
        """Add rows, get the finished ones.

        Args:
            time: (n,), in s, strictly increasing over all calls.
            columns: arrays (n,) or (n, k).

        Returns:
            Times (m,) and columns (m,) or (m, k); m may be 0.
        """
        if not np.isfinite(self._slots_per_second):
            return time, list(columns)
        if not len(time):
            return time, list(columns)
        slot = np.floor(self._slots_per_second * time)
        if (self._slot is not None and slot[-1] != self._slot) or slot[0] != slot[-1]:
            begin = int(np.searchsorted(slot, slot[-1]))
            self._hold(time[:begin], columns, 0, begin)
            done = self._take()
            self._hold(time[begin:], columns, begin, len(time))
            self._slot = float(slot[-1])
            return self._reduce(*done)
        self._hold(time, columns, 0, len(time))
        self._slot = float(slot[-1])
        return time[:0], [c[:0] for c in columns]

    def finish(self) -> tuple[Array, list[Array]] | None:
        """The rows of the last slot; None where there are none."""
        if not self._time:
            return None
        return self._reduce(*self._take())

    def _hold(self, time: Array, columns: Sequence[Array], begin: int, end: int) -> None:
        # Copies, because the caller may use its arrays again before the next slot begins.
        self._time.append(time.copy())
        self._columns.append([c[begin:end].copy() for c in columns])

    def _take(self) -> tuple[Array, list[Array]]:
        held = np.concatenate(self._time), [np.concatenate(c) for c in zip(*self._columns, strict=True)]
        self._time, self._columns = [], []
        return held

    def _reduce(self, time: Array, columns: list[Array]) -> tuple[Array, list[Array]]:
        slot = np.floor(self._slots_per_second * time)
        starts = np.flatnonzero(np.concatenate([[True], slot[1:] != slot[:-1]]))
        counts = np.diff(np.append(starts, len(time)))
        lasts = starts + counts - 1
        pair = counts > 1
        place = np.cumsum(np.where(pair, 2, 1)) - np.where(pair, 2, 1)
        size = int(place[-1]) + (2 if pair[-1] else 1)

        def lay_out(first: Array, second: Array) -> Array:
            out = np.empty((size, *first.shape[1:]))
            out[place] = first
            out[place[pair] + 1] = second[pair]
            return out

        reduced = []
        for column in columns:
            low, high = np.fmin.reduceat(column, starts), np.fmax.reduceat(column, starts)
            first, last = column[starts], column[lasts]
            falling = last < first
            few = (counts <= 2).reshape(-1, *[1] * (column.ndim - 1))
            reduced.append(
                lay_out(
                    np.where(few, first, np.where(falling, high, low)),
                    np.where(few, last, np.where(falling, low, high)),
                )
            )
        return lay_out(time[starts], time[lasts]), reduced


def corners(x: Array, y: Array, every: int) -> NDArray[np.intp]:
    """Samples that keep the shape of a curve: of each ``every`` in a row the one that stands out most.

    That is the one farthest from the straight piece between the sample before those in the row and the one
    after them, on axes as long as the curve is wide and high.

    Args:
        x: (n,), NaN where there is none.
        y: (n,).
        every: at least 1.

    Returns:
        Positions (ceil(n / every),), increasing.
    """
    n = len(x)
    starts = np.arange(0, n, every)
    if every <= 1:
        return starts
    groups = np.minimum(starts[:, None] + np.arange(every), n - 1)
    with np.errstate(all="ignore"):
        points = np.stack([v / (np.nanmax(v) - np.nanmin(v)) if np.isfinite(v).any() else v for v in (x, y)])
        before = points[:, np.maximum(starts - 1, 0), None]
        chord = points[:, np.minimum(starts + every, n - 1), None] - before
        offset = points[:, groups] - before
        share = np.clip((offset * chord).sum(0) / (chord**2).sum(0), 0.0, 1.0)
        distance = ((offset - np.nan_to_num(share) * np.nan_to_num(chord)) ** 2).sum(0)
    # Any point is better than none.
    distance = np.where(np.isfinite(points[:, groups]).all(0), np.nan_to_num(distance), -1.0)
    chosen: NDArray[np.intp] = groups[np.arange(len(starts)), np.argmax(distance, axis=1)]
    return chosen
