"""Many joints advanced together are the same joints advanced alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim.scenario import Scenario
from hdsim.simulation.run import RunFailed

ROOT = Path(__file__).parents[2]
LOADS = (0.2, 0.5, 1.5)


@pytest.fixture(scope="module")
def base() -> Scenario:
    scenario = hdsim.load_scenario(ROOT / "scenarios" / "seed_move.yaml")
    return scenario.with_(drive={"preset": "csg-20-100", "mesh": {"model": "lumped"}})


@pytest.fixture(scope="module")
def drives(base: Scenario) -> list[Scenario]:
    """They differ in inertia, and in the seed of their kinematic error."""
    return [base.with_({"load.inertia_kg_m2": load, "run.seed": k}) for k, load in enumerate(LOADS)]


@pytest.mark.parametrize("threads", [1, 2])
def test_each_drive_goes_through_the_very_steps_of_a_plant_of_its_own(
    drives: list[Scenario], threads: int
) -> None:
    together = hdsim.plants(drives, motor="torque", threads=threads)
    alone = [hdsim.plant(one, motor="torque") for one in drives]
    torques = np.array([0.1, 0.15, -0.1])
    for k in range(6):
        # The load goes in a straight line over the step.
        line = (0.5 * k, 0.5 * (k + 1))
        together.step(2e-3, {"motor_torque": torques, "load_torque": line})
        for torque, one in zip(torques, alone, strict=True):
            one.step(2e-3, {"motor_torque": float(torque), "load_torque": line})
    found = together.values()
    assert found.keys() == together.outputs.keys()
    for name, values in found.items():
        assert values.tolist() == [one.values([name])[name] for one in alone], name
    assert len(set(found["output_angle"].tolist())) == len(drives)


def test_drives_are_reset_one_by_one(drives: list[Scenario]) -> None:
    batch = hdsim.plants(drives, motor="torque")
    batch.step(1e-3, {"motor_torque": 0.2})
    first = batch.values(["motor_angle"])["motor_angle"]
    batch.step(1e-3)
    batch.reset(np.array([False, True, False]))
    assert batch.time_s.tolist() == [2e-3, 0.0, 2e-3]
    batch.step(1e-3, {"motor_torque": 0.2})
    again = batch.values(["motor_angle"])["motor_angle"]
    assert again[1] == first[1]
    assert (again[[0, 2]] > first[[0, 2]]).all()


def test_drives_that_are_built_otherwise_are_refused(base: Scenario) -> None:
    other = base.with_({"effects.output_backlash": {}})
    with pytest.raises(hdsim.InputError, match=r"drive 1 of the batch is built otherwise"):
        hdsim.plants([base, other], motor="torque")


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({"torque": 1.0}, "no input 'torque'; there are: motor_torque, load_torque"),
        ({"motor_torque": [1.0, 2.0]}, r"found shape \(2,\), expected a number or \(3,\)"),
        ({"motor_torque": np.nan}, "not finite"),
    ],
)
def test_wrong_inputs_are_named(drives: list[Scenario], inputs: dict[str, object], said: str) -> None:
    with pytest.raises(hdsim.InputError, match=said):
        hdsim.plants(drives, motor="torque").step(1e-3, inputs)


def test_a_drive_that_fails_is_named_and_all_stay_where_they_are(drives: list[Scenario]) -> None:
    batch = hdsim.plants(drives, motor="torque")
    with pytest.raises(RunFailed, match=r"drive 2: .*exceeds"):
        batch.step(1.0, {"motor_torque": [0.0, 0.0, 1e6]})
    assert batch.time_s.tolist() == [0.0, 0.0, 0.0]
    assert batch.values(["motor_angle"])["motor_angle"].tolist() == [0.0, 0.0, 0.0]
