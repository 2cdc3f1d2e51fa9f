"""Steps a second of ``hdsim.plant`` and ``hdsim.plants``, as ratios to ``hdsim.simulate`` for each step.

    python benchmarks/stepping.py [--drives 64] [--threads 1] [--dt-ms 1]

The loop is the same everywhere: a torque, a step, the output's angle. The ratio is to a loop that calls
``hdsim.simulate`` for every step, from where the last one ended. The median of five repetitions is shown.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import hdsim

ROOT = Path(__file__).parents[1]
MESHES = {"lumped": {"model": "lumped"}, "tabulated": {"model": "tabulated"}, "teeth": {}}
REPETITIONS = 5


def seconds_per_step(loop: Callable[[int], object], steps: int) -> float:
    """Median seconds of one step; the first call compiles and does not count."""
    loop(2)
    taken = []
    for _ in range(REPETITIONS):
        started = time.perf_counter()
        loop(steps)
        taken.append((time.perf_counter() - started) / steps)
    return statistics.median(taken)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=64)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--dt-ms", type=float, default=1.0)
    given = parser.parse_args()
    dt = 1e-3 * given.dt_ms
    base = hdsim.load_scenario(ROOT / "scenarios" / "seed_move.yaml")
    print(f"steps of {given.dt_ms:g} ms; a batch has {given.drives} drives and {given.threads} thread(s)")
    print(f"{'mesh':<10} {'simulate':>12} {'plant':>12} {'ratio':>7} {'plants':>12} {'ratio':>7}  steps/s")
    for name, mesh in MESHES.items():
        drive = {"preset": "seed-2021", **({"mesh": mesh} if mesh else {})}
        scenario = base.with_({"effects": {"kinematic_error": {}}}, drive=drive)

        def simulated(steps: int, scenario: hdsim.Scenario = scenario) -> None:
            angle = velocity = 0.0
            for _ in range(steps):
                one = scenario.with_(
                    {
                        "command.motor": {
                            "type": "torque",
                            "torque": {"type": "hold", "torque_nm": 0.05},
                        },
                        "load.torque": None,
                        "run.duration_s": dt,
                        "run.sample_rate_hz": 1.0 / dt,
                        "run.start.motor_angle_rad": angle,
                        "run.start.motor_velocity_rad_per_s": velocity,
                    }
                )
                result = hdsim.simulate(one)
                angle, velocity = float(result["motor_angle"][-1]), float(result["motor_velocity"][-1])

        plant = hdsim.plant(scenario, motor="torque", output="torque")

        def stepped(steps: int, plant: object = plant) -> None:
            plant.reset()
            for _ in range(steps):
                plant.step(dt, {"motor_torque": 0.05})
                plant.values(["output_angle"])

        drives = [scenario.with_({"run.seed": k}) for k in range(given.drives)]
        plants = hdsim.plants(drives, motor="torque", output="torque", threads=given.threads)
        torques = np.full(given.drives, 0.05)

        def batched(steps: int, plants: object = plants, torques: np.ndarray = torques) -> None:
            plants.reset()
            for _ in range(steps):
                plants.step(dt, {"motor_torque": torques})
                plants.values(["output_angle"])

        each = seconds_per_step(simulated, 10)
        alone = seconds_per_step(stepped, 300)
        together = seconds_per_step(batched, 30) / given.drives
        print(
            f"{name:<10} {1 / each:>12,.0f} {1 / alone:>12,.0f} {each / alone:>7.0f} {1 / together:>12,.0f} "
            f"{each / together:>7.0f}"
        )


if __name__ == "__main__":
    main()
