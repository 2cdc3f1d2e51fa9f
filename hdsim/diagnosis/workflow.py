"""The whole diagnosis: check, compare, re-fit, then locate, name and add until nothing is left, and prove."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from hdsim.diagnosis.collect import collect
from hdsim.diagnosis.curve import CurveFit, fit_curve
from hdsim.diagnosis.decide import Decision, decide
from hdsim.diagnosis.evidence import Evidence
from hdsim.diagnosis.locate import SHARP
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.remainder import remainder
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.search import Search, Stage, search
from hdsim.diagnosis.verdict import Located, NamedEffect, Verdict
from hdsim.effects import catalogue
from hdsim.errors import InputError
from hdsim.estimate.baseline import trees, with_baselines
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Check
from hdsim.estimate.fit import Fit, added_spreads, base_intervals
from hdsim.estimate.found import DataProblem, FittedNumber
from hdsim.estimate.numbers import Interval
from hdsim.estimate.offsets import Zeros
from hdsim.estimate.one_thread import one_blas_thread
from hdsim.estimate.opening import bench_for, checked, locked_side
from hdsim.estimate.plan import LoadSource
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.prove import borne_out, gaps
from hdsim.estimate.records import Array, Record
from hdsim.estimate.refit import Refit, refit, tie, together
from hdsim.estimate.short_cut import short_cut_of
from hdsim.estimate.state import State, state_of
from hdsim.estimate.suspect import delays, moving_zeros, one_way, suspicions
from hdsim.estimate.thin import readings_of_means
from hdsim.estimate.write import fitted_numbers, scenario_changes

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

#: Part of a curve's promise that held-out data must show: nearer to all of it than to none.
HALF = 0.5
#: Least part of the structure that is said to follow another shape than its law's.
LEAST_REST = 0.02


@dataclass
class Diagnosis:
    """Everything that a diagnosis found; ``verdict`` is its summary, and rests on ``evidence`` alone."""

    verdict: Verdict
    evidence: Evidence
    checks: list[Check]
    bench: Bench
    refit: Refit
    stages: list[Stage]
    named: list[Named]
    final: Fit
    start: State
    predictions: dict[str, list[Array]] = field(default_factory=dict)

    @property
    def changes(self) -> dict[str, Any]:
        """What was fitted and what was added, for ``Scenario.with_``; not the gain of a torque's reading."""
        state = self.final.state
        effects = state.merged_effects()
        own = scenario_changes(state, self.refit.freedoms, self.start)
        return {f"effects.{one.effect}": effects[one.effect] for one in state.added} | own

    def _repr_html_(self) -> str:
        from hdsim.notebook import diagnosis_html

        return diagnosis_html(self)


def diagnose(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    *,
    holdout: Sequence[Recording | Record] = (),
    load: LoadSource | None = None,
    zeros: Zeros = "campaign",
    force: bool = False,
    black_box: bool = False,
    on_step: Callable[[str], object] | None = None,
) -> Diagnosis:
    """Find what a model is missing.

    Args:
        measured: records that fits may see.
        scenario: the model; what it commands does not matter, its motion is the measured one.
        holdout: records that only the proof sees; parts of ``measured`` when there are none.
        load: where the load's torque comes from; ``output_torque`` takes what the joint's sensor measures.
        zeros: whether a torque sensor has one zero in all records, or was zeroed before each.
        force: go on in spite of errors in the data.
        black_box: learn the same samples by gradient boosting too, to see what is left to be learnt.
        on_step: told what is being done.

    Returns:
        The diagnosis with its verdict.

    Raises:
        InputError: the data cannot answer the question, or are suspect (see ``force``), or a black box is
            asked for without scikit-learn.
    """
    if black_box:
        trees()
    with one_blas_thread():
        tell = on_step or (lambda _: None)
        return _diagnosed(measured, scenario, holdout, load, zeros, force, black_box, tell)


def _diagnosed(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    holdout: Sequence[Recording | Record],
    load: LoadSource | None,
    zeros: Zeros,
    force: bool,
    black_box: bool,
    tell: Callable[[str], object],
) -> Diagnosis:
    """See ``diagnose``."""
    seconds: dict[str, float] = {}

    @contextlib.contextmanager
    def step(name: str, text: str) -> Iterator[None]:
        tell(text)
        started = time.process_time()
        yield
        seconds[name] = round(seconds.get(name, 0.0) + time.process_time() - started, 3)

    with step("check", "checking the data"):
        records, held, checks = checked(measured, scenario, holdout=holdout, force=force)
        problems = [problem for check in checks for problem in check.problems]
    start = state_of(scenario)
    with step("compare", "predicting the measured channels"):
        readings = readings_of_means([*records, *held], load=load, locked=locked_side(scenario))
        bench = bench_for(records, held, scenario, load, readings=readings, zeros=zeros)
    with step("refit", "re-fitting the model's own numbers"):
        try:
            base = refit(bench, start)
        except PredictionError as error:
            names = ", ".join(record.name for record in records)
            raise InputError(f"{names}: the model cannot follow the measured motion: {error}") from None

    running = contextlib.ExitStack()

    def during(name: str, text: str) -> Callable[[str], object]:
        running.close()
        running.enter_context(step(name, text))
        return tell

    with running:
        found = search(bench, base.fit, during)
    states = {"before": start, "refit": base.fit.state, "after": found.fit.state}
    with step("prove", "proving on held-out data"):
        gap, predictions = gaps(bench, states)
    evidence = collect(bench, base, found, gap, predictions)
    decision = decide(evidence)
    current, named = found.fit, [found.named[k] for k in decision.names]
    if len(named) < len(found.named):
        # What is not believed is not in the model either.
        current = _only(bench, base, found, decision.names)
    unknown = decision.kind == "unknown"
    curve: CurveFit | None = None
    place = (found.stages[0] if unknown else found.stages[-1]).location
    if unknown or (named and evidence.left_chance <= RULES.chance):
        # What has no name, or what the names leave of their own, is a curve.
        with step("curve", "fitting the curve of what has no name"):
            curve = fit_curve(bench, current, place, on_step=tell)
    if unknown and curve is not None:
        with step("prove", "proving on held-out data"):
            _, there = gaps(bench, states | {"after": curve.fit.state})
            curve = curve if borne_out(bench, there)[0] >= HALF else None
        current = curve.fit if curve is not None else current
    if current is not found.fit:
        with step("prove", "proving on held-out data"):
            gap, predictions = gaps(bench, states | {"after": current.state})
    with step("prove", "proving on held-out data"):
        gap = with_baselines(bench, start, gap, black_box=black_box)
    # Of the final model: what the re-fit alone had bent, effects and a curve may have set right.
    doubts = suspicions(bench, replace(base, fit=current), start)
    problems += [*doubts, *one_way(bench), *moving_zeros(bench, current.predictions)]
    intervals = base_intervals(current, base.freedoms)
    intervals += [i for i in base.intervals if i.name not in {j.name for j in intervals}]
    problems += delays(bench, intervals)
    moved = [i for i in intervals if i.moved]
    off = moved
    if decision.kind == "parameter" and not moved:
        off = tie(bench, base.before, current, intervals)
        if not off:
            decision.kind = "nothing"
    common: dict[str, Any] = {
        "parameters": {i.name: _number(i) for i in intervals},
        "moved": [i.name for i in off],
        "gap": gap,
        "located": _located(found.stages),
        "data_problems": [DataProblem(**vars(problem)) for problem in problems],
        "not_tried": found.stages[0].screening.skipped if found.stages[0].screening else {},
        "confidence": decision.certainty,
        "because": decision.because,
        "curve": curve.found() if curve is not None else None,
        "readings": readings,
        "short_cut": short_cut_of(bench, current.predictions, predictions["after"]),
        "seconds": seconds,
    }
    patterned = evidence.left_chance <= RULES.chance and evidence.left >= RULES.structured
    noisy = evidence.rest is not None and evidence.rest.times_noise > RULES.rest
    if unknown and (evidence.laws or patterned or not noisy):
        verdict = _without_a_name(found.stages, evidence, common)
    elif unknown:
        verdict = _without_a_place(bench, found.fit, common)
    elif named:
        effects = _effects(named, decision, current)
        words = " and ".join(_words(effect) for effect in effects)
        sentence = f"The model is missing {words}.{_rest_words(found.stages[-1], evidence)}"
        verdict = Verdict(verdict="effect", sentence=sentence, effects=effects, **common)
    elif decision.kind == "parameter":
        verdict = _numbers_off(off, common, sure=bool(moved))
    else:
        verdict = Verdict(verdict="nothing", sentence="The data show nothing that the model lacks.", **common)
    if doubts:
        words = "; ".join(f"{doubt.record}: {doubt.channel} {doubt.message}" for doubt in doubts)
        verdict.sentence = f"Check the data first: {words}. {verdict.sentence}"
    return Diagnosis(verdict, evidence, checks, bench, base, found.stages, named, current, start, predictions)


def _only(bench: Bench, base: Refit, found: Search, believed: Sequence[int]) -> Fit:
    """The model with the believed effects only, fitted anew."""
    if not believed:
        return base.fit
    added = tuple(found.fit.state.added[k] for k in believed)
    return together(bench, found.fit, replace(found.fit.state, added=added))


def _without_a_name(stages: Sequence[Stage], evidence: Evidence, common: Mapping[str, Any]) -> Verdict:
    place = max(stages, key=lambda stage: stage.location.structured).location.places[0]
    nearest = ", ".join(law.name.replace("_", " ") for law in evidence.laws)
    said = f"; nearest: {nearest}, {100 * evidence.explained:.0f} % of the structure" if nearest else ""
    return Verdict(
        verdict="unknown",
        sentence="Something is missing that nothing in the catalogue explains well enough to be named: "
        f"{100 * place.share:.0f} % of what is left of {place.channel} is a function of "
        f"{place.coordinate.replace('_', ' ')}{said}.",
        suspects={law.name: round(law.gain, 3) for law in evidence.laws},
        **common,
    )


def _without_a_place(bench: Bench, last: Fit, common: Mapping[str, Any]) -> Verdict:
    rest = remainder(bench, last.predictions)
    assert rest is not None  # the evidence has said so
    return Verdict(
        verdict="unknown",
        sentence=f"Something is missing that nothing in the catalogue explains: {rest.channel} of "
        f"{rest.record} is left with up to {rest.times_noise:.2g} times its noise, most of it "
        f"between {rest.start_s:.3g} and {rest.end_s:.3g} s, and a function of no coordinate that "
        "these data repeat.",
        remainder=rest,
        **common,
    )


def _rest_words(last: Stage, evidence: Evidence) -> str:
    """What the names leave, with its place; nothing where it may be chance."""
    left = 1.0 - evidence.explained
    if evidence.left_chance > RULES.chance or left < LEAST_REST or not last.location.places:
        return ""
    place = last.location.places[0]
    coordinate = place.coordinate.replace("_", " ")
    return f" {100 * left:.0f} % of the structure follows another shape, over the {coordinate}."


def _numbers_off(off: Sequence[Interval], common: Mapping[str, Any], *, sure: bool) -> Verdict:
    changes = [f"{i.name} {i.value:.4g} instead of {i.start:.4g} {i.unit}".rstrip() for i in off]
    said = f"numbers of the model are off: {', '.join(changes)}."
    if not sure:
        said = f"a number of the model is off, most simply {' or '.join(i.name for i in off)}."
    return Verdict(verdict="parameter", sentence=f"No effect is missing; {said}", **common)


def _number(interval: Interval) -> FittedNumber:
    bounds = (interval.low, interval.high) if interval.determined else None
    return FittedNumber(value=interval.value, interval=bounds, start=interval.start, tied_to=interval.tied_to)


def _effects(named: Sequence[Named], decision: Decision, final: Fit) -> list[NamedEffect]:
    known = catalogue()
    found = []
    chances = [decision.confidence[k] for k in decision.names]
    spreads = added_spreads(final)
    for one, confidence, (added, covariance, shapes) in zip(named, chances, spreads, strict=True):
        confused = known[one.name].signature.confused_with
        found.append(
            NamedEffect(
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


def _words(effect: NamedEffect) -> str:
    others = [catalogue()[name].title for name in effect.indistinguishable_from]
    return f"{effect.title} (these data cannot tell it from {', '.join(others)})" if others else effect.title


def _located(stages: Sequence[Stage], most: int = 6) -> list[Located]:
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
