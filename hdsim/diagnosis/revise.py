"""After the search: every name is asked for once more, with all the others beside it.

Names are given one after the other, the first ones while other effects are still missing. Here the model
without each is fitted anew: a name that leaves nothing which the others do not explain as well is taken back
(backward elimination), and of the rest it is said what part of what would be missing they explain.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from hdsim.diagnosis.contest import confusable
from hdsim.diagnosis.name import MISMATCH, Named
from hdsim.estimate.asked import gone_with
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import worth_of_a_number
from hdsim.estimate.fit import Fit, added_spreads, fit, settled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import together

#: Least excess over a channel's noise power that counts: a fifth of the noise's root mean square (chosen:
#: half of what the weakest effects of blind cases have).
EXCESS = 0.05
#: Part of what would be missing without it below which a name is taken back (chosen: of calibration cases
#: right ones have 0.8 to 1, wrong ones 0.1 to 0.35 and, once, 0.9).
NEEDLESS = 0.1
#: Chance of an effect that is not there, as for the intervals of numbers.
BY_CHANCE = 0.05


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
            rest = without(bench, current, k, made_up=True)
            one.needed = 1.0 if rest is None else needed(bench, rest, current)
            others.append(rest)
        k = _least_needed(bench, current, named, others)
        for one, rest in zip(named, others, strict=True):
            one.less, one.worth = rest, math.inf
            if rest is not None:
                one.worth = bench.power(rest.predictions) - bench.power(current.predictions)
        left_out = others[k]
        if left_out is None or named[k].needed >= NEEDLESS:
            alike = stand_ins(bench, current, named, others)
            if alike is None:
                break
            kept, k = alike
            left_out = others[k]
            assert left_out is not None
            named[kept].alike |= {named[kept].name, named[k].name}
        del named[k]
        # What the others make up for it takes them a few more steps.
        current = together(bench, left_out)
    if len(named) == 1:
        named[0].needed, named[0].less = 1.0, None
    return current


def base_alone(bench: Bench, base: Fit, current: Fit) -> Fit | None:
    """The base's own numbers where they explain what the only name was given for; None where they don't.

    A re-fit may end at another minimum than the nearest to the truth. A fit beside an effect comes out of it,
    and the effect is given for what the numbers have done since.

    Args:
        bench: the measured series.
        base: the re-fitted model.
        current: the model with the one name, settled.
    """
    gained = bench.power(base.predictions) - bench.power(current.predictions)
    if gained <= EXCESS * bench.noise_power:
        return None
    rest = without(bench, current, 0)
    if rest is None:
        return None
    lost = bench.power(rest.predictions) - bench.power(current.predictions)
    return together(bench, rest) if lost < NEEDLESS * gained else None


def _least_needed(bench: Bench, current: Fit, named: Sequence[Named], others: list[Fit | None]) -> int:
    """Which name is needed least, or one that is needless.

    Of two names neither can have been needed for the sake of the other alone. Of more, the models without are
    carried on to their ends, which makes each name needed less, until one is needless.

    Args:
        bench: the measured series.
        current: the model with all names.
        named: in the order of ``current.state.added``; ``needed`` is changed in place.
        others: the model without each, rough; changed in place.
    """
    rough = sorted(range(len(named)), key=lambda k: named[k].needed) if len(named) > 2 else []
    for k in rough:
        rest = others[k]
        if rest is not None and named[k].needed >= NEEDLESS:
            others[k] = rest = carried_on(bench, rest)
            named[k].needed = needed(bench, rest, current)
        if named[k].needed < NEEDLESS:
            return k
    return min(range(len(named)), key=lambda k: named[k].needed)


def stand_ins(
    bench: Bench, current: Fit, named: Sequence[Named], others: Sequence[Fit | None]
) -> tuple[int, int] | None:
    """Two names of which either alone explains nearly all that both do: one effect.

    No formula is exact to more than ``MISMATCH`` of what it explains. Where the other name takes up no more
    than that in any channel, whichever of the two is left out, it is no effect beside it but another formula
    of the same. Each channel is asked: an encoder that resolves much would hide that only one of two explains
    a torque (an arm's weight and an error of the output's encoder). Nor are they two where neither is told
    from nothing beside the other: then their sizes cancel, and only what they do together is.

    Args:
        bench: the measured series.
        current: the model with all names.
        named: in the order of ``current.state.added``.
        others: the model without each.

    Returns:
        Which of the names stays, and which is an alternative to it, as their numbers; None where there are no
        such two.
    """
    noise, whole = bench.noise_powers, bench.channel_powers(current.predictions)

    def lack(rest: Fit, both: dict[str, float]) -> float:
        """Largest part of what both explain in a channel that one of them does not."""
        powers = bench.channel_powers(rest.predictions)
        return max((powers[c] - whole[c]) / part for c, part in both.items())

    for j, k in combinations(range(len(named)), 2):
        less_j, less_k = others[j], others[k]
        if named[j].name == named[k].name or not confusable(named[j].name, named[k].name):
            continue
        if less_j is None or less_k is None:
            continue
        neither = without(bench, less_k, j)
        if neither is None:
            continue
        both = {c: power - whole[c] for c, power in bench.channel_powers(neither.predictions).items()}
        both = {c: part for c, part in both.items() if part > EXCESS * noise[c]}
        if not both:
            continue
        lacks = {j: lack(less_k, both), k: lack(less_j, both)}
        if max(lacks.values()) > MISMATCH and (told(current, j) or told(current, k)):
            continue
        # A law at the end of its range stands for one that it is not.
        ends = {j: less_k.state.added[j].at_limit, k: less_j.state.added[k - 1].at_limit}
        kept = min((j, k), key=lambda one: (ends[one], lacks[one]))
        return kept, j + k - kept
    return None


def told(current: Fit, k: int) -> bool:
    """Whether the size of an effect is told from nothing, with all others beside it (Wald test).

    Args:
        current: the model with all effects.
        k: which of them.
    """
    from scipy.stats import chi2

    added, covariance, _ = added_spreads(current)[k]
    sizes = np.array(added.coefficients)
    wald = float(sizes @ np.linalg.lstsq(covariance, sizes, rcond=None)[0])
    return wald > float(chi2.isf(BY_CHANCE, len(sizes)))


def without(bench: Bench, current: Fit, k: int, *, made_up: bool = False) -> Fit | None:
    """The model without an effect, all the rest fitted roughly from where it was; None where that fails.

    Args:
        bench: the measured series.
        current: the model with it.
        k: which of its effects.
        made_up: begin where the others make up for it, which bends them as far as they can: it is asked
            whether it is needed, and not what is missing without it.
    """
    gone = gone_with(current, k)
    known, lost = (gone.columns, math.nan), None
    if made_up:
        sizes = np.array(current.state.added[k].coefficients)
        lost = -current.columns[:, current.numbers_of(k)][:, : len(sizes)] @ sizes
    try:
        return fit(bench, gone.state, gone.frees, prune=False, after=gone, known=known, lost=lost, rough=True)
    except (PredictionError, np.linalg.LinAlgError):
        return None


def carried_on(bench: Bench, found: Fit) -> Fit:
    """A rough fit at its end, or as it is where that fails."""
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        return settled(bench, found)
    return found


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
        worth = worth_of_a_number(rest[rows], blocks[rows])
        beyond, gained = before[channel] - noise[channel], before[channel] - after[channel]
        if gained > worth * max(numbers, 1) and beyond > EXCESS * noise[channel]:
            best = max(best, min(gained / beyond, 1.0))
    return best
