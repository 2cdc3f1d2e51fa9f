"""Step 5b, the contest: candidates are fitted in the simulated model, a few steps first, the best to the end.

Each fit begins where a linear fit says that the effect lies, with the base's answer to it.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.traces import Screened, designs
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.fit import Fit, at_present, fit, sharpened
from hdsim.estimate.numbers import scaled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import REACHED
from hdsim.estimate.state import Added, State
from hdsim.estimate.vector import Vector, sensitivities

#: Evaluations of a rough and of a full fit; what a rough one may leave, in units of what the best leaves, to
#: be fitted further, and from the numbers as given or from where another led.
ROUGH, FULL, LEFT_IN, FAR_LEFT_IN = 5, 12, 2.0, 3.0
#: Most candidates that are.
FAR_MOST = 3
#: Logarithm by which a re-fitted number may have moved before a fit begins at the given one too.
FAR = 0.7
#: Farthest that the base's numbers go with the screen's word alone, as a logarithm.
FARTHEST = 2.0
#: Part of the drive's compliance that the screen may give to an effect in series.
SOFTEST = 0.85
#: Part by which a law of compliance must leave more than the best of them to be fitted from there too.
LAGS = 0.1
#: Part of the screen's coefficient at which a compliance's fit, or one that led astray, begins a second time.
SMALL = 0.2

#: Candidates that were fitted, by name, each with whether it was fitted to the end.
Fitted = dict[str, tuple[Fit, bool]]


@dataclass
class _Point:
    """Where the base is linear: its numbers and those of the effects that it has, and what it leaves there.

    Attributes:
        theta: logarithms of factors on the fitted base's numbers, shape (f,).
        state: the base there.
        predictions: its predictions.
        columns: sensitivities to all numbers, shape (rows, p).
        left: whitened residual, shape (rows,).
    """

    theta: Array
    state: State
    predictions: Sequence[Array]
    columns: Array
    left: Array


def _at(bench: Bench, base: Fit, theta: Array) -> _Point:
    """The base at other numbers of its own, shape (f,)."""
    frees = at_present(base)
    state = scaled(base.state, frees, theta.tolist())
    there = [free.moved(float(t)) for free, t in zip(frees, theta, strict=True)]
    vector = Vector(state, tuple(there), 0)
    predictions = bench.predict(state)
    return _Point(
        theta, state, predictions, sensitivities(bench, vector, vector.start(), predictions),
        bench.stacked(bench.residuals(predictions)),
    )  # fmt: skip


def contest(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    residual: Residual,
    on_step: Callable[[str], object] | None,
    fitted: Fitted | None = None,
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
    """
    tell = on_step or (lambda _: None)
    known = fitted if fitted is not None else {}
    names = [one.name for one in shortlist]
    best = {n: (bench.power(found.predictions), found) for n, (found, _) in known.items() if n in names}
    shortlist = [one for one in shortlist if one.name not in best]

    def keep(name: str, several: list[Fit]) -> None:
        for each in several:
            loss = bench.power(each.predictions)
            if name not in best or loss < best[name][0]:
                best[name] = loss, each

    left = bench.stacked(bench.residuals(base.predictions))
    here = _Point(np.zeros(len(base.frees)), base.state, base.predictions, base.columns, left)
    for one in shortlist:
        tell(f"fitting {one.name}")
        several = [one, *one.others]
        # A screen's traces may be of an earlier model.
        anew = designs(bench, base.state, base.predictions, [each.added for each in several])
        for each, columns in zip(several, anew, strict=True):
            if columns is None:
                continue
            rest = residual.values - residual.project(each.columns) @ np.array(each.added.coefficients)
            keep(one.name, _roughly(bench, base, here, each.added, columns, _power(bench, rest)))
    if not best:
        return []
    noise = sum(bench.noise_powers.values())
    least = min(loss for loss, _ in best.values())
    if any(abs(t) > FAR for t in base.theta) and least > REACHED * noise:
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            given = _at(bench, base, -base.theta)
            nearest = sorted(best, key=lambda name: best[name][0])[:FAR_MOST]
            nearest = [name for name in nearest if best[name][0] <= FAR_LEFT_IN * least]
            for one in shortlist:
                if one.name in nearest:
                    tell(f"fitting {one.name} from the numbers as given")
                    for each in (one, *one.others):
                        keep(one.name, _from(bench, base, given, each.added))
    _after_the_best(bench, base, shortlist, best, keep, tell)
    least = min(loss for loss, _ in best.values())
    full = {name for name, (_, whole) in known.items() if whole}
    further = [name for name, (loss, _) in best.items() if loss <= LEFT_IN * least and name not in full]
    for name in further:
        tell(f"fitting {name} in full")
        keep(name, _fully(bench, base, best[name][1]))
    first = min(best, key=lambda name: best[name][0])
    if first in further:
        keep(first, _at_next_minima(bench, base, best[first][1]))
    for name in best:
        known[name] = best[name][1], name in full or name in further
    return [(name, found, bench.block_powers(found.predictions)) for name, (_, found) in best.items()]


def _after_the_best(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    best: dict[str, tuple[float, Fit]],
    keep: Callable[[str, list[Fit]], None],
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
    enough = (1.0 + LAGS) * max(loss, sum(bench.noise_powers.values()))
    rivals = [one for one in series if best.get(one.name, (math.inf, None))[0] > enough]
    if not rivals:
        return
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        there = _at(bench, base, leader.theta)
        for one in rivals:
            tell(f"fitting {one.name} from where {name} led")
            for shapes in product(*(shape.starts for shape in one.added.fitting.shapes)):
                keep(one.name, _from(bench, base, there, replace(one.added, shapes=shapes)))


def against_priors(bench: Bench, results: Sequence[tuple[str, Fit, Array]]) -> list[tuple[str, Fit, Array]]:
    """Fits with what the priors have against their numbers shared out over their losses.

    It counts as many independent samples as the base's numbers are squared prior spreads away from what they
    were given as: a fit that has to bend the base needs as much more of the data on its side.
    """
    best = min(results, key=lambda result: float(result[2].sum()))[1]
    power = _power(bench, bench.stacked(bench.residuals(best.predictions)))

    def strain(found: Fit) -> float:
        return sum(
            ((float(t) - f.none) / f.prior) ** 2 for f, t in zip(found.frees, found.theta, strict=True)
        )

    return [(name, found, losses + power * strain(found) / len(losses)) for name, found, losses in results]


def _from(bench: Bench, base: Fit, given: _Point, added: Added) -> list[Fit]:
    """The model with an effect, from where a linear fit at a point says that it lies."""
    (columns,) = designs(bench, given.state, given.predictions, [added])
    if columns is None:
        return []
    # Delays stay where they are: nothing bounds them here.
    moving = np.ones(given.columns.shape[1])
    moving[: len(base.frees)] = [not free.step for free in base.frees]
    both = np.hstack([given.columns * moving, columns])
    found, *_ = np.linalg.lstsq(both, given.left, rcond=1e-6)
    return _roughly(bench, base, given, added, columns, _power(bench, given.left - both @ found))


def _roughly(bench: Bench, base: Fit, point: _Point, added: Added, columns: Array, power: float) -> list[Fit]:
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
    frees = at_present(base)
    f, before_it = len(frees), Vector(base.state, (), 0)
    x0 = before_it.start()
    moves, coefficients = _linear(base, point, added, columns, power)
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
            found.append(
                fit(bench, state, frees, prune=False, evaluations=ROUGH, theta=theta, after=base,
                    known=(np.hstack([point.columns, columns]), power), rough=True)
            )  # fmt: skip

    for start, move in begins:
        begin(start, move)
    before = bench.power(base.predictions)
    if not series and all(bench.power(each.predictions) > before for each in found):
        # A step so long that it leads astray: where numbers almost stand in for one another.
        begin(SMALL * coefficients, SMALL * moves)
    return found


def _linear(base: Fit, point: _Point, added: Added, columns: Array, power: float) -> tuple[Array, Array]:
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


def _fully(bench: Bench, base: Fit, found: Fit) -> list[Fit]:
    """A rough fit carried on to its end, if it gets there.

    Short of the noise it may have stopped because its sensitivities no longer held: they are made anew.
    """
    if bench.power(found.predictions) > REACHED * sum(bench.noise_powers.values()):
        found = sharpened(bench, found)
    theta = {free.name: float(t) for free, t in zip(found.frees, found.theta, strict=True)}
    state = replace(base.state, added=found.state.added)
    evaluations = FULL + 4 * bool(found.state.added[-1].shapes)
    known = found.columns, _power(bench, bench.stacked(bench.residuals(found.predictions)))
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        full = fit(bench, state, found.frees, prune=False, evaluations=evaluations, theta=theta, after=base,
                   known=known, rough=True)  # fmt: skip
        return [full]
    return []


def _at_next_minima(bench: Bench, base: Fit, found: Fit) -> list[Fit]:
    """An effect's fits from where its cost may have its next minima, carried on where they leave less."""
    added = found.state.added[-1]
    others = [
        replace(
            added,
            coefficients=(1.0,) * len(added.coefficients),
            shapes=(*added.shapes[:k], v, *added.shapes[k + 1 :]),
        )
        for k, shape in enumerate(added.fitting.shapes)
        for v in shape.next_minima(added.shapes[k])
    ]
    several: list[Fit] = []
    if others:
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            there = _at(bench, base, found.theta)
            for other in others:
                several += _from(bench, base, there, other)
    # From another minimum's numbers the way is long: a few steps say nothing yet.
    ends = [full for each in several for full in _fully(bench, base, each)]
    nearest = min(ends, key=lambda each: bench.power(each.predictions), default=None)
    if nearest is not None and bench.power(nearest.predictions) <= LEFT_IN * bench.power(found.predictions):
        ends += _fully(bench, base, nearest)
    return ends


def _power(bench: Bench, rest: Array) -> float:
    """What one independent sample of a residual counts."""
    return max(float(np.mean(rest**2)), 1e-30) * correlation(rest, bench.stacked_blocks())
