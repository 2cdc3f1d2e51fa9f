"""What is left beyond the coordinates of the effects that are there: each formula errs in its own."""

from __future__ import annotations

import numpy as np

from hdsim.diagnosis.locate import curves_over
from hdsim.diagnosis.screen import Residual
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit


def beyond_curves(bench: Bench, current: Fit, left: Residual) -> Residual:
    """A residual without what smooth curves over the coordinates of the added effects explain.

    An exact formula leaves nothing there: what is left in its coordinate is another's.
    """
    homes = {
        (coordinate, channel)
        for one, channels in zip(current.state.added, shown_in(bench, current), strict=True)
        if not catalogue()[one.effect].signature.exact
        for coordinate in one.lives_in
        for channel in channels
    }
    residuals = bench.residuals(current.predictions, drift=True)
    curves = curves_over(bench, residuals, homes, current.state.delays)
    return Residual(left.values, np.hstack([left.base, curves]), bench.stacked_blocks())


def shown_in(bench: Bench, current: Fit) -> list[list[str]]:
    """Channels in which each added effect shows more than the noise: in others it can leave nothing."""
    numbers, noise = bench.stacked_series(), bench.noise_powers
    found = []
    for k, added in enumerate(current.state.added):
        columns = current.columns[:, current.numbers_of(k)][:, : len(added.coefficients)]
        powers = (columns @ np.array(added.coefficients)) ** 2
        own = {
            channel: sum(
                float(powers[numbers == k].sum()) for k, s in enumerate(bench.series) if s.channel == channel
            )
            for channel in bench.channels
        }
        found.append([channel for channel in bench.channels if own[channel] > noise[channel]])
    return found
