"""Where the time of a diagnosis goes: a record at 1 kHz against the whole catalogue.

    python benchmarks/diagnose_time.py [SECONDS] [EFFECT ...]

A size 20 drive swings an arm for SECONDS (20) with one hidden effect (each of EFFECT in turn, a few that
cost little and much by default), sensors with noise. The diagnosis begins at the model without it. Printed
are the seconds of each step, the number of simulated records, and the aim: below 60 s on two cores.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import hdsim
from hdsim.diagnose.workflow import diagnose
from hdsim.estimate.records import Record

BASE = """
name: benchmark of the diagnosis
drive: {preset: csg-20-100, mesh: {model: lumped}}
command:
  motor:
    type: position
    at: output
    trajectory: {type: sine, amplitude_deg: 45, frequency_hz: 0.25}
    controller:
      type: cascade
      position_gain_per_s: 30
      velocity_gain_nm_s_per_rad: 0.025
      velocity_integral_gain_nm_per_rad: 0.5
load: {inertia_kg_m2: 0.5, gravity: {mass_kg: 4.0, centre_of_mass_m: 0.3}}
run: {duration_s: SECONDS, sample_rate_hz: 1000}
"""
#: Standard deviations of the sensors' noise.
NOISE = {"motor_angle": 2e-5, "output_angle": 4e-6, "motor_torque": 6e-3, "output_torque": 0.15}
HIDDEN = {
    "nothing": {},
    "stribeck_friction": {"extra_static_nm": 0.03, "stribeck_velocity_rad_per_s": 6.0},
    "kinematic_error": {},
    "motor_torque_ripple": {"components": [{"order": 12, "cogging_nm": 0.03}]},
    "torsional_hysteresis_maxwell": {},
}


def record_of(scenario: hdsim.Scenario) -> Record:
    """A run as its sensors would show it."""
    run = hdsim.simulate(scenario)
    rng = np.random.default_rng(0)
    channels = {name: run[name] + size * rng.standard_normal(len(run.time)) for name, size in NOISE.items()}
    return Record("benchmark", run.time, channels)


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    chosen = sys.argv[2:] or list(HIDDEN)
    steps = ("check", "compare", "refit", "locate", "screen", "fit", "again", "curve", "prove")
    table = Table(title=f"{seconds:g} s at 1 kHz: seconds of each step (aim: all below 60 s)")
    for title in ("hidden", "said", *steps, "all", "records simulated"):
        table.add_column(title, justify="left" if title in ("hidden", "said") else "right")
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder, "base.yaml")
        base.write_text(BASE.replace("SECONDS", f"{seconds:g}"), encoding="utf-8")
        scenario = hdsim.load_scenario(base)
        diagnose([record_of(scenario)], scenario)  # compile and import
        for name in chosen:
            hidden = Path(folder, f"{name}.yaml")
            effects = "" if name == "nothing" else f"effects: {{{name}: {HIDDEN.get(name, {})}}}\n"
            hidden.write_text(f"extends: base.yaml\n{effects}", encoding="utf-8")
            record = record_of(hdsim.load_scenario(hidden))
            began = time.perf_counter()
            found = diagnose([record], scenario)
            whole = time.perf_counter() - began
            verdict = found.verdict
            said = " + ".join(effect.name for effect in verdict.effects) or verdict.verdict
            runs = sum(predictor.runs for predictor in found.bench.predictors)
            spent = (f"{verdict.seconds.get(step, 0.0):.1f}" for step in steps)
            table.add_row(name, said, *spent, f"{whole:.1f}", str(runs))
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
