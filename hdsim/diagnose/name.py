"""Step 5, name: which effect of the catalogue leaves the trace that is left.

Screen: every effect is simulated at its unit size in the re-fitted model; the change of all channels
together is its trace, and the cross-validated share of the residual that the traces explain ranks it. Fit:
the best few are then fitted in the simulated model, with the base's own numbers free, and compared on
blocks that the comparison has not used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from hdsim.diagnose.bench import Bench
from hdsim.diagnose.fit import Fit, fit, trace
from hdsim.diagnose.freedom import Added, Free, State, signed
from hdsim.diagnose.locate import Line
from hdsim.diagnose.measured import Array
from hdsim.diagnose.predict import PredictionError
from hdsim.diagnose.screen import Residual, Share, chance_of
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting, Periodic

#: Orders of a periodic term that are taken from the spectra.
MOST_ORDERS = 3
#: Largest chance at which a search may name an effect.
LEVEL = 0.02
#: Least share of the weighed residual that an effect must explain to be worth a name.
LEAST_SHARE = 0.03
#: Candidates that are fitted in full, and the part of the best share that they must reach on the screen.
SHORTLIST, NEAR = 4, 0.75
#: Loss of explained power, as a part of it, within which two effects count as the same trace.
SAME = 0.02


@dataclass
class Screened:
    """An effect on the screen: the fitting of it that explains most."""

    name: str
    added: Added
    share: Share


@dataclass
class Screening:
    """The whole catalogue on the screen.

    Attributes:
        ranked: by falling share, one entry an effect.
        chance: probability that the search finds the best share where nothing is missing.
        skipped: effects that could not be tried, with the reason.
    """

    ranked: list[Screened] = field(default_factory=list)
    chance: float = 1.0
    skipped: dict[str, str] = field(default_factory=dict)


@dataclass
class Named:
    """A fitted effect.

    Attributes:
        name: in the catalogue.
        fit: the model with it.
        losses: shape (blocks,), power of each block's residual after the fit.
        group: effects that these data cannot tell from it, with the ratio of explained power.
        confidence: share of resampled records (over blocks) in which it, or its group, is best.
    """

    name: str
    fit: Fit
    losses: Array
    group: dict[str, float]
    confidence: float


def screen(
    bench: Bench,
    state: State,
    predictions: Sequence[Array],
    residual: Residual,
    lines: Sequence[Line],
    *,
    on_step: Callable[[str], object] | None = None,
) -> Screening:
    """Rank every effect of the catalogue by the share of the residual that its trace explains.

    Args:
        bench: the measured series.
        state: the re-fitted model.
        predictions: its predictions.
        residual: what it leaves.
        lines: peaks of the order spectra.
        on_step: told what is being tried.
    """
    found = Screening()
    draws: list[Array] = []
    present = set(state.effects) | {added.effect for added in state.added}
    for name, kind in catalogue().items():
        fittings: tuple[Fitting, ...] = getattr(kind, "fittings", ())
        if name in present and name != "sensors":
            found.skipped[name] = "the model has it"
            continue
        if not fittings:
            found.skipped[name] = "declares no fitting"
            continue
        if on_step is not None:
            on_step(name)
        best: Screened | None = None
        for fitting in fittings:
            if any(channel not in bench.channels for channel in fitting.needs):
                continue
            if behind_sensor(bench, state, name, fitting):
                found.skipped[name] = (
                    "acts on the load's side of the torque sensor, whose reading is the load"
                )
                continue
            for added in starts(name, fitting, lines):
                columns = traces(bench, state, predictions, added)
                if columns is None or not np.any(columns):
                    continue
                share = _allowed(residual, columns, signed(fitting, len(added.orders)))
                draws.append(share.chance)
                if best is None or share.share > best.share.share:
                    best = Screened(name, replace(added, coefficients=tuple(share.coefficients)), share)
        if best is None:
            found.skipped.setdefault(name, "leaves no trace in these channels, or they lack what it needs")
        else:
            found.ranked.append(best)
    found.ranked.sort(key=lambda one: -one.share.share)
    if found.ranked:
        found.chance = chance_of(found.ranked[0].share.share, draws)
    return found


def starts(name: str, fitting: Fitting, lines: Sequence[Line]) -> list[Added]:
    """The effect at unit size with every combination of its shapes' starts."""
    orders: tuple[float, ...] = ()
    for term in fitting.terms:
        if isinstance(term, Periodic):
            own = [line for line in lines if line.channel == term.channel and line.order >= 1.0]
            orders = tuple(line.order for line in own[:MOST_ORDERS])
            if not orders:
                return []
    count = len(signed(fitting, len(orders)))
    return [
        Added(name, fitting, (1.0,) * count, tuple(shapes), orders)
        for shapes in product(*(shape.starts for shape in fitting.shapes))
    ]


def behind_sensor(bench: Bench, state: State, name: str, fitting: Fitting) -> bool:
    """Whether an effect acts on the output, in records whose load is what the output's torque sensor reads.

    Such an effect changes the torque that the sensor has measured already, so it cannot be missing there.
    """
    first = bench.predictors[0]
    if first.plan.load != "output_torque":
        return False
    for added in starts(name, fitting, ())[:1]:
        try:
            without = first.predict(state.candidate())
            tried = replace(state, added=(*state.added, added))
            there = first.predict(tried.candidate())
        except PredictionError:
            return True
        torque = float(np.std(there["output_torque"] - without["output_torque"])) / abs(first.ratio)
        motor = float(np.std(there.get("motor_torque", np.zeros(1)) - without.get("motor_torque", 0.0)))
        return torque > 0.5 * motor and torque > 0.0
    return False


def traces(bench: Bench, state: State, predictions: Sequence[Array], added: Added) -> Array | None:
    """Change of the whitened predictions for each coefficient at 1 alone, shape (rows, k)."""
    columns = []
    before = predictions
    for k in range(len(added.coefficients)):
        below = 1.0 if added.fitting.cumulative else 0.0
        unit = tuple(1.0 if j == k else below if j < k else 0.0 for j in range(len(added.coefficients)))
        tried = replace(state, added=(*state.added, replace(added, coefficients=unit)))
        try:
            there = bench.predict(tried.candidate(), tried.gain)
        except PredictionError:
            return None
        columns.append(trace(bench, before, there))
        if added.fitting.cumulative:
            before = there
    return np.column_stack(columns)


def _allowed(residual: Residual, columns: Array, free: list[bool]) -> Share:
    """The share with coefficients of the allowed sign: a wrong one is left out."""
    use = [True] * columns.shape[1]
    while True:
        kept = np.array(use)
        share = residual.share(columns * kept)
        wrong = [k for k, c in enumerate(share.coefficients) if use[k] and c < 0 and not free[k]]
        if not wrong:
            return share
        for k in wrong:
            use[k] = False
        if not any(use):
            powers = residual.powers
            return Share(0.0, powers, np.zeros(columns.shape[1]), share.chance)


def name_effect(
    bench: Bench,
    base: Fit,
    screening: Screening,
    *,
    on_step: Callable[[str], object] | None = None,
) -> Named | None:
    """Fit the screen's best in the simulated model and keep the best of them.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        screening: the catalogue on the screen.
        on_step: told what is being fitted.
    """
    best_share = screening.ranked[0].share.share
    shortlist = [one for one in screening.ranked if one.share.share >= NEAR * best_share][:SHORTLIST]
    before = block_losses(bench, base.predictions)
    results: list[tuple[str, Fit, Array]] = []
    for one in shortlist:
        if on_step is not None:
            on_step(f"fitting {one.name}")
        state = replace(base.state, added=(*base.state.added, one.added))
        frees = [free for free in _at_present(base) if free.value > 0]
        try:
            found = fit(bench, state, frees, held_effects=len(base.state.added), evaluations=6, prune=False)
        except (PredictionError, np.linalg.LinAlgError):
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
    for other, _, rest in results[1:]:
        difference = rest - losses
        spread = float(np.sqrt(len(difference)) * difference.std())
        if difference.sum() < 2.0 * spread or difference.sum() < SAME * explained:
            group[other] = float((before - rest).sum()) / explained
    return Named(name, found, losses, group, _confidence(results, {name, *group}))


def _at_present(base: Fit) -> list[Free]:
    """The base's free numbers at their fitted values."""
    return [
        replace(free, value=free.value * float(np.exp(t)))
        for free, t in zip(base.frees, base.theta, strict=True)
    ]


def block_losses(bench: Bench, predictions: Sequence[Array]) -> Array:
    """Power of the whitened training residual in each block, shape (blocks,)."""
    rest = bench.stacked(bench.residuals(predictions))
    return np.asarray(np.bincount(bench.stacked_blocks(), rest**2, bench.blocks), dtype=float)


def _confidence(results: list[tuple[str, Fit, Array]], group: set[str], draws: int = 400) -> float:
    losses = np.stack([rest for _, _, rest in results])
    rng = np.random.default_rng(3)
    picks = rng.integers(0, losses.shape[1], size=(draws, losses.shape[1]))
    best = np.argmin(losses[:, picks].sum(axis=2), axis=0)
    return float(np.mean([results[int(k)][0] in group for k in best]))
