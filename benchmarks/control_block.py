"""The sampled block of ``control`` beside the one in continuous time: 0.2 s of a loop around the drive.

    python benchmarks/control_block.py

Processor time, and by how much the sampled block is faster than the other with BDF (``control`` chooses RK45
unless told otherwise, which the stiff ring makes many times slower).
"""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Any

import control as ct
import numpy as np

import hdsim

END_S = 0.2
LUMPED = {"drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}}}
CASES: dict[str, dict[str, Any]] = {
    "rigid": {"drive": {"preset": "csg-20-100", "mesh": {"model": "rigid"}}, "effects": {}},
    "lumped": LUMPED | {"effects": {}},
    "lumped, effects": LUMPED,
    "teeth, ring static": {"drive.mesh.ring": "static"},
    "tabulated": {"drive.mesh": {"model": "tabulated"}},
    "teeth": {},
}


def seconds(scenario: hdsim.Scenario, dt: float | None) -> float:
    """Processor time of a position loop; continuous without a period."""
    block = hdsim.io_system(scenario, dt_s=dt)
    gains = [[2.0]], [[0.5, -0.5, -0.02]]
    law = ([[0.0]], [[1.0, -1.0, 0.0]], *gains) if dt is None else ([[1.0]], [[dt, -dt, 0.0]], *gains, dt)
    names = ["reference", "motor_angle", "motor_velocity"]
    controller = ct.ss(*law, inputs=names, outputs=["motor_torque"], name="pid")
    joined = {"inputs": ["reference", "load_torque"], "outputs": ["motor_angle"], "check_unused": False}
    loop = ct.interconnect([block, controller], **joined)
    times = np.arange(round(END_S / (dt or 1e-3)) + 1) * (dt or 1e-3)
    inputs = np.vstack([np.full(len(times), 0.1), np.zeros(len(times))])
    options = {} if dt else {"solve_ivp_method": "BDF"}
    ct.input_output_response(loop, times[:3], inputs[:, :3], **options)
    taken = []
    for _ in range(3):
        start = time.process_time()
        ct.input_output_response(loop, times, inputs, **options)
        taken.append(time.process_time() - start)
    return min(taken)


def main() -> None:
    """Print a row for each mesh."""
    warnings.simplefilter("ignore")
    base = hdsim.load_scenario(Path(__file__).parents[1] / "scenarios" / "seed_move.yaml")
    print("| mesh | continuous, BDF | 1 kHz | ratio | 10 kHz | ratio |\n|---|---|---|---|---|---|")
    for name, changes in CASES.items():
        scenario = base.with_(changes)
        slow, coarse, fine = (seconds(scenario, dt) for dt in (None, 1e-3, 1e-4))
        ratios = f"{coarse:.2f} s | {slow / coarse:.1f} | {fine:.2f} s | {slow / fine:.1f}"
        print(f"| {name} | {slow:.2f} s | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
