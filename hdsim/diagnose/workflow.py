"""The whole diagnosis: check, compare, re-fit, then locate, name and add until nothing is left, and prove."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hdsim.diagnose.curve import CurveFit, fit_curve
from hdsim.diagnose.locate import Location
from hdsim.diagnose.name import LEVEL, Named
from hdsim.diagnose.remainder import remainder
from hdsim.diagnose.search import Stage, search
from hdsim.diagnose.verdict import Located, NamedEffect, Remainder, Verdict
from hdsim.effects import catalogue
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.check import Check, check_record
from hdsim.estimate.fit import Fit, added_spreads, base_intervals
from hdsim.estimate.found import DataProblem, FittedNumber
from hdsim.estimate.numbers import Interval
from hdsim.estimate.predict import LoadSource, PredictionError, predictors
from hdsim.estimate.prove import gaps, kept
from hdsim.estimate.records import Array, Record, record_from
from hdsim.estimate.refit import Refit, refit, tie
from hdsim.estimate.state import State, state_of
from hdsim.estimate.suspect import delays, suspicions
from hdsim.estimate.write import fitted_numbers

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

#: Share of the weighed residual that must be structured for ``unknown``, and the part of all structure that
#: the named effects must explain to be believed; more where they leave most in their own coordinate.
STRUCTURED, ADEQUATE, OWN_ADEQUATE = 0.12, 0.9, 0.95
#: The first of these in the own coordinate of an exact law.
EXACTLY = 0.05
#: How far held-out data must bear out what was added, see ``kept``.
KEPT = 0.5
#: Least relative fall of a held-out gap for the verdict ``parameter``.
LEAST_FALL = 0.03


@dataclass
class Diagnosis:
    """Everything that a diagnosis found; ``verdict`` is its summary.

    ``explained`` is the part of all structure in the re-fitted model's residual that the names explain.
    """

    verdict: Verdict
    checks: list[Check]
    bench: Bench
    refit: Refit
    stages: list[Stage]
    named: list[Named]
    final: Fit
    start: State
    explained: float = 0.0
    predictions: dict[str, list[Array]] = field(default_factory=dict)


def diagnose(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    *,
    holdout: Sequence[Recording | Record] = (),
    load: LoadSource | None = None,
    force: bool = False,
    on_step: Callable[[str], object] | None = None,
) -> Diagnosis:
    """Find what a model is missing.

    Args:
        measured: records that fits may see.
        scenario: the model; what it commands does not matter, its motion is the measured one.
        holdout: records that only the proof sees; parts of ``measured`` when there are none.
        load: where the load's torque comes from; ``output_torque`` takes what the joint's sensor measures.
        force: go on in spite of errors in the data.
        on_step: told what is being done.

    Returns:
        The diagnosis with its verdict.

    Raises:
        InputError: the data cannot answer the question, or are suspect (see ``force``).
    """
    tell = on_step or (lambda _: None)
    seconds: dict[str, float] = {}

    @contextlib.contextmanager
    def step(name: str, text: str) -> Iterator[None]:
        tell(text)
        started = time.perf_counter()
        yield
        seconds[name] = round(seconds.get(name, 0.0) + time.perf_counter() - started, 3)

    ratio = scenario.drive.ratio
    with step("check", "checking the data"):
        records, held = (
            [r if isinstance(r, Record) else record_from(r) for r in many] for many in (measured, holdout)
        )
        if not records:
            raise InputError("no measured record is given")
        checks = [check_record(record, ratio) for record in [*records, *held]]
        problems = [problem for check in checks for problem in check.problems]
        errors = [problem for check in checks for problem in check.errors]
        if errors and not force:
            lines = "\n".join(f"{p.record}: {p.channel}: {p.kind}: {p.message}" for p in errors)
            raise InputError(f"{lines}\nmend the mapping or the data, or go on in spite of it (--force)")
    with step("compare", "predicting the measured channels"):
        locked = scenario.command.output.type == "locked"
        training = predictors(records, ratio, load=load, output_locked=locked)
        bench = Bench(training, predictors(held, ratio, load=load, output_locked=locked))
    start = state_of(scenario)
    with step("refit", "re-fitting the model's own numbers"):
        try:
            base = refit(bench, start)
        except PredictionError as error:
            names = ", ".join(record.name for record in records)
            raise InputError(f"{names}: the model cannot follow the measured motion: {error}") from None
        doubts = suspicions(bench, base, start)
        problems += doubts

    running = contextlib.ExitStack()

    def during(name: str, text: str) -> Callable[[str], object]:
        running.close()
        running.enter_context(step(name, text))
        return tell

    with running:
        found = search(bench, base.fit, during)
    current, stages, named, left = found.fit, found.stages, found.named, found.left
    explained = bench.power(base.fit.predictions) - bench.power(current.predictions)
    last = stages[-1].location
    rest = last.structured * left.power
    explained /= max(explained + rest, 1e-300)
    states = {"before": start, "refit": base.fit.state, "after": current.state}
    with step("prove", "proving on held-out data"):
        gap, predictions = gaps(bench, states)
    # A name, or a curve, that does not hold on data that it has not seen is none; nor is a name that fits at
    # the end of its range alone.
    unknown = last.chance <= LEVEL and _misfit(named, last, explained)
    unknown = unknown or (bool(named) and kept(bench, predictions) < KEPT)
    unknown = unknown or any(added.at_limit for added in current.state.added)
    rest_of = None if named or unknown else remainder(bench, current.predictions)
    curve: CurveFit | None = None
    if unknown:
        # What explains only a part is not added; the curve of all that is missing is.
        current = base.fit
        with step("curve", "fitting the curve of what has no name"):
            curve = fit_curve(bench, base.fit, stages[0].location, on_step=tell)
        with step("prove", "proving on held-out data"):
            if curve is not None:
                gap, predictions = gaps(bench, states | {"after": curve.fit.state})
                curve = curve if kept(bench, predictions) >= KEPT else None
            if curve is None:
                gap, predictions = gaps(bench, states | {"after": current.state})
        current = curve.fit if curve is not None else current
    fell = any(g.refit < (1.0 - LEAST_FALL) * g.before for g in gap.values())
    intervals = [i for i in base_intervals(current, base.freedoms) if i.determined]
    intervals += [i for i in base.intervals if i.name not in {j.name for j in intervals}]
    problems += delays(bench, intervals)
    moved = [i for i in intervals if i.moved]
    off = moved
    if fell and not (moved or named or unknown or rest_of):
        off = tie(bench, base.before, current, intervals)
    common: dict[str, Any] = {
        "parameters": {i.name: _number(i) for i in intervals},
        "moved": [i.name for i in off],
        "gap": gap,
        "located": _located(stages),
        "data_problems": [DataProblem(**vars(problem)) for problem in problems],
        "not_tried": stages[0].screening.skipped if stages[0].screening else {},
        "seconds": seconds,
    }
    if unknown:
        verdict = _without_a_name(stages, named, curve, common)
    elif rest_of is not None:
        verdict = _without_a_place(rest_of, common)
    elif named:
        effects = _effects(named, current)
        words = " and ".join(_words(effect) for effect in effects)
        verdict = Verdict(
            verdict="effect", sentence=f"The model is missing {words}.", effects=effects, **common
        )
    elif off and fell:
        verdict = _numbers_off(off, common, sure=bool(moved))
    else:
        verdict = Verdict(verdict="nothing", sentence="The data show nothing that the model lacks.", **common)
    if doubts:
        words = "; ".join(f"{doubt.record}: {doubt.channel} {doubt.message}" for doubt in doubts)
        verdict.sentence = f"Check the data first: {words}. {verdict.sentence}"
    return Diagnosis(verdict, checks, bench, base, stages, named, current, start, explained, predictions)


def _without_a_name(
    stages: Sequence[Stage], named: Sequence[Named], curve: CurveFit | None, common: Mapping[str, Any]
) -> Verdict:
    place = max(stages, key=lambda stage: stage.location.structured).location.places[0]
    return Verdict(
        verdict="unknown",
        sentence="Something is missing that nothing in the catalogue explains: "
        f"{100 * place.share:.0f} % of what is left of {place.channel} is a function of "
        f"{place.coordinate.replace('_', ' ')}.",
        suspects={one.name: round(one.share, 3) for one in named},
        curve=curve.found() if curve is not None else None,
        **common,
    )


def _without_a_place(rest: Remainder, common: Mapping[str, Any]) -> Verdict:
    return Verdict(
        verdict="unknown",
        sentence=f"Something is missing that nothing in the catalogue explains: {rest.channel} of "
        f"{rest.record} is left with up to {rest.times_noise:.2g} times its noise, most of it "
        f"between {rest.start_s:.3g} and {rest.end_s:.3g} s, and a function of no coordinate that "
        "these data repeat.",
        remainder=rest,
        **common,
    )


def _numbers_off(off: Sequence[Interval], common: Mapping[str, Any], *, sure: bool) -> Verdict:
    changes = [f"{i.name} {i.value:.4g} instead of {i.start:.4g} {i.unit}".rstrip() for i in off]
    said = f"numbers of the model are off: {', '.join(changes)}."
    if not sure:
        said = f"a number of the model is off, most simply {' or '.join(i.name for i in off)}."
    return Verdict(verdict="parameter", sentence=f"No effect is missing; {said}", **common)


def _misfit(named: Sequence[Named], last: Location, explained: float) -> bool:
    """Whether the names explain too little to be believed.

    Args:
        named: the named effects.
        last: where what they leave lives.
        explained: part of all structure that they explain.
    """
    needed = ADEQUATE
    place = last.places[0]
    for one in named:
        signature = catalogue()[one.name].signature
        if place.coordinate == signature.lives_in[0] and place.channel in signature.channels:
            needed = OWN_ADEQUATE
            if signature.exact:
                return last.structured > EXACTLY
    return last.structured > STRUCTURED and explained < needed


def _number(interval: Interval) -> FittedNumber:
    bounds = (interval.low, interval.high) if interval.determined else None
    return FittedNumber(value=interval.value, interval=bounds, start=interval.start, tied_to=interval.tied_to)


def _effects(named: Sequence[Named], final: Fit) -> list[NamedEffect]:
    known = catalogue()
    found = []
    for one, (added, covariance, shapes) in zip(named, added_spreads(final), strict=True):
        confused = known[one.name].signature.confused_with
        found.append(
            NamedEffect(
                name=one.name,
                title=" ".join(
                    [known[one.name].title, f"({added.fitting.label})" if added.fitting.label else ""]
                ).strip(),
                confidence=one.confidence,
                chance=one.chance,
                explained=one.share,
                parameters=fitted_numbers(added, covariance, shapes),
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
            if key in best or place.share < 0.02 or len(best) >= most:
                continue
            orders = [line.order for line in stage.location.lines if line.channel == place.channel]
            best[key] = Located(
                stage=stage.title,
                coordinate=place.coordinate,
                channel=place.channel,
                share=round(place.share, 4),
                orders=orders if place.coordinate == "wave_generator_angle" else [],
            )
        found += list(best.values())
    return found
