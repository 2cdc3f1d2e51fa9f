"""Size and cost of the log of a real run: with scene and teeth, against the same run that logs nothing.

    python benchmarks/log_cost.py [SCENARIO] [SECONDS]

The scenario runs for SECONDS (60) at 1 kHz, teeth at 50 Hz, with the scene: once with its samples thrown away
as they come, once into a log, twice each. Prints the size of the log and the share of processor time that
logging takes. Aims: below 60 MB and below 15 %.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

import hdsim
from hdsim.scenario.model import Scenario
from hdsim.simulation.setup import build_run
from hdsim.simulation.simulate import simulate_to_log

ROOT = Path(__file__).resolve().parents[1]


def lengthened(path: Path, seconds: float) -> Scenario:
    scenario = hdsim.load_scenario(path)
    data = scenario.model_dump()
    data["run"] |= {"duration_s": seconds, "sample_rate_hz": 1000.0, "teeth_rate_hz": 50.0}
    return Scenario.model_validate(data)


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "scenarios" / "sine_tracking.yaml"
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    scenario = lengthened(path, seconds)
    list(build_run(lengthened(path, 0.05)).blocks())  # compile
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "a.mcap")
        simulate_to_log(lengthened(path, 0.05), log)
        best = {"bare": float("inf"), "logged": float("inf")}
        for _ in range(2):
            began = time.process_time()
            for _ in build_run(scenario).blocks():
                pass
            best["bare"] = min(best["bare"], time.process_time() - began)
            began = time.process_time()
            simulate_to_log(scenario, log)
            best["logged"] = min(best["logged"], time.process_time() - began)
        share = 100 * (best["logged"] - best["bare"]) / best["logged"]
        size = log.stat().st_size / 1e6
        Console().print(
            f"{scenario.name}, {seconds:g} s at 1 kHz, teeth at 50 Hz: log {size:.1f} MB (aim < 60)\n"
            f"run alone {best['bare']:.2f} s, with log {best['logged']:.2f} s of processor time: "
            f"logging takes {share:.1f} % of the run (aim < 15)"
        )


if __name__ == "__main__":
    main()
