"""The free numbers of a model as one vector, and the measured series as a function of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.bench import Bench
from hdsim.estimate.numbers import Free, scaled
from hdsim.estimate.records import Array
from hdsim.estimate.state import State
from hdsim.estimate.swings import swung_on

#: Largest step of finite differences in the logarithm of a number, and of a stiffness or a shape, in which
#: the model is further from linear; change of the whitened predictions, root mean square, for which a smaller
#: step will do (five times what the solver's own error can be), and the smallest part of the largest step;
#: times the step that a coefficient may go for that.
STEP, SMALL_STEP, CHANGE, LEAST_STEP, MOST_STEP = 1e-1, 3e-2, 0.03, 3e-3, 10.0
#: Part of the largest step below which the wanted one is asked for anew.
BENT = 0.1
#: Step of a derivative that is integrated beside the model. One of 1e-8 errs by 8 % in the torque of Maxwell
#: elements of the usual sharpness, this one by 1 %, and rounding by less.
BESIDE = 1e-9
#: Prior spreads of an effect's coefficients (in units of their terms) and of what a fit moves of its shapes.
COEFFICIENT_PRIOR, SHAPE_PRIOR = 30.0, 1.5
#: Farthest that a fit moves a shape from where it starts.
SHAPE_REACH = 3.0


@dataclass(frozen=True)
class Vector:
    """The free numbers as one vector: logarithms, then coefficients and shapes of effects.

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

    def _inverted(self) -> NDArray[np.bool_]:
        return np.array([self.by_compliance and free.compliance for free in self.frees], dtype=bool)

    def logarithms(self, x: Array) -> Array:
        """Logarithms of the base's factors at ``x``, shape (f,)."""
        own = x[: len(self.frees)]
        inverted = self._inverted()
        return np.where(inverted, -np.log1p(-np.where(inverted, own, 0.0)), own)

    def _own(self, logarithms: Sequence[float]) -> list[float]:
        """The base's part of ``x`` at logarithms of its factors."""
        logs = np.array(logarithms, dtype=float)
        return [float(v) for v in np.where(self._inverted(), -np.expm1(-logs), logs)]

    def rates(self, x: Array) -> Array:
        """Derivatives of the logarithms with respect to their part of ``x``, shape (f,)."""
        return np.where(self._inverted(), np.exp(self.logarithms(x)), 1.0)

    def start(self, theta: Mapping[str, float] | None = None) -> Array:
        """Where a fit begins; ``theta`` replaces logarithms of the base's factors, by name."""
        values = self._own([(theta or {}).get(free.name, 0.0) for free in self.frees])
        for added in self.base.added[self.first :]:
            values += added.coefficients
            values += [s.number(v) for s, v in zip(added.fitting.shapes, added.shapes, strict=True)]
        return np.array(values)

    def centre(self, x0: Array) -> Array:
        """Where the priors have their centres: shapes where the fit begins, coefficients at none."""
        values = self._own([free.none for free in self.frees])
        at = len(self.frees)
        for added in self.base.added[self.first :]:
            at += len(added.coefficients)
            values += [0.0] * len(added.coefficients) + x0[at : at + len(added.shapes)].tolist()
            at += len(added.shapes)
        return np.array(values)

    def state(self, x: Array) -> State:
        """The model at ``x``."""
        state = scaled(self.base, self.frees, self.logarithms(x).tolist())
        at = len(self.frees)
        effects = list(self.base.added[: self.first])
        for added in self.base.added[self.first :]:
            coefficients = tuple(float(v) for v in x[at : at + len(added.coefficients)])
            at += len(coefficients)
            moved = zip(added.fitting.shapes, x[at : at + len(added.shapes)], strict=True)
            shapes = tuple(shape.value(float(v)) for shape, v in moved)
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

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds, shape (p,) each."""
        ends = [free.bounds for free in self.frees]
        pairs = list(zip(self._own([e[0] for e in ends]), self._own([e[1] for e in ends]), strict=True))
        for added in self.base.added[self.first :]:
            pairs += added.fitting.bounds(added.limits, added.orders)
            for shape, value in zip(added.fitting.shapes, added.shapes, strict=True):
                (low, high), here = shape.bounds(added.limits), shape.number(value)
                pairs.append((max(here - SHAPE_REACH, low), min(here + SHAPE_REACH, high)))
        lower, upper = np.array(pairs, dtype=float).reshape(-1, 2).T
        return lower, upper

    def steps(self, x: Array) -> Array:
        """Steps of finite differences at ``x``, shape (p,): back from an end that a number stands at."""
        own = np.array([SMALL_STEP if free.compliance else STEP for free in self.frees])
        steps = (own / self.rates(x)).tolist()
        at = len(self.frees)
        for added in self.base.added[self.first :]:
            steps += [SMALL_STEP * max(1.0, abs(v)) for v in x[at : at + len(added.coefficients)]]
            steps += [SMALL_STEP] * len(added.shapes)
            at += len(added.coefficients) + len(added.shapes)
        sizes = np.array(steps)
        return np.asarray(np.where(x + sizes > self.bounds()[1], -sizes, sizes))


def begun_within(x: Array, bounds: tuple[Array, Array]) -> Array:
    """The nearest place to ``x`` where a fit may begin: at a lower bound an optimiser's interior does not."""
    lower, upper = bounds
    return np.clip(x, np.where(np.isfinite(lower), lower + 1e-3, lower), upper)


class Measured:
    """A model's free numbers against the training data: the problem that a fit of a model solves.

    Args:
        bench: the measured series, weighed.
        vector: the free numbers.
        theta: where the logarithms of the base's factors start, by name; 0 by default.
    """

    def __init__(self, bench: Bench, vector: Vector, theta: Mapping[str, float] | None = None) -> None:
        self.bench, self.vector = bench, vector
        self.names = [free.name for free in vector.frees]
        for added in vector.base.added[vector.first :]:
            self.names += [f"{added.effect}, coefficient {k + 1}" for k in range(len(added.coefficients))]
            self.names += [f"{added.effect}.{shape.path}" for shape in added.fitting.shapes]
        self.bounds = vector.bounds()
        self.start = begun_within(vector.start(theta), self.bounds)
        self.priors = vector.priors()
        self.centre = vector.centre(self.start)
        self.blocks = bench.stacked_blocks()
        #: Predictions by the bytes of where they were made, and how loads swung in them where records begin.
        self.predictions: dict[bytes, list[Array]] = {}
        self._swung: dict[bytes, Vector] = {}
        self._nearest = np.inf

    def residual(self, x: Array) -> Array:
        """Whitened, shape (rows,).

        Raises:
            PredictionError: the model could not be predicted.
        """
        predictions = self.predicted(x)
        rest = self.bench.stacked(self.bench.residuals(predictions))
        if self.bench.swings and float(rest @ rest) < self._nearest:
            # From there on loads swing as they had best.
            self._nearest = float(rest @ rest)
            base, apart = self.swung(x).base, self.bench.centred(self.bench.apart(predictions))
            swings = swung_on(self.bench.series, apart, self.bench.swings, base.swings)
            self.vector = replace(self.vector, base=replace(base, swings=swings))
        return rest

    def swung(self, x: Array) -> Vector:
        """The numbers beside the swings with which the prediction was made."""
        return self._swung.get(x.tobytes(), self.vector)

    def predicted(self, x: Array) -> list[Array]:
        """Predictions of the training records, made once."""
        found = self.predictions.get(x.tobytes())
        if found is None:
            found = self.predictions[x.tobytes()] = self.bench.predict(self.vector.state(x))
            self._swung[x.tobytes()] = self.vector
        return found

    def steps(self, x: Array) -> Array:
        """Of finite differences, shape (p,)."""
        return self.vector.steps(x)

    def changes(self, pairs: Sequence[tuple[Array, Array]]) -> list[Array | None]:
        """Whitened change of the predictions from one place of each pair to the other, offsets removed."""
        there = self.bench.predict_all([self.vector.state(x) for pair in pairs for x in pair])
        return [
            None if back is None or ahead is None else self.bench.trace(back, ahead)
            for back, ahead in zip(there[::2], there[1::2], strict=True)
        ]

    def sensitivities(
        self, x: Array, first: int = 0, like: Array | None = None, *, tangents: bool = False
    ) -> Array:
        """See ``sensitivities``."""
        known = self.predictions.get(x.tobytes())
        return sensitivities(self.bench, self.swung(x), x, known, first=first, like=like, tangents=tangents)


def sensitivities(
    bench: Bench,
    vector: Vector,
    x: Array,
    predictions: list[Array] | None = None,
    *,
    first: int = 0,
    like: Array | None = None,
    tangents: bool = False,
) -> Array:
    """Derivatives of the whitened predictions, offsets removed, to the numbers from ``first`` on.

    Secants say what the data tell of a number: they are as large as a change has to be to be heard, across
    the corners that it moves. A step of a fit is as good by tangents, which are integrated beside the model.

    Args:
        bench: the measured series.
        vector: the numbers.
        x: where.
        predictions: what the model predicts there, if it is known.
        first: index of the first number that is asked for.
        like: sensitivities near ``x``, shape (rows, up to p): steps are then large enough for a change that
            stands out from the solver's noise, and no larger.
        tangents: take tangents to numbers that leave the model's parts as they are.
    """
    here = vector.state(x)
    if predictions is None:
        predictions = bench.predict(here)
    steps, wanted = vector.steps(x), range(first, len(x))
    known = _tangents(bench, vector, x, steps, wanted) if tangents else {}
    if like is not None:
        steps *= _shorter(like, steps, vector)
    columns = np.zeros((len(bench.stacked_blocks()), len(wanted)))
    for k, tangent in known.items():
        columns[:, k - first] = tangent
    others = [k for k in wanted if k not in known]
    columns[:, [k - first for k in others]] = _differences(bench, vector, x, predictions, steps, others)
    if like is None:
        # Secants of changes that are far above the noise show the model's bend, not its slope.
        factors = _shorter(columns, steps[first:], vector, first)
        bent = [k for k in others if factors[k - first] < BENT]
        steps[bent] *= factors[[k - first for k in bent]]
        columns[:, [k - first for k in bent]] = _differences(bench, vector, x, predictions, steps, bent)
    return columns


def _shorter(like: Array, steps: Array, vector: Vector, first: int = 0) -> Array:
    """Factors of finite differences' steps for a change that stands out from the solver's noise, no larger.

    Effects are linear in their coefficients, so those may move further.
    """
    own = slice(first, first + like.shape[1])
    factors = np.ones(len(steps))
    size = np.sqrt(np.mean(like**2, axis=0)) * np.abs(steps[: like.shape[1]])
    most = np.where(vector.coefficients()[own], MOST_STEP, 1.0)
    factors[: like.shape[1]] = np.clip(CHANGE / np.maximum(size, 1e-300), LEAST_STEP, most)
    return factors


def _differences(
    bench: Bench, vector: Vector, x: Array, predictions: list[Array], steps: Array, wanted: Sequence[int]
) -> Array:
    """Whitened finite differences of the wanted numbers, shape (rows, len(wanted))."""
    here = vector.state(x)
    states = [vector.state(x + steps[k] * (np.arange(len(x)) == k)) for k in wanted]
    # How a channel is read needs no simulation.
    read = [_only_read(vector, k) for k in wanted]
    simulated = iter(bench.predict_all([s for s, only in zip(states, read, strict=True) if not only]))
    columns = np.zeros((len(bench.stacked_blocks()), len(states)))
    for at, (k, state, only) in enumerate(zip(wanted, states, read, strict=True)):
        there = bench.reread(predictions, here, state) if only else next(simulated)
        if there is not None:
            columns[:, at] = bench.trace(predictions, there) / steps[k]
    return columns


def _only_read(vector: Vector, k: int) -> bool:
    return k < len(vector.frees) and vector.frees[k].reading


def _tangents(
    bench: Bench, vector: Vector, x: Array, steps: Array, wanted: Sequence[int]
) -> dict[int, Array]:
    """Whitened derivatives, integrated beside the model, to those numbers that leave its parts as they are.

    How a channel is read needs no integration: those numbers are not among them. Nor are any of a drive with
    teeth, whose tables come from root finding: its errors are more than such a step does.

    Args:
        bench: the measured series.
        vector: the numbers.
        x: where.
        steps: of finite differences, shape (p,): a derivative is one-sided where the model is.
        wanted: which numbers.
    """
    if vector.base.toothed:
        return {}
    wanted = [k for k in wanted if not _only_read(vector, k)]
    sizes = np.copysign(BESIDE * np.maximum(1.0, np.abs(x)), steps)
    others = [vector.state(x + sizes[k] * (np.arange(len(x)) == k)) for k in wanted]
    found = bench.beside(vector.state(x), others) if wanted else []
    return {
        k: bench.trace(*pair) / sizes[k] for k, pair in zip(wanted, found, strict=True) if pair is not None
    }
