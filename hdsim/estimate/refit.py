"""Step 3, re-fit first: the numbers that the base model already has, before anything is called missing."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hdsim.estimate.beginning import hear_beginning
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import robust_covariance
from hdsim.estimate.fit import Fit, at_present, base_intervals, fit, settled, sharpened, strain
from hdsim.estimate.flanks import hear_flanks, widen_by_flanks
from hdsim.estimate.free_swing import swinging
from hdsim.estimate.motion_noise import hear_motion
from hdsim.estimate.numbers import Free, Interval, base_freedoms, delay_freedoms
from hdsim.estimate.offsets import part_zeros
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.standstill import hear_standstill
from hdsim.estimate.state import State
from hdsim.estimate.unwound import turn_to_zero, zeros_beside
from hdsim.estimate.vector import Vector, sensitivities

#: Most fits under weights that follow from the one before, and factor between the weights that ends them.
WEIGHINGS, ALIKE = 3, 1.5
#: Part of what is left beside the noise below which the delays that leave it are believed at once, and what a
#: rough fit may leave over that to be carried on.
ALL, NEARLY = 0.1, 2.0
#: Part of what a re-fit leaves beside the noise that numbers which it did not move must explain to be moved.
MUCH = 0.1
#: Most times that a fit short of its end is carried on.
CARRIED_ON = 6
#: Most times that the beginnings of records are asked.
BEGINNINGS = 3
#: Prior spreads that a number may have gone for a fit to begin at the given one too.
FAR = 2.0
#: What a fit may leave, in units of the noise, to count as one that has reached it.
REACHED = 1.05


@dataclass
class Refit:
    """The base model with its own numbers fitted.

    Attributes:
        fit: the fitted model.
        freedoms: the numbers as they were.
        intervals: each with its interval, or marked as not determined by these data.
        before: predictions of the model as given.
    """

    fit: Fit
    freedoms: list[Free]
    intervals: list[Interval]
    before: list[Array]

    @property
    def moved(self) -> list[Interval]:
        """Numbers whose start value lies outside their interval."""
        return [interval for interval in self.intervals if interval.moved]


def refit(
    bench: Bench,
    state: State,
    frees: Sequence[Free] | None = None,
    *,
    begun: tuple[list[Array], Fit] | None = None,
) -> Refit:
    """Fit the base model's numbers to the training data.

    Args:
        bench: the measured series; their weights are set on the way.
        state: the base model.
        frees: numbers that may move; all that the base has when None.
        begun: its first steps (``first_look``), where they have been taken.
    """
    freedoms = _own_numbers(bench, state) if frees is None else list(frees)
    before, found = begun or _roughly(bench, state, freedoms)
    # A vibration at the beginning bends a fit, and one that is less bent shows more of it.
    for _ in range(BEGINNINGS):
        if not (hear_beginning(bench, before) or hear_beginning(bench, found.predictions)):
            break
        before, found = _roughly(bench, state, freedoms)

    def anew() -> Fit:
        return _roughly(bench, state, freedoms)[1]

    found = hear_standstill(bench, state, before, found, anew)
    hear_motion(bench, (state, found.state), found.predictions)
    hear_flanks(bench, found.state)
    # Weights follow the residual: what a fit explained no longer counts as noise. A fit under weights that
    # still hold much of it leaves what the next one finds.
    reweigh(bench, found)
    for weighing in range(WEIGHINGS):
        frees = at_present(found)
        if weighing == 0 and found.undetermined:
            # Far from the end, what the data see may look different from there.
            # What was driven to nearly nothing has no slope there; that is no reason to call it unknown.
            found = fit(bench, found.state, [*found.undetermined, *frees], sure=len(frees))
        else:
            known = found.columns, math.nan
            found = fit(bench, found.state, frees, prune=False, known=known, after=found)
        align(bench, found)
        if reweigh(bench, found) < ALIKE:
            break
    found = _with_those_left(bench, found)
    _widened(bench, found)

    def heard(late: Fit) -> bool:
        """Whether fewer samples count now: what a delay leaves hides what a rest or a beginning does."""
        rested = hear_standstill(bench, state, before, late, lambda: late, partial(at_its_end, bench))
        return hear_beginning(bench, rested.predictions) or rested is not late

    found = _delayed(bench, found, heard)
    widen_by_flanks(bench, found)
    return Refit(found, freedoms, base_intervals(found, freedoms), bench.predict(state))


def _delayed(bench: Bench, found: Fit, heard: Callable[[Fit], bool]) -> Fit:
    """The fit with the torques' delays, where they explain what it leaves.

    Args:
        bench: the measured series.
        found: the fit without them.
        heard: whether samples no longer count that leave more than the others with the delays.
    """
    noise, left = bench.noise_power, bench.power(found.predictions)
    late = with_delays(bench, found, rough=True) if left > noise else None
    if late is None or bench.power(late.predictions) - noise > (1.0 - MUCH) * (left - noise):
        return found
    if heard(late):
        found = settled(bench, together(bench, found, rough=True))
        _widened(bench, found)
        reweigh(bench, found)
        if bench.power(found.predictions) <= REACHED * bench.noise_power:
            return found
        late = with_delays(bench, found, rough=True) or found
    noise, left = bench.noise_power, bench.power(found.predictions)
    if bench.power(late.predictions) - noise < NEARLY * ALL * (left - noise):
        late = settled(bench, late)
    if bench.power(late.predictions) - noise >= ALL * (left - noise):
        return found
    reweigh(bench, late)
    return late


def first_look(bench: Bench, state: State) -> tuple[list[Array], Fit]:
    """The first steps of a re-fit: predictions of the model as given, and a first fit.

    Raises:
        PredictionError: the model as given could not be predicted.
    """
    return _roughly(bench, state, _own_numbers(bench, state))


def _own_numbers(bench: Bench, state: State) -> list[Free]:
    """All numbers that the base has."""
    locked = all(predictor.plan.locked for predictor in bench.predictors)
    return base_freedoms(state, bench.channels, load_known=bench.load_known, locked=locked)


def _roughly(bench: Bench, state: State, freedoms: Sequence[Free]) -> tuple[list[Array], Fit]:
    """Predictions of the model as given, and a first fit."""
    bench.swings = {}
    before = bench.predict(state)
    speeds = [predictor.motor_velocity for predictor in bench.predictors[: bench.training]]
    part_zeros(bench.series, bench.apart(before), bench.zeros, speeds)
    bench.weigh(bench.residuals(before))
    found = fit(bench, state, freedoms, evaluations=5, rough=True)
    align(bench, found)
    return before, found


def at_its_end(bench: Bench, found: Fit) -> Fit:
    """A fit carried on under weights that follow what it leaves, until they stay."""
    for _ in range(WEIGHINGS):
        found = together(bench, found, rough=True)
        if _weights_risen(bench, found).max() < ALIKE:
            break
    return found


def as_far_as_promised(bench: Bench, found: Fit) -> Fit:
    """A fit carried on while it promises, and keeps, that much of what it leaves beside the noise will go.

    Short of its end it leaves what looks like another effect.
    """
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        for _ in range(CARRIED_ON):
            left = bench.power(found.predictions) - bench.noise_power
            if left <= (REACHED - 1.0) * bench.noise_power or _promised(bench, found) < MUCH * left:
                break
            known = found.columns, math.nan
            on = fit(bench, found.state, at_present(found), prune=False, known=known, after=found, rough=True)
            if bench.power(on.predictions) - bench.noise_power > (1.0 - MUCH) * left:
                break
            found = sharpened(bench, on)
    return found


def _promised(bench: Bench, found: Fit) -> float:
    """Power of what a fit leaves that its sensitivities would take away, its priors heeded."""
    rest = bench.stacked(bench.residuals(found.predictions))
    worth = 1.0 / math.sqrt(bench.sample_power(rest))
    vector = Vector(found.state, tuple(at_present(found)), 0)
    whole = np.vstack([worth * found.columns, np.diag(1.0 / vector.priors())])
    x0 = vector.start()
    aim = np.concatenate([worth * rest, (vector.centre(x0) - x0) / vector.priors()])
    moves, *_ = np.linalg.lstsq(whole, aim, rcond=1e-6)
    return float(rest @ rest - np.sum((rest - found.columns @ moves) ** 2))


def _with_those_left(bench: Bench, found: Fit) -> Fit:
    """The fit with numbers that were left where they were, where they explain much of what it leaves.

    What a number that is far off leaves lasts as long as the record, and so counts as a few samples, of which
    nothing can be told; once all numbers have moved together it is gone, and the data tell them.
    """
    left = [free for free in found.undetermined if not free.reading]
    noise = bench.noise_power
    before = bench.power(found.predictions)
    if not left or before <= REACHED * noise:
        return found
    readings = replace(found, undetermined=[f for f in found.undetermined if f.reading], beside=None)
    unknown = Vector(found.state, tuple(left), len(found.state.added))
    columns = sensitivities(bench, unknown, unknown.start(), found.predictions)
    rest = bench.stacked(bench.residuals(found.predictions))
    columns = np.hstack([columns, found.columns, bench.offset_columns()])
    moves, *_ = np.linalg.lstsq(columns, rest, rcond=1e-6)
    if float(np.sum((rest - columns @ moves) ** 2)) > before - MUCH * (before - noise):
        return found
    frees = at_present(found)
    whole = fit(bench, found.state, [*frees, *left], prune=False, after=readings, rough=True)
    if bench.power(whole.predictions) > before - MUCH * (before - noise):
        return found
    align(bench, whole)
    reweigh(bench, whole)
    # What they leave now says which of them the data do not tell after all.
    return fit(bench, whole.state, at_present(whole), after=readings)


def _widened(bench: Bench, found: Fit) -> None:
    """Let the numbers that the data do not determine widen the intervals of the others."""
    found.beside = None
    if not found.columns.size:
        return
    columns, sizes = zeros_beside(bench, found.state, found.predictions)
    if found.undetermined:
        unknown = Vector(found.state, tuple(found.undetermined), len(found.state.added))
        own = sensitivities(bench, unknown, unknown.start(), found.predictions)
        columns, sizes = np.hstack([own, columns]), np.concatenate([unknown.priors(), sizes])
    if not sizes.size:
        return
    found.beside = columns, sizes
    rest = bench.stacked(bench.residuals(found.predictions))
    priors = Vector(found.state, tuple(found.frees), 0).priors()
    found.covariance = robust_covariance(found.columns, rest, bench.stacked_blocks(), priors, found.beside)


def together(bench: Bench, found: Fit, state: State | None = None, *, rough: bool = False) -> Fit:
    """All numbers fitted together, the base's and those of all effects.

    What the data did not determine while an effect was missing is asked again: it was drowned by that effect.
    A sensor's sensitivity is not: it would bend to whatever is still missing, and is known beforehand.

    Args:
        bench: the measured series.
        found: the fit that is carried on.
        state: the model, where it has other effects than the fit's.
        rough: as in ``fit``.
    """
    frees = [*at_present(found), *(free for free in found.undetermined if not free.reading)]
    readings = replace(found, undetermined=[f for f in found.undetermined if f.reading], beside=None)
    # A number that a missing effect has driven to nearly nothing leaves no slope to come back by.
    far = {f.name: f.none for f in frees if not f.step and abs(f.none) > FAR * f.prior}
    whole = fit(bench, state or found.state, frees, after=readings, rough=True)
    if far and bench.power(whole.predictions) > REACHED * bench.noise_power:
        other = fit(bench, state or found.state, frees, theta=far, after=readings, rough=True)
        whole = min(whole, other, key=lambda each: unlikelihood(bench, each, whole))
    if rough:
        return whole
    left = [free for free in whole.undetermined if not free.reading]
    if left:
        # What was left as given holds what it is tied to where the data would have moved both. At the end all
        # numbers share by their priors, and none seems known because another was held.
        whole = fit(bench, whole.state, [*at_present(whole), *left], prune=False, after=readings)
    else:
        whole = settled(bench, whole)
    _widened(bench, whole)
    widen_by_flanks(bench, whole)
    return whole


def unlikelihood(bench: Bench, found: Fit, like: Fit) -> float:
    """What data and priors have against a fit, in units of an independent sample of what ``like`` leaves."""
    rest = bench.stacked(bench.residuals(like.predictions))
    power = bench.sample_power(rest)
    return bench.power(found.predictions) / power + strain(found)


def with_delays(bench: Bench, found: Fit, *, rough: bool = False) -> Fit | None:
    """The model with the torques' delays free too; None where they are, or none can be.

    They come last: what is missing bends a delay as it bends any number, and a ripple hides behind one.
    """
    period = bench.predictors[0].record.as_read.period_s
    free = delay_freedoms(found.state, bench.channels, period, load_known=bench.load_known)
    if not free or any(each.step for each in found.frees):
        return None
    # How a channel is read needs no simulation.
    late = Vector(found.state, tuple(free), len(found.state.added))
    own, f = sensitivities(bench, late, late.start(), found.predictions), len(found.frees)
    known = np.hstack([found.columns[:, :f], own, found.columns[:, f:]]), math.nan
    frees = [*at_present(found), *free]
    return fit(bench, found.state, frees, prune=False, known=known, after=found, rough=rough)


def align(bench: Bench, found: Fit) -> None:
    """Turn locked records to where the fitted model carries nothing, and let loads that swing do so."""
    if turn_to_zero(bench, found.state, found.predictions):
        found.predictions = bench.predict(found.state)
    if bench.swings:
        found.state, found.predictions = swinging(bench, found.state, found.predictions)


def reweigh(bench: Bench, found: Fit) -> float:
    """Set the weights from what a fit leaves, and its sensitivities with them.

    Returns:
        Largest factor by which a training series' weight has risen.
    """
    change = _weights_risen(bench, found)[bench.stacked_series()]
    found.weigh(change)
    return float(np.max(change, initial=1.0))


def _weights_risen(bench: Bench, found: Fit) -> Array:
    """Set the weights from what a fit leaves; factor by which each series' has risen, shape (series,)."""
    old = np.array([series.sigma for series in bench.series])
    bench.weigh(bench.residuals(found.predictions))
    return np.asarray(old / np.array([series.sigma for series in bench.series]))
