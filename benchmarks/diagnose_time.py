"""Processor seconds of a diagnosis, by step, over random cases: the whole catalogue against each.

    python benchmarks/diagnose_time.py [--cases 50] [--seed 0]

Each case draws a drive of the catalogue (size and ratio), an arm, a motion, the sensors, their noise and
their rate (20 s at 1 kHz in half of the cases, else 5 to 60 s at 250 Hz to 5 kHz), and hides an effect of a
random strength, or none; the diagnosis begins at the model without it. Aims: a median of 15 processor
seconds, and no case above 60. The first case is run once more before, so that compiling counts little.
Processor seconds count all threads.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.records import Record

#: Aims, processor seconds.
MEDIAN, LONGEST = 15.0, 60.0
STEPS = ("check", "compare", "refit", "locate", "screen", "fit", "again", "curve", "prove")
#: Sizes with the ratios that are drawn, and an arm's mass (kg) that suits the rated torque.
SIZES = {14: 1.5, 17: 2.5, 20: 4.0, 25: 7.0}
RATIOS = (50, 80, 100)
RATES = (250.0, 500.0, 1000.0, 2000.0, 5000.0)
SENSORS = {
    "motor": ("motor_angle", "motor_torque"),
    "both": ("motor_angle", "motor_torque", "output_angle"),
    "all": ("motor_angle", "motor_torque", "output_angle", "output_torque"),
}
#: Effects that are hidden, with the number that is drawn between the two (in logarithm), or none.
HIDDEN: dict[str, tuple[str, float, float] | None] = {
    "": None,
    "stribeck_friction": ("extra_static_nm", 0.005, 0.05),
    "kinematic_error": ("amplitude_arcmin", 0.2, 2.0),
    "motor_torque_ripple": ("cogging_nm", 0.005, 0.05),
    "torsional_hysteresis_maxwell": None,
    "output_backlash": ("backlash_arcmin", 0.3, 3.0),
    "load_dependent_loss": None,
}


@dataclass(frozen=True)
class Case:
    """A drawn case: the base and what it hides as scenario texts, the channels and their noise."""

    hidden: str
    rate_hz: float
    seconds: float
    base: str
    effects: dict[str, object]
    channels: tuple[str, ...]
    noise: dict[str, float]


def drawn(rng: np.random.Generator) -> Case:
    """A random case."""
    size, ratio = int(rng.choice(list(SIZES))), int(rng.choice(RATIOS))
    ordinary = rng.random() < 0.5
    rate = 1000.0 if ordinary else float(rng.choice(RATES))
    seconds = 20.0 if ordinary else float(np.round(np.exp(rng.uniform(np.log(5.0), np.log(60.0)))))
    mass = SIZES[size]
    swing, often = rng.uniform(20.0, 60.0), rng.uniform(0.1, 0.4)
    chirp = rng.random() < 0.3
    trajectory = {"type": "sine", "amplitude_deg": float(swing), "frequency_hz": float(often)}
    if chirp:
        trajectory = {
            "type": "chirp", "amplitude_deg": float(0.1 * swing), "start_frequency_hz": float(0.2 * often),
            "end_frequency_hz": float(10.0 * often), "duration_s": seconds,
        }  # fmt: skip
    base = {
        "name": "benchmark of the diagnosis",
        "drive": {"preset": f"csg-{size}-{ratio}", "mesh": {"model": "lumped"}},
        "command": {
            "motor": {
                "type": "position",
                "at": "output",
                "trajectory": trajectory,
                "controller": {
                    "type": "cascade",
                    "position_gain_per_s": 30,
                    "velocity_gain_nm_s_per_rad": 0.025 * mass / 4.0,
                    "velocity_integral_gain_nm_per_rad": 0.5 * mass / 4.0,
                },
            }
        },
        "load": {
            "inertia_kg_m2": 0.125 * mass,
            "gravity": {"mass_kg": mass, "centre_of_mass_m": 0.3},
        },
        "run": {"duration_s": seconds, "sample_rate_hz": rate},
    }
    name = str(rng.choice(list(HIDDEN)))
    own: dict[str, object] = {}
    if (field := HIDDEN[name]) is not None:
        value = float(np.exp(rng.uniform(np.log(field[1]), np.log(field[2]))))
        own = {field[0]: value}
        if name == "kinematic_error":
            own = {"components": [{"order": 2, field[0]: value}]}
        elif name == "motor_torque_ripple":
            own = {"components": [{"order": int(rng.choice([2, 6, 12])), field[0]: value}]}
    factor = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    noise = {
        "motor_angle": 2e-5,
        "output_angle": 4e-6,
        "motor_torque": 1.5e-3 * mass,
        "output_torque": 0.04 * mass,
    }
    return Case(
        name,
        rate,
        seconds,
        json.dumps(base),
        {name: own} if name else {},
        SENSORS[str(rng.choice(list(SENSORS)))],
        {channel: factor * value for channel, value in noise.items()},
    )


def record_of(case: Case, scenario: hdsim.Scenario, rng: np.random.Generator) -> Record:
    """A run as its sensors would show it."""
    run = hdsim.simulate(scenario)
    channels = {c: run[c] + case.noise[c] * rng.standard_normal(len(run.time)) for c in case.channels}
    return Record("benchmark", run.time, channels)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--cases", type=int, default=50, help="how many")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    table = Table(title="processor seconds of a diagnosis, by step")
    for title in ("case", "hidden", "said", "samples", "of", *STEPS, "all"):
        table.add_column(title, justify="left" if title in ("hidden", "said") else "right")
    console = Console(width=190)
    spent: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        # The first one compiles and imports, and is not counted.
        for number in range(-1, given.cases):
            rng = np.random.default_rng([given.seed, max(number, 0)])
            case = drawn(rng)
            base, whole = Path(folder, "base.yaml"), Path(folder, "hidden.yaml")
            base.write_text(case.base, encoding="utf-8")
            whole.write_text(json.dumps({"extends": "base.yaml", "effects": case.effects}), encoding="utf-8")
            record = record_of(case, hdsim.load_scenario(whole), rng)
            began = time.process_time()
            found = diagnose([record], hdsim.load_scenario(base)).verdict
            seconds = time.process_time() - began
            if number < 0:
                continue
            spent.append(seconds)
            said = " + ".join(effect.name for effect in found.effects) or found.verdict
            steps = [f"{found.seconds.get(step, 0.0):.1f}" for step in STEPS]
            count = f"{len(record.time)}, {case.rate_hz:g} Hz"
            row = [
                str(number),
                case.hidden or "nothing",
                said,
                count,
                str(found.readings),
                *steps,
                f"{seconds:.1f}",
            ]
            table.add_row(*row)
            console.print(*row[:3], row[-1], sep=" | ")
    console.print(table)
    for what, value, aim in (
        ("median", float(np.median(spent)), MEDIAN),
        ("nine tenths", float(np.quantile(spent, 0.9)), None),
        ("longest", max(spent), LONGEST),
    ):
        kept = "" if aim is None else f" (aim: {aim:g}, {'met' if value <= aim else 'missed'})"
        console.print(f"{what}: {value:.1f} processor seconds{kept}")


if __name__ == "__main__":
    main()
