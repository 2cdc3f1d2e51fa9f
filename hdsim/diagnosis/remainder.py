"""Step 8, what is left of the noise: a rest that is plainly more than noise is said, wherever it lives.

What happens once cannot be cross-validated, and what lives in no coordinate of the catalogue has no place;
neither is a reason to call a model complete.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdsim.diagnosis.verdict import Remainder
from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array

#: Rest over the noise, root mean square, above which it isn't noise; below 1.25 where nothing is missing.
EXCESS = 1.6
#: Part of the rest's excess power that the stretch where it lives must hold.
MOST = 0.8


def remainder(bench: Bench, predictions: Sequence[Array]) -> Remainder | None:
    """The channel that is left with most beyond its noise; None where noise is all that is left.

    Args:
        bench: the measured series.
        predictions: of the training records.
    """
    worst: Remainder | None = None
    for series, residual in zip(bench.series, bench.residuals(predictions, drift=True), strict=True):
        if series.record >= bench.training or not series.train.any():
            continue
        record = bench.predictors[series.record].record
        # In units of a single reading's noise, however many a sample is the mean of.
        reading = max(series.reading, 1e-300)
        square = 1.0 + (residual[series.train] ** 2 - series.noise**2) / reading**2
        block = series.block[series.train] - series.block.min()
        counts = np.bincount(block)
        used = counts > 0
        powers = np.bincount(block, square)[used] / counts[used]
        ratio = float(np.sqrt(max(powers.max(), 0.0)))
        if np.sqrt(max(square.mean(), 0.0)) < EXCESS or (worst is not None and worst.times_noise > ratio):
            continue
        beyond = np.maximum(powers - 1.0, 0.0)
        order = np.argsort(-beyond)
        needed = int(np.searchsorted(np.cumsum(beyond[order]), MOST * beyond.sum())) + 1
        inside = np.isin(block, np.flatnonzero(used)[order[:needed]])
        times = record.time[series.train][inside]
        worst = Remainder(
            record=record.name, channel=series.channel, times_noise=ratio,
            start_s=float(times[0]), end_s=float(times[-1]),
        )  # fmt: skip
    return worst
