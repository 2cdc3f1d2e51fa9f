"""The whole diagnosis: check, compare, re-fit, then locate, name and add until nothing is left, and prove."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from hdsim.diagnosis.base import on_few_readings, refitted
from hdsim.diagnosis.collect import collect
from hdsim.diagnosis.curve import CurveFit, fit_curve, proved
from hdsim.diagnosis.decide import Decision, Reason, decide, reasons_of
from hdsim.diagnosis.discrepancy import discrepancy
from hdsim.diagnosis.effort import told_of_end
from hdsim.diagnosis.evidence import Evidence
from hdsim.diagnosis.growth import tracked
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.passes import Search, Stage
from hdsim.diagnosis.remains import remains, taken_back
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.search import search
from hdsim.diagnosis.sentences import (
    effect_words,
    fitted_number,
    located,
    named_effects,
    numbers_off,
    rest_words,
    without_a_name,
    without_a_place,
)
from hdsim.diagnosis.teeth import teeth_found
from hdsim.diagnosis.verdict import Verdict
from hdsim.estimate.all_data import on_all_data, refuse_held_out_records
from hdsim.estimate.asked import asked_for
from hdsim.estimate.baseline import trees, with_baselines
from hdsim.estimate.beginning import beginnings
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Check
from hdsim.estimate.drift import drifted
from hdsim.estimate.fit import Fit, base_intervals
from hdsim.estimate.found import DataProblem, Gap
from hdsim.estimate.jumps import Jump, jumped, take_back_jumps
from hdsim.estimate.off import wrong_numbers
from hdsim.estimate.offsets import Zeros
from hdsim.estimate.one_thread import one_blas_thread
from hdsim.estimate.opening import bench_for, checked, locked_side
from hdsim.estimate.plan import LoadSource
from hdsim.estimate.prove import gaps, unseen
from hdsim.estimate.records import Array, Record
from hdsim.estimate.refit import Refit, align
from hdsim.estimate.repeat import with_repeats
from hdsim.estimate.resolved import told_of_damping
from hdsim.estimate.short_cut import short_cut_of
from hdsim.estimate.state import State, state_of
from hdsim.estimate.suspect import delays, moving_zeros, one_way, suspicions
from hdsim.estimate.thin import readings_of_means
from hdsim.estimate.unsettled import unsettled
from hdsim.estimate.write import scenario_changes

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario


@dataclass
class Diagnosis:
    """The result of a diagnosis; ``verdict`` is its summary and follows from ``evidence`` alone."""

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
    with_curve: Fit | None = None

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
    thorough: bool = False,
    all_data: bool = False,
    on_step: Callable[[str], object] | None = None,
) -> Diagnosis:
    """Find what a model is missing.

    Args:
        measured: records that the fits may use.
        scenario: the model; its command does not matter, as the measured motion is prescribed.
        holdout: validation records, used in no fit; parts of ``measured`` when there are none.
        load: source of the load torque; ``output_torque`` takes the reading of the joint's sensor.
        zeros: whether a torque sensor has one zero in all records, one in each, or is trusted to have none.
        force: continue in spite of errors in the data.
        black_box: also fit gradient-boosted trees as a baseline.
        thorough: look for a third effect and more whatever it takes (``hdsim.diagnosis.effort``).
        all_data: estimate the numbers again from the held-out stretches too, once these have judged the model
            (``hdsim.estimate.all_data``); of an ``unknown`` effect they stay.
        on_step: called with the name of each step.

    Returns:
        The diagnosis with its verdict.

    Raises:
        InputError: the data cannot answer the question, or are suspect (see ``force``), or a black box is
            asked for without scikit-learn.
    """
    refuse_held_out_records(all_data, holdout)
    if black_box:
        trees()
    wanted = black_box, thorough, all_data
    with one_blas_thread():
        return _diagnosed(
            measured, scenario, holdout, load, zeros, force, wanted, on_step or (lambda _: None)
        )


def _diagnosed(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    holdout: Sequence[Recording | Record],
    load: LoadSource | None,
    zeros: Zeros,
    force: bool,
    wanted: tuple[bool, bool, bool],
    tell: Callable[[str], object],
) -> Diagnosis:
    """See ``diagnose``."""
    black_box, thorough, all_data = wanted
    seconds: dict[str, float] = {}

    @contextlib.contextmanager
    def step(name: str, text: str) -> Iterator[None]:
        tell(text)
        started = time.process_time()
        yield
        seconds[name] = round(seconds.get(name, 0.0) + time.process_time() - started, 3)

    with step("check", "checking the data"):
        records, held, checks = checked(measured, scenario, holdout=holdout, load=load, force=force)
        problems = [problem for check in checks for problem in check.problems]
    start = state_of(scenario)
    with step("compare", "predicting the measured channels"):
        means: dict[str, Any] = {"load": load, "locked": locked_side(scenario)}
        readings = readings_of_means([*records, *held], **means)
        bench = bench_for(records, held, scenario, load, readings=readings, zeros=zeros)
    with step("refit", "re-fitting the parameters of the model"):
        # Where what is missing is much, slower readings show it as well.
        bench, base, readings = on_few_readings(
            bench,
            start,
            readings,
            lambda left: readings_of_means([*records, *held], **means, left=left),
            lambda count: bench_for(records, held, scenario, load, readings=count, zeros=zeros),
        )

    running = contextlib.ExitStack()

    def during(name: str, text: str) -> Callable[[str], object]:
        running.close()
        running.enter_context(step(name, text))
        return tell

    jumps: list[Jump] = []
    earlier: Search | None = None
    with running:
        while True:
            found = search(bench, base.fit, during, thorough=thorough, earlier=earlier)
            if found.anew:
                # The first effects have shown samples that do not count.
                earlier = found
                during("refit", "re-fitting the parameters of the model")
                base = refitted(bench, start)
            elif found.better is not None:
                # The effect has only shown the base's own numbers a better minimum.
                own = base_intervals(found.better, base.freedoms)
                base = replace(base, fit=found.better, intervals=own)
            elif back := take_back_jumps(bench, found.fit.predictions):
                # All that a model leaves: it bends the base, and hides what is smaller.
                jumps += back
                during("refit", "re-fitting the parameters of the model")
                base = refitted(bench, start)
            else:
                break
    # Its own numbers are those that effects have asked for, too.
    base = replace(base, freedoms=[*base.freedoms, *asked_for(start, found.fit.state.added)])
    with step("prove", "validating on held-out data"):
        judged = _judged(bench, base, found, start)
    whole = found, judged
    with running:
        while len(judged.decision.names) < len(found.named) and len(found.named) > 1:
            # What is not believed is not in the model either, and the others are judged without it.
            tell_of = during("again", "taking back what is not believed")
            least = min(range(len(found.named)), key=judged.decision.confidence.__getitem__)
            found = taken_back(bench, found, least, tell_of)
            less = _judged(bench, base, found, start)
            less.instead_of(judged, least)
            judged = less
    if not (judged.decision.names or whole[1].decision.names):
        found, judged = whole  # of several names that are none, what they explain together says most
    evidence, decision, gap, predictions = judged.evidence, judged.decision, judged.gap, judged.predictions
    named, current = (found.named, found.fit) if decision.names else ([], base.fit)
    unknown = decision.kind == "unknown"
    curve: CurveFit | None = None
    with_it: dict[str, Gap] | None = None
    place = (found.stages[0] if unknown else found.stages[-1]).location
    with step("prove", "asking what is left and the zeros of the records"):
        lacks = evidence.left_chance <= RULES.chance
        current = drifted(bench, current, discrepancy(bench, current, place) if lacks else None)
    if unknown or (named and lacks):
        # What has no name, or what the names leave of their own, is a curve.
        with step("curve", "fitting the curve of the unidentified effect"):
            curve = fit_curve(bench, current, place, on_step=tell)
    if curve is not None:
        with step("prove", "validating on held-out data"):
            with_it = proved(bench, current, curve)
            if unknown and with_it is not None:
                current = curve.fit
                align(bench, current)
            elif unknown:
                curve = None
    if current is not found.fit:
        with step("prove", "validating on held-out data"):
            gap, predictions = gaps(bench, {"before": start, "refit": base.fit.state, "after": current.state})
    if with_it is not None and named:
        gap = {c: g.model_copy(update={"with_curve": with_it[c].after}) for c, g in gap.items()}
    with step("orders", "tracking orders over speed"):
        orders = tracked(bench, current.state, [stage.location for stage in found.stages])
    with step("prove", "validating on held-out data"):
        gap = with_baselines(bench, start, gap, black_box=black_box)
        gap = with_repeats(bench, current.state, gap, predictions["after"])
    # Of the final model: what the re-fit alone had bent, effects and a curve may have set right.
    doubts = suspicions(bench, replace(base, fit=current), start)
    problems += [*doubts, *beginnings(bench), *one_way(bench), *moving_zeros(bench, current.predictions)]
    silent = decision.kind in ("nothing", "parameter")
    problems += unseen(bench, predictions["after"], slightly=silent)
    problems += [*jumped(bench, jumps), *unsettled(bench, current), *told_of_end(bench, found)]
    final, counted = current, contextlib.ExitStack()
    if all_data and not unknown:
        with step("prove", "estimating the parameters from all data"):
            on_all = on_all_data(bench, current, lambda f: discrepancy(bench, f, place) if lacks else None)
            final = counted.enter_context(on_all)
    intervals = base_intervals(final, base.freedoms)
    intervals += [i for i in base.intervals if i.name not in {j.name for j in intervals}]
    intervals, blurred = told_of_damping(bench, final.state, intervals)
    problems += [*delays(bench, intervals), *blurred]
    off = [i for i in intervals if i.moved]
    if decision.kind == "parameter":
        off = wrong_numbers(bench, base.before, final, intervals)
        if not off:
            decision.kind = "nothing"
    rest = remains(evidence) if named else None
    common: dict[str, Any] = {
        "parameters": {i.name: fitted_number(i) for i in intervals},
        "moved": [i.name for i in off],
        "gap": gap,
        "located": located(found.stages),
        "orders": orders,
        "data_problems": [DataProblem(**vars(problem)) for problem in problems],
        "not_tried": found.stages[0].screening.skipped if found.stages[0].screening else {},
        "confidence": decision.certainty,
        "because": [*decision.because, *judged.taken_back],
        "remains": rest,
        "curve": curve.found() if curve is not None else None,
        "readings": readings,
        "short_cut": short_cut_of(bench, current.predictions, predictions["after"]),
        "seconds": seconds,
        "estimated_from": "training" if final is current else "all",
    }
    patterned = evidence.left_chance <= RULES.chance and evidence.left >= RULES.structured
    noisy = evidence.rest is not None and evidence.rest.times_noise > RULES.rest
    if unknown and (evidence.laws or patterned or not noisy):
        verdict = without_a_name(found.stages, evidence, common)
    elif unknown:
        verdict = without_a_place(bench, found.fit, common)
    elif named:
        effects = named_effects(named, decision, final)
        words = " and ".join(effect_words(effect) for effect in effects)
        sentence = f"The model is missing {words}.{rest_words(rest)}"
        with step("prove", "asking what the names say of the teeth"):
            teeth = teeth_found(effects, final.state, (bench, final))
        verdict = Verdict(verdict="effect", sentence=sentence, effects=effects, teeth=teeth, **common)
    elif decision.kind == "parameter":
        verdict = numbers_off(off, final, common)
    else:
        said = "The data show no effect that is missing from the model."
        verdict = Verdict(verdict="nothing", sentence=said, **common)
    counted.close()
    if doubts:
        words = "; ".join(f"{doubt.record}: {doubt.channel} {doubt.message}" for doubt in doubts)
        verdict.sentence = f"Check the data first: {words}. {verdict.sentence}"
    also = curve.fit if curve is not None and with_it is not None and named else None
    return Diagnosis(
        verdict, evidence, checks, bench, base, found.stages, named, final, start, predictions, also
    )


@dataclass
class _Judged:
    """What is said of a search's result: held-out gaps, predictions, evidence, decision."""

    gap: dict[str, Gap]
    predictions: dict[str, list[Array]]
    evidence: Evidence
    decision: Decision
    taken_back: list[Reason] = field(default_factory=list)

    def instead_of(self, before: _Judged, least: int) -> None:
        """Keep why names were taken back, the ``least``-th among them, as they were judged before."""
        left, laws = Counter(law.name for law in self.evidence.laws), before.evidence.laws
        self.taken_back = list(before.taken_back)
        for k in sorted(range(len(laws)), key=lambda k: k == least):
            if left[laws[k].name]:
                left[laws[k].name] -= 1
            else:
                self.taken_back += reasons_of(before.evidence, k)


def _judged(bench: Bench, base: Refit, found: Search, start: State) -> _Judged:
    gap, predictions = gaps(bench, {"before": start, "refit": base.fit.state, "after": found.fit.state})
    evidence = collect(bench, base, found, gap, predictions)
    return _Judged(gap, predictions, evidence, decide(evidence))
