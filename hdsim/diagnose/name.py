"""Step 5b, name: the best of the screen are fitted in the simulated model, and the best of them has the name.

The base's own numbers stay free in these fits; candidates are compared block of time by block of time.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdsim.diagnose.bench import Bench
from hdsim.diagnose.fit import Fit, Vector, at_present, correlation, fit, sensitivities, settled
from hdsim.diagnose.freedom import Added, State, scaled, signed
from hdsim.diagnose.measured import Array
from hdsim.diagnose.predict import PredictionError
from hdsim.diagnose.screen import Residual
from hdsim.diagnose.traces import Screened, Screening, designs
from hdsim.effects import catalogue
from hdsim.effects._fitting import Inverse

#: Largest chance at which a search may name an effect.
LEVEL = 0.02
#: Least share of the weighed residual that an effect must explain to be worth a name.
LEAST_SHARE = 0.03
#: Candidates that are fitted roughly, and the part of the best share that they must reach on the screen.
SHORTLIST, NEAR = 9, 0.25
#: The same part for effects that are known to look like the best, or that live in the coordinate that
#: explains most: the screen is linear, they are not.
ALIKE = 0.1
#: Evaluations of a rough and of a full fit; what a rough one may leave, in units of what the best leaves, to
#: be fitted further, and from the numbers as given.
ROUGH, FULL, LEFT_IN, FAR_LEFT_IN = 5, 12, 2.0, 3.0
#: Logarithm by which a re-fitted number may have moved before a fit begins at the given one too.
FAR = 0.7
#: What a fit may leave, in units of the noise, to count as one that has reached it.
REACHED = 1.05
#: Farthest that the base's numbers go with the screen's word alone, as a logarithm.
FARTHEST = 2.0
#: Logarithm by which a re-fit must have made the drive softer for a compliance to be suspected.
SOFTER = 0.03
#: Part of the drive's compliance that the screen may give to an effect in series.
SOFTEST = 0.85
#: Part of the screen's coefficient at which a compliance's fit begins a second time.
SMALL = 0.2
#: Part of its share that another effect must keep beside the best to be an effect of its own.
BESIDE = 0.6
#: Loss of explained power, as a part of it, within which two effects count as the same trace.
SAME = 0.02
#: The same for effects that are known to look alike, when neither reaches the noise.
MISMATCH = 0.1


@dataclass
class Named:
    """A fitted effect.

    Attributes:
        name: in the catalogue.
        fit: the model with it.
        losses: shape (blocks,), power of each block's residual after the fit.
        group: effects that these data cannot tell from it, with the ratio of explained power.
        confidence: share of resampled records (over blocks) in which it, or its group, is best.
        share: of the residual, which its trace explained on the screen.
        chance: of the search that found it.
        alternatives: fits of the others on the shortlist.
    """

    name: str
    fit: Fit
    losses: Array
    group: dict[str, float]
    confidence: float
    share: float
    chance: float
    alternatives: dict[str, Fit]


def name_effect(
    bench: Bench,
    base: Fit,
    screening: Screening,
    residual: Residual,
    *,
    coordinate: str = "",
    on_step: Callable[[str], object] | None = None,
) -> Named | None:
    """Fit the screen's best in the simulated model and keep the best of them.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        screening: the catalogue on the screen.
        residual: what it was screened on.
        coordinate: the one that explains most of it; effects that live there are fitted more readily.
        on_step: told what is being fitted.
    """
    best = screening.ranked[0]
    known = catalogue()

    def near(name: str) -> float:
        lives = coordinate in known[name].signature.lives_in[:1]
        return ALIKE if lives or confusable(best.name, name) else NEAR

    shortlist = [one for one in screening.ranked if one.share.share >= near(one.name) * best.share.share]
    shortlist = shortlist[:SHORTLIST]
    softer = any(
        "stiffness" in free.name and t < -SOFTER for free, t in zip(base.frees, base.theta, strict=True)
    )
    if softer and any(_in_series(one) for one in shortlist):
        # The re-fit may have taken any compliance in series for the drive's own.
        shortlist += [one for one in screening.ranked if _in_series(one) and one not in shortlist]
    before = block_losses(bench, base.predictions)
    with bench.coarse():
        results = _contest(bench, base, shortlist, residual, on_step)
    if not results:
        return None
    results.sort(key=lambda result: float(result[2].sum()))
    name, found, losses = results[0]
    explained = float((before - losses).sum())
    if explained <= 0:
        return None
    group = {}
    on_screen = {one.name: one for one in shortlist}
    for other, rival, rest in results[1:]:
        difference = rest - losses
        spread = float(np.sqrt(len(difference)) * difference.std())
        if beside(residual, on_screen[name], on_screen[other]):
            continue
        same = max(2.0 * spread, SAME * explained)
        if confusable(name, other):
            # Two formulas that both miss the noise are not told apart by less than what the better one lacks,
            # nor a simple one from one with more freedom, which may reach the noise where it does not.
            lacks = float(losses.sum()) - sum(bench.noise_powers.values())
            freer = freedom(found) > freedom(rival)
            same = max(same, MISMATCH * explained if freer else min(lacks, MISMATCH * explained))
        if difference.sum() < same:
            group[other] = float((before - rest).sum()) / explained
    return Named(
        name,
        settled(bench, found, len(base.state.added)),
        losses,
        group,
        _confidence(results, {name, *group}),
        on_screen[name].share.share,
        screening.chance,
        {
            o: settled(bench, each, len(base.state.added)) if o in group else each
            for o, each, _ in results[1:]
        },
    )


@dataclass
class _Point:
    """Where the base is linear: its numbers, and what it leaves there.

    Attributes:
        theta: logarithms of factors on the fitted base's numbers, shape (f,).
        state: the base there.
        predictions: its predictions.
        columns: sensitivities to the numbers, shape (rows, f).
        left: whitened residual, shape (rows,).
    """

    theta: Array
    state: State
    predictions: Sequence[Array]
    columns: Array
    left: Array


def _as_given(bench: Bench, base: Fit) -> _Point:
    """The base at its numbers before they were fitted."""
    frees = at_present(base)
    state = scaled(base.state, frees, (-base.theta).tolist())
    there = [
        replace(free, value=free.value * math.exp(-t)) for free, t in zip(frees, base.theta, strict=True)
    ]
    # All effects are held there.
    vector = Vector(state, tuple(there), len(state.added))
    predictions = bench.predict(state.candidate(), state.gain)
    return _Point(
        -base.theta, state, predictions, sensitivities(bench, vector, vector.start(), predictions),
        bench.stacked(bench.residuals(predictions)),
    )  # fmt: skip


def _contest(
    bench: Bench,
    base: Fit,
    shortlist: Sequence[Screened],
    residual: Residual,
    on_step: Callable[[str], object] | None,
) -> list[tuple[str, Fit, Array]]:
    """Fit every candidate roughly, and the best of them further; each with what it leaves by blocks.

    Where the re-fit went far the candidates are fitted from the numbers as given too: a base without the
    effect may have bent them to stand in for it.
    """
    tell = on_step or (lambda _: None)
    fits: dict[str, Fit] = {}

    def keep(name: str, found: list[Fit]) -> None:
        found += [fits[name]] if name in fits else []
        if found:
            fits[name] = min(found, key=lambda each: _loss(bench, each))

    f = len(base.frees)
    left = bench.stacked(bench.residuals(base.predictions))
    here = _Point(np.zeros(f), base.state, base.predictions, base.columns[:, :f], left)
    for one in shortlist:
        tell(f"fitting {one.name}")
        for each in (one, *one.others):
            rest = residual.values - residual.project(each.columns) @ np.array(each.added.coefficients)
            keep(one.name, _roughly(bench, base, here, each.added, each.columns, _power(bench, rest)))
    if not fits:
        return []
    noise = sum(bench.noise_powers.values())
    least = min(_loss(bench, each) for each in fits.values())
    if any(abs(t) > FAR for t in base.theta) and least > REACHED * noise:
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            given = _as_given(bench, base)
            for one in shortlist:
                if one.name in fits and _loss(bench, fits[one.name]) <= FAR_LEFT_IN * least:
                    tell(f"fitting {one.name} from the numbers as given")
                    for each in (one, *one.others):
                        keep(one.name, _from_given(bench, base, given, each.added))
    least = min(_loss(bench, each) for each in fits.values())
    results: list[tuple[str, Fit, Array]] = []
    for name, found in fits.items():
        if _loss(bench, found) <= LEFT_IN * least:
            tell(f"fitting {name} in full")
            found = _fully(bench, base, found)
        results.append((name, found, block_losses(bench, found.predictions)))
    return results


def _from_given(bench: Bench, base: Fit, given: _Point, added: Added) -> list[Fit]:
    """The model with an effect, from where a linear fit at the numbers as given says that it lies."""
    (columns,) = designs(bench, given.state, given.predictions, [added])
    if columns is None:
        return []
    both = np.hstack([given.columns, columns])
    found, *_ = np.linalg.lstsq(both, given.left, rcond=1e-6)
    free = signed(added.fitting, len(added.orders))
    coefficients = np.where(
        free, found[given.columns.shape[1] :], np.maximum(found[given.columns.shape[1] :], 0.0)
    )
    power = _power(bench, given.left - both @ found)
    return _roughly(bench, base, given, replace(added, coefficients=tuple(coefficients)), columns, power)


def _roughly(bench: Bench, base: Fit, point: _Point, added: Added, columns: Array, power: float) -> list[Fit]:
    """The model with an effect, a few steps from where a linear fit says that it lies.

    Compliances are far from linear in their shape, and the drive's own stands in for them: they start closer
    to the base too, and where all that the re-fit made the drive softer is theirs.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        point: where the base is linear.
        added: the effect with its coefficients of the linear fit.
        columns: its trace at the point, shape (rows, k).
        power: what one independent sample of the linear fit's residual counts.
    """
    frees, coefficients = at_present(base), np.array(added.coefficients)
    square = point.columns.T @ point.columns + np.diag([power / free.prior**2 for free in frees])
    moves = np.linalg.solve(square, point.columns.T @ (point.left - columns @ coefficients))
    stiff = np.array(["stiffness" in free.name for free in frees], dtype=bool)
    series = any(isinstance(term, Inverse) for term in added.fitting.terms)
    if series:
        # Beside a compliance it is the drive's own compliance, not its stiffness, that moves in proportion.
        moves = np.where(stiff, -np.log1p(-np.clip(moves, None, SOFTEST)), moves)
    moves = np.clip(moves, -FARTHEST, FARTHEST)
    begins = [(coefficients, moves)]
    if series and point.state is base.state:
        begins.append((SMALL * coefficients, SMALL * moves))
        stiffer = np.where(stiff, np.maximum(-base.theta, 0.0), 0.0)
        size = float(columns[:, 0] @ (point.columns @ np.expm1(-stiffer)) / (columns[:, 0] @ columns[:, 0]))
        if size > 0:
            begins.append((np.array([size]), stiffer))
    if added.fitting.play:
        # By as much as the trace is too small, the spring beyond the play is stiffer.
        beyond = math.log(max(float(coefficients[0]), 1.0))
        begins.append((np.ones(1), np.clip(np.where(stiff, beyond, moves), -FARTHEST, FARTHEST)))
    held = len(base.state.added)
    found: list[Fit] = []
    for start, move in begins:
        state = replace(base.state, added=(*base.state.added, replace(added, coefficients=tuple(start))))
        theta = {free.name: float(t) for free, t in zip(frees, point.theta + move, strict=True)}
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            found.append(
                fit(bench, state, frees, held_effects=held, prune=False, evaluations=ROUGH, theta=theta,
                    beside=base.beside, known=(np.hstack([point.columns, columns]), power), rough=True)
            )  # fmt: skip
    return found


def _fully(bench: Bench, base: Fit, found: Fit) -> Fit:
    """A rough fit carried on to its end."""
    theta = {free.name: float(t) for free, t in zip(found.frees, found.theta, strict=True)}
    state = replace(base.state, added=found.state.added)
    evaluations = FULL + 4 * bool(found.state.added[-1].shapes)
    known = found.columns, _power(bench, bench.stacked(bench.residuals(found.predictions)))
    held = len(base.state.added)
    try:
        full = fit(bench, state, found.frees, held_effects=held, prune=False, evaluations=evaluations,
                   theta=theta, beside=base.beside, known=known, rough=True)  # fmt: skip
    except (PredictionError, np.linalg.LinAlgError):
        return found
    return full if _loss(bench, full) < _loss(bench, found) else found


def _in_series(one: Screened) -> bool:
    return any(isinstance(term, Inverse) for term in one.added.fitting.terms)


def _power(bench: Bench, rest: Array) -> float:
    """What one independent sample of a residual counts."""
    return max(float(np.mean(rest**2)), 1e-30) * correlation(rest, bench.stacked_blocks())


def _loss(bench: Bench, found: Fit) -> float:
    return float(block_losses(bench, found.predictions).sum())


def freedom(found: Fit) -> int:
    """Free numbers of a fit's last effect."""
    added = found.state.added[-1]
    return len(added.coefficients) + len(added.shapes)


def confusable(one: str, other: str) -> bool:
    """Whether one of two effects says that it can look like the other."""
    known = catalogue()
    return other in known[one].signature.confused_with or one in known[other].signature.confused_with


def beside(residual: Residual, one: Screened, other: Screened) -> bool:
    """Whether two traces are two effects rather than two names of one: each explains what the other can't."""
    both = residual.share(np.hstack([one.columns, other.columns])).share
    return both - one.share.share > BESIDE * other.share.share


def block_losses(bench: Bench, predictions: Sequence[Array]) -> Array:
    """Power of the whitened training residual in each block, shape (blocks,)."""
    rest = bench.stacked(bench.residuals(predictions))
    return np.asarray(np.bincount(bench.stacked_blocks(), rest**2, bench.blocks), dtype=float)


def channel_powers(bench: Bench, predictions: Sequence[Array]) -> dict[str, float]:
    """Power of the whitened training residual in each channel."""
    residuals = bench.residuals(predictions)
    found = dict.fromkeys(bench.channels, 0.0)
    for series, residual in zip(bench.series, residuals, strict=True):
        if series.record < bench.training:
            found[series.channel] += float(np.sum((residual[series.train] / series.sigma) ** 2))
    return found


def _confidence(results: list[tuple[str, Fit, Array]], group: set[str], draws: int = 400) -> float:
    losses = np.stack([rest for _, _, rest in results])
    rng = np.random.default_rng(3)
    picks = rng.integers(0, losses.shape[1], size=(draws, losses.shape[1]))
    best = np.argmin(losses[:, picks].sum(axis=2), axis=0)
    return float(np.mean([results[int(k)][0] in group for k in best]))
