"""An ensemble in one thread against a pool of one process of an earlier revision, in turns.

    python benchmarks/pool_before.py REVISION [RUNS]

The pool runs in a clone of this repository at REVISION, with the packages that are installed here; it makes
RUNS (64; an eighth with all teeth) short runs that differ in the load's inertia, and keeps two channels, as
the ensemble of ``hdsim.simulate_all`` does. Both begin with each run's scenario as plain data. Wall seconds,
medians of the rounds' ratios, for runs of several lengths. This file imports nothing that came after the
pools of then, for they import it.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import hdsim
from hdsim.scenario import Scenario
from hdsim.simulation.setup import build_run

ROOT = Path(__file__).parents[1]
CHANNELS = ("motor_angle", "output_angle")
ROUNDS = 5
#: Mesh and lengths of the runs, s of the drive's time.
RUNS: tuple[tuple[str, tuple[float, ...]], ...] = (
    ("lumped", (0.1, 0.3, 0.6, 1.2)),
    ("teeth", (0.1, 0.3, 0.6, 0.9)),
)


def moves(mesh: str, count: int, duration_s: float) -> list[dict[str, Any]]:
    """The beginning of ``seed_move`` of the folder's own revision, with several loads, as plain data."""
    data = hdsim.load_scenario(Path("scenarios", "seed_move.yaml")).model_dump(mode="json")
    if mesh != "teeth":
        data["drive"]["mesh"] = {"model": mesh}
    data["run"] |= {"teeth_rate_hz": 0.0, "duration_s": duration_s}
    return [data | {"load": data["load"] | {"inertia_kg_m2": 0.5 + 0.005 * k}} for k in range(count)]


def recorded(data: dict[str, Any]) -> dict[str, object]:
    """Some channels of one run."""
    recording = build_run(Scenario.model_validate(data)).record()
    return {name: recording[name] for name in CHANNELS}


def serve() -> None:
    """Make the runs that are asked for in a pool of one process; answer with the seconds that they took."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        for line in sys.stdin:
            asked = moves(*json.loads(line))
            began = time.perf_counter()
            list(pool.map(recorded, asked))
            print(time.perf_counter() - began, flush=True)


@contextmanager
def pool_of(revision: str) -> Iterator[Callable[[str, int, float], float]]:
    """A function that gives the seconds which the pool of a revision takes for some moves."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["git", "clone", "-q", "--no-checkout", ROOT, folder], check=True)
        subprocess.run(["git", "-C", folder, "checkout", "-q", "--detach", revision], check=True)
        server = subprocess.Popen(
            [sys.executable, Path(__file__).resolve(), "serve"],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": folder},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert server.stdin is not None
        assert server.stdout is not None
        ask, answers = server.stdin, server.stdout

        def spent(mesh: str, count: int, duration_s: float) -> float:
            print(json.dumps([mesh, count, duration_s]), file=ask, flush=True)
            return float(answers.readline())

        try:
            yield spent
        finally:
            server.communicate()


def main(revision: str, runs: int) -> None:
    """Measure and print."""
    with pool_of(revision) as pool:
        for mesh, lengths in RUNS:
            count = max(1, runs // 8) if mesh == "teeth" else runs
            for duration_s in lengths:
                before, now = [], []
                for number in range(ROUNDS + 1):
                    spent = pool(mesh, count, duration_s)
                    asked = moves(mesh, count, duration_s)
                    began = time.perf_counter()
                    scenarios = [Scenario.model_validate(data) for data in asked]
                    hdsim.simulate_all(scenarios, CHANNELS, threads=1)
                    if number:  # the first round compiles and fills caches
                        before.append(spent)
                        now.append(time.perf_counter() - began)
                ratio = statistics.median(a / b for a, b in zip(before, now, strict=True))
                pooled, alone = (1e3 * statistics.median(found) / count for found in (before, now))
                print(
                    f"{mesh}, {duration_s:g} s: pool at {revision} {pooled:.1f} ms a run, ensemble "
                    f"{alone:.1f} ms, ratio {ratio:.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve()
    else:
        os.chdir(ROOT)
        main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 64)
