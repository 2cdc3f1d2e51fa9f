"""Step 5b, the contest: candidates are fitted in the simulated model, roughly first, the best to the end."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from hdsim.diagnosis.candidate_fits import (
    fits_at_next_minima,
    fits_from,
    full_fits,
    rough_fits,
    to_its_end,
)
from hdsim.diagnosis.designs import designs
from hdsim.diagnosis.point import Point, given_point, point_at
from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.traces import Screened
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, strain
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import REACHED

#: What a rough fit may leave, in units of what the best leaves, to be carried to its end, and to be fitted
#: from the numbers as given or from where another led.
LEFT_IN, FAR_LEFT_IN = 2.0, 3.0
#: Most candidates that are.
FAR_MOST = 3
#: Part by which a law of compliance must leave more than the best of them to be fitted from there too.
LAGS = 0.1
#: Stiffness over the re-fitted one where candidates are asked, too: half an octave of the resonance and one.
OTHER_RESONANCES = 0.25, 0.5, 2.0, 4.0
#: Part of what the best leaves that a linear fit must leave there for a fit to begin there (calibration cases
#: of a recorded joint: 0.16 to 0.65 where the spring lies there, from 0.97 on where it does not).
THERE = 0.8

#: Candidates that were fitted, by name, each with whether it was fitted to the end.
Fitted = dict[str, tuple[Fit, bool]]


def contest(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    residual: Residual,
    on_step: Callable[[str], object] | None,
    fitted: Fitted | None = None,
    known_power: float = math.inf,
) -> list[tuple[str, Fit, Array]]:
    """Fit every candidate roughly, and the best of them further; each with what it leaves by blocks.

    Where the re-fit went far the candidates are fitted from the numbers as given too: a base without the
    effect may have bent them to stand in for it.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        shortlist: the candidates.
        residual: what they were screened on.
        on_step: told what is being fitted.
        fitted: candidates of an earlier contest over the same base, which need not be fitted again; those of
            this one are added.
        known_power: what a model that is known leaves: nothing that is as far behind it is carried on.
    """
    tell = on_step or (lambda _: None)
    known = fitted if fitted is not None else {}
    names = [one.name for one in shortlist]
    best = {n: (bench.power(found.predictions), found) for n, (found, _) in known.items() if n in names}
    shares = {one.name: one.share.share for one in shortlist}
    everyone, shortlist = shortlist, [one for one in shortlist if one.name not in best]

    def keep(name: str, several: Iterable[Fit]) -> None:
        for each in several:
            loss = bench.power(each.predictions)
            if name not in best or loss < best[name][0]:
                best[name] = loss, each

    def least_left() -> float:
        return min(known_power, *(loss for loss, _ in best.values()))

    left = bench.stacked(bench.residuals(base.predictions))
    here = Point(np.zeros(len(base.frees)), base.state, base.predictions, base.columns, left)
    for one in shortlist:
        tell(f"fitting {one.name}")
        several = [one, *one.others]
        # A screen's traces may be of an earlier model.
        anew = designs(bench, base.state, base.predictions, [each.added for each in several])
        for each, columns in zip(several, anew, strict=True):
            if columns is None:
                continue
            rest = residual.values - residual.project(each.columns) @ np.array(each.added.coefficients)
            keep(one.name, rough_fits(bench, base, here, each.added, columns, bench.sample_power(rest)))
    if not best:
        return []
    noise = bench.noise_power
    if (least := least_left()) > REACHED * noise:
        near = [name for name in best if best[name][0] <= FAR_LEFT_IN * least]
        nearest = sorted(near, key=lambda name: best[name][0])[:FAR_MOST]
        rivals = [
            one
            for one in shortlist
            if one.name in nearest or (one.added.fitting.in_series and one.name in near)
        ]
        _from_the_given(bench, base, rivals, keep, tell)
    _after_the_best(bench, base, shortlist, best, keep, tell)
    if (least := least_left()) > FAR_LEFT_IN * noise:
        _at_other_resonances(bench, base, shortlist, THERE * least, keep, tell)
    least = least_left()
    full = {name for name, (_, whole) in known.items() if whole}
    further = [name for name, (loss, _) in best.items() if loss <= LEFT_IN * least and name not in full]
    for name in further:
        tell(f"fitting {name} in full")
        keep(name, full_fits(bench, base, best[name][1]))
    # What was known beside a leader that was known, too, has been fitted from there.
    alike = shortlist if min(best, key=lambda name: best[name][0]) in known else everyone
    _look_alikes(bench, base, alike, best, [*full, *further], shares, keep, tell)
    first = min(best, key=lambda name: best[name][0])
    if first in further:
        enough = LEFT_IN * min(known_power, best[first][0])
        keep(first, fits_at_next_minima(bench, base, best[first][1], enough))
    for name in best:
        known[name] = best[name][1], name in full or name in further
    return [(name, found, bench.block_powers(found.predictions)) for name, (_, found) in best.items()]


def _from_the_given(
    bench: Bench,
    base: Fit,
    rivals: Sequence[Screened],
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit candidates from the numbers as given, if the base has been bent; laws of compliance to their end.

    The bent base had what is theirs: on the way from there they leave more at first.
    """

    def ended(there: Point, one: Screened) -> Iterator[Fit]:
        begun = _begun_from(bench, base, there, one)
        yield from begun
        if one.added.fitting.in_series:
            for each in _nearest_of_each(bench, begun):
                yield from full_fits(bench, base, each)

    given = given_point(bench, base)
    if given is not None:
        _from_point(given, "the numbers as given", rivals, ended, keep, tell)


def _after_the_best(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    best: dict[str, tuple[float, Fit]],
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit laws of compliance from the numbers to which the best of them led the base.

    The base without any of them is far from where each would have it, and the way there is bent.
    """
    series = [one for one in shortlist if one.added.fitting.in_series]
    if len(series) < 2 or not any(one.name in best for one in series):
        return
    name = min((one.name for one in series if one.name in best), key=lambda name: best[name][0])
    loss, leader = best[name]
    if loss > FAR_LEFT_IN * min(least for least, _ in best.values()):
        return  # what is missing is none of them
    enough = (1.0 + LAGS) * max(loss, bench.noise_power)
    rivals = [one for one in series if best.get(one.name, (math.inf, None))[0] > enough]

    def begun(there: Point, one: Screened) -> Iterator[Fit]:
        for shapes in product(*(shape.starts for shape in one.added.fitting.shapes)):
            yield from fits_from(bench, base, there, replace(one.added, shapes=shapes))

    led = leader.theta[: len(base.frees)]
    _from_elsewhere(bench, base, led, f"where {name} led", rivals, begun, keep, tell)


def _at_other_resonances(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    enough: float,
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit candidates from springs that put the resonance elsewhere, where a linear fit leaves little there.

    What drives a resonance shows in phase below it and in counterphase above: from a spring on the wrong side
    of what is excited every step to the right one leaves more.
    """
    springs = np.array([free.compliance for free in at_present(base)])
    if not springs.any():
        return
    rivals = [one for one in shortlist if not one.added.fitting.in_series]

    def ended(there: Point, one: Screened) -> Iterator[Fit]:
        for begun in _begun_from(bench, base, there, one, enough):
            yield begun
            yield from full_fits(bench, base, begun)

    for factor in OTHER_RESONANCES:
        where = f"{factor:g} times the stiffness"
        _from_elsewhere(bench, base, math.log(factor) * springs, where, rivals, ended, keep, tell)


def _look_alikes(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    best: dict[str, tuple[float, Fit]],
    full: Sequence[str],
    shares: Mapping[str, float],
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit what looks like the best anew from the numbers to which it led the base.

    Of those that were fitted in full, or whose traces explain more than the best's, where that misses the
    noise: what a re-fit bent to stand in for one of them is back there, and the way of each from the bent
    numbers is a valley with turns: which is at its end first need not be the better one. And laws of
    compliance that have not come as far: one as large as the drive's own is found from few places.
    """
    name = min(best, key=lambda name: best[name][0])
    loss, leader = best[name]
    noise = bench.noise_power
    missed = name in full and loss > REACHED * noise
    enough = (1.0 + LAGS) * max(loss, noise)

    def lags(one: Screened) -> bool:
        return one.added.fitting.in_series and best.get(one.name, (math.inf,))[0] > enough

    def may_lead(one: Screened) -> bool:
        return one.name in full or one.share.share > shares[name]

    alike = [one for one in shortlist if confusable(one.name, name)]
    rivals = [one for one in alike if (missed and may_lead(one)) or lags(one)]

    def ended(there: Point, one: Screened) -> Iterator[Fit]:
        for each in _nearest_of_each(bench, _begun_from(bench, base, there, one)):
            yield from to_its_end(bench, base, each, LEFT_IN * loss)

    led = leader.theta[: len(base.frees)]
    _from_elsewhere(bench, base, led, f"where {name} led", rivals, ended, keep, tell)


def _begun_from(bench: Bench, base: Fit, there: Point, one: Screened, enough: float = math.inf) -> list[Fit]:
    """Fits of a candidate, in each of its formulas, begun at a point where a linear fit leaves little."""
    several = (one, *one.others)
    return [found for each in several for found in fits_from(bench, base, there, each.added, enough)]


def _nearest_of_each(bench: Bench, begun: Sequence[Fit]) -> Iterable[Fit]:
    """Of each formula the fit that leaves least."""
    nearest: dict[str, Fit] = {}
    for each in sorted(begun, key=lambda each: bench.power(each.predictions)):
        nearest.setdefault(each.state.added[-1].fitting.label, each)
    return nearest.values()


def _from_elsewhere(
    bench: Bench,
    base: Fit,
    theta: Array,
    where: str,
    rivals: Sequence[Screened],
    fits: Callable[[Point, Screened], Iterable[Fit]],
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit candidates from other numbers of the base, shape (f,)."""
    if not rivals:
        return
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        _from_point(point_at(bench, base, theta), where, rivals, fits, keep, tell)


def _from_point(
    there: Point,
    where: str,
    rivals: Sequence[Screened],
    fits: Callable[[Point, Screened], Iterable[Fit]],
    keep: Callable[[str, Iterable[Fit]], None],
    tell: Callable[[str], object],
) -> None:
    """Fit candidates from a point, as many as can be predicted."""
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        for one in rivals:
            tell(f"fitting {one.name} from {where}")
            keep(one.name, fits(there, one))


def confusable(one: str, other: str) -> bool:
    """Whether one of two effects says that it can look like the other."""
    known = catalogue()
    return other in known[one].signature.confused_with or one in known[other].signature.confused_with


def against_priors(bench: Bench, results: Sequence[tuple[str, Fit, Array]]) -> list[tuple[str, Fit, Array]]:
    """Fits with what the priors have against their numbers shared out over their losses.

    It counts as many independent samples as the base's numbers are squared prior spreads away from what they
    were given as: a fit that has to bend the base needs as much more of the data on its side.
    """
    best = min(results, key=lambda result: float(result[2].sum()))[1]
    power = bench.sample_power(bench.stacked(bench.residuals(best.predictions)))
    return [(name, found, losses + power * strain(found) / len(losses)) for name, found, losses in results]
