"""The evidence of a search, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdsim.diagnosis.beyond import shown_in
from hdsim.diagnosis.decide import WORSE
from hdsim.diagnosis.evidence import (
    Evidence,
    HeldOutEvidence,
    LawEvidence,
    PlaceEvidence,
    RestEvidence,
    StageEvidence,
)
from hdsim.diagnosis.held import held_of, law_of, own_held
from hdsim.diagnosis.locate import Location
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.passes import Search, Stage
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.flanks import nothing_but_flanks, only_flanks
from hdsim.estimate.found import Gap
from hdsim.estimate.records import Array
from hdsim.estimate.refit import Refit
from hdsim.estimate.state import Added

#: Places of a stage that are kept.
PLACES = 12


def collect(
    bench: Bench,
    base: Refit,
    found: Search,
    gap: Mapping[str, Gap],
    predictions: Mapping[str, Sequence[Array]],
) -> Evidence:
    """All that a verdict may rest on.

    Args:
        bench: the measured series.
        base: the re-fit.
        found: what the search found.
        gap: held-out gaps of the model as given, re-fitted and with all effects.
        predictions: of all series by these three models.
    """
    last = found.stages[-1].location
    explained = bench.power(base.fit.predictions) - bench.power(found.fit.predictions)
    left = last.structured * found.left.power
    project = found.left.project
    shown = shown_in(bench, found.fit)
    held = held_of(bench, predictions["refit"], predictions["after"]) if found.named else HeldOutEvidence()
    changed = (
        held_of(bench, predictions["before"], predictions["after"]) if found.named else HeldOutEvidence()
    )
    may_hold = float(np.clip(held.slope + WORSE * held.spread, 0.0, 1.0))
    power = bench.power(base.fit.predictions)
    return Evidence(
        stages=[_stage(stage) for stage in found.stages],
        laws=[
            _law(
                one,
                found.fit.state.added[k],
                shown[k] or catalogue()[one.name].signature.channels,
                last,
                explained if len(found.named) == 1 else one.worth,
                own_held(bench, one.less, predictions["after"]),
            )
            for k, one in enumerate(found.named)
        ],
        explained=max(explained, 0.0) / max(max(explained, 0.0) + left, 1e-300),
        left=last.structured,
        left_chance=1.0 if only_flanks(bench, left, project) else last.chance,
        held=held,
        changed=changed,
        patterned=(left + may_hold * max(explained, 0.0)) / max(power, 1e-300),
        rest=None
        if nothing_but_flanks(bench, found.left.power, project)
        else _rest(bench, found.fit.predictions),
        rest_before=_rest(bench, base.fit.predictions),
        fell=_fell(gap),
        moved=[i.name for i in base.moved],
    )


def _fell(gap: Mapping[str, Gap]) -> float:
    """Largest relative fall of a gap by the re-fit, if all together are better for it."""
    known = [g for g in gap.values() if g.before > 0 and g.noise > 0]
    before, refit = (sum((getattr(g, at) / g.noise) ** 2 for g in known) for at in ("before", "refit"))
    return max((1.0 - g.refit / g.before for g in known), default=0.0) if refit < before else 0.0


def _stage(stage: Stage) -> StageEvidence:
    location = stage.location
    return StageEvidence(
        title=stage.title,
        power=stage.power,
        structured=location.structured,
        structured_chance=location.chance,
        chance=stage.screening.chance if stage.screening else 1.0,
        places=[
            PlaceEvidence(
                coordinate=place.coordinate,
                channel=place.channel,
                share=place.share,
                power=place.share * location.powers[place.channel],
            )
            for place in location.places[:PLACES]
        ],
        candidates=stage.named.candidates if stage.named else [],
        named=stage.named.name if stage.named else "",
    )


def _law(
    one: Named,
    added: Added,
    channels: Sequence[str],
    last: Location,
    worth: float,
    held: HeldOutEvidence | None,
) -> LawEvidence:
    own = max(_own(added, channels, last), 0.0)
    of_the_last = {
        "group": list(one.group),
        "own_left": own / max(own + max(worth, 0.0), 1e-300),
        "own_first": _own_first(added, channels, last),
        "at_limit": added.at_limit,
    }
    return law_of(one, added, one.needed, held).model_copy(update=of_the_last)


def _own_first(added: Added, channels: Sequence[str], location: Location) -> bool:
    """Whether an effect's own coordinate holds more than any other of what is left where it shows."""
    places = [place for place in location.places if place.channel in channels]
    best = max(places, key=lambda place: place.share * location.powers[place.channel], default=None)
    return best is None or best.coordinate == added.lives_in[0]


def _own(added: Added, channels: Sequence[str], location: Location) -> float:
    """Whitened power of a residual that lives in an effect's own coordinate, in channels it shows in."""
    found: dict[str, float] = {}
    for place in location.places:
        if place.coordinate == added.lives_in[0] and place.channel in channels:
            power = place.share * location.powers[place.channel]
            found[place.channel] = max(found.get(place.channel, 0.0), power)
    return sum(found.values())


def _rest(bench: Bench, predictions: Sequence[Array]) -> RestEvidence | None:
    """The training channel that is left with most beyond its noise."""
    worst: RestEvidence | None = None
    for series, residual in zip(bench.series, bench.residuals(predictions, drift=True), strict=True):
        if series.record >= bench.training or not series.train.any() or series.noise <= 0:
            continue
        if bench.of_the_load(series):
            continue
        # In units of a single reading's noise, however many a sample is the mean of.
        beyond = float(np.mean(residual[series.train] ** 2)) - series.noise**2
        times = float(np.sqrt(max(1.0 + beyond / series.reading**2, 0.0)))
        if worst is None or times > worst.times_noise:
            name = bench.predictors[series.record].record.name
            worst = RestEvidence(record=name, channel=series.channel, times_noise=times)
    return worst
