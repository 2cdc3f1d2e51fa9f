"""Size and cost of the log of a real run: with scene and teeth, against the same run that logs nothing.

    python benchmarks/log_cost.py [SCENARIO] [SECONDS]

The scenario runs for SECONDS (60) at 1 kHz, teeth at 50 Hz, with the scene: once into memory, once straight
into its log; then the recording in memory is written as a log, whose time is all logging and scatters less
than the difference of two runs. Aims: below 60 MB and below 15 % of processor time.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

import hdsim
from hdsim.log import write_log
from hdsim.scenario.model import Scenario
from hdsim.simulation.simulate import simulate, simulate_to_log

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
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "a.mcap")
        simulate_to_log(lengthened(path, 0.05), log)  # compile and import
        simulate(lengthened(path, 0.05)).save(log)
        began = time.process_time()
        recording = simulate(scenario)
        bare = time.process_time() - began
        began = time.process_time()
        simulate_to_log(scenario, log)
        logged = time.process_time() - began
        began = time.process_time()
        write_log(recording, Path(folder, "b.mcap"))
        writing = time.process_time() - began
        share = 100 * writing / (bare + writing)
        size = log.stat().st_size / 1e6
        Console().print(
            f"{scenario.name}, {seconds:g} s at 1 kHz, teeth at 50 Hz: log {size:.1f} MB (aim < 60)\n"
            f"run alone {bare:.2f} s, straight into its log {logged:.2f} s, writing the finished recording "
            f"{writing:.2f} s of processor time: logging takes {share:.1f} % of the run (aim < 15)"
        )


if __name__ == "__main__":
    main()
