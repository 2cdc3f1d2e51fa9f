"""After the search: every name is asked for once more, with all the others beside it.

Names are given one after the other, the first ones while other effects are still missing. Here the model
without each is fitted anew: a name that leaves nothing which the others do not explain as well is taken back
(backward elimination), and of the rest it is said what part of what would be missing they explain.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable

import numpy as np

from hdsim.diagnosis.name import Named
from hdsim.estimate.asked import gone_with
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.fit import Fit, fit, settled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import together

#: Least excess over a channel's noise power that counts: a fifth of the noise's root mean square (chosen:
#: half of what the weakest effects of blind cases have).
EXCESS = 0.05
#: Part of what would be missing without it below which a name is taken back (chosen: of calibration cases
#: right ones have 0.8 to 1, wrong ones 0.1 to 0.35 and, once, 0.9).
NEEDLESS = 0.1


def revised(bench: Bench, current: Fit, named: list[Named], tell: Callable[[str], object]) -> Fit:
    """The model without needless names; ``needed`` and ``worth`` of the others are set.

    Args:
        bench: the measured series.
        current: the model with all of them.
        named: in the order of ``current.state.added``; needless ones are taken out of it.
        tell: told what is being done.
    """
    while len(named) > 1:
        others: list[Fit | None] = []
        for k, one in enumerate(named):
            tell(f"without {one.name}")
            rest = without(bench, current, k)
            one.needed, one.worth = 1.0, math.inf
            if rest is not None:
                one.needed = needed(bench, rest, current)
                if len(named) > 2 and one.needed >= NEEDLESS:
                    # Of two names neither can have been needed for the sake of the other alone.
                    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
                        rest = settled(bench, rest)
                    one.needed = needed(bench, rest, current)
                one.worth = bench.power(rest.predictions) - bench.power(current.predictions)
            others.append(rest)
        k = min(range(len(named)), key=lambda k: named[k].needed)
        left_out = others[k]
        if left_out is None or named[k].needed >= NEEDLESS:
            break
        del named[k]
        # What the others make up for it takes them a few more steps.
        current = together(bench, left_out)
    if len(named) == 1:
        named[0].needed = 1.0
    return current


def without(bench: Bench, current: Fit, k: int) -> Fit | None:
    """The model without an effect, all the rest fitted roughly from where it was; None where that fails.

    Args:
        bench: the measured series.
        current: the model with it.
        k: which of its effects.
    """
    gone = gone_with(current, k)
    known = gone.columns, math.nan
    try:
        return fit(bench, gone.state, gone.frees, prune=False, after=gone, known=known, rough=True)
    except (PredictionError, np.linalg.LinAlgError):
        return None


def needed(bench: Bench, less: Fit, whole: Fit) -> float:
    """Part of what a model lacks that another has, in the channel where that is most.

    A channel counts where it is better off by more than the freedom of one more effect is worth to the
    Bayesian information criterion (Schwarz 1978): the logarithm of its independent samples, for each number.

    Args:
        bench: the measured series.
        less: the model that lacks something.
        whole: the one that has it.
    """
    noise = bench.noise_powers
    before, after = (bench.channel_powers(f.predictions) for f in (less, whole))
    rest, series = bench.stacked(bench.residuals(whole.predictions)), bench.stacked_series()
    blocks, numbers = bench.stacked_blocks(), whole.columns.shape[1] - less.columns.shape[1]
    best = 0.0
    for channel in bench.channels:
        rows = np.isin(series, [k for k, s in enumerate(bench.series) if s.channel == channel])
        alike = correlation(rest[rows], blocks[rows])
        worth = float(np.mean(rest[rows] ** 2)) * alike * math.log(max(rows.sum() / alike, 2.0))
        beyond, gained = before[channel] - noise[channel], before[channel] - after[channel]
        if gained > worth * max(numbers, 1) and beyond > EXCESS * noise[channel]:
            best = max(best, min(gained / beyond, 1.0))
    return best
