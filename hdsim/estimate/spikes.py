"""Samples of a channel that are not to be trusted: spikes, and saturation.

Spikes are found as Hampel's filter does, by the deviation from a running median (Hampel 1974, J. American
Statistical Association 69:383).
"""

from __future__ import annotations

import numpy as np

from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import Array, Mask
from hdsim.log.outliers import runs_of

#: Deviations beyond which a sample is a spike, in standard deviations of the noise.
SPIKE_DEVIATIONS = 12.0
#: Samples of the running median.
SPIKE_WINDOW = 11
#: Longest run of samples that still is a spike.
LONGEST_SPIKE = 4


def find_spikes(values: Array, trusted: Mask) -> Mask:
    """Samples far from the running median, in runs of a few samples at most: shape (n,)."""
    from scipy.ndimage import label, median_filter

    filled = np.interp(np.arange(len(values)), np.flatnonzero(trusted), values[trusted])
    # Along the local slope, or a spike on a ramp would shift the median for its neighbours.
    slope = median_filter(np.gradient(filled), SPIKE_WINDOW, mode="nearest")
    reach = SPIKE_WINDOW // 2
    padded = np.pad(filled, reach, mode="edge")
    shifted = [padded[reach + k : reach + k + len(filled)] - k * slope for k in range(-reach, reach + 1)]
    deviation = np.abs(filled - np.median(shifted, axis=0))
    # The local scale keeps the corners of a fast motion from being taken for spikes.
    local = median_filter(deviation, 5 * SPIKE_WINDOW, mode="nearest") / 0.6745
    scale = np.maximum(local, noise_floor(values, trusted))
    scale = np.maximum(scale, 1e-9 * np.ptp(values[trusted]))
    spikes = (deviation > SPIKE_DEVIATIONS * scale) & trusted
    runs, count = label(spikes)
    for k in range(1, count + 1):
        where = np.flatnonzero(runs == k)
        first, last = where[0], where[-1]
        before, after = (
            filled[max(0, first - SPIKE_WINDOW // 2) : first],
            filled[last + 1 :][: SPIKE_WINDOW // 2],
        )
        around = np.concatenate([before, after])
        # A spike leaves the range of its neighbours and comes back; a step or a corner does not.
        beyond = np.maximum(filled[where] - around.max(), around.min() - filled[where])
        least = max(0.5 * SPIKE_DEVIATIONS * float(scale[where].min()), float(np.ptp(around)))
        if len(where) > LONGEST_SPIKE or beyond.max() < least:
            spikes[where] = False
    return np.asarray(spikes)


def largest_jump(values: Array, trusted: Mask, spikes: Mask) -> float:
    """Largest distance of a spike from the line between its trusted neighbours, in the values' unit."""
    rest = trusted & ~spikes
    around = np.interp(np.flatnonzero(spikes), np.flatnonzero(rest), values[rest])
    return float(np.max(np.abs(values[spikes] - around)))


def saturated(values: Array, trusted: Mask) -> Mask:
    """Samples at the highest or lowest number of a channel that stays there for a while, shape (n,)."""
    found = np.zeros(len(values), dtype=bool)
    for extreme in (values[trusted].max(), values[trusted].min()):
        there = values == extreme
        run = longest_run(there)
        if run >= 10 and run > 0.002 * len(values) and there.mean() < 0.9:
            found |= there
    return found


def longest_run(flags: Mask) -> int:
    """Length of the longest run of true."""
    return max((last - first for first, last in runs_of(flags)), default=0)
