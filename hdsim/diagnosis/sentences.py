"""What a verdict says: its sentences and the effects, parameters and regressors that it lists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hdsim.diagnosis.decide import Decision
from hdsim.diagnosis.evidence import Evidence
from hdsim.diagnosis.locate import SHARP
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.passes import Stage
from hdsim.diagnosis.remainder import remainder
from hdsim.diagnosis.verdict import IdentifiedEffect, Located, Remains, Verdict
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, added_spreads
from hdsim.estimate.found import ParameterEstimate
from hdsim.estimate.numbers import Interval
from hdsim.estimate.write import fitted_numbers


def without_a_name(stages: Sequence[Stage], evidence: Evidence, common: Mapping[str, Any]) -> Verdict:
    """``unknown``, with what the residual depends on and the closest effects."""
    place = max(stages, key=lambda stage: stage.location.structured).location.places[0]
    nearest = ", ".join(law.name.replace("_", " ") for law in evidence.laws)
    share = f"{100 * evidence.explained:.0f} % of the systematic residual"
    said = f"; closest: {nearest}, {share}" if nearest else ""
    return Verdict(
        verdict="unknown",
        sentence="An effect is missing, and none of the catalogue explains enough to be identified: "
        f"{100 * place.share:.0f} % of the residual of {place.channel} is a function of "
        f"{place.coordinate.replace('_', ' ')}{said}.",
        suspects={law.name: round(law.gain, 3) for law in evidence.laws},
        **common,
    )


def without_a_place(bench: Bench, last: Fit, common: Mapping[str, Any]) -> Verdict:
    """``unknown``, where the residual depends on nothing that the data repeat."""
    rest = remainder(bench, last.predictions)
    assert rest is not None  # the evidence has said so
    return Verdict(
        verdict="unknown",
        sentence="An effect is missing that no effect of the catalogue explains: the residual of "
        f"{rest.channel} in {rest.record} reaches {rest.times_noise:.2g} times its noise, most of it "
        f"between {rest.start_s:.3g} and {rest.end_s:.3g} s, and is a function of no regressor that "
        "these data repeat.",
        remainder=rest,
        **common,
    )


def rest_words(remains: Remains | None) -> str:
    """What the names leave, with what it depends on; nothing where it may be chance."""
    if remains is None:
        return ""
    coordinate = remains.coordinate.replace("_", " ")
    return f" {100 * remains.share:.0f} % of the systematic residual remains, a function of the {coordinate}."


def numbers_off(off: Sequence[Interval], current: Fit, common: Mapping[str, Any]) -> Verdict:
    """``parameter``, with those that are wrong."""
    changes = [f"{i.name} {i.value:.4g} instead of {i.start:.4g} {i.unit}".rstrip() for i in off]
    said = f"parameters of the model are wrong: {', '.join(changes)}.{_or_in_series(off, current)}"
    if not all(i.moved for i in off):
        said = f"a parameter of the model is wrong, most simply {' or '.join(i.name for i in off)}."
    return Verdict(verdict="parameter", sentence=f"No effect is missing; {said}", **common)


def _or_in_series(off: Sequence[Interval], current: Fit) -> str:
    """What would look the same as a spring that is softer than is likely: by two spreads of its prior."""
    names = {interval.name for interval in off}
    softer = any(
        free.compliance and free.name in names and float(t) - free.none < -2.0 * free.prior
        for free, t in zip(current.frees, current.theta, strict=True)
    )
    if not softer:
        return ""
    kinds = [kind for kind in catalogue().values() if any(f.in_series for f in getattr(kind, "fittings", ()))]
    return f" A compliance in series would look the same: {', '.join(kind.title for kind in kinds)}."


def fitted_number(interval: Interval) -> ParameterEstimate:
    """A fitted parameter as the verdict lists it."""
    bounds = (interval.low, interval.high) if interval.determined else None
    return ParameterEstimate(
        value=interval.value, interval=bounds, start=interval.start, tied_to=interval.tied_to
    )


def named_effects(named: Sequence[Named], decision: Decision, final: Fit) -> list[IdentifiedEffect]:
    """The effects that a decision names, as the verdict lists them."""
    known = catalogue()
    found = []
    chances = [decision.confidence[k] for k in decision.names]
    spreads = added_spreads(final)
    for one, confidence, (added, covariance, shapes) in zip(named, chances, spreads, strict=True):
        confused = known[one.name].signature.confused_with
        found.append(
            IdentifiedEffect(
                name=one.name,
                title=" ".join(
                    [known[one.name].title, f"({added.fitting.label})" if added.fitting.label else ""]
                ).strip(),
                confidence=confidence,
                chance=one.chance,
                explained=one.share,
                parameters=fitted_numbers(added, covariance, shapes),
                settings=added.settings(),
                indistinguishable_from=list(one.group),
                separated_by={
                    other: confused.get(other) or known[other].signature.confused_with.get(one.name, "")
                    for other in one.group
                },
            )
        )
    return found


def effect_words(effect: IdentifiedEffect) -> str:
    """An effect's title, with those that the data cannot distinguish from it."""
    others = [catalogue()[name].title for name in effect.indistinguishable_from]
    alike = f"{effect.title} (not distinguishable with these data from {', '.join(others)})"
    return alike if others else effect.title


def located(stages: Sequence[Stage], most: int = 6) -> list[Located]:
    """The strongest regressors of each stage, and every order."""
    found = []
    for stage in stages:
        best: dict[tuple[str, str], Located] = {}
        for place in stage.location.places:
            key = (place.coordinate, place.channel)
            if key in best or place.share < 0.02 or (len(best) >= most and place.coordinate != SHARP):
                continue
            orders = [line.order for line in stage.location.lines if line.channel == place.channel]
            best[key] = Located(
                stage=stage.title,
                coordinate=place.coordinate,
                channel=place.channel,
                share=round(place.share, 4),
                orders=orders if place.coordinate == SHARP else [],
            )
        found += list(best.values())
    return found
