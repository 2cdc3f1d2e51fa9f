"""Output-error fits: a model's numbers by non-linear least squares on the predicted channels, with intervals.

The Jacobian is made of finite differences whose step is large against the solver's noise; between two of
them it follows the residuals that the fit sees anyway (Broyden 1965, Mathematics of Computation 19:577), for
as long as it foretells them. Residuals of a model are correlated in time, so the covariance is the cluster
jackknife over blocks of time (MacKinnon, Nielsen and Webb 2023, Journal of Econometrics 232:272), and the
fit weighs the data by the number of independent samples that they are worth. Every number has a prior
spread: what the data say less about than that stays where it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.bench import Bench
from hdsim.estimate.freedom import Added, Free, Interval, State, ceilings, scaled, signed
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array

#: Largest step of finite differences in the logarithm of a number, and of a stiffness or a shape, in which
#: the model is further from linear; change of the whitened predictions, root mean square, for which a smaller
#: step will do, and the smallest part of the largest step; times the step that a coefficient may go for that.
STEP, SMALL_STEP, CHANGE, LEAST_STEP, MOST_STEP = 1e-1, 3e-2, 0.3, 3e-3, 10.0
#: Prior spreads of an effect's coefficients (in units of their terms) and of the logarithm of its shapes.
COEFFICIENT_PRIOR, SHAPE_PRIOR = 30.0, 1.5
#: Ratio of posterior to prior spread above which the data are said not to determine a number.
UNDETERMINED = 0.5
#: Evaluations of the residual in one fit, Jacobians aside.
EVALUATIONS = 8
#: Relative fall of the cost at which a round of a fit ends; rounds, and promised fall, in units of what one
#: independent sample adds to the cost, at which no further one begins.
ROUGHLY, ROUNDS, TIGHT = 3e-4, 2, 0.25
#: Least degrees of freedom of an interval: with fewer nobody can say what a spread is.
FEWEST_DEGREES = 3.0
#: Size of a direction, all columns of length 1, below which what they say of it may be their own error, and
#: change of the whitened predictions along it, root mean square, below which it is the solver's.
WEAK, HEARD = 0.3, 0.006
#: Part of a step's change that a Jacobian may get wrong and still be corrected instead of made anew, and of
#: the residual that it may get wrong and stay as it is.
FORETOLD, NEGLIGIBLE = 0.3, 0.01


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
        beside: sensitivities to the undetermined numbers, shape (rows, u), and their prior spreads (u,): not
            knowing them widens the intervals of the others.
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


@dataclass(frozen=True)
class Vector:
    """The free numbers as one vector: logarithms, then coefficients and logarithms of shapes of effects.

    Attributes:
        base: the model.
        frees: numbers of the base.
        first: effects before this one are held fixed.
        by_compliance: a stiffness moves by the part x of its compliance that it gives away, theta =
            -log(1 - x): beside a compliance in series the model is linear in that, and not in theta.
    """

    base: State
    frees: tuple[Free, ...]
    first: int
    by_compliance: bool = False

    def _stiff(self) -> NDArray[np.bool_]:
        return np.array([self.by_compliance and "stiffness" in free.name for free in self.frees], dtype=bool)

    def logarithms(self, x: Array) -> Array:
        """Logarithms of the base's factors at ``x``, shape (f,)."""
        own = x[: len(self.frees)]
        stiff = self._stiff()
        return np.where(stiff, -np.log1p(-np.where(stiff, own, 0.0)), own)

    def rates(self, x: Array) -> Array:
        """Derivatives of the logarithms with respect to their part of ``x``, shape (f,)."""
        return np.where(self._stiff(), np.exp(self.logarithms(x)), 1.0)

    def start(self, theta: Mapping[str, float] | None = None) -> Array:
        """Where a fit begins; ``theta`` replaces logarithms of the base's factors, by name."""
        logs = np.array([(theta or {}).get(free.name, 0.0) for free in self.frees])
        values = np.where(self._stiff(), -np.expm1(-logs), logs).tolist()
        for added in self.base.added[self.first :]:
            values += [*added.coefficients, *(math.log(shape) for shape in added.shapes)]
        return np.array(values)

    def state(self, x: Array) -> State:
        """The model at ``x``."""
        state = scaled(self.base, self.frees, self.logarithms(x).tolist())
        at = len(self.frees)
        effects = list(self.base.added[: self.first])
        for added in self.base.added[self.first :]:
            coefficients = tuple(float(v) for v in x[at : at + len(added.coefficients)])
            at += len(coefficients)
            shapes = tuple(math.exp(float(v)) for v in x[at : at + len(added.shapes)])
            at += len(shapes)
            effects.append(replace(added, coefficients=coefficients, shapes=shapes))
        return replace(state, added=tuple(effects))

    def priors(self) -> Array:
        """Prior standard deviations, shape (p,)."""
        spreads = [free.prior for free in self.frees]
        for added in self.base.added[self.first :]:
            spreads += [COEFFICIENT_PRIOR] * len(added.coefficients) + [SHAPE_PRIOR] * len(added.shapes)
        return np.array(spreads)

    def coefficients(self) -> NDArray[np.bool_]:
        """Which numbers are coefficients of an effect, shape (p,)."""
        kinds = [False] * len(self.frees)
        for added in self.base.added[self.first :]:
            kinds += [True] * len(added.coefficients) + [False] * len(added.shapes)
        return np.array(kinds, dtype=bool)

    def lower(self) -> Array:
        """Lower bounds, shape (p,)."""
        bounds = np.where(self._stiff(), -math.expm1(3.0), [f.none - 3.0 for f in self.frees]).tolist()
        for added in self.base.added[self.first :]:
            bounds += [-math.inf if s else 0.0 for s in signed(added.fitting, len(added.orders))]
            bounds += [
                max(math.log(value) - 3.0, math.log(shape.least) if shape.least > 0 else -math.inf)
                for value, shape in zip(added.shapes, added.fitting.shapes, strict=True)
            ]
        return np.array(bounds)

    def upper(self) -> Array:
        """Upper bounds, shape (p,)."""
        bounds = np.where(self._stiff(), -math.expm1(-3.0), [f.none + 3.0 for f in self.frees]).tolist()
        for added in self.base.added[self.first :]:
            bounds += ceilings(added)
            bounds += [
                min(math.log(value) + 3.0, math.log(shape.most))
                for value, shape in zip(added.shapes, added.fitting.shapes, strict=True)
            ]
        return np.array(bounds)

    def steps(self, x: Array) -> Array:
        """Steps of finite differences at ``x``, shape (p,)."""
        steps = [SMALL_STEP if "stiffness" in free.name else STEP for free in self.frees]
        steps = (np.array(steps) / self.rates(x)).tolist()
        at = len(self.frees)
        for added in self.base.added[self.first :]:
            steps += [SMALL_STEP * max(1.0, abs(v)) for v in x[at : at + len(added.coefficients)]]
            steps += [SMALL_STEP] * len(added.shapes)
            at += len(added.coefficients) + len(added.shapes)
        return np.array(steps)


def fit(
    bench: Bench,
    state: State,
    frees: Sequence[Free],
    *,
    held_effects: int = 0,
    evaluations: int = EVALUATIONS,
    prune: bool = True,
    theta: Mapping[str, float] | None = None,
    beside: tuple[Array, Array] | None = None,
    known: tuple[Array, float] | None = None,
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
        theta: where the logarithms of the base's factors start, by name; 0 by default.
        beside: sensitivities to numbers that nobody knows, and their prior spreads; see ``Fit``.
        known: sensitivities near the start to the first numbers, shape (rows, up to p), and what one
            independent sample of the residual will count (or nan), where they are known.
        rough: the covariance is not needed, nor the sensitivities at the end.

    Raises:
        PredictionError: the start itself could not be predicted.
    """
    from scipy.optimize import least_squares

    blocks = bench.stacked_blocks()
    chosen = list(frees)
    undetermined: list[Free] = []
    ties: dict[str, list[str]] = {}
    power = known[1] if known is not None else math.nan
    if prune and chosen:
        chosen, undetermined, ties, known = _determined(bench, state, chosen, held_effects, blocks, theta)
        power = known[1]
    series = any(added.fitting.in_series for added in state.added[held_effects:])
    vector = Vector(state, tuple(chosen), held_effects, series)
    lower, upper = vector.lower(), vector.upper()
    x0 = np.clip(vector.start(theta), np.where(np.isfinite(lower), lower + 1e-3, lower), upper)
    first = vector.state(x0)
    predictions = bench.predict(first)
    start = _stacked(bench, predictions)
    if len(x0) == 0:
        empty = np.zeros((len(start), 0))
        return Fit(state, [], x0, np.zeros((0, 0)), predictions, empty, undetermined, ties)
    if math.isnan(power):
        power = correlation(start, blocks) * max(float(np.mean(start**2)), 1e-30)
    worth = 1.0 / math.sqrt(power)
    priors, centre = vector.priors(), vector.start({free.name: free.none for free in chosen})
    centre[len(chosen) :] = np.where(
        np.isfinite(lower[len(chosen) :]) & (priors[len(chosen) :] == SHAPE_PRIOR), x0[len(chosen) :], 0.0
    )
    near = None
    if known is not None:
        own = min(len(chosen), known[0].shape[1])
        near = np.hstack([known[0][:, :own] * vector.rates(x0)[:own], known[0][:, own:]])
    slopes = _Slopes(bench, vector, near)
    slopes.seen(x0, predictions, start)

    def residual(x: Array) -> Array:
        rest = slopes.rest.get(x.tobytes())
        if rest is None:
            try:
                moved = vector.state(x)
                there = bench.predict(moved)
                rest = _stacked(bench, there)
                slopes.seen(x, there, rest)
            except PredictionError:
                rest = 10.0 * start
        return np.concatenate([worth * rest, (x - centre) / priors])

    def jacobian(x: Array) -> Array:
        return np.vstack([-worth * slopes.at(x), np.diag(1.0 / priors)])

    for _ in range(1 if rough else ROUNDS):
        found = least_squares(
            residual,
            x0,
            jac=jacobian,
            bounds=(lower, upper),
            method="trf",
            x_scale="jac",
            ftol=ROUGHLY,
            xtol=1e-4,
            gtol=1e-10,
            max_nfev=evaluations,
        )
        if rough:
            columns = slopes.at(found.x)
            break
        # The end is where the exact Jacobian promises less than an independent sample of the data is worth.
        columns = slopes.proved(found.x)
        whole = jacobian(found.x)
        free = found.active_mask == 0
        step, *_ = np.linalg.lstsq(whole[:, free], -found.fun, rcond=None)
        promised = np.sum(found.fun**2) - np.sum((found.fun + whole[:, free] @ step) ** 2)
        if promised < TIGHT:
            break
        x0 = found.x
    rows = len(start)
    rest = found.fun[:rows] / worth
    own = len(chosen)
    columns = np.hstack([columns[:, :own] / vector.rates(found.x), columns[:, own:]])
    covariance = np.diag(priors**2) if rough else robust_covariance(columns, rest, blocks, priors, beside)
    return Fit(
        vector.state(found.x), chosen, vector.logarithms(found.x), covariance,
        slopes.predictions[found.x.tobytes()], columns, undetermined, ties, beside,
    )  # fmt: skip


class _Slopes:
    """The Jacobian of a fit: made anew only where the last one no longer foretells the residuals.

    Args:
        bench: the measured series.
        vector: the free numbers.
        known: the Jacobian near the start, shape (rows, up to p), where it is known.
    """

    def __init__(self, bench: Bench, vector: Vector, known: Array | None) -> None:
        self._bench, self._vector = bench, vector
        self._columns = known
        self._at: Array | None = None if known is None else np.zeros(0)
        #: Predictions and whitened residuals by the bytes of where they were seen.
        self.predictions: dict[bytes, list[Array]] = {}
        self.rest: dict[bytes, Array] = {}

    def seen(self, x: Array, predictions: list[Array], rest: Array) -> None:
        """Keep what was predicted."""
        self.predictions[x.tobytes()], self.rest[x.tobytes()] = predictions, rest

    def exact(self, x: Array) -> Array:
        """The Jacobian at ``x`` by finite differences, shape (rows, p)."""
        columns = self._made(x, like=self._columns)
        self._columns, self._at = columns, x.copy()
        return self._columns

    def proved(self, x: Array) -> Array:
        """The Jacobian at ``x`` with each direction in which its columns cancel tried as a whole.

        What is left of columns that cancel is mostly their own error, which would be taken for knowledge.
        """
        columns = self.exact(x)
        lengths = np.linalg.norm(columns, axis=0)
        seen = lengths > 0  # the others say nothing that could be wrong
        _, sizes, directions = np.linalg.svd(np.linalg.qr(columns[:, seen] / lengths[seen], mode="r"))
        weak = np.zeros((int(np.sum(sizes < WEAK)), len(x)))
        weak[:, seen] = directions[sizes < WEAK] / lengths[seen]
        most = self._vector.steps(x)
        steps = [d * float(np.min(most / np.maximum(np.abs(d), 1e-300))) for d in weak]
        states = [self._vector.state(x + sign * d) for d in steps for sign in (1.0, -1.0)]
        there = self._bench.predict_all(states)
        for d, ahead, back in zip(steps, there[::2], there[1::2], strict=True):
            if ahead is None or back is None:
                continue
            change = 0.5 * self._bench.trace(back, ahead)
            if math.sqrt(np.mean(change**2)) < HEARD:
                change = np.zeros_like(change)
            along = d * lengths**2
            columns = columns + np.outer(change - columns @ d, along / (d @ along))
        self._columns = columns
        return columns

    def at(self, x: Array) -> Array:
        """The Jacobian at ``x``, corrected or made anew, shape (rows, p)."""
        if self._columns is None or self._at is None:
            return self.exact(x)
        if not len(self._at):
            # What was known counts where the fit begins.
            rest = self._made(x, self._columns.shape[1])
            self._columns, self._at = np.hstack([self._columns, rest]), x.copy()
        step = x - self._at
        if not np.any(step):
            return self._columns
        before, now = self.rest.get(self._at.tobytes()), self.rest.get(x.tobytes())
        if before is None or now is None:
            return self.exact(x)
        change = before - now  # of the predictions
        missed = change - self._columns @ step
        size = float(np.linalg.norm(missed))
        if size <= NEGLIGIBLE * np.linalg.norm(now):
            return self._columns  # of the order of the solver's noise, from which nothing is learned
        if size > FORETOLD * np.linalg.norm(change):
            return self.exact(x)
        scaled = np.einsum("ij,ij->j", self._columns, self._columns) * step
        self._columns = self._columns + np.outer(missed, scaled / max(float(step @ scaled), 1e-300))
        self._at = x.copy()
        return self._columns

    def _made(self, x: Array, first: int = 0, like: Array | None = None) -> Array:
        predictions = self.predictions.get(x.tobytes())
        return sensitivities(self._bench, self._vector, x, predictions, first=first, like=like)


def settled(bench: Bench, found: Fit, held_effects: int = 0) -> Fit:
    """A rough fit carried on to its very end, with the sensitivities and the covariance there."""
    known = found.columns, math.nan
    return fit(bench, found.state, at_present(found), held_effects=held_effects, prune=False,
               evaluations=EVALUATIONS, beside=found.beside, known=known)  # fmt: skip


def at_present(found: Fit) -> list[Free]:
    """A fit's free numbers at their fitted values."""
    return [free.moved(float(t)) for free, t in zip(found.frees, found.theta, strict=True)]


def sensitivities(
    bench: Bench,
    vector: Vector,
    x: Array,
    predictions: list[Array] | None = None,
    *,
    first: int = 0,
    like: Array | None = None,
) -> Array:
    """Derivatives of the whitened predictions, offsets removed, to the numbers from ``first`` on.

    Args:
        bench: the measured series.
        vector: the numbers.
        x: where.
        predictions: what the model predicts there, if it is known.
        first: index of the first number that is asked for.
        like: sensitivities near ``x``, shape (rows, up to p): steps are then large enough for a change that
            stands out from the solver's noise, and no larger.
    """
    here = vector.state(x)
    if predictions is None:
        predictions = bench.predict(here)
    steps = vector.steps(x)
    if like is not None:
        size = np.sqrt(np.mean(like**2, axis=0))
        # Effects are linear in their coefficients, so those may move further.
        kinds = vector.coefficients()[: len(size)]
        wanted = CHANGE / np.maximum(size * steps[: len(size)], 1e-300)
        steps[: len(size)] *= np.clip(wanted, LEAST_STEP, np.where(kinds, MOST_STEP, 1.0))
    steps = steps[first:]
    states = []
    for k, step in enumerate(steps, start=first):
        shifted = x.copy()
        shifted[k] += step
        states.append(vector.state(shifted))
    # How a channel is read needs no simulation.
    read = [k < len(vector.frees) and vector.frees[k].reading for k in range(first, len(x))]
    simulated = iter(bench.predict_all([s for s, only in zip(states, read, strict=True) if not only]))
    rows = len(bench.stacked_blocks())
    columns = np.zeros((rows, len(steps)))
    for k, (state, only, step) in enumerate(zip(states, read, steps, strict=True)):
        there = bench.reread(predictions, here, state) if only else next(simulated)
        if there is not None:
            columns[:, k] = bench.trace(predictions, there) / step
    return columns


def _stacked(bench: Bench, predictions: Sequence[Array]) -> Array:
    return bench.stacked(bench.residuals(predictions))


def correlation(rest: Array, blocks: NDArray[np.int64]) -> float:
    """Samples for which one independent sample counts: variance of block sums over that of white noise."""
    sums = np.bincount(blocks, rest)
    counts = np.bincount(blocks)
    used = counts > 0
    power = float(np.mean(rest**2))
    if power <= 0:
        return 1.0
    ratio = float(np.mean(sums[used] ** 2 / counts[used])) / power
    return float(np.clip(ratio, 1.0, counts[used].mean()))


def robust_covariance(
    columns: Array,
    rest: Array,
    blocks: NDArray[np.int64],
    priors: Array,
    beside: tuple[Array, Array] | None = None,
) -> Array:
    """Covariance of the free numbers, shape (p, p): how they move when one block of time is left out.

    It is scaled so that two standard deviations are a 95 % interval: for each number Student's t with one
    degree of freedom less than the blocks that tell of it (their effective number, Carter, Schnepel and
    Steigerwald 2017, Review of Economics and Statistics 99:698), over 2.

    Args:
        columns: sensitivities to the free numbers, shape (rows, p).
        rest: what the fit leaves, shape (rows,).
        blocks: shape (rows,).
        priors: shape (p,).
        beside: sensitivities to and prior spreads of numbers that stay where they are.
    """
    if beside is not None:
        whole = robust_covariance(
            np.hstack([columns, beside[0]]), rest, blocks, np.concatenate([priors, beside[1]])
        )
        return whole[: len(priors), : len(priors)]
    from scipy.stats import t as student_t

    power = max(float(np.mean(rest**2)), 1e-30)
    # The prior keeps a direction that the data say nothing about from having no spread at all.
    information = columns.T @ columns + np.diag(power / priors**2)
    bread = np.linalg.inv(information)
    order = np.argsort(blocks, kind="stable")
    ends = np.flatnonzero(np.diff(blocks[order])) + 1
    moves, parts = [], []
    for rows in np.split(order, ends):
        own = columns[rows]
        square = own.T @ own
        without = np.linalg.inv(information - square)
        moves.append(without @ (own.T @ rest[rows]))
        parts.append(np.einsum("ij,jk,ik->i", without, square, without))
    away, variances = np.array(moves), np.array(parts)
    clustered = away.T @ away * (len(away) - 1) / len(away)
    clustered += bread @ np.diag(power**2 / priors**2) @ bread
    # Few blocks can make the clustered spread too small by chance: white noise is its least.
    white = power * bread
    low = np.maximum(1.0, np.sqrt(np.diag(white) / np.maximum(np.diag(clustered), 1e-300)))
    telling = variances.sum(axis=0) ** 2 / np.maximum((variances**2).sum(axis=0), 1e-300)
    scale = low * student_t.ppf(0.975, np.maximum(telling - 1.0, FEWEST_DEGREES)) / 2.0
    return np.asarray(clustered * np.outer(scale, scale))


def _determined(
    bench: Bench,
    state: State,
    frees: list[Free],
    held_effects: int,
    blocks: NDArray[np.int64],
    theta: Mapping[str, float] | None,
) -> tuple[list[Free], list[Free], dict[str, list[str]], tuple[Array, float]]:
    """Split the numbers into those that the data determine and the others, with what each is tied to.

    Also returns the sensitivities to what is left to fit, and what one independent sample of the residual
    counts once a step of the fit is taken.

    The scaled Jacobian's singular values say how many directions the data see; the number with the largest
    share in an unseen one is dropped, one after the other.
    """
    vector = Vector(state, tuple(frees), held_effects)
    x0 = vector.start(theta)
    first = vector.state(x0)
    predictions = bench.predict(first)
    columns = sensitivities(bench, vector, x0, predictions)
    rest = _stacked(bench, predictions)
    # What one step of the fit takes away is no noise, however far off the start is.
    step, *_ = np.linalg.lstsq(columns * vector.priors(), rest, rcond=1e-6)
    rest = rest - columns * vector.priors() @ step
    power = max(float(np.mean(rest**2)), 1e-30) * correlation(rest, blocks)
    priors = vector.priors()
    kept = list(range(len(frees)))
    others = list(range(len(frees), columns.shape[1]))
    dropped: list[Free] = []
    ties: dict[str, list[str]] = {}
    while kept:
        use = kept + others
        scaled_columns = columns[:, use] * priors[use] / math.sqrt(power)
        _, singular, directions = np.linalg.svd(np.linalg.qr(scaled_columns, mode="r"))
        spread = (directions**2 / (1.0 + singular[:, None] ** 2)).sum(axis=0)[: len(kept)]
        worst = int(np.argmax(spread))
        if math.sqrt(spread[worst]) <= UNDETERMINED:
            break
        weakest = directions[-1]
        free = frees[kept[worst]]
        dropped.append(free)
        ties[free.name] = [
            frees[kept[k]].name
            for k in range(len(kept))
            if k != worst and abs(weakest[k]) > 0.3 and np.linalg.norm(scaled_columns[:, worst]) > 2
        ]
        kept.pop(worst)
    return [frees[k] for k in kept], dropped, ties, (columns[:, kept + others], power)


def base_intervals(found: Fit, starts: Sequence[Free]) -> list[Interval]:
    """The base's numbers with 95 % intervals; those that were left alone are marked undetermined.

    Args:
        found: the fit.
        starts: the numbers as they were before anything was fitted.
    """
    first = {free.name: free.value for free in starts}
    intervals = []
    for k, free in enumerate(found.frees):
        # A factor of e^20 to either side says enough of a number that nobody knows.
        now, spread = float(found.theta[k]), min(2.0 * math.sqrt(found.covariance[k, k]), 20.0)
        value, low, high = free.at(now), free.at(now - spread), free.at(now + spread)
        intervals.append(Interval(free.name, value, first.get(free.name, free.value), low, high, free.unit))
    for free in found.undetermined:
        start = first.get(free.name, free.value)
        intervals.append(
            Interval(
                free.name,
                free.value,
                start,
                math.nan,
                math.nan,
                free.unit,
                False,
                found.ties.get(free.name, []),
            )
        )
    return intervals


def added_spreads(found: Fit, held_effects: int = 0) -> list[tuple[Added, Array, Array]]:
    """Each fitted effect with covariance of its coefficients and standard deviations of log shapes."""
    at = len(found.frees)
    result = []
    for added in found.state.added[held_effects:]:
        c, s = len(added.coefficients), len(added.shapes)
        covariance = found.covariance[at : at + c, at : at + c]
        shapes = np.sqrt(np.diag(found.covariance)[at + c : at + c + s])
        result.append((added, covariance, shapes))
        at += c + s
    return result
