"""Output-error fits: a model's numbers by non-linear least squares on the predicted channels, with intervals.

The Jacobian is made of tangents near the end, elsewhere of finite differences whose step is large against
the solver's noise, and of Broyden's updates between them (``slopes``). Residuals of a model are correlated in
time, so the covariance is the cluster jackknife over blocks of time (``covariance``; MacKinnon, Nielsen and
Webb 2023, Journal of Econometrics 232:272), and the fit weighs the data by the number of independent samples
that they are worth (``minimise``). Every number has a prior spread: what the data say less about than that
stays where it is (``determine``).
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import robust_covariance, sample_power
from hdsim.estimate.determine import determined
from hdsim.estimate.minimise import EVALUATIONS, minimised
from hdsim.estimate.numbers import REACH, Free, Interval, scaled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State
from hdsim.estimate.vector import Measured, Vector, begun_within, sensitivities

#: Largest logarithm of the factor to either end of an interval: e^20 says enough of what nobody knows.
WIDEST = 20.0
#: Least absolute correlation of numbers that are tied: one alone would be known more than twice as well.
TIED = 0.9


@dataclass
class Fit:
    """A fitted model.

    Attributes:
        state: the model with its fitted numbers.
        frees: the numbers of the base that were free.
        theta: logarithms of their factors, shape (f,).
        covariance: of all free numbers, shape (p, p); the priors' in a rough fit.
        predictions: of the training records.
        columns: sensitivities of the predictions to every free number, whitened, shape (rows, p).
        undetermined: numbers that were left where they were, because the data do not determine them.
        ties: for each undetermined number, those that it cannot be told from.
        beside: sensitivities to the undetermined numbers and then to the zeros of locked records, shape
            (rows, u), and their prior spreads (u,): not knowing them widens the intervals of the others.
        promised: fall of the cost that the sensitivities promise where it ended, in units of what an
            independent sample of the residual adds; 0 of a rough fit, which has none there.
    """

    state: State
    frees: list[Free]
    theta: Array
    covariance: Array
    predictions: list[Array]
    columns: Array
    undetermined: list[Free]
    ties: dict[str, list[str]]
    beside: tuple[Array, Array] | None = None
    promised: float = 0.0

    def numbers_of(self, effect: int) -> slice:
        """Where the numbers of an effect of ``state.added`` stand among all free numbers."""
        widths = [len(one.coefficients) + len(one.shapes) for one in self.state.added]
        first = len(self.frees) + sum(widths[:effect])
        return slice(first, first + widths[effect])

    def weigh(self, change: Array) -> None:
        """Give the sensitivities other weights: ``change``, shape (rows,), times those that they have."""
        if self.columns.size:
            self.columns *= change[:, None]
        if self.beside is not None:
            self.beside = self.beside[0] * change[:, None], self.beside[1]

    def become(self, other: Fit) -> None:
        """Take over all that another fit of the same numbers found."""
        for each in fields(self):
            setattr(self, each.name, getattr(other, each.name))

    def ordered(self, effects: Sequence[int]) -> Fit:
        """The same fit with its effects in another order."""
        numbers = np.arange(self.columns.shape[1])
        order = np.concatenate([numbers[: len(self.frees)], *(numbers[self.numbers_of(e)] for e in effects)])
        return replace(
            self,
            state=replace(self.state, added=tuple(self.state.added[e] for e in effects)),
            covariance=self.covariance[np.ix_(order, order)],
            columns=self.columns[:, order],
        )


def fit(
    bench: Bench,
    state: State,
    frees: Sequence[Free],
    *,
    held_effects: int = 0,
    evaluations: int = EVALUATIONS,
    prune: bool = True,
    sure: int = 0,
    theta: Mapping[str, float] | None = None,
    after: Fit | None = None,
    known: tuple[Array, float] | None = None,
    lost: Array | None = None,
    rough: bool = False,
) -> Fit:
    """Fit a model to the training data.

    Args:
        bench: the measured series, weighed.
        state: the model to start from.
        frees: numbers of the base that may move.
        held_effects: that many of the first added effects stay as they are.
        evaluations: residuals that the optimiser may ask for.
        prune: leave numbers that the data do not determine where they are.
        sure: that many of the last numbers of the base are fitted in any case.
        theta: where the logarithms of the base's factors start, by name; 0 by default.
        after: an earlier fit whose undetermined numbers stay so, and widen the intervals of this one's.
        known: sensitivities near the start to the first numbers, shape (rows, up to p), and what one
            independent sample of the residual will count (or nan), where they are known.
        lost: change of the predictions, whitened, shape (rows,), by what the model no longer has: with
            ``known`` the fit begins where the others make up for it, if that leaves less.
        rough: the covariance is not needed, nor the sensitivities at the end.

    Raises:
        PredictionError: the start itself could not be predicted.
    """
    chosen = list(frees)
    undetermined, ties = (list(after.undetermined), dict(after.ties)) if after is not None else ([], {})
    beside = after.beside if after is not None else None
    moves: Array | None = None
    power = known[1] if known is not None else math.nan
    if prune and chosen:
        whole = Measured(bench, Vector(state, tuple(chosen), held_effects), theta)
        # What is carried on for a search is near its end already.
        columns = whole.sensitivities(whole.start, tangents=rough and after is not None)
        asked = len(chosen) - sure
        rest = whole.residual(whole.start)
        split = determined(columns, rest, whole.priors, whole.blocks, asked, len(chosen))
        dropped = [chosen[k] for k in split.dropped]
        ties |= {chosen[k].name: [chosen[j].name for j in tied] for k, tied in split.ties.items()}
        kept = [*split.kept, *range(asked, columns.shape[1])]
        known, power = (columns[:, kept], split.power), split.power
        chosen = [chosen[k] for k in kept if k < len(chosen)]
        begins = dict(theta or {})
        back = [free.none - begins.get(free.name, 0.0) for free in dropped]
        if any(back):
            # What the data do not say is what was given: the others make up for it.
            change = columns[:, split.dropped] @ np.array(back)
            moves = _standing_in(known[0], whole.priors[kept], change)
            for free, move in zip(chosen, moves[: len(chosen)].tolist(), strict=True):
                begins[free.name] = begins.get(free.name, 0.0) + move
            theta = begins
            state = scaled(state, dropped, [free.none for free in dropped])
            dropped = [free.moved(free.none) for free in dropped]
            power = math.nan
        undetermined += dropped
    in_series = any(added.fitting.in_series for added in state.added[held_effects:])
    vector = Vector(state, tuple(chosen), held_effects, in_series)
    problem = Measured(bench, vector, theta)
    x0 = problem.start
    if moves is not None:
        moved = x0 + np.concatenate([np.zeros(len(chosen)), moves[len(chosen) :]])
        x0 = begun_within(moved, problem.bounds)
    if lost is not None and known is not None:
        x0 = _made_up(problem, x0, known[0], lost)
    predictions = problem.predicted(x0)
    start = problem.residual(x0)
    if len(x0) == 0:
        empty = np.zeros((len(start), 0))
        return Fit(state, [], x0, np.zeros((0, 0)), predictions, empty, undetermined, ties, beside)
    if math.isnan(power):
        power = sample_power(start, problem.blocks)
    near = None
    if known is not None:
        own = min(len(chosen), known[0].shape[1])
        near = np.hstack([known[0][:, :own] * vector.rates(x0)[:own], known[0][:, own:]])
    found = minimised(problem, x0, problem.centre, power, known=near, evaluations=evaluations, rough=rough)
    own = len(chosen)
    columns = np.hstack([found.columns[:, :own] / vector.rates(found.x), found.columns[:, own:]])
    priors = problem.priors
    promised = found.promised * power / sample_power(found.rest, problem.blocks)
    covariance = (
        np.diag(priors**2)
        if rough
        else robust_covariance(columns, found.rest, problem.blocks, priors, beside)
    )
    return Fit(
        problem.swung(found.x).state(found.x), chosen, vector.logarithms(found.x), covariance,
        problem.predicted(found.x), columns, undetermined, ties, beside, promised,
    )  # fmt: skip


def _standing_in(columns: Array, priors: Array, change: Array) -> Array:
    """How numbers move to make up for a change of the predictions, shape (p,).

    Args:
        columns: sensitivities to the numbers, shape (rows, p).
        priors: their prior spreads, shape (p,).
        change: whitened, shape (rows,).
    """
    moves, *_ = np.linalg.lstsq(columns * priors, -change, rcond=1e-3)
    return np.asarray(np.clip(moves * priors, -REACH, REACH) if len(priors) else moves)


def _made_up(problem: Measured, x0: Array, columns: Array, lost: Array) -> Array:
    """Where the numbers stand in for what the model has lost, or where they were, whichever leaves less.

    What an effect and one of the base's numbers do together may be far less than what either does, and no
    slope leads back from where one of them is gone.
    """
    moves, own = _standing_in(columns, problem.priors, lost), len(problem.vector.frees)
    moves[:own] /= problem.vector.rates(x0)
    there = begun_within(x0 + moves, problem.bounds)
    with contextlib.suppress(PredictionError):
        here, new = (problem.residual(x) for x in (x0, there))
        return there if float(new @ new) < float(here @ here) else x0
    return x0


def settled(bench: Bench, found: Fit) -> Fit:
    """A rough fit carried on to its very end, with the sensitivities and the covariance there."""
    known = found.columns, math.nan
    return fit(bench, found.state, at_present(found), prune=False, after=found, known=known)


def sharpened(bench: Bench, found: Fit) -> Fit:
    """A rough fit with the sensitivities made anew where it ended."""
    vector = Vector(found.state, tuple(at_present(found)), 0)
    columns = sensitivities(bench, vector, vector.start(), found.predictions, tangents=True)
    return replace(found, columns=columns)


def at_present(found: Fit) -> list[Free]:
    """A fit's free numbers at their fitted values."""
    return [free.moved(float(t)) for free, t in zip(found.frees, found.theta, strict=True)]


def strain(found: Fit) -> float:
    """Squared prior spreads that a fit's numbers of the base are away from what they were given as."""
    return sum(((float(t) - f.none) / f.prior) ** 2 for f, t in zip(found.frees, found.theta, strict=True))


def base_intervals(found: Fit, starts: Sequence[Free]) -> list[Interval]:
    """The base's numbers with 95 % intervals; those that the data do not bound are marked undetermined.

    They were left alone, or what was believed before the fit says more of them than the data do: what such an
    interval excludes, its prior and the other numbers exclude, and not the data.

    Args:
        found: the fit.
        starts: the numbers as they were before anything was fitted.
    """
    first = {free.name: free.value for free in starts}
    intervals = []
    for k, free in enumerate(found.frees):
        now, spread = float(found.theta[k]), min(2.0 * math.sqrt(found.covariance[k, k]), WIDEST)
        value, low, high = free.at(now), free.at(now - spread), free.at(now + spread)
        start = first.get(free.name, free.value)
        # Information adds up, and the data's is more than the prior's.
        bound = found.covariance[k, k] < 0.5 * free.prior**2
        if not bound:
            low = high = math.nan
        tied = [] if bound else _tied(found, k)
        intervals.append(
            Interval(free.name, value, start, low, high, free.unit, bound, tied, delay_of=free.delay_of)
        )
    for free in found.undetermined:
        start, tied = first.get(free.name, free.value), found.ties.get(free.name, [])
        nan = math.nan
        intervals.append(Interval(free.name, free.value, start, nan, nan, free.unit, False, tied))
    return intervals


def _tied(found: Fit, k: int) -> list[str]:
    """Numbers of the base that move with the ``k``-th where that moves."""
    own = found.covariance[: len(found.frees), : len(found.frees)]
    spreads = np.sqrt(np.diag(own))
    with_it = np.abs(own[k]) / (spreads * spreads[k])
    return [free.name for j, free in enumerate(found.frees) if j != k and with_it[j] >= TIED]


def added_spreads(found: Fit) -> list[tuple[Added, Array, Array]]:
    """Each fitted effect with covariance of its coefficients and standard deviations of log shapes."""
    result = []
    for k, added in enumerate(found.state.added):
        own = found.covariance[found.numbers_of(k), found.numbers_of(k)]
        c = len(added.coefficients)
        result.append((added, own[:c, :c], np.sqrt(np.diag(own)[c:])))
    return result
