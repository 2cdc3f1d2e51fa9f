"""A shaft at rest that shows once an effect is named.

Behind what is missing, the torque that holds a shaft at rest is missed no more than the others, and a re-fit
does not look for it (``hdsim.estimate.standstill``); beside the effect that was found it would be taken for
the next one, a friction that remembers. So each time that effects were found it is asked once more.

Where nothing else is missing, what holds the shaft would be taken for one more effect. A rest is a
hypothesis of its own then: while the shaft turns the model is right as it is, and at rest friction is
anything up to what breaks it loose (Filippov 1988).
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from functools import partial

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.fit import Fit
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.refit import REACHED, at_its_end, together
from hdsim.estimate.series import Counted, Series
from hdsim.estimate.standstill import (
    CLEARLY,
    count_only,
    has_a_sign,
    hear_standstill,
    leave_out_rest,
    missed_at_rest,
    while_turning,
)

#: Part of what the model before missed at rest that one with an effect more must miss still for that effect
#: not to be what tells of rests (chosen: most of it).
TOLD = 0.5


def hear_rest(bench: Bench, before: Fit, found: Fit) -> bool:
    """Take the sign of friction sharper, or leave rests out, where that is clearly likelier now.

    Args:
        bench: the measured series, weighed; predictors and masks are changed where that is so.
        before: the model before the last effect was found.
        found: the model with the effects that were found.

    Returns:
        Whether anything was changed.
    """
    if not has_a_sign(found.state):
        return leave_out_rest(bench, found)
    later = hear_standstill(
        bench,
        found.state,
        found.predictions,
        found,
        lambda: together(bench, found, rough=True),
        partial(at_its_end, bench),
    )
    return later is not found or only_sticks(bench, before, found)


def only_sticks(bench: Bench, before: Fit, found: Fit, *, whole: bool = False) -> bool:
    """Leave rests out where a model that only sticks is clearly likelier than the effect that was found.

    Args:
        bench: the measured series, weighed; masks are changed where that is so.
        before: the model before that effect was found.
        found: the model with it.
        whole: only where it leaves no more than the noise, too.
    """
    turning = while_turning(bench)
    if not before.state.drive.friction.sticks or not missed_at_rest(bench, before.predictions, turning):
        return False
    counted = Counted(bench.series)
    likelier = False
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        if count_only(bench, turning):
            alone = at_its_end(bench, before)
            enough = not whole or bench.power(alone.predictions) <= REACHED * bench.noise_power
            likelier = enough and _likelier_at_rest(bench, alone, found, counted.trained) > CLEARLY
    if likelier:
        counted.weigh_as_before()
    else:
        counted.put_back()
    return likelier


def sticks_beside(bench: Bench, before: Fit, found: Fit, traces: Sequence[Array]) -> bool:
    """Leave rests out where the effect that was found tells nothing of them, nor could any other one.

    Args:
        bench: the measured series; masks are changed.
        before: the model before that effect was found.
        found: the model with it.
        traces: of the effects that might be missing, whitened, shape (rows, k) each.
    """
    turning = while_turning(bench)
    if not (has_a_sign(found.state) and before.state.drive.friction.sticks):
        return False
    if not missed_at_rest(bench, found.predictions, turning):
        return False
    ours, first = bench.residuals(found.predictions), bench.residuals(before.predictions)
    owner = bench.stacked_series()
    designs = [np.zeros((len(owner), 1)), *traces]
    odds = np.zeros(len(designs))
    for k, (series, rows) in enumerate(zip(bench.series, turning, strict=True)):
        turns, rests = rows[series.train], ~rows[series.train]
        if not len(ours[k]) or not turns.any() or not rests.any():
            continue
        left, blocks = ours[k][series.train], series.block[series.train]
        if np.sum(left[rests] ** 2) < TOLD * np.sum(first[k][series.train][rests] ** 2):
            return False
        power = max(float(np.mean(left[turns] ** 2)), series.noise**2)
        turned, rested = (correlation(left[each], blocks[each]) for each in (turns, rests))
        anything = _anything(found, series, series.train, power)
        for j, columns in enumerate(designs):
            own = columns[owner == k]
            theirs = left - own @ np.linalg.lstsq(own, left, rcond=1e-6)[0]
            apart = np.sum(theirs[turns] ** 2) - np.sum(left[turns] ** 2)
            gains = np.sum(_gains(left[rests], theirs[rests], power, anything))
            odds[j] += 0.5 * apart / (power * turned) + gains / rested
    return bool(odds.min() > CLEARLY) and count_only(bench, turning)


def _anything(found: Fit, series: Series, counted: Mask, power: float) -> float:
    """Likelihood of any torque up to what breaks a shaft loose over that of one that is as predicted."""
    friction, peak = found.state.drive.friction, np.sqrt(2.0 * np.pi * power)
    load = float(np.max(np.abs(series.measured[counted])))
    breaks = friction.coulomb_nm + friction.load_coefficient * load
    return float(peak / (2.0 * breaks + peak))


def _gains(ours: Array, theirs: Array, power: float, anything: float) -> Array:
    """Log-odds of samples at rest where a shaft sticks, against a model that predicts them, shape (n,)."""
    as_predicted = np.exp(-0.5 * ours**2 / power)
    return np.asarray(0.5 * theirs**2 / power + np.log(0.5 * as_predicted + 0.5 * anything))


def _likelier_at_rest(bench: Bench, alone: Fit, found: Fit, trained: Sequence[Mask]) -> float:
    """Logarithm of the odds of a model that only sticks against one with an effect more.

    While the shaft turns both have the noise, or what the better one leaves. At rest the first one's torque
    is as likely to be as predicted as to be anything up to what breaks the shaft loose.

    Args:
        bench: the measured series, of which samples at rest do not count.
        alone: the model without the effect, fitted without those.
        found: the model with it, fitted with them.
        trained: samples that counted there, of each series, shape (n,) each.
    """
    odds = 0.0
    for series, ours, theirs, before in zip(
        bench.series,
        bench.residuals(alone.predictions),
        bench.residuals(found.predictions),
        trained,
        strict=True,
    ):
        turns, rests = series.train, before & ~series.train
        if not len(ours) or not turns.any():
            continue
        power = max(min(float(np.mean(each[turns] ** 2)) for each in (ours, theirs)), series.noise**2)
        apart = np.square(theirs) - np.square(ours)
        worth = power * correlation(theirs[turns], series.block[turns])
        odds += 0.5 * float(np.sum(apart[turns])) / worth
        if not rests.any():
            continue
        gains = _gains(ours[rests], theirs[rests], power, _anything(alone, series, before, power))
        odds += float(np.sum(gains)) / correlation(theirs[rests], series.block[rests])
    return odds
