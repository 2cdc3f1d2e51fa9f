"""Step 9, next experiment: which scenario would separate candidates that the data cannot tell apart.

Every scenario is simulated under every candidate; ``hdsim.diagnosis.separation`` says how far apart they are.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from hdsim.diagnosis.experiments import Experiment, experiments, limits_of
from hdsim.diagnosis.further import Candidate, NextExperiment
from hdsim.diagnosis.separation import noise_of, separated
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.prescribed import LEAD_IN_S
from hdsim.estimate.records import Array
from hdsim.estimate.state import State
from hdsim.estimate.vector import Vector
from hdsim.log.mapping import MEASURED
from hdsim.plot import units

#: Rate at which experiments are simulated, Hz; the noise counts at the rate of the data.
RATE_HZ = 200.0
#: Most candidates that are compared.
MOST_CANDIDATES = 3
#: Spread of a zero that nobody knows, in steps of its finite difference.
UNKNOWN = 1e3
#: Least d' of an experiment that is proposed: right in 84 % of cases, five times of six.
TELLS = 2.0
#: Relative tolerance of the simulations.
RTOL = 1e-5


@dataclass(frozen=True)
class Outcome:
    """What an experiment would tell: d' of the pair that it separates worst, and where its records differ."""

    experiment: Experiment
    separation: float
    pair: tuple[str, str]
    channel: str
    difference: float
    at_s: float


def propose(
    bench: Bench,
    candidates: Mapping[str, Fit],
    *,
    base: Path | None = None,
    beside: Path | None = None,
    titles: Mapping[str, str] | None = None,
) -> tuple[NextExperiment, str]:
    """Find the experiment that would separate candidates best.

    Args:
        bench: the measured series.
        candidates: fitted models by name, the best first; of a weak verdict the effect's and the base's.
        base: file of the scenario that the proposal extends; ``base.yaml`` when None.
        beside: directory in which the proposal will stand.
        titles: words for the candidates.

    Returns:
        The proposal and the YAML text of its scenario.

    Raises:
        InputError: fewer than two candidates, or none can be simulated.
    """
    names = list(candidates)[:MOST_CANDIDATES]
    if len(names) < 2:
        raise InputError(f"an experiment separates at least two candidates, found {len(names)}")
    fits = {name: candidates[name] for name in names}
    first = fits[names[0]]
    repetition = [] if bench.predictors[0].plan.locked == "motor" else [_repetition(bench)]
    outcomes = _outcomes(bench, [*repetition, *experiments(limits_of(bench, first.state))], fits)
    again = next((o.separation for o in outcomes if o.experiment.motion is not None), 0.0)
    ranked = sorted((o for o in outcomes if o.experiment.motion is None), key=lambda o: -o.separation)
    if not ranked:
        raise InputError("no experiment could be simulated with these candidates")
    chosen = ranked[0]
    words = dict(titles or {})
    said = {name: words.get(name, name.replace("_", " ")) for name in names}
    one, other = (said[name] for name in chosen.pair)
    hardest = f" between {one} and {other}, the hardest to distinguish" if len(names) > 2 else ""
    channel = chosen.channel.replace("_", " ")
    apart = f"{', '.join(list(said.values())[:-1])} and {said[names[-1]]}"
    considered = [
        Candidate(
            title=o.experiment.title,
            separation=_short(o.separation),
            relative=_short(o.separation / again) if again > 0 else 0.0,
        )
        for o in ranked
    ]
    unit = units.Unit(MEASURED[chosen.channel], 1.0)
    if unit.name == "rad":
        unit = units.for_error(chosen.difference)
    sentence = (
        f"To distinguish {apart}: {chosen.experiment.title}. Expected d' {_said(chosen.separation)}{hardest} "
        f"({_said(again)} from repeating the record). Look at {channel}: their predictions "
        f"differ by up to {unit.factor * chosen.difference:.2g} {unit.name}, at {chosen.at_s:.2g} s."
    )
    if chosen.separation < TELLS:
        sentence = (
            f"None of the {len(ranked)} experiments that were tried would distinguish {apart}: the best of "
            f"them, {chosen.experiment.title}, has an expected d' of {_said(chosen.separation)} (it takes "
            f"{TELLS:g} to be right five times of six)."
        )
    proposal = NextExperiment(
        sentence=sentence,
        between=names,
        separation=_short(chosen.separation),
        repeated=_short(again),
        correct=_short(0.5 * math.erfc(-0.5 * chosen.separation / math.sqrt(2.0))),
        considered=considered,
    )
    path = base or Path("base.yaml")
    extends = os.path.relpath(path, beside) if beside is not None else str(path)
    return proposal, scenario_text(chosen.experiment, extends, sentence, _rate(bench))


def scenario_text(experiment: Experiment, extends: str, sentence: str, rate_hz: float) -> str:
    """YAML of an experiment as a scenario that extends another."""
    from hdsim.scenario.writer import to_yaml

    description = sentence
    if experiment.encoder_turned_deg:
        description += " The scenario is the motion only; the encoder is turned on the machine."
    data: dict[str, Any] = {
        "name": f"next experiment: {experiment.title}"[:200],
        "description": description,
        "extends": extends,
        "command": {"motor": experiment.motor, "output": experiment.output},
    }
    if experiment.load:
        data["load"] = experiment.load
    data["run"] = {"duration_s": experiment.duration_s, "sample_rate_hz": float(f"{rate_hz:.6g}")}
    return to_yaml(data)


def _rate(bench: Bench) -> float:
    return 1.0 / bench.predictors[0].record.as_read.period_s


def _repetition(bench: Bench) -> Experiment:
    predictor = bench.predictors[0]
    output = {"type": "locked"} if predictor.plan.locked else {"type": "free"}
    return Experiment(
        "repeat the record",
        {},
        LEAD_IN_S + predictor.record.duration_s,
        output,
        motion=predictor.motion,
        load_torque=predictor.load_torque,
        lead_in_s=LEAD_IN_S,
    )


def _outcomes(bench: Bench, tried: Sequence[Experiment], fits: Mapping[str, Fit]) -> list[Outcome]:
    """Simulate experiments under all candidates and all small changes of their numbers."""
    from hdsim.simulation.ensemble import in_order

    noise = noise_of(bench, next(iter(fits.values())))
    rate = min(RATE_HZ, _rate(bench))
    plans = {name: _steps(fit) for name, fit in fits.items()}
    jobs: list[tuple[Experiment, State]] = []
    for experiment in tried:
        shifted = experiment.shifted()
        for name, fit in fits.items():
            jobs += [(experiment, fit.state), *((experiment, state) for state, _ in plans[name])]
            if shifted is not None:
                jobs.append((shifted[0], fit.state))
    channels = list(noise)
    table_for = bench.predictors[0].table_for
    done = iter(in_order(lambda job: _simulated(job[0], job[1], channels, rate, table_for), jobs))
    found = []
    for experiment in tried:
        shifted = experiment.shifted()
        records, slopes, steps, roots = {}, {}, {}, {}
        complete = True
        for name, fit in fits.items():
            records[name] = next(done)
            slopes[name] = [next(done) for _ in plans[name]]
            steps[name] = [step for _, step in plans[name]]
            values, vectors = np.linalg.eigh(fit.covariance)
            roots[name] = vectors * np.sqrt(np.maximum(values, 0.0))
            if shifted is not None:
                slopes[name].append(next(done))
                steps[name].append(shifted[1])
                p = len(values)
                whole = np.zeros((p + 1, p + 1))
                whole[:p, :p], whole[p, p] = roots[name], UNKNOWN * shifted[1]
                roots[name] = whole
            # Where the output is locked its angle tells nothing, and it may be all that is measured.
            complete = complete and all(one is not None and one for one in (records[name], *slopes[name]))
        if not complete:
            continue
        outcome = None
        for pair in combinations(fits, 2):
            for truth, fitted in (pair, pair[::-1]):
                seen = separated(
                    records[truth], records[fitted], slopes[fitted], steps[fitted], roots[fitted],
                    noise, _rate(bench) / rate,
                )  # fmt: skip
                if outcome is None or seen[0] < outcome.separation:
                    at = seen[3] / rate + (experiment.lead_in_s if experiment.motion is None else 0.0)
                    outcome = Outcome(experiment, seen[0], pair, seen[1], seen[2], at)
        if outcome is not None:
            found.append(outcome)
    return found


def _steps(fit: Fit) -> list[tuple[State, float]]:
    """Every fitted number moved a little, with the step, in the order of the fit's covariance."""
    # How many of the effects were held while it was fitted shows in the size of the covariance.
    for held in range(len(fit.state.added), -1, -1):
        vector = Vector(fit.state, tuple(fit.frees), held)
        x = vector.start()
        if len(x) == len(fit.covariance):
            break
    else:
        raise ValueError(f"a fit of {len(fit.covariance)} numbers, but its model has {len(x)}")
    found = []
    for k, step in enumerate(vector.steps(x)):
        moved = x.copy()
        moved[k] += step
        found.append((vector.state(moved), float(step)))
    return found


def _simulated(
    experiment: Experiment,
    state: State,
    channels: Sequence[str],
    rate: float,
    table_for: frozenset[str] | None,
) -> dict[str, Array] | None:
    """The channels that an experiment measures under a model, without its start; None when it fails."""
    from hdsim.actuation.command import Command
    from hdsim.actuation.loads import Load, SignalTorque
    from hdsim.drive.model import Model
    from hdsim.estimate.predict import PredictionError
    from hdsim.simulation.run import RunFailed
    from hdsim.simulation.sample import sample

    try:
        candidate = state.candidate()
    except PredictionError:
        return None
    drive = candidate.drive
    effects: dict[str, Any] = dict(candidate.effects)
    sensors = effects.get("sensors")
    if experiment.encoder_turned_deg and sensors is not None and sensors.output_angle is not None:
        encoder = sensors.output_angle
        phase = encoder.eccentricity_phase_deg + experiment.encoder_turned_deg
        turned = encoder.model_copy(update={"eccentricity_phase_deg": phase})
        effects["sensors"] = sensors.model_copy(update={"output_angle": turned})
    load = candidate.load
    if experiment.motion is not None:
        command = Command.model_validate({"motor": {"type": "free"}, "output": experiment.output})
    else:
        command = Command.model_validate({"motor": experiment.motor, "output": experiment.output})
    motions: dict[str, Any] = {m.axis: m.signal for m in command.motions(drive.ratio)}
    if experiment.motion is not None:
        motions["motor"] = experiment.motion
    if experiment.load:
        changed = load.model_dump(exclude_none=True) | experiment.load
        load = Load.model_validate({key: value for key, value in changed.items() if value is not None})
    parts: list[Any] = [*effects.values()]
    if experiment.load_torque is not None:
        load = load.model_copy(update={"torque": None})
        parts.append(SignalTorque(experiment.load_torque))
    parts.append(load)
    model = Model(
        drive.resolved().settled(),
        parts,
        load_inertia_kg_m2=load.inertia_kg_m2,
        motions=motions,
        seed=candidate.seed,
        audited=False,
        table_for=table_for,
    )
    times = np.arange(round(rate * experiment.duration_s) + 1) / rate
    times = times[times >= experiment.lead_in_s]
    asked = [c for c in channels if c != "output_angle" or experiment.output["type"] != "locked"]
    try:
        got = sample(model, times, asked, rtol=RTOL, atol=RTOL * model.seen_scale())
    except RunFailed:
        return None
    return {c: state.reading(c, times, got.get(f"measured_{c}", got[c])) for c in asked}


def _said(separation: float) -> str:
    return f"{separation:.0f}" if separation >= 9.95 else f"{separation:.2g}"


def _short(value: float) -> float:
    return float(f"{value:.4g}")
