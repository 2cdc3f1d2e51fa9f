"""Ensembles, sensitivities and meshes, as ratios of times measured in turns.

    python benchmarks/ensemble.py [RUNS]

An ensemble of RUNS (64) short runs that differ in a number, ``hdsim.simulate_all``, in one thread and in
two, against single runs (``Run.record``) one after the other and against a pool of one process that makes
them, for several lengths: the shorter, the more of a run is not its integration. The compiled integration of
the longest alone in one thread and in two: what the machine lets two threads gain; ten sensitivities of
``scenarios/seed_move.yaml`` against the run alone; one run with each mesh. Wall seconds, the processor's for
what runs alone; medians of the rounds.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import hdsim
from hdsim.drive._layout import INSIDE
from hdsim.scenario import Scenario
from hdsim.simulation.ensemble import in_order
from hdsim.simulation.rosenbrock import rodas4_through
from hdsim.simulation.run import Run
from hdsim.simulation.setup import build_run

SCENARIO = Path(__file__).parents[1] / "scenarios" / "seed_move.yaml"
CHANNELS = ("motor_angle", "output_angle")
ROUNDS = 5
#: Lengths of short runs, s of the drive's time.
LENGTHS_S = (0.1, 0.3, 0.6, 1.2)
PARAMETERS = (
    "drive.torsion.stiffness_k1_nm_per_rad",
    "drive.torsion.damping_nm_s_per_rad",
    "drive.friction.viscous_nm_s_per_rad",
    "drive.friction.coulomb_nm",
    "effects.kinematic_error.components[0].amplitude_arcmin",
    "effects.kinematic_error.components[1].amplitude_arcmin",
    "load.inertia_kg_m2",
    "command.motor.controller.position_gain_per_s",
    "command.motor.controller.velocity_gain_nm_s_per_rad",
    "command.motor.controller.velocity_integral_gain_nm_per_rad",
)


def scenario_of(mesh: str, inertia_kg_m2: float = 0.5, duration_s: float = LENGTHS_S[-1]) -> Scenario:
    """The move's beginning with a mesh and a load."""
    data = hdsim.load_scenario(SCENARIO).model_dump(mode="json")
    if mesh != "teeth":
        data["drive"]["mesh"] = {"model": mesh}
    data["load"]["inertia_kg_m2"] = inertia_kg_m2
    data["run"] |= {"teeth_rate_hz": 0.0, "duration_s": duration_s}
    return Scenario.model_validate(data)


def recorded(data: dict[str, object]) -> dict[str, object]:
    """Some channels of a run that keeps everything."""
    recording = build_run(Scenario.model_validate(data)).record()
    return {name: recording[name] for name in CHANNELS}


def seconds(call: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Time of a call."""
    began = clock()
    call()
    return clock() - began


def in_turns(
    calls: dict[str, Callable[[], object]], clock: Callable[[], float] = time.perf_counter
) -> dict[str, list[float]]:
    """Times of several calls, round after round, so that whatever else the machine does meets all alike."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for number in range(ROUNDS + 1):
        for name, call in calls.items():
            spent = seconds(call, clock)
            if number:  # the first round compiles and fills caches
                found[name].append(spent)
    return found


def ratio(over: list[float], under: list[float]) -> float:
    """Median of the rounds' ratios."""
    return statistics.median(a / b for a, b in zip(over, under, strict=True))


def in_use(call: Callable[[], object]) -> float:
    """Part of two cores' time that a call takes, median of the rounds."""
    shares = []
    for _ in range(ROUNDS):
        began, spent = time.perf_counter(), time.process_time()
        call()
        shares.append((time.process_time() - spent) / (2.0 * (time.perf_counter() - began)))
    return statistics.median(shares)


def ensembles(runs: int, duration_s: float) -> None:
    """Print the ratios of an ensemble."""
    scenarios = [scenario_of("lumped", 0.5 * (1.0 + 0.01 * k), duration_s) for k in range(runs)]
    plain = [one.model_dump(mode="json") for one in scenarios]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        found = in_turns(
            {
                "single": lambda: [recorded(one) for one in plain],
                "one": lambda: hdsim.simulate_all(scenarios, CHANNELS, threads=1),
                "two": lambda: hdsim.simulate_all(scenarios, CHANNELS, threads=2),
                "pool": lambda: list(pool.map(recorded, plain)),
            }
        )
    each = {name: 1e3 * statistics.median(spent) / runs for name, spent in found.items()}
    print(
        f"ensemble of {runs} of {duration_s:g} s: {each['one']:.1f} ms a run in one thread, single runs "
        f"{each['single']:.1f} ms"
    )
    print(f"  single runs / ensemble in one thread   {ratio(found['single'], found['one']):.2f}")
    print(f"  pool of one process / one thread       {ratio(found['pool'], found['one']):.2f}")
    print(
        f"  single runs / ensemble in two threads  {ratio(found['single'], found['two']):.2f} (wanted: 1.9)"
    )
    print(f"  one thread / two threads               {ratio(found['one'], found['two']):.2f}")
    used = in_use(lambda: hdsim.simulate_all(scenarios, CHANNELS, threads=2))
    print(f"  of two cores in use by two threads     {100 * used:.0f} %")


def machine(runs: int) -> None:
    """Print what two threads gain where there is next to no Python: the most that an ensemble can."""
    ready = [build_run(scenario_of("lumped", 0.5 * (1.0 + 0.01 * k))) for k in range(runs)]

    def integrate(run: Run) -> object:
        system = run.model.system
        return rodas4_through(
            system,
            run.spans(),
            run.y0,
            np.zeros(1),
            rtol=run.rtol,
            atol=run.rtol * system.scale,
            inside_at=INSIDE,
        )

    found = in_turns(
        {"one": lambda: in_order(integrate, ready, 1), "two": lambda: in_order(integrate, ready, 2)}
    )
    print(f"  likewise, the integration alone        {ratio(found['one'], found['two']):.2f} (the machine's)")


def main(runs: int) -> None:
    """Measure and print."""
    for duration_s in LENGTHS_S:
        ensembles(runs, duration_s)
    machine(runs)
    alone: dict[str, list[float]] = {}
    for mesh in ("lumped", "teeth"):
        scenario = scenario_of(mesh)
        found = in_turns(
            {
                "alone": lambda s=scenario: hdsim.simulate(s),
                "beside": lambda s=scenario: hdsim.simulate(s, sensitivities=PARAMETERS),
            },
            time.process_time,
        )
        alone[mesh] = found["alone"]
        cost = ratio(found["beside"], found["alone"])
        print(f"{mesh}: run with ten sensitivities / run {cost:.2f} (wanted: below 5)")
    scenario = scenario_of("tabulated")
    tabulated = in_turns({"run": lambda: hdsim.simulate(scenario)}, time.process_time)["run"]
    print(
        f"lumped : tabulated : teeth = 1 : {ratio(tabulated, alone['lumped']):.1f} "
        f": {ratio(alone['teeth'], alone['lumped']):.1f} (tabulated with its table)"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
