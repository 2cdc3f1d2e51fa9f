"""What only the model can tell: scales of torques that stand alone, and logs of other drives."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario
from test_real_data import KINOVA, ROOT

import hdsim
from hdsim.diagnosis import base as base_model
from hdsim.diagnosis import workflow
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.check import check_record
from hdsim.estimate.predict import PredictionError, predictors
from hdsim.estimate.records import Record, record_from
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.estimate.suspect import suspicions

TOTAL = 6.93e-5 + 0.50002 / 1e4


def suspected(records, model, holdout=(), load=None):
    ratio = model.drive.ratio
    assert not [p for r in [*records, *holdout] for p in check_record(r, ratio).errors]
    bench = Bench(predictors(records, ratio, load=load), predictors(list(holdout), ratio, load=load))
    start = state_of(model)
    return suspicions(bench, refit(bench, start), start)


def scaled(name="r", torque=1.0, motor=1.0, **more) -> Record:
    r = rigid_record(4.0, **more)
    channels = {
        "motor_angle": motor * r.channels["motor_angle"],
        "motor_torque": torque * r.channels["motor_torque"],
    }
    return Record(name, r.time, channels)


@pytest.mark.parametrize(
    "record",
    [
        scaled(),
        scaled(inertia=1.5 * TOTAL, coulomb=0.06),
        scaled(coulomb=0.25),
        scaled(torque=1.6),
        scaled(extra=lambda angle, velocity: 0.05 * np.sin(2 * angle)),
        scaled(coulomb=0.0, viscous=0.0),
    ],
)
def test_this_drive_with_other_numbers_or_an_effect_is_not_suspected(tmp_path, record):
    assert suspected([record], scenario(tmp_path)) == []


@pytest.mark.parametrize(
    ("record", "kind", "words"),
    [
        (scaled(torque=1000.0), "unit", ["1000 times", "mN m for N m"]),
        (scaled(torque=1e-3), "unit", ["0.001 times", "wrong by 1000"]),
        (scaled(torque=-1.0), "sign", ["-1 times", "sign reversed"]),
        (scaled(torque=-100.0), "side", ["-100 times", "other side of the gear"]),
        (scaled(torque=-0.01), "side", ["-0.01 times", "other side of the gear"]),
        (scaled(torque=180 / np.pi), "unit", ["57.3 times", "degrees"]),
        (scaled(motor=1 / (2 * np.pi)), "unit", ["6.3 times", "acceleration", "revolutions"]),
        (scaled(motor=-1.0), "sign", ["-1 times", "sign reversed"]),
        (scaled(inertia=12 * TOTAL), "ratio", ["times", "of another drive"]),
    ],
)
def test_a_torque_alone_is_held_against_the_model(tmp_path, record, kind, words):
    (found,) = suspected([record], scenario(tmp_path))
    assert (found.channel, found.kind, found.severity) == ("motor_torque", kind, "warning")
    for word in words:
        assert word in found.message


def test_a_holdout_of_another_drive_is_suspected_and_one_of_another_rate_is_not(tmp_path):
    model = scenario(tmp_path)
    other = scaled("other", inertia=2.5 * TOTAL, coulomb=0.09)
    (found,) = suspected([scaled("mine")], model, [other])
    assert (found.record, found.kind) == ("other", "drive")
    assert "times as much as the records that it was fitted to" in found.message
    r = rigid_record(4.0, seed=3)
    slower = Record("slower", r.time[::2], {name: values[::2] for name, values in r.channels.items()})
    assert suspected([scaled("mine")], model, [slower]) == []
    assert suspected([scaled("mine"), slower], model) == []


DRIVE = """
name: NAME
drive: {preset: PRESET, mesh: {model: lumped}}
command:
  motor: {type: motion, trajectory: {type: sine, amplitude_deg: 3000, frequency_hz: 0.5}}
load: {inertia_kg_m2: LOAD}
run: {duration_s: 2.0, sample_rate_hz: 500}
"""


def drive(tmp_path, preset, load):
    path = tmp_path / f"{preset}.yaml"
    path.write_text(DRIVE.replace("NAME", preset).replace("PRESET", preset).replace("LOAD", str(load)))
    return hdsim.load_scenario(path)


def test_a_log_of_another_drive_is_told_by_its_ratio_or_suspected_by_its_torque(tmp_path):
    small, large = drive(tmp_path, "csg-14-50", 0.01), drive(tmp_path, "csg-25-160", 2.0)
    record = record_from(hdsim.simulate(small), "small")
    with pytest.raises(InputError, match=r"small: output_angle: ratio: .*is -50.*ratio -160"):
        workflow.diagnose([record], large)
    alone = {name: record.channels[name] for name in ("motor_angle", "motor_torque")}
    found = suspected([Record("small", record.time, alone)], large)
    assert [p.kind for p in found] == ["ratio"]
    assert "of another drive" in found[0].message


def test_force_goes_on_in_spite_of_an_error(tmp_path, monkeypatch):
    def went_on(bench, start, begun):
        raise InputError(f"went on with {len(bench.series)} channel")

    monkeypatch.setattr(base_model, "refit", went_on)
    record = scaled(motor=180 / np.pi)
    model = scenario(tmp_path)
    with pytest.raises(InputError, match="rev/min"):
        workflow.diagnose([record], model)
    with pytest.raises(InputError, match="went on with 1 channel"):
        workflow.diagnose([record], model, force=True)


def test_a_re_fit_that_fails_once_all_begins_anew_is_told(tmp_path, monkeypatch):
    fitted = []

    def fails_at_last(bench, start, begun):
        if fitted:
            raise PredictionError("it ran away")
        fitted.append(refit(bench, start))
        return fitted[0]

    monkeypatch.setattr(base_model, "refit", fails_at_last)
    monkeypatch.setattr(workflow, "search", lambda *_, **options: SimpleNamespace(anew=True, fit=None))
    with pytest.raises(InputError, match="r: the model cannot follow the measured motion: it ran away"):
        workflow.diagnose([scaled()], scenario(tmp_path))


def test_a_motion_that_no_model_follows_is_told(tmp_path):
    with pytest.raises(InputError, match="r: the model cannot follow the measured motion: RunawayError"):
        workflow.diagnose([scaled(motor=10800 / np.pi)], scenario(tmp_path), force=True)


@pytest.mark.skipif(not KINOVA.exists(), reason="the recordings are not here")
@pytest.mark.parametrize("joint", [1, 6])
def test_a_real_joint_under_a_base_that_lacks_friction_is_not_suspected(joint):
    base = ROOT / "scenarios" / "bases" / "kinova_rigid.yaml"
    mapping = ROOT / "scenarios" / "mappings" / f"kinova_joint_{joint}.yaml"
    record = record_from(hdsim.import_recording(KINOVA / "opti_traj_testing1.csv", mapping), f"joint {joint}")
    assert suspected([record], hdsim.load_scenario(base), load="output_torque") == []


def test_a_number_that_later_fits_bring_back_is_no_longer_suspected(tmp_path):
    model, record = scenario(tmp_path), scaled(coulomb=0.25)
    bench, start = Bench(predictors([record], model.drive.ratio)), state_of(model)
    base = refit(bench, start)
    assert suspicions(bench, base, start) == []
    k = [free.name for free in base.fit.frees].index("drive.friction.coulomb_nm")
    bent = base.fit.theta.copy()
    bent[k] = base.fit.frees[k].given + np.log(100.0)
    (found,) = suspicions(bench, replace(base, fit=replace(base.fit, theta=bent)), start)
    assert "drive.friction.coulomb_nm is 100 times" in found.message
    # A later fit begins where the re-fit ended: its own factor of 1 is still 100 times the model's number.
    frees = list(base.fit.frees)
    frees[k] = frees[k].moved(bent[k])
    bent[k] = 0.0
    (again,) = suspicions(bench, replace(base, fit=replace(base.fit, frees=frees, theta=bent)), start)
    assert "drive.friction.coulomb_nm is 100 times" in again.message
    bent[k] = -np.log(100.0)
    assert suspicions(bench, replace(base, fit=replace(base.fit, frees=frees, theta=bent)), start) == []
