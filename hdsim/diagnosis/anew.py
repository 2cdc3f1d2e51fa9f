"""Samples that count no more once an effect has shown them, and what a search begins anew with then.

A vibration at the beginning of a record, or a shaft at rest, may be what the first effects were named for,
and has bent the base in any case. So all begins anew without it, but for a model that comes near the noise
without bending the base, and is clearly likelier than what was tried in its place.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.contest import FAR_LEFT_IN, LEFT_IN
from hdsim.diagnosis.given import AT_STAKE
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.passes import Search
from hdsim.diagnosis.rest import hear_rest
from hdsim.diagnosis.swing import hear_swing, let_swing
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, sharpened, strain
from hdsim.estimate.free_swing import swinging
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import as_far_as_promised, reweigh, together, unlikelihood
from hdsim.estimate.series import Counted


def heard(bench: Bench, before: Fit, found: Fit, *, beginnings: bool = True, rests: bool = True) -> bool:
    """Whether the effect found last has shown samples that do not count, or a shaft that sticks.

    Args:
        bench: the measured series; their masks and predictors are changed where that is so.
        before: the model before that effect was found.
        found: the model with it; where its load swings at the beginning of a record, it does from there on.
        beginnings: whether beginnings of records are asked.
        rests: whether rests are.
    """
    counted = Counted(bench.series)
    # What it explained no longer counts as noise.
    bench.weigh(bench.residuals(found.predictions))
    free = let_swing(bench, found) if beginnings else found
    if free is not found:
        found.become(free)
    if (beginnings and hear_swing(bench, found)) or (rests and hear_rest(bench, before, found)):
        return True
    now = np.array([series.sigma for series in bench.series])
    counted.weigh_as_before()
    if free is not found:
        then = np.array([series.sigma for series in bench.series])
        found.weigh((now / then)[bench.stacked_series()])
    return False


def begun_anew(bench: Bench, found: Search, *models: tuple[Fit, list[Named]]) -> Search:
    """The search once samples count no more, with the first of some models that explains what is left.

    Args:
        bench: the measured series, without those samples.
        found: the search.
        models: fits beside those samples, with the names of their effects.
    """
    found.anew = True
    for model, names in models:
        if not names:
            continue
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            on = as_far_as_promised(bench, sharpened(bench, together(bench, model, rough=True)))
            if not _near(bench, on):
                # What it explained no longer counts as noise, and a load may swing there.
                reweigh(bench, on)
                on = let_swing(bench, on)
            if _near(bench, on) and not any(_may_be_another(bench, on, one) for one in names):
                found.fit, found.named, found.kept = on, list(names), True
                break
    return found


def _near(bench: Bench, on: Fit) -> bool:
    """Whether a fit leaves so little, and bends the base so little, that a contest would ask for no other."""
    return bench.power(on.predictions) <= LEFT_IN * bench.noise_power and strain(on) <= AT_STAKE


def _may_be_another(bench: Bench, on: Fit, named: Named) -> bool:
    """Whether one of the laws that were tried in a name's place is not clearly less likely now.

    One that is far behind stays there.
    """
    least = unlikelihood(bench, on, on) + AT_STAKE
    for other in named.alternatives.values():
        if bench.power(other.predictions) > FAR_LEFT_IN * bench.power(named.fit.predictions):
            continue
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            there = together(bench, other, rough=True)
            if unlikelihood(bench, there, on) < least:
                return True
    return False


def gone_on_with(bench: Bench, kept: Search) -> Search:
    """A search that goes on without those samples, with what explains the others.

    Args:
        bench: the measured series, without those samples.
        kept: the search beside them.
    """
    kept.kept = False  # once: it may turn out that they are needless
    current = together(bench, kept.fit, rough=True)
    if current.state.swings:
        current.state, current.predictions = swinging(bench, current.state, current.predictions)
    reweigh(bench, current)
    current = as_far_as_promised(bench, sharpened(bench, current))
    # What was seen beside those samples has no place any more.
    stages = [
        replace(one, screening=one.screening and replace(one.screening, seen={}), over_given=None)
        for one in kept.stages
    ]
    return Search(current, left_of(bench, current), stages, kept.named, thorough=kept.thorough)
