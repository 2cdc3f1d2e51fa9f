"""Step 5b, name: the best of the screen are fitted in the simulated model, and the best of them has the name.

The base's own numbers stay free in these fits; candidates are compared block of time by block of time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from hdsim.diagnose.bench import Bench
from hdsim.diagnose.fit import Fit, fit
from hdsim.diagnose.freedom import Added, Free
from hdsim.diagnose.measured import Array
from hdsim.diagnose.predict import PredictionError
from hdsim.diagnose.screen import Residual
from hdsim.diagnose.traces import Screened, Screening
from hdsim.effects import catalogue
from hdsim.effects._fitting import Inverse

#: Largest chance at which a search may name an effect.
LEVEL = 0.02
#: Least share of the weighed residual that an effect must explain to be worth a name.
LEAST_SHARE = 0.03
#: Candidates that are fitted in full, and the part of the best share that they must reach on the screen.
SHORTLIST, NEAR = 5, 0.75
#: The same part for effects that are known to look like the best, or that live in the coordinate that
#: explains most: the screen is linear, they are not.
ALIKE = 0.5
#: Logarithm by which a re-fitted number may have moved before a fit begins at the given one too.
FAR = 0.7
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
    before = block_losses(bench, base.predictions)
    results: list[tuple[str, Fit, Array]] = []
    for one in shortlist:
        if on_step is not None:
            on_step(f"fitting {one.name}")
        found = _fitted(bench, base, one.added)
        if found is None:
            continue
        results.append((one.name, found, block_losses(bench, found.predictions)))
    if not results:
        return None
    results.sort(key=lambda result: float(result[2].sum()))
    name, found, losses = results[0]
    explained = float((before - losses).sum())
    if explained <= 0:
        return None
    group = {}
    on_screen = {one.name: one for one in shortlist}
    for other, _, rest in results[1:]:
        difference = rest - losses
        spread = float(np.sqrt(len(difference)) * difference.std())
        if beside(residual, on_screen[name], on_screen[other]):
            continue
        same = max(2.0 * spread, SAME * explained)
        if confusable(name, other):
            # Two formulas that both miss the noise are not told apart by less than what the better one lacks.
            same = max(same, min(float(losses.sum()) - bench.noise_power, MISMATCH * explained))
        if difference.sum() < same:
            group[other] = float((before - rest).sum()) / explained
    return Named(
        name,
        found,
        losses,
        group,
        _confidence(results, {name, *group}),
        on_screen[name].share.share,
        screening.chance,
        {other: fitted for other, fitted, _ in results[1:]},
    )


def _fitted(bench: Bench, base: Fit, added: Added) -> Fit | None:
    """The model with an effect, from the re-fitted numbers and, where they went far, from the given ones.

    A base without the effect may have bent its numbers far out of the way to stand in for it.
    """
    state = replace(base.state, added=(*base.state.added, added))
    frees = [free for free in at_present(base) if free.value > 0]
    begins: list[dict[str, float]] = [{}]
    if any(abs(t) > FAR for t in base.theta):
        begins.append({free.name: -float(t) for free, t in zip(base.frees, base.theta, strict=True)})
    evaluations = 6 + 4 * bool(added.shapes) + 6 * (len(begins) > 1)
    states = [state]
    if any(isinstance(term, Inverse) for term in added.fitting.terms):
        # Compliances that stiffen are far from linear in their coefficient: a small one is a start too.
        small = replace(added, coefficients=tuple(SMALL * c for c in added.coefficients))
        states.append(replace(base.state, added=(*base.state.added, small)))
    found: list[Fit] = []
    for state, theta in product(states, begins):
        try:
            found.append(
                fit(bench, state, frees, held_effects=len(base.state.added), prune=False,
                    evaluations=evaluations,
                    theta=theta, beside=base.beside)
            )  # fmt: skip
        except (PredictionError, np.linalg.LinAlgError):
            continue
    if not found:
        return None
    return min(found, key=lambda one: float(block_losses(bench, one.predictions).sum()))


def confusable(one: str, other: str) -> bool:
    """Whether one of two effects says that it can look like the other."""
    known = catalogue()
    return other in known[one].signature.confused_with or one in known[other].signature.confused_with


def beside(residual: Residual, one: Screened, other: Screened) -> bool:
    """Whether two traces are two effects rather than two names of one: each explains what the other can't."""
    both = residual.share(np.hstack([one.columns, other.columns])).share
    return both - one.share.share > BESIDE * other.share.share


def at_present(base: Fit) -> list[Free]:
    """A fit's free numbers at their fitted values."""
    return [
        replace(free, value=free.value * float(np.exp(t)))
        for free, t in zip(base.frees, base.theta, strict=True)
    ]


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
