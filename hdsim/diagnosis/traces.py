"""Step 5a, the fast screen: the trace of every effect of the catalogue, and how much of the rest it explains.

Every effect is simulated in the re-fitted model, at a size that suits the residual; the change of all
channels together is its trace. The cross-validated share of the residual that it explains ranks it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdsim.diagnosis.behind import behind_sensor
from hdsim.diagnosis.designs import traces
from hdsim.diagnosis.locate import Place
from hdsim.diagnosis.remembered import Traces, key_of, remembered
from hdsim.diagnosis.screen import LEVEL, Residual, Share, chance_of
from hdsim.diagnosis.starts import neighbours, starts
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.orders import Line
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State, number_at

#: Starts that are many, and the share of a channel below which nothing lives in a coordinate.
MANY, TRACELESS = 6, 2e-3
#: Times that the shapes of the effects that explain most are refined, and the part of the best share for it.
REFINED, REFINABLE = 2, 0.1
#: Part of its best fitting's share that another kind of fitting must reach to be fitted too.
KINDRED = 0.8


@dataclass
class Screened:
    """An effect on the screen: the fitting of it that explains most, and its trace, shape (rows, k).

    ``others`` are fittings of other kinds that explain nearly as much, or are in series with the drive's own.
    """

    name: str
    added: Added
    share: Share
    columns: Array
    others: list[Screened] = field(default_factory=list)


@dataclass
class Screening:
    """The whole catalogue on the screen.

    Attributes:
        ranked: by falling share, one entry an effect.
        chance: probability that the search finds the best share where nothing is missing.
        skipped: effects that could not be tried, with the reason.
        seen: traces that were simulated, whitened with ``sigmas``, by what was asked for (``key_of``):
            effect, way of fitting with its units and settings, shapes. Units that were used may be others.
        sigmas: of every series when they were.
        state: the model in which they were.
        behind: whether a way of fitting an effect acts behind the sensor whose reading is the load.
    """

    ranked: list[Screened] = field(default_factory=list)
    chance: float = 1.0
    skipped: dict[str, str] = field(default_factory=dict)
    seen: Traces = field(default_factory=dict)
    sigmas: Array = field(default_factory=lambda: np.zeros(0))
    state: State | None = None
    behind: dict[tuple[str, str], bool] = field(default_factory=dict)


def screen(
    bench: Bench,
    state: State,
    residual: Residual,
    lines: Sequence[Line],
    *,
    places: Sequence[Place] = (),
    before: Screening | None = None,
    leave_out: Collection[str] = (),
    on_step: Callable[[str], object] | None = None,
) -> Screening:
    """Rank every effect of the catalogue by the share of the residual that its trace explains.

    Args:
        bench: the measured series.
        state: the re-fitted model.
        residual: what it leaves.
        lines: peaks of the order spectra.
        places: where the residual lives; fittings with many starts are left out where theirs shows nothing.
        before: an earlier screening of these data. What an effect does is nearly the same whatever other
            effects the model has by now, so its traces serve again, unless the model's own numbers have moved
            so far that they are others; those that come near are refined anew.
        leave_out: effects that need not be tried, because one that the model has does what they do.
        on_step: told what is being tried.
    """
    found = Screening(sigmas=np.array([series.sigma for series in bench.series]), state=state)
    found.behind = dict(before.behind) if before is not None else {}
    shares: list[Share] = []
    present = set(state.effects) | {added.effect for added in state.added}
    tried: list[Added] = []
    many: list[Added] = []
    ranges = bench.ranges(state)
    measured = bench.measured
    for name, kind in catalogue().items():
        fittings: tuple[Fitting, ...] = getattr(kind, "fittings", ())
        if name in present and not kind.several:
            found.skipped[name] = "the model has it"
            continue
        if name in leave_out:
            found.skipped[name] = "an effect that the model has does the same with fewer numbers"
            continue
        if not fittings:
            continue  # it stands for what has no name
        for fitting in fittings:
            if not fitting.of_mesh(state.toothed):
                continue
            if not fitting.of_channels(measured, bench.channels):
                continue
            if fitting.covered_by and all((number_at(state, path) or 0.0) > 0 for path in fitting.covered_by):
                found.skipped[name] = f"the model has {' and '.join(fitting.covered_by)}"
                continue
            if lacking := [path for path in fitting.beyond if not _has(state, path)]:
                found.skipped[name] = f"the model has no {' and '.join(lacking)} to depart from"
                continue
            if bench.turns < fitting.turns:
                found.skipped[name] = f"the wave generator makes {bench.turns:.2g} turns only"
                continue
            if (name, fitting.label) in {(added.effect, added.fitting.label) for added in state.added}:
                continue
            way = name, fitting.label
            # Where an effect acts is what its formula says, whatever else the model has by now.
            if way not in found.behind:
                found.behind[way] = behind_sensor(bench, state, name, fitting, ranges)
            if found.behind[way]:
                found.skipped[name] = (
                    "acts on the load's side of the torque sensor, whose reading is the load"
                )
                continue
            begins = starts(name, fitting, lines, ranges)
            (tried if len(begins) < MANY else many).extend(begins)
    if on_step is not None:
        on_step(f"{len(tried)} traces")
    kinds: dict[tuple[str, str], Screened] = {}
    wanted = float(np.sqrt(residual.power / max(len(residual.values), 1)))
    with bench.coarse():
        without = bench.predict(state)
        memory = remembered(bench, before, state, without, found.sigmas)

    def look(several: Sequence[Added], *, first: bool = True) -> None:
        # Orders are read from the data each time.
        keys = [key_of(added) for added in several if not added.orders] if first else []
        known = {key: memory[key] for key in keys if key in memory}
        new = [added for added in several if key_of(added) not in known]
        with bench.coarse():
            simulated = traces(bench, state, without, new, wanted)
        keys = [*known, *(key_of(added) for added in new)]
        for key, (added, columns) in zip(keys, [*known.values(), *simulated], strict=True):
            if columns is None or not np.any(columns):
                continue
            if first and not added.orders:
                found.seen[key] = added, columns
            share = _allowed(residual, columns, added.fitting.signed(added.orders))
            shares.append(share)
            way = added.effect, added.fitting.label
            if way not in kinds or share.share > kinds[way].share.share:
                added = replace(added, coefficients=tuple(share.coefficients))
                kinds[way] = Screened(added.effect, added, share, columns)

    look(tried)
    # A residual may live in a coordinate that only an effect's trace shows, as it rings on its way.
    alive = {_home(one.name) for one in kinds.values() if one.share.share > TRACELESS}
    alive |= {place.coordinate for place in places if place.share > TRACELESS}
    look([added for added in many if _home(added.effect) in alive or not places])
    for name in {added.effect for added in many if _home(added.effect) not in alive and places}:
        found.skipped[name] = f"no residual depends on the {_home(name).replace('_', ' ')}"
    for times in range(REFINED):
        most = max((one.share.share for one in kinds.values()), default=0.0)
        worth = [one for one in kinds.values() if one.share.share >= max(REFINABLE * most, 1e-3)]
        look([added for one in worth for added in neighbours(one.added, times)], first=False)
    best: dict[str, Screened] = {}
    for one in sorted(kinds.values(), key=lambda one: -one.share.share):
        first = best.setdefault(one.name, one)
        # Of a compliance the base's own may have taken all that a screen could show.
        kindred = one.share.share >= KINDRED * first.share.share or one.added.fitting.in_series
        if one is not first and kindred:
            first.others.append(one)
    for name in catalogue():
        if name in best:
            found.skipped.pop(name, None)  # one of its ways has been tried
            continue
        found.skipped.setdefault(name, "no effect on these channels, or a channel that it needs is missing")
    found.ranked += best.values()
    _remarkable_first(found, shares)
    return found


def _remarkable_first(found: Screening, shares: Sequence[Share]) -> None:
    """Set the chance of the best; where that may be chance, leave out what ranks above one that is not.

    Each is held against the best of the whole search on surrogates, so asking all of them raises no alarm
    more often than asking the first (single-step, Westfall and Young 1993).
    """
    chances = [chance_of(one.share, shares) for one in found.ranked[:1]]
    if chances and chances[0] > LEVEL:
        chances += [chance_of(one.share, shares) for one in found.ranked[1:] if one.share.share > 0]
        first = next((k for k, chance in enumerate(chances) if chance <= LEVEL), 0)
        found.ranked, chances = found.ranked[first:], chances[first:]
    found.chance = chances[0] if chances else 1.0


def ranked_anew(screening: Screening, residual: Residual) -> Screening:
    """A screening's traces on another residual of the same model."""
    found = Screening(skipped=screening.skipped)
    shares: list[Share] = []
    for one in screening.ranked:
        kinds = []
        for each in (one, *one.others):
            share = _allowed(residual, each.columns, each.added.fitting.signed(each.added.orders))
            shares.append(share)
            added = replace(each.added, coefficients=tuple(share.coefficients))
            kinds.append(Screened(each.name, added, share, each.columns))
        kinds.sort(key=lambda kind: -kind.share.share)
        kinds[0].others = kinds[1:]
        found.ranked.append(kinds[0])
    found.ranked.sort(key=lambda one: -one.share.share)
    _remarkable_first(found, shares)
    return found


def _home(name: str) -> str:
    """The coordinate in which an effect shows most."""
    return catalogue()[name].signature.lives_in[0]


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


def _has(state: State, path: str) -> bool:
    """Whether a model has a number above zero, or an effect has a field of that name that is."""
    _, _, name = path.rpartition(".")
    of_effects = (getattr(effect, name, 0.0) for effect in state.merged_effects().values())
    return any((value or 0.0) > 0 for value in (number_at(state, path), *of_effects))
