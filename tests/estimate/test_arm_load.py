"""A drive in an arm that moves as a whole: its load by the URDF, along the other joints' encoders."""

import numpy as np
import pytest

import hdsim
from hdsim.cli import main
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record, record_from

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

import arm_plant as plant


def test_a_payload_is_found_in_a_joint_whose_neighbours_move(tmp_path):
    joint = 1
    data, mapping = plant.record(tmp_path, joint)
    base = hdsim.load_scenario(plant.model(tmp_path, joint))
    measured = record_from(hdsim.import_recording(data, mapping))
    assert sorted(measured.joints) == [f"joint_{k + 1}" for k in range(6) if k != joint]
    fixed = ("load.arm.payload.lever_m", "load.arm.mass_factor", "motor_torque_gain")
    found = hdsim.fit([measured], base, fix=fixed)
    gap = found.gap["motor_torque"]
    assert gap.before > 2 * gap.after
    assert gap.after == pytest.approx(2e-3, rel=0.06)
    numbers = {number.name: number for number in found.intervals}
    mass = numbers["load.arm.payload.mass_kg"]
    assert mass.low < plant.MASS < mass.high
    assert mass.value == pytest.approx(plant.MASS, rel=0.03)
    # The regression knows the arm as it was believed to be, and not what the payload adds.
    assert gap.after < gap.regression


def test_a_joint_that_was_not_measured_is_named(tmp_path, capsys):
    data, mapping = plant.record(tmp_path, 1, 2.0)
    text = mapping.read_text(encoding="utf-8")
    mapping.write_text(
        "\n".join(line for line in text.splitlines() if "joint_4" not in line), encoding="utf-8"
    )
    with pytest.raises(SystemExit) as stop:
        main(["fit", str(data), "--mapping", str(mapping), "--model", str(plant.model(tmp_path, 1)),
              "--out", str(tmp_path / "out")])  # fmt: skip
    assert stop.value.code == 2
    assert "joint_4 is neither measured (joints of the mapping) nor given a motion" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_measured_joints_are_kept_in_a_log(tmp_path):
    data, mapping = plant.record(tmp_path, 1, 1.0)
    recording = hdsim.import_recording(data, mapping)
    recording.save(tmp_path / "run.mcap")
    again = record_from(hdsim.open_log(tmp_path / "run.mcap"))
    for name, values in record_from(recording).joints.items():
        assert np.array_equal(again.joints[name], values)


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 3])
def test_the_noise_of_other_joints_is_known_as_noise_of_the_load(tmp_path, joint):
    """Drawing them anew changes the load as much as reading them again does (parametric bootstrap)."""
    time, motion = plant.motions(8.0, 0)
    arm = hdsim.load_scenario(plant.model(tmp_path, joint, plant.MASS)).load.arm
    own = {"motor_angle": plant.RATIO * motion[0, :, joint], "motor_torque": np.sin(time)}

    def read(seed):
        noise = 2e-4 * np.random.default_rng(seed).standard_normal((len(time), 6))
        angles = motion[0] + noise
        others = {f"joint_{k + 1}": angles[:, k] for k in range(6) if k != joint}
        return predictors([Record("run", time, own, joints=others)], plant.RATIO, arm=arm)[0]

    def load(predictor):
        return predictor.course.torque(arm, time, motion[:, :, joint])[100:-100]

    once = read(4)
    apart = np.mean([np.var(load(read(seed)) - load(once)) / 2 for seed in (5, 6, 7)])
    drawn = np.mean([np.var(load(once.disturbed(seed)) - load(once)) for seed in (0, 1, 2)])
    # Other readings choose other knots.
    assert 0.6 < np.sqrt(drawn / apart) < 1.6


@pytest.mark.slow
def test_a_diagnosis_names_friction_and_not_what_the_neighbours_do(tmp_path):
    data, mapping = plant.record(tmp_path, 1)
    base = hdsim.load_scenario(plant.model(tmp_path, 1, payload=plant.MASS, coulomb=0.0))
    found = diagnose([record_from(hdsim.import_recording(data, mapping))], base).verdict
    assert len(found.effects) == 1
    names = {found.effects[0].name, *found.effects[0].indistinguishable_from}
    assert names <= {"input_coulomb_viscous", "load_side_friction", "stribeck_friction", "lugre_friction"}
    assert found.gap["motor_torque"].after < 1.05 * 2e-3
