"""Steps 4 to 6 in turn: locate, name, add, until nothing significant is left.

The first names are given while other effects are still missing, so each is asked again once there are
several: the model without it, but with all others, is screened anew, and the best effect there takes its
place or, when nothing significant is missing there, none does. The torques' delays are fitted when nothing
more is found, and all is asked once more when they have explained something.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdsim.diagnose.locate import Line, Location, locate, order_lines
from hdsim.diagnose.name import (
    LEAST_SHARE,
    LEVEL,
    SAME,
    Named,
    confusable,
    name_effect,
)
from hdsim.diagnose.screen import Residual
from hdsim.diagnose.traces import Screening, screen
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, fit
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import align, reweigh, with_delays
from hdsim.estimate.state import State

#: Most effects that one diagnosis adds, and most passes that it makes.
MOST_EFFECTS, MOST_STAGES = 4, 7
#: Part of a channel's first residual that a later effect must explain; more where it can look like what an
#: effect that is there already leaves, because the true formula is never quite the catalogue's.
LATER_SHARE, LATER_ALIKE = 0.02, 0.1
#: The first of these for a sharp line in a shaft's angle where no other effect has one, which no formula's
#: misfit leaves, and the part of what is left of its channel that it must hold.
LINE_SHARE, LINE_LEFT = 0.005, 0.03
#: Part of what is left by which it must have fallen for the last name to be asked again.
NEWS = 0.1

Step = Callable[[str], object]


@dataclass
class Stage:
    """One pass of locate and name."""

    title: str
    location: Location
    screening: Screening | None = None
    named: Named | None = None


@dataclass
class Search:
    """What a search found: its passes, the effects in the order of ``fit.state.added``, the last fit."""

    fit: Fit
    left: Residual
    stages: list[Stage] = field(default_factory=list)
    named: list[Named] = field(default_factory=list)


def search(bench: Bench, base: Fit, during: Callable[[str, str], Step]) -> Search:
    """Add effects until nothing significant is left.

    Args:
        bench: the measured series, weighed.
        base: the re-fitted model.
        during: told the step that begins and what it does; returns who is told the details.
    """
    found = Search(base, left_of(bench, base))
    while True:
        following = _next(bench, base, found, during)
        if following is not None:
            found.fit = following
            continue
        late = with_delays(bench, found.fit)
        if late is None:
            return found
        noise = sum(bench.noise_powers.values())
        left, now = (bench.power(each.predictions) - noise for each in (found.fit, late))
        found.fit = late
        if now > (1.0 - NEWS) * left or len(found.stages) == MOST_STAGES:
            return found
        # What a delay has blurred may show now.
        align(bench, found.fit)
        reweigh(bench, found.fit)


def _next(bench: Bench, base: Fit, found: Search, during: Callable[[str, str], Step]) -> Fit | None:
    """The model with one more effect; None when nothing significant is left, or nothing that matters."""
    current = found.fit
    title = "refit" if not found.named else f"with {found.named[-1].name}"
    during("locate", f"locating what is left {title}")
    found.left = left_of(bench, current)
    stage = Stage(title, locate(bench, found.left, bench.residuals(current.predictions)))
    found.stages.append(stage)
    # Names that take each other's place would go on for ever.
    if len(found.named) == MOST_EFFECTS or len(found.stages) == MOST_STAGES:
        return None
    sharp = _sharp(stage.location.lines, found.named)
    if found.named and not _more_could(bench, base, current, sharp):
        return None
    tell = during("screen", "screening the catalogue")
    stage.screening = screen(
        bench, current.state, found.left, stage.location.lines,
        places=stage.location.places, on_step=tell,
    )  # fmt: skip
    ranked = stage.screening.ranked
    if not ranked or stage.screening.chance > LEVEL:
        return None
    if not found.named and ranked[0].share.share < LEAST_SHARE:
        return None
    tell = during("fit", "fitting the shortlist")
    places = stage.location.places
    named = name_effect(
        bench, current, stage.screening, found.left,
        coordinate=places[0].coordinate if places else "", on_step=tell,
    )  # fmt: skip
    if named is None or not _matters(bench, base, current, named, found.named, sharp):
        return None
    stage.named = named
    found.named.append(named)
    current = named.fit
    align(bench, current)
    reweigh(bench, current)
    if len(found.named) > 1:
        tell = during("again", "asking each name again beside the others")
        current = _again(bench, base, _together(bench, current), found, tell)
        align(bench, current)
        reweigh(bench, current)
    return current


def _sharp(lines: Sequence[Line], named: list[Named]) -> set[str]:
    """Channels in which a line holds much of what is left, and no named effect but a sensor's can have it."""
    if any(catalogue()[one.name].signature.orders for one in named if one.name != "sensors"):
        return set()
    return {line.channel for line in lines if line.share >= LINE_LEFT and line.order >= 1.0}


def _more_could(bench: Bench, base: Fit, now: Fit, sharp: Container[str]) -> bool:
    """Whether more than noise is left in some channel, enough for one more effect to matter."""
    first, last = (bench.channel_powers(each.predictions) for each in (base, now))
    noise = bench.noise_powers
    return any(last[c] - noise[c] >= (LINE_SHARE if c in sharp else LATER_SHARE) * first[c] for c in first)


def _matters(
    bench: Bench, base: Fit, before: Fit, new: Named, others: list[Named], sharp: Container[str] = ()
) -> bool:
    """Whether an effect explains enough beside what was there first, in one channel at least."""
    alike = any(
        (confusable(new.name, other.name) and _channel(new.name) == _channel(other.name))
        or new.name in other.group
        for other in others
    )
    least = dict.fromkeys(bench.channels, LATER_ALIKE if alike else LATER_SHARE)
    if new.fit.state.added[-1].orders:
        least |= {c: LINE_SHARE for c in least if c in sharp}
    first, last, now = (bench.channel_powers(each.predictions) for each in (base, before, new.fit))
    return not others or max(last[c] - now[c] - least[c] * first[c] for c in first) >= 0


def _channel(name: str) -> str:
    """The channel in which an effect shows most."""
    return catalogue()[name].signature.channels[0]


def _together(bench: Bench, found: Fit, state: State | None = None) -> Fit:
    """All numbers fitted together: the base's and those of all effects."""
    return fit(bench, state or found.state, at_present(found), prune=False, beside=found.beside)


def _again(bench: Bench, base: Fit, current: Fit, found: Search, tell: Step) -> Fit:
    """Ask every name again; ``found.named`` is changed in place.

    The last one was asked beside the others, and is so again only where they have changed since, or where it
    has gone to the end of its range.
    """
    first = bench.power(current.predictions)
    k = 0
    while k < len(found.named):
        stuck = current.state.added[k].at_limit
        settled = bench.power(current.predictions) > (1.0 - NEWS) * first
        if k == len(found.named) - 1 and settled and not stuck:
            break
        own = found.named[k]
        added = list(current.state.added)
        others = added[:k] + added[k + 1 :]
        try:
            without = _together(bench, current, replace(current.state, added=tuple(others)))
        except (PredictionError, np.linalg.LinAlgError):
            k += 1
            continue
        left = left_of(bench, without)
        lines: list[Line] = []
        residuals = bench.residuals(without.predictions)
        for channel in bench.channels:
            lines += order_lines(bench, residuals, channel)
        tell(f"{own.name} again")
        screening = screen(bench, without.state, left, lines)
        named = None
        if screening.ranked and screening.chance <= LEVEL:
            named = name_effect(bench, without, screening, left, on_step=tell)
        rest = found.named[:k] + found.named[k + 1 :]
        if named is None or not _matters(bench, base, without, named, rest, _sharp(lines, rest)):
            # The others explain what it did.
            found.named.pop(k)
            current = without
            continue
        loss, now = bench.power(current.predictions), bench.power(named.fit.predictions)
        same = named.name == own.name or own.name in named.group
        if same or stuck or now < (1.0 - SAME) * loss:
            own = named if named.name == own.name or not same or stuck else own
            if own is named:
                # It was fitted last: back to its place.
                fitted = named.fit.state.added[-1]
                state = replace(named.fit.state, added=(*others[:k], fitted, *others[k:]))
                current = _together(bench, named.fit, state)
            else:
                own.group = {name: part for name, part in named.group.items() if name != own.name}
                own.group[named.name] = 1.0
            found.named[k] = own
        k += 1
    return current


def left_of(bench: Bench, current: Fit) -> Residual:
    """The whitened residual without what the model's own numbers and the sensors' offsets explain."""
    numbers = bench.stacked_series()
    offsets = (numbers[:, None] == np.unique(numbers)[None, :]).astype(float)
    unwound = [column[:, None] for column in bench.unwound(current.state, current.predictions).values()]
    # A delay of a few samples takes little, but without its bounds it would take all that lags.
    own = [k for k in range(current.columns.shape[1]) if k >= len(current.frees) or not current.frees[k].step]
    columns: Array = np.hstack([current.columns[:, own], offsets, *unwound])
    return Residual(bench.stacked(bench.residuals(current.predictions)), columns, bench.stacked_blocks())
