"""Baselines beside a gap, on plants made with NumPy whose noise is known, and on a real joint."""

import sys
from pathlib import Path

import numpy as np
import pytest
from rig import model

import hdsim
from hdsim.cli import main
from hdsim.estimate.baseline import with_baselines
from hdsim.estimate.opening import bench_for
from hdsim.estimate.prove import gaps
from hdsim.estimate.records import Record, record_from
from hdsim.estimate.state import state_of

ROOT = Path(__file__).parents[2]
KINOVA = ROOT.parent / "shared/data/kinova-gen3-7dof/validation_data/opti_traj_testing1.csv"
#: Of a regression in plain NumPy over velocity, its sign, inertia and the sensor's torque, N m at the motor.
REGRESSED_NM = {1: 0.0085, 3: 0.0093, 4: 0.0102, 6: 0.0047}
NOISE = {"motor_torque": 2e-3, "output_angle": 3e-6}


def plant(hidden=lambda output, speed: 0.0, error=None, seconds=8) -> Record:
    """A swing of a rigid drive, ratio -100, by Newton's law: arm, friction, ripple of order 2, noise."""
    t = np.arange(seconds * 500) / 500.0
    parts = ((60.0, 2 * np.pi * 0.3), (8.0, 2 * np.pi * 1.1))
    angle, speed, rate = (
        sum(a * w**k * wave(w * t) for a, w in parts)
        for k, wave in enumerate((lambda x: 1 - np.cos(x), np.sin, np.cos))
    )
    rng = np.random.default_rng(3)
    torque = 1.2e-4 * rate + 0.03 * np.tanh(speed / 0.5) + 3.5e-4 * speed - 0.1 * np.sin(angle / -100 - 0.3)
    error_of_gear = 1e-4 * np.sin(4 * angle) + 1e-3 * torque
    torque = torque + 0.02 * np.sin(2 * angle + 0.4) + hidden(angle / -100, speed)
    noisy = NOISE["motor_torque"] * rng.standard_normal(len(t)) if error is None else error(rng, len(t))
    output = angle / -100 + error_of_gear + NOISE["output_angle"] * rng.standard_normal(len(t))
    return Record("plant", t, {"motor_angle": angle, "motor_torque": torque + noisy, "output_angle": output})


def beside(record: Record, tmp_path, **options):
    """The gaps of a model that is off by much, with their baselines."""
    scenario = model(tmp_path)
    bench, start = bench_for([record], [], scenario), state_of(scenario)
    gap, _ = gaps(bench, dict.fromkeys(("before", "refit", "after"), start))
    return with_baselines(bench, start, gap, **options)


def test_a_regression_leaves_the_noise_of_a_plant_that_is_linear_in_its_terms(tmp_path):
    for channel, gap in beside(plant(), tmp_path).items():
        assert gap.regression == pytest.approx(NOISE[channel], rel=0.05)
        low, high = gap.intervals["regression"]
        assert low < gap.regression < high
        assert gap.before > 3 * gap.regression
        assert gap.black_box is None


def test_records_with_and_without_a_known_load_are_one_regression(tmp_path):
    loaded, free = plant(seconds=6), plant(seconds=9)
    load = 20.0 * np.sin(2 * np.pi * 0.7 * loaded.time)
    loaded.channels |= {
        "load_torque": load,
        "motor_torque": loaded.channels["motor_torque"] - load / 100.0,
        "output_angle": loaded.channels["output_angle"] + 1e-5 * load,
    }
    loaded = Record("loaded", loaded.time, loaded.channels)
    scenario = model(tmp_path)
    bench, start = bench_for([loaded, free], [], scenario), state_of(scenario)
    gap, _ = gaps(bench, dict.fromkeys(("before", "refit", "after"), start))
    for channel, found in with_baselines(bench, start, gap).items():
        assert found.regression == pytest.approx(NOISE[channel], rel=0.15)


def test_the_noise_beside_a_gap_is_no_bound_where_errors_last(tmp_path):
    def lasting(rng, n):
        """White noise through a first-order lag of 20 samples, standard deviation 0.01."""
        steps = np.sqrt(1 - 0.95**2) * rng.standard_normal(n)
        found = np.zeros(n)
        for k in range(1, n):
            found[k] = 0.95 * found[k - 1] + 0.01 * steps[k]
        return found

    gap = beside(plant(error=lasting), tmp_path)["motor_torque"]
    assert gap.regression == pytest.approx(0.01, rel=0.15)
    assert gap.noise < 0.5 * gap.regression


@pytest.mark.slow
def test_only_a_black_box_follows_what_is_not_linear(tmp_path, monkeypatch):
    pytest.importorskip("sklearn")
    monkeypatch.setattr("hdsim.estimate.baseline.ROUNDS", 100)
    # A catch: the drag is there on one side of an angle, and only in one direction.
    record = plant(lambda output, speed: 0.08 * ((output < -0.7) & (speed > 0)), seconds=24)
    gap = beside(record, tmp_path, black_box=True)["motor_torque"]
    assert gap.regression > 5 * NOISE["motor_torque"]
    assert gap.black_box < 0.4 * gap.regression
    assert gap.black_box > 0.95 * NOISE["motor_torque"]


def test_a_black_box_adds_nothing_to_a_plant_without_more_to_learn(tmp_path, monkeypatch):
    pytest.importorskip("sklearn")
    monkeypatch.setattr("hdsim.estimate.baseline.ROUNDS", 30)
    gap = beside(plant(), tmp_path, black_box=True)["motor_torque"]
    assert gap.black_box == pytest.approx(gap.regression, rel=0.05)


def test_without_the_extra_a_black_box_is_refused_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "sklearn.ensemble", None)
    model(tmp_path)
    record = plant()
    columns = {
        c: hdsim.recording.Column(v, "rad" if "angle" in c else "N m") for c, v in record.channels.items()
    }
    hdsim.Recording({"state": hdsim.recording.Table(record.time, columns)}).save(tmp_path / "run.mcap")
    for command in ("fit", "diagnose"):
        with pytest.raises(SystemExit) as stop:
            main([command, str(tmp_path / "run.mcap"), "--model", str(tmp_path / "rig.yaml"), "--black-box",
                  "--out", str(tmp_path / "out")])  # fmt: skip
        assert stop.value.code == 2
        assert "pip install 'hdsim[baseline]'" in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not KINOVA.exists(), reason="the recordings are not here")
@pytest.mark.parametrize("joint", REGRESSED_NM)
def test_on_a_real_joint_it_leaves_no_more_than_numpy_did(joint):
    mapping = ROOT / "scenarios/mappings" / f"kinova_joint_{joint}.yaml"
    base = hdsim.load_scenario(ROOT / "scenarios/bases/kinova_rigid.yaml")
    bench = bench_for([record_from(hdsim.import_recording(KINOVA, mapping))], [], base, "output_torque")
    gap, _ = gaps(bench, dict.fromkeys(("before", "refit", "after"), state_of(base)))
    assert with_baselines(bench, state_of(base), gap)["motor_torque"].regression < 1.05 * REGRESSED_NM[joint]
