"""What ten records of a joint cost beside one: processor time and memory of a fit and of a diagnosis.

    python benchmarks/many_records.py [RECORDS]

Each record is a swing of its own of a joint with Stribeck friction and a torque ripple, 4 s at 1 kHz, written
down here with NumPy; the model is a rigid drive without either. Each case runs in its own process and has
its own peak memory; "of proportion" is below 1 where a record among many costs less than one alone.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

MODEL: dict[str, Any] = {
    "name": "rigid, without friction",
    "drive": {
        "preset": "csg-20-100",
        "inertia": {"motor_kg_m2": 3.0e-5, "wave_generator_kg_m2": 1.0e-5},
        "friction": {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0},
        "mesh": {"model": "rigid"},
    },
    "command": {"motor": {"type": "free"}},
    "load": {"inertia_kg_m2": 0.05},
    "run": {"duration_s": 1.0},
}
RATIO, INERTIA_KG_M2 = 100.0, 4.0e-5 + 0.05 / 100.0**2


def swing(seed: int) -> Any:
    """A measured record of the joint."""
    from hdsim.estimate.records import Record

    rng = np.random.default_rng(seed)
    time_s = np.arange(4000) * 1e-3
    rates, sizes = 2 * np.pi * rng.uniform(0.3, 1.5, 2), rng.uniform(5.0, 25.0, 2)
    angle = sum(a * (1 - np.cos(w * time_s)) for a, w in zip(sizes, rates, strict=True))
    velocity = sum(a * w * np.sin(w * time_s) for a, w in zip(sizes, rates, strict=True))
    acceleration = sum(a * w * w * np.cos(w * time_s) for a, w in zip(sizes, rates, strict=True))
    friction = np.tanh(velocity / 0.5) * (0.02 + 0.015 * np.exp(-((velocity / 8.0) ** 2))) + 1e-4 * velocity
    torque = INERTIA_KG_M2 * acceleration + friction + 0.006 * np.sin(5 * angle + 0.4)
    channels = {
        "motor_angle": angle + 2e-5 * rng.standard_normal(len(angle)),
        "motor_torque": torque + 1e-3 * rng.standard_normal(len(angle)),
    }
    return Record(f"swing {seed}", time_s, channels)


def one(task: str, count: int) -> None:
    """Do a task with so many records and print what it took."""
    import hdsim
    from hdsim.diagnosis.workflow import diagnose
    from hdsim.scenario import Scenario

    scenario = Scenario.model_validate(MODEL)
    records = [swing(k) for k in range(count)]
    began = time.process_time()
    if task == "fit":
        hdsim.fit(records, scenario)
        found = ""
    else:
        found = ", ".join(effect.name for effect in diagnose(records, scenario).verdict.effects)
    seconds = time.process_time() - began
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"seconds": seconds, "megabytes": megabytes, "found": found}))


def main() -> None:
    """Run each task with one record and with many."""
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    print(f"{'':10}{'1 record':>20}{f'{many} records':>20}{'of proportion':>15}  found")
    for task in ("fit", "diagnose"):
        got = []
        for count in (1, many):
            out = subprocess.run(
                [sys.executable, __file__, task, str(count)], check=True, capture_output=True, text=True
            )
            got.append(json.loads(out.stdout))
        cells = "".join(f"{g['seconds']:>10.1f} s{g['megabytes']:>5.0f} MB" for g in got)
        ratio = got[1]["seconds"] / got[0]["seconds"] / many
        print(f"{task:10}{cells:>40}{ratio:>15.2f}  {got[1]['found']}")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        one(sys.argv[1], int(sys.argv[2]))
    else:
        main()
