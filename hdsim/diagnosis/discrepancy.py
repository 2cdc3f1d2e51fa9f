"""What a model leaves widens its numbers: a law that is missing or inexact has bent them by as much.

A residual that is a function of a coordinate is the model's discrepancy there, and numbers that do the same
cannot be told from it (M. C. Kennedy and A. O'Hagan 2001, Bayesian calibration of computer models, J. Royal
Statistical Society B 63:425; J. Brynjarsdottir and A. O'Hagan 2014, Inverse Problems 30:114007: without it
intervals shrink around wrong values). So the curve over that coordinate stands beside the numbers, each of
its directions as large, before the data, as all that is left there promises.
"""

from __future__ import annotations

import numpy as np

from hdsim.diagnosis.locate import Location, curves_over
from hdsim.diagnosis.rules import RULES
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.records import Array

#: Size of a direction of the curve's columns, beside the largest, below which it says nothing of its own.
SAME = 1e-6


def discrepancy(bench: Bench, found: Fit, location: Location) -> tuple[Array, Array]:
    """What the located remainder may have moved numbers by: for ``hdsim.estimate.drift.drifted``.

    Args:
        bench: the measured series, weighed.
        found: the fit that leaves it.
        location: where it lives; only what chance does not leave there counts.

    Returns:
        Orthonormal curves, whitened, over the best coordinate of each channel, shape (rows, k), and their
        sizes, (k,); none where chance leaves as much.
    """
    powers = bench.channel_powers(found.predictions)
    residuals = bench.residuals(found.predictions, drift=True)
    zeros = bench.offset_columns()
    columns, spreads = [np.zeros((len(zeros), 0))], [np.zeros(0)]
    for channel in bench.channels if location.chance <= RULES.chance else ():
        best = next((place for place in location.places if place.channel == channel), None)
        if best is None or best.share <= 0.0 or best.chance > RULES.chance:
            continue
        curves = curves_over(bench, residuals, {(best.coordinate, channel)}, found.state.delays)
        if zeros.size:
            curves = curves - zeros @ np.linalg.lstsq(zeros, curves, rcond=None)[0]
        own, sizes, _ = np.linalg.svd(curves, full_matrices=False)
        own = own[:, sizes > SAME * sizes.max(initial=0.0)]
        columns.append(own)
        spreads.append(np.full(own.shape[1], np.sqrt(best.share * powers[channel] / max(own.shape[1], 1))))
    return np.hstack(columns), np.concatenate(spreads)
