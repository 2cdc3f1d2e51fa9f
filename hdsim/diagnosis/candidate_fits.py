"""Fits of one candidate of the contest: a few steps, to the end, and from where its next minima may lie.

Each begins where a linear fit says that the effect lies, with the base's answer to it.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.designs import designs
from hdsim.diagnosis.point import Point, point_at
from hdsim.diagnosis.softest import softest
from hdsim.estimate.asked import asked_beside
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, fit, sharpened
from hdsim.estimate.numbers import Free, scaled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import REACHED
from hdsim.estimate.state import Added, State
from hdsim.estimate.vector import Vector, sensitivities

#: Evaluations of a rough and of a full fit.
ROUGH, FULL = 5, 12
#: Farthest that the base's numbers go with the screen's word alone, as a logarithm.
FARTHEST = 2.0
#: Part of the drive's compliance that the screen may give to an effect in series.
SOFTEST = 0.85
#: Part of the screen's coefficient at which a compliance's fit, or one that led astray, begins a second time.
SMALL = 0.2
#: Most times that a fit from another minimum is carried on, and part by which what it leaves must have fallen
#: at a time: the way there is a bent valley.
FARTHER, STALLED = 6, 0.01


def fits_from(bench: Bench, base: Fit, there: Point, added: Added, enough: float = math.inf) -> list[Fit]:
    """The model with an effect, from where a linear fit at a point says that it lies.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        there: the point.
        added: the effect.
        enough: power of what the linear fit may leave for a fit to begin there.
    """
    (columns,) = designs(bench, there.state, there.predictions, [added])
    if columns is None:
        return []
    # Delays stay where they are: nothing bounds them here.
    moving = np.ones(there.columns.shape[1])
    moving[: len(base.frees)] = [not free.step for free in base.frees]
    both = np.hstack([there.columns * moving, columns])
    found, *_ = np.linalg.lstsq(both, there.left, rcond=1e-6)
    rest = there.left - both @ found
    if float(rest @ rest) > enough:
        return []
    return rough_fits(bench, base, there, added, columns, bench.sample_power(rest))


def rough_fits(
    bench: Bench, base: Fit, point: Point, added: Added, columns: Array, power: float
) -> list[Fit]:
    """The model with an effect, a few steps from where a linear fit says that it lies.

    The effects before it move along: they may have taken what is its. Compliances are far from linear in
    their shape, and the drive's own stands in for them: they start closer to the base too, and where all that
    the re-fit made the drive softer is theirs.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        point: where the base is linear.
        added: the effect.
        columns: its trace at the point, shape (rows, k).
        power: what one independent sample of the linear fit's residual counts.
    """
    frees, asked = at_present(base), asked_beside(base, added)
    f, before_it = len(frees), Vector(base.state, (), 0)
    x0 = before_it.start()
    moves, coefficients = linear_fit(base, point, added, columns, power)
    stiff = np.array([*(free.compliance for free in frees), *(False for _ in x0)], dtype=bool)
    series = added.fitting.in_series
    if series:
        # Beside a compliance it is the drive's own compliance, not its stiffness, that moves in proportion.
        given_away = -np.log1p(-np.clip(moves, None, SOFTEST))
        moves = np.where(stiff, np.clip(given_away, -FARTHEST, FARTHEST), moves)
    begins = [(coefficients, moves)]
    if series and point.state is base.state:
        begins.append((SMALL * coefficients, SMALL * moves))
        stiffer = np.zeros(len(moves))
        stiffer[:f] = np.where(stiff[:f], np.maximum(-base.theta, 0.0), 0.0)
        size = float(columns[:, 0] @ (point.columns @ np.expm1(-stiffer)) / (columns[:, 0] @ columns[:, 0]))
        if size > 0:
            begins.append((np.array([size]), stiffer))
    if series and bench.power(point.predictions) > REACHED * bench.noise_power:
        alone = softest(bench, point, added, columns, stiff)
        if alone is not None:
            begins.append((np.array([alone]), np.zeros(len(moves))))
    if added.fitting.play:
        # By as much as the trace is too small, the spring beyond the play is stiffer.
        beyond = math.log(max(float(coefficients[0]), 1.0))
        begins.append((np.ones(1), np.where(stiff, np.clip(beyond, -FARTHEST, FARTHEST), moves)))
    lower, upper = before_it.bounds()
    found: list[Fit] = []

    def begin(start: Array, move: Array) -> None:
        earlier = before_it.state(np.clip(x0 + move[f:], lower, upper)).added
        state = replace(base.state, added=(*earlier, replace(added, coefficients=tuple(start))))
        theta = {free.name: float(t) for free, t in zip(frees, point.theta + move[:f], strict=True)}
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            # What it asks for does nothing without it.
            own = _slopes(bench, state, frees, theta, asked)
            known = np.hstack([point.columns[:, :f], own, point.columns[:, f:], columns])
            evaluations = ROUGH + 2 * len(asked)
            found.append(
                fit(bench, state, [*frees, *asked], prune=False, evaluations=evaluations, theta=theta,
                    after=base, known=(known, power), rough=True)
            )  # fmt: skip

    for start, move in begins:
        begin(start, move)
    before = bench.power(base.predictions)
    if not series and all(bench.power(each.predictions) > before for each in found):
        # A step so long that it leads astray: where numbers almost stand in for one another.
        begin(SMALL * coefficients, SMALL * moves)
    return found


def _slopes(
    bench: Bench, state: State, frees: Sequence[Free], theta: dict[str, float], asked: Sequence[Free]
) -> Array:
    """Sensitivities to what an effect asks for, where its fit begins, shape (rows, asked)."""
    if not asked:
        return np.zeros((len(bench.stacked_blocks()), 0))
    there = scaled(state, frees, [theta[free.name] for free in frees])
    vector = Vector(there, tuple(asked), len(there.added))
    return sensitivities(bench, vector, vector.start(), tangents=True)


def linear_fit(base: Fit, point: Point, added: Added, columns: Array, power: float) -> tuple[Array, Array]:
    """How the model's numbers move, shape (p,), and an effect's coefficients, shape (k,), by a linear fit.

    All at once, with their priors and bounds: what an effect says as well as the model's numbers do is shared
    out by what was believed of those, and nothing goes where neither the data nor a prior tell.
    """
    from scipy.optimize import lsq_linear

    p, n = point.columns.shape[1], point.columns.shape[1] + columns.shape[1]
    unit = replace(added, coefficients=(0.0,) * columns.shape[1])
    vector = Vector(replace(base.state, added=(*base.state.added, unit)), tuple(at_present(base)), 0)
    x0 = vector.start({free.name: float(t) for free, t in zip(vector.frees, point.theta, strict=True)})
    both, priors = np.hstack([point.columns, columns]), vector.priors()[:n]
    lower, upper = (end[:n] - x0[:n] for end in vector.bounds())
    far = np.where(np.arange(n) < len(base.frees), FARTHEST, np.inf)
    bounds = np.minimum(np.maximum(lower, -far), 0.0), np.maximum(np.minimum(upper, far), 0.0)
    worth = 1.0 / math.sqrt(power)
    q, r = np.linalg.qr(np.vstack([worth * both, np.diag(1.0 / priors)]))
    aim = np.concatenate([worth * point.left, (vector.centre(x0) - x0)[:n] / priors])
    found = lsq_linear(r, q.T @ aim, bounds).x
    return found[:p], found[p:]


def full_fits(bench: Bench, base: Fit, found: Fit) -> list[Fit]:
    """A rough fit carried on to its end, if it gets there.

    Short of the noise it may have stopped because its sensitivities no longer held: they are made anew.
    """
    if bench.power(found.predictions) > REACHED * bench.noise_power:
        found = sharpened(bench, found)
    theta = {free.name: float(t) for free, t in zip(found.frees, found.theta, strict=True)}
    state = replace(base.state, added=found.state.added)
    added = found.state.added[-1]
    evaluations = FULL + 4 * bool(added.shapes) + 2 * len(added.fitting.asks)
    known = found.columns, bench.sample_power(bench.stacked(bench.residuals(found.predictions)))
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        full = fit(bench, state, found.frees, prune=False, evaluations=evaluations, theta=theta, after=base,
                   known=known, rough=True)  # fmt: skip
        return [full]
    return []


def fits_at_next_minima(bench: Bench, base: Fit, found: Fit, enough: float) -> list[Fit]:
    """An effect's fits from where its cost may have its next minima, and on from one that leaves less.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        found: the fit.
        enough: power of what another may leave after the first time to be carried on further.
    """
    begun = [found.state.added[-1]]
    ends: list[Fit] = []
    while True:
        best = min([found, *ends], key=lambda each: bench.power(each.predictions))
        others = [one for one in _at_next_minima(best.state.added[-1]) if not any(map(one.beside, begun))]
        if not others:
            return ends
        begun += others
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            there = point_at(bench, base, best.theta[: len(base.frees)])
            for other in others:
                gone: list[Fit] = []
                for each in _begun_at(bench, base, there, other):
                    if not any(_same_way(bench, each, one) for one in gone):
                        ends += to_its_end(bench, base, each, enough)
                        gone.append(each)


def _same_way(bench: Bench, one: Fit, other: Fit) -> bool:
    """Whether two fits have come to the same place, whichever way each began."""
    apart = bench.power(one.predictions) / bench.power(other.predictions)
    return abs(apart - 1.0) < STALLED and one.state.added[-1].beside(other.state.added[-1])


def _begun_at(bench: Bench, base: Fit, there: Point, other: Added) -> Iterator[Fit]:
    """The model with an effect of other shapes, these free from the first step on, and held at first.

    The other numbers are far from what they are there: free at once, the shapes may make up for them and
    leave the minimum before the fit has come near it.
    """
    yield from fits_from(bench, base, there, other)
    for held in fits_from(bench, base, there, other.held()):
        *before, last = held.state.added
        freed = replace(other, coefficients=last.coefficients)
        yield replace(held, state=replace(held.state, added=(*before, freed)))


def _at_next_minima(added: Added) -> list[Added]:
    """An effect, of strength 1, where its cost may have its next minima."""
    return [
        replace(
            added,
            coefficients=(1.0,) * len(added.coefficients),
            shapes=(*added.shapes[:k], v, *added.shapes[k + 1 :]),
        )
        for k, shape in enumerate(added.fitting.shapes)
        for v in shape.next_minima(added.shapes[k])
    ]


def to_its_end(bench: Bench, base: Fit, found: Fit, enough: float) -> list[Fit]:
    """A fit carried on while that takes much off what it leaves: from another minimum the way is long.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        found: the fit.
        enough: power of what a fit may leave after the first time to be carried on further.
    """
    ends: list[Fit] = []
    for _ in range(FARTHER):
        before = bench.power(found.predictions)
        further = full_fits(bench, base, found)
        ends += further
        if not further or not bench.power(further[0].predictions) < min((1.0 - STALLED) * before, enough):
            break
        found = further[0]
    return ends
