"""Samples of a channel that stand out from their neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hdsim.log.mapping import OutlierMask

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Neighbours on either side whose range an isolated spike leaves.
_NEIGHBOURS = 5


def outliers(values: Array, mask: OutlierMask) -> NDArray[np.bool_]:
    """Samples that stand out from the median of their neighbours, shape (n,); see `OutlierMask`."""
    from scipy.ndimage import median_filter

    sound = np.isfinite(values)
    if sound.sum() < 2:
        return np.zeros(len(values), bool)
    whole = np.interp(np.arange(len(values)), np.flatnonzero(sound), values[sound])
    reach = 2 * mask.width_samples + 1
    padded = np.pad(whole, reach, mode="reflect", reflect_type="odd") if len(whole) > reach else whole
    if len(padded) == len(whole):
        return np.zeros(len(values), bool)
    # Halfway between two samples on either side: on a straight line that is where the sample should be, and
    # of the pairs more are sound than not beside a spike that is no wider than stated.
    n = len(whole)
    pairs = [
        0.5 * (padded[reach - d : reach - d + n] + padded[reach + d : reach + d + n])
        for d in range(1, reach + 1)
    ]
    off = np.abs(whole - np.median(pairs, axis=0))
    # 1.4826 times the median deviation estimates a normal distribution's standard deviation.
    spread = 1.4826 * median_filter(off, mask.window_samples, mode="nearest")
    steps = np.abs(np.diff(whole))
    quantum = float(np.min(steps[steps > 0], initial=np.inf))
    found: NDArray[np.bool_] = (off > mask.threshold * spread) & (off > 3 * quantum)
    return _isolated(whole, found, mask.width_samples) & sound if mask.isolated else found


def runs_of(flags: Flags) -> list[tuple[int, int]]:
    """First sample of every run, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _isolated(values: Array, far: Flags, width: int) -> Flags:
    """Runs of at most ``width`` that leave the range of the sound samples around them by more than it.

    A step or a wrapped angle stays where it went, the corners of a steep reversal lie within its range.
    """
    found = np.zeros(len(values), dtype=bool)
    for first, last in runs_of(far):
        before = np.flatnonzero(~far[:first])[-_NEIGHBOURS:]
        after = last + np.flatnonzero(~far[last:][: 4 * _NEIGHBOURS])[:_NEIGHBOURS]
        if last - first > width or not (len(before) and len(after)):
            continue
        around = values[np.concatenate([before, after])]
        beyond = np.maximum(values[first:last] - around.max(), around.min() - values[first:last])
        found[first:last] = beyond.min() > np.ptp(around)
    return found
