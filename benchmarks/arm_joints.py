"""Joints 2 and 4 of an arm whose six joints all move, each with a hidden effect, diagnosed with its URDF.

    python benchmarks/arm_joints.py [draws] [first seed]

The arm is a forward simulation of MuJoCo with a controller in each joint (``tests/estimate/arm_forward.py``);
the drive of one joint is rigid, with friction and one thing that its model has not: the Coulomb part of that,
a motor's ripple, a kinematic error, or nothing. Each line says what was hidden and what was named; the last
counts. Compared are motor torque and output angle.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "estimate"))

import arm_forward as forward
import arm_plant as plant

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.records import Record

#: Names that count as right; the friction of a rigid drive acts on either side alike.
RIGHT = {
    "friction": {"input_coulomb_viscous", "load_side_friction", "stribeck_friction", "lugre_friction"},
    "ripple": {"motor_torque_ripple"},
    "kinematic error": {"kinematic_error"},
    "nothing": set(),
}
NOISE = {"motor_torque": 2e-3, "output_angle": 5e-6, "joint": 1e-5}


def record(joint: int, hidden: str, seed: int) -> Record:
    """Ten seconds of one joint's motor and output, and the encoders of all others."""
    rng = np.random.default_rng([seed, joint, 5])
    drawn = {
        "kinematic error": lambda: {
            "error_rad": rng.uniform(6e-5, 3e-4),
            "error_order": rng.choice([2.0, 4.0]),
            "phase": rng.uniform(0, 2 * np.pi),
        },
        "friction": lambda: {"coulomb_nm": rng.uniform(0.02, 0.1)},
        "ripple": lambda: {
            "ripple_order": rng.choice([1.0, 6.0, 12.0]),
            "ripple_nm": rng.uniform(0.005, 0.03),
            "phase": rng.uniform(0, 2 * np.pi),
        },
        "nothing": dict,
    }[hidden]()
    run = forward.run(joint, forward.Hidden(**drawn), 10.0, seed)
    channels = {
        "motor_angle": run["motor_angle"],
        "motor_torque": run["motor_torque"],
        "output_angle": run["joints"][:, joint],
    }
    count = len(run["time"])
    noisy = {c: v + NOISE.get(c, 0.0) * rng.standard_normal(count) for c, v in channels.items()}
    names = [f"joint_{k + 1}" for k in range(6)]
    others = {
        name: run["joints"][:, k] + NOISE["joint"] * rng.standard_normal(count)
        for k, name in enumerate(names)
        if k != joint
    }
    return Record(names[joint], run["time"], noisy, joints=others)


def main() -> None:
    """Run the draws."""
    draws, first = (int(a) for a in (sys.argv[1:] + ["20", "0"][len(sys.argv) - 1 :])[:2])
    right = wrong = silent = 0
    for seed in range(first, first + draws):
        for joint in (1, 3):
            hidden = list(RIGHT)[(seed + joint // 2) % len(RIGHT)]
            with tempfile.TemporaryDirectory() as folder:
                coulomb = 0.0 if hidden == "friction" else plant.COULOMB
                base = hdsim.load_scenario(plant.model(Path(folder), joint, plant.MASS, coulomb))
                begun = time.perf_counter()
                found = diagnose([record(joint, hidden, seed)], base).verdict
            named = [{effect.name, *effect.indistinguishable_from} for effect in found.effects]
            said = ", ".join(" or ".join(sorted(names)) for names in named) or found.verdict
            good = all(names & RIGHT[hidden] for names in named) and bool(named) == bool(RIGHT[hidden])
            good = good and found.verdict != "unknown"
            right, wrong = right + good, wrong + (bool(named) and not good)
            silent += not named and not good
            gap = found.gap["motor_torque"]
            word = "right" if good else "WRONG" if named else "silent"
            print(
                f"{seed:3d} joint {joint + 1}  {hidden:15s} {word:6s} {said}; "
                f"motor torque {1e3 * gap.before:.3g} to {1e3 * gap.after:.3g} mN m, "
                f"noise {1e3 * gap.noise:.3g} ({time.perf_counter() - begun:.0f} s)",
                flush=True,
            )
    print(f"{right} right, {wrong} with a wrong name, {silent} without one, of {2 * draws}")


if __name__ == "__main__":
    main()
