"""A prediction of a diagnosis against the public run of the same model: processor time, error, threads.

    python benchmarks/prediction.py [SECONDS]

A record of SECONDS (20) at 1 kHz with an encoder's noise is prescribed to a size 20 drive; asked for are the
torques and the output's angle. ``run`` is ``Run(...).record()``: all channels, events, energy audit, SciPy's
loop. ``predict`` is ``Predictor.predict``, which a diagnosis calls up to a thousand times. Costs are
processor seconds, the shortest of several; errors the largest relative root-mean-square error of a channel
against a run at 1e-11. ``ten beside`` is ``samples_beside`` with ten models whose load differs a little, in
units of that call without them: finite differences to ten numbers need ten. The last columns are wall seconds
of sixteen models in one thread and in two.

Before that, what teeth cost in a fit or a diagnosis: predictions of the drive ``seed-2021`` by its bench,
which take the short cut of ``hdsim.estimate.short_cut``, and their error against the whole model over the
noise.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from hdsim.drive.model import Model
from hdsim.estimate.opening import bench_for
from hdsim.estimate.plan import plan_for
from hdsim.estimate.predict import COARSE_RTOL, RTOL, Candidate, Predictor
from hdsim.estimate.prescribed import LEAD_IN_S
from hdsim.estimate.records import Record
from hdsim.estimate.short_cut import short_cut_of, whole_models
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario
from hdsim.simulation.run import Run
from hdsim.simulation.sample import alike, samples_beside

TOLERANCES = (1e-5, 1e-6, 1e-7)
RIPPLE = {"motor_torque_ripple": {"components": [{"order": 12, "cogging_nm": 0.03}]}}
CASES = {
    "lumped": ("lumped", {}),
    "lumped, torque ripple": ("lumped", RIPPLE),
    "lumped, kinematic error": ("lumped", {"kinematic_error": {}}),
    "lumped, Maxwell hysteresis": ("lumped", {"torsional_hysteresis_maxwell": {}}),
    "rigid": ("rigid", {}),
    "tabulated": ("tabulated", {}),
}  # fmt: skip
MANY, BESIDE = 16, 10


def record_of(seconds: float) -> Record:
    """A swing of the output by 45 degrees, as encoders and sensors show it."""
    times = np.arange(round(1000 * seconds) + 1) / 1000
    angle = -100.0 * math.radians(45) * np.sin(2 * np.pi * 0.25 * times)
    rng = np.random.default_rng(0)
    channels = {"motor_angle": angle, "output_angle": angle / -100.0}
    channels |= {"motor_torque": np.cos(times), "output_torque": np.cos(times)}
    noise = {"motor_angle": 2e-5, "output_angle": 4e-6, "motor_torque": 6e-3, "output_torque": 0.15}
    return Record(
        "benchmark", times, {c: v + noise[c] * rng.standard_normal(len(times)) for c, v in channels.items()}
    )


def scenario_of(mesh: str, effects: dict[str, object], preset: str = "csg-20-100") -> Scenario:
    """A drive with an arm on its output."""
    return Scenario.model_validate({
        "drive": {"preset": preset, "mesh": {"model": mesh}},
        "effects": effects,
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": 1.0},
    })  # fmt: skip


def candidate_of(mesh: str, effects: dict[str, object]) -> Candidate:
    """The model of such a drive."""
    scenario = scenario_of(mesh, effects)
    return Candidate(scenario.drive, scenario.effects.active(), scenario.load)


def model_of(
    predictor: Predictor, candidate: Candidate, *, heavier: float = 0.0, audited: bool = True
) -> Model:
    """The model under the measured motion, its load's inertia larger by a part of itself."""
    return Model(
        candidate.drive,
        [*candidate.effects.values(), candidate.load],
        load_inertia_kg_m2=(1.0 + heavier) * candidate.load.inertia_kg_m2,
        motions={"motor": predictor.motion},
        audited=audited,
    )


def beside(predictor: Predictor, candidate: Candidate, repeats: int) -> str:
    """Cost of ten models that are linearised beside one, in units of that one alone."""
    times, channels = predictor.record.time + LEAD_IN_S, predictor.plan.channels
    one, *others = (
        model_of(predictor, candidate, heavier=1e-7 * k, audited=False) for k in range(BESIDE + 1)
    )
    if not alike(one, others[0], float(times[-1])):
        return "-"
    costs = [
        cheapest(partial(samples_beside, one, several, times, channels, rtol=TOLERANCES[1]), repeats)
        for several in ((), others)
    ]
    return f"{costs[1] / costs[0]:.1f}"


def run_of(predictor: Predictor, candidate: Candidate, rtol: float) -> dict[str, np.ndarray]:
    """The predicted channels from the public way of simulating."""
    model = model_of(predictor, candidate)
    run = Run(model, duration_s=LEAD_IN_S + predictor.record.duration_s, sample_rate_hz=1000.0, rtol=rtol)
    recorded = run.record()
    count = len(predictor.record.time)
    return {channel: recorded[channel][-count:] for channel in predictor.plan.channels}


def cheapest(call, repeats: int) -> float:
    """Processor seconds of a call."""
    spent = []
    for _ in range(repeats):
        began = time.process_time()
        call()
        spent.append(time.process_time() - began)
    return min(spent)


def error(found: dict[str, np.ndarray], exact: dict[str, np.ndarray]) -> float:
    """Largest relative root-mean-square error of a channel; the first samples hold a jump of the motion."""
    return max(float(np.std((found[c] - exact[c])[5:]) / np.std(exact[c])) for c in exact)


def at_equal_error(costs: list[float], errors: list[float], wanted: float) -> float:
    """Cost at an error, interpolated on logarithmic axes; nan outside."""
    if not min(errors) <= wanted <= max(errors):
        return math.nan
    order = np.argsort(errors)
    return float(np.exp(np.interp(np.log(wanted), np.log(errors)[order], np.log(costs)[order])))


def row(record: Record, name: str) -> list[str]:
    """A line of the table."""
    mesh, effects = CASES[name]
    candidate = candidate_of(mesh, effects)
    predictor = Predictor(record, plan_for(record), candidate.drive.ratio)
    repeats = 1 if mesh == "tabulated" else 5
    exact = run_of(predictor, candidate, 1e-8 if mesh == "tabulated" else 1e-11)
    costs: dict[str, list[float]] = {"run": [], "predict": []}
    errors: dict[str, list[float]] = {"run": [], "predict": []}
    for rtol in TOLERANCES:
        predictor.rtol = rtol
        ways = {
            "run": partial(run_of, predictor, candidate, rtol),
            "predict": partial(predictor.predict, candidate),
        }
        for way, call in ways.items():
            errors[way].append(max(error(call(), exact), 1e-14))
            costs[way].append(cheapest(call, repeats))
    predictor.rtol = TOLERANCES[1]
    seconds = []
    for threads in (1, 2):
        began = time.perf_counter()
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(predictor.predict, [candidate] * MANY))
        seconds.append(time.perf_counter() - began)
    run, predict, wanted = costs["run"][1], costs["predict"][1], errors["run"][1]
    equal = run / at_equal_error(costs["predict"], errors["predict"], wanted)
    return [
        name,
        f"{1e3 * run:.1f}",
        f"{1e3 * predict:.1f}",
        f"{run / predict:.1f}",
        f"{wanted:.1e}",
        f"{errors['predict'][1]:.1e}",
        "-" if math.isnan(equal) else f"{equal:.1f}",
        beside(predictor, candidate, repeats),
        *(f"{value:.2f}" for value in seconds),
    ]


def meshes(record: Record, repeats: int = 5) -> Table:
    """Cost of predictions by mesh, beside the lumped one's, measured in turns."""
    states, benches = {}, {}
    for mesh in ("lumped", "tabulated", "teeth"):
        scenario = scenario_of(mesh, {}, preset="seed-2021")
        benches[mesh], states[mesh] = bench_for([record], [], scenario), state_of(scenario)
    costs: dict[tuple[str, float], list[float]] = {}
    for _ in range(repeats):
        for rtol in (RTOL, COARSE_RTOL):
            for mesh, bench in benches.items():
                bench.predictors[0].rtol = rtol
                costs.setdefault((mesh, rtol), []).append(cheapest(partial(bench.predict, states[mesh]), 1))
    table = Table(title="predictions of a bench, processor ms")
    for title in ("mesh", f"at {RTOL:g}", "ratio", f"at {COARSE_RTOL:g}", "ratio", "error over noise"):
        table.add_column(title, justify="right")
    for mesh, bench in benches.items():
        bench.predictors[0].rtol = RTOL
        short = bench.predict(states[mesh])
        with whole_models(bench):
            found = short_cut_of(bench, short, bench.predict(states[mesh]))
        row = [mesh]
        for rtol in (RTOL, COARSE_RTOL):
            ratios = [a / b for a, b in zip(costs[mesh, rtol], costs["lumped", rtol], strict=True)]
            row += [f"{1e3 * min(costs[mesh, rtol]):.1f}", f"{statistics.median(ratios):.1f}"]
        table.add_row(*row, "-" if found is None else f"{max(found.error.values()):.4f}")
    return table


def main() -> None:
    """Measure and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    record = record_of(seconds)
    Console(width=160).print(meshes(record))
    table = Table(title=f"{seconds:g} s at 1 kHz, processor ms at a tolerance of 1e-6")
    titles = ("run", "predict", "ratio", "error run", "predict", "ratio at equal error", "ten beside")
    table.add_column("model")
    for title in (*titles, f"{MANY} in one thread, s", "in two, s"):
        table.add_column(title, justify="right")
    for name in CASES:
        table.add_row(*row(record, name))
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
