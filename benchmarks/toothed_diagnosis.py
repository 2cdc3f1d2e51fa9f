"""A diagnosis of a drive with all its teeth: processor seconds, the gap before and after, what is named.

    python benchmarks/toothed_diagnosis.py [--mesh teeth] [--hidden EFFECT] [--seconds 8]

The drive ``seed-2021`` swings an arm; seen are both encoders and the motor's torque, with noise, at 1 kHz.
The plant has an effect (Maxwell hysteresis) that the base, the same drive, lacks; ``--hidden nothing`` hides
none. Processor seconds count all threads; compiling is done by a prediction before.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 2e-5, "output_angle": 4e-6, "motor_torque": 6e-3}
NOTHING = "nothing"


def scenario_of(mesh: str, seconds: float, effects: dict[str, object]) -> Scenario:
    """The drive with an arm that swings by 30 degrees either way."""
    return Scenario.model_validate({
        "name": f"{mesh} drive with an arm",
        "drive": {"preset": "seed-2021", "mesh": {"model": mesh}},
        "effects": effects,
        "command": {"motor": {
            "type": "position",
            "at": "output",
            "trajectory": {"type": "sine", "amplitude_deg": 30.0, "frequency_hz": 0.25},
            "controller": {
                "type": "cascade",
                "position_gain_per_s": 30,
                "velocity_gain_nm_s_per_rad": 0.025,
                "velocity_integral_gain_nm_per_rad": 0.5,
            },
        }},
        "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": seconds, "sample_rate_hz": 1000.0},
    })  # fmt: skip


def record_of(scenario: Scenario, seed: int) -> Record:
    """A run as its sensors would show it."""
    run = hdsim.simulate(scenario)
    rng = np.random.default_rng(seed)
    channels = {c: run[c] + size * rng.standard_normal(len(run.time)) for c, size in NOISE.items()}
    return Record("benchmark", run.time, channels)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--mesh", default="tabulated", help="of the base")
    parser.add_argument("--plant", default="teeth", help="mesh of the plant")
    parser.add_argument("--hidden", default="torsional_hysteresis_maxwell")
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    given = parser.parse_args()
    hidden = {} if given.hidden == NOTHING else {given.hidden: {}}
    record = record_of(scenario_of(given.plant, given.seconds, hidden), given.seed)
    base = scenario_of(given.mesh, given.seconds, {})
    bench = bench_for([record], [], base, None)
    for _ in range(2):
        began = time.process_time()
        bench.predict(state_of(base))
        print(f"a prediction: {time.process_time() - began:.3f} processor seconds")
    began = time.process_time()
    found = diagnose([record], base, on_step=print)
    spent = time.process_time() - began
    print(f"{given.mesh}: {spent:.1f} processor seconds, {found.verdict.verdict}")
    for effect in found.verdict.effects:
        print(f"  named: {effect.name} {effect.settings}")
    for channel, gap in found.verdict.gap.items():
        print(f"  gap {channel}: {gap}")
    print(found.verdict.seconds)


if __name__ == "__main__":
    main()
