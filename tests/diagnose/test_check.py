import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.errors import InputError
from hdsim.estimate.check import check_record
from hdsim.estimate.factors import explain
from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import Record, record_from
from hdsim.estimate.spikes import find_spikes
from hdsim.recording import Column, Recording, Table

RATIO = -100.0


def record(**channels) -> Record:
    t = np.arange(4000) / 1000.0
    motor = 60.0 * np.sin(2 * np.pi * 0.7 * t)
    given = {"motor_angle": motor, "output_angle": motor / RATIO} | channels
    return Record("r", t, {name: np.array(values) for name, values in given.items()})


def kinds(checked) -> set[tuple[str, str]]:
    return {(p.channel, p.kind) for p in checked.problems}


def test_clean_data_have_no_problem():
    assert check_record(record(), RATIO).problems == []


@given(st.floats(1e-6, 1e2), st.integers(0, 50))
@settings(max_examples=30, deadline=None)
def test_noise_floor_is_that_of_the_noise(deviation, seed):
    t = np.arange(5000) / 1000.0
    values = 50 * deviation * np.sin(2 * np.pi * 1.3 * t)
    values += deviation * np.random.default_rng(seed).standard_normal(len(t))
    assert noise_floor(values, np.ones(len(t), dtype=bool)) == pytest.approx(deviation, rel=0.1)


def test_spikes_are_masked_counted_and_nothing_else_is():
    rng = np.random.default_rng(1)
    t = np.arange(4000) / 1000.0
    torque = 0.3 * np.sin(2 * np.pi * t) + 0.01 * rng.standard_normal(4000)
    where = np.array([500, 1200, 1201, 3000])
    torque[where] += 0.8
    r = record(motor_torque=torque)
    found = [p for p in check_record(r, RATIO).problems if p.kind == "spikes"]
    assert [p.count for p in found] == [4]
    assert not r.trusted["motor_torque"][where].any()
    assert r.trusted["motor_torque"].sum() == 3996


def test_a_step_and_a_corner_are_no_spikes():
    t = np.arange(2000) / 1000.0
    values = np.where(t < 1.0, 0.0, 1.0) + 10 * np.abs(t - 0.5)
    values += 1e-3 * np.random.default_rng(2).standard_normal(2000)
    assert not find_spikes(values, np.ones(2000, dtype=bool)).any()


def test_gaps_missing_dead_and_saturated_channels_are_said():
    t = np.arange(4000) / 1000.0
    torque = np.clip(np.sin(2 * np.pi * t), -0.8, 0.8)
    missing = np.sin(t)
    missing[100:150] = np.nan
    r = record(motor_torque=torque, output_torque=missing, temperature=np.full(4000, 25.0))
    r.time[2000:] += 0.2
    found = kinds(check_record(r, RATIO))
    assert {("time", "gap"), ("motor_torque", "saturated"), ("output_torque", "missing")} <= found
    assert ("temperature", "dead") in found


@pytest.mark.parametrize(
    ("change", "kind"),
    [(180 / np.pi, "unit"), (-1.0, "sign"), (100.0, "side"), (1 / (2 * np.pi), "unit"), (1.25, "ratio")],
)
def test_wrong_units_sides_signs_and_ratios_are_suspected(change, kind):
    r = record()
    r.channels["output_angle"] = r.channels["output_angle"] * change
    problems = check_record(r, RATIO).errors
    assert [(p.channel, p.kind) for p in problems] == [("output_angle", kind)]
    assert f"{change:.4g}" in problems[0].message


def test_a_velocity_in_degrees_is_suspected():
    t = np.arange(4000) / 1000.0
    velocity = 60 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * t) * 180 / np.pi
    assert ("motor_velocity", "unit") in kinds(check_record(record(motor_velocity=velocity), RATIO))


def test_a_velocity_of_the_side_whose_angle_is_not_there_is_checked_over_the_ratio():
    t = np.arange(4000) / 1000.0
    velocity = 60 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * t) / RATIO
    motor = record().channels["motor_angle"]
    for factor, kinds in (
        (1.0, []),
        (30 / np.pi, ["unit"]),
        (-1.0, ["sign"]),
        (RATIO, ["side"]),
        (1.6, ["ratio"]),
    ):
        r = Record("r", t, {"motor_angle": motor, "output_velocity": factor * velocity})
        problems = check_record(r, RATIO).errors
        assert [p.kind for p in problems if p.kind != "dead"] == kinds


def test_torques_of_both_sides_tell_a_turned_sign_and_suspect_a_unit():
    t = np.arange(4000) / 1000.0
    torque = 20 * np.sin(2 * np.pi * 0.7 * t)
    motor = torque / RATIO
    for factor, severity, kind in (
        (-1.0, "error", "sign"),
        (1000.0, "warning", "unit"),
        (RATIO, "error", "side"),
    ):
        r = record(output_torque=torque, motor_torque=factor * motor)
        (problem,) = check_record(r, RATIO).problems
        assert (problem.channel, problem.severity, problem.kind) == ("motor_torque", severity, kind)
    # An unloaded drive carries little beside its motor's inertia.
    (problem,) = check_record(record(output_torque=torque, motor_torque=8 * motor), RATIO).problems
    assert problem.severity == "warning"


def test_saturated_samples_are_masked_and_too_many_stop():
    t = np.arange(4000) / 1000.0
    torque = np.sin(2 * np.pi * 0.7 * t) + 1e-3 * np.random.default_rng(0).standard_normal(4000)
    for limit, severity in ((0.9, "warning"), (0.4, "error")):
        r = record(motor_torque=np.clip(torque, -limit, limit))
        (problem,) = check_record(r, RATIO).problems
        assert (problem.kind, problem.severity) == ("saturated", severity)
        assert (~r.trusted["motor_torque"]).sum() == problem.count == (np.abs(torque) >= limit).sum()


def test_right_factor_needs_no_explanation():
    assert explain(1.01, 100) is None
    assert explain(-1.0, 100) is not None


def test_a_recording_too_short_or_of_other_channels_is_refused():
    t = np.arange(10) / 10
    with pytest.raises(InputError, match="10 samples"):
        record_from(Recording({"state": Table(t, {"motor_angle": Column(t, "rad")})}))
    t = np.arange(1000) / 10
    with pytest.raises(InputError, match="no channel of motor_angle"):
        record_from(Recording({"state": Table(t, {"speed": Column(t, "rad")})}))


def slipping(seed=0):
    """An angle and its velocity at 1 kHz, and the samples at which its log has repeated or lost one."""
    rng = np.random.default_rng(seed)
    seen, slips = np.arange(4000), np.zeros(4000, dtype=bool)
    for start in range(400, 3800, 190):
        seen[start:] -= 1  # repeated
        seen[start + 60 :] += 1  # lost
        slips[[start, start + 60]] = True
    t = np.arange(4000) / 1000.0
    angle = (1.0 - np.cos(2 * np.pi * 0.35 * t))[seen] + 1e-5 * rng.standard_normal(4000)
    velocity = (2 * np.pi * 0.35 * np.sin(2 * np.pi * 0.35 * t))[seen] + 2e-3 * rng.standard_normal(4000)
    return angle, velocity, slips


def test_repeated_and_lost_samples_are_left_out_of_the_motors_torque():
    angle, velocity, slips = slipping()
    torque = velocity + 0.01 * np.random.default_rng(1).standard_normal(4000)
    r = record(output_angle=angle, motor_angle=-100 * angle, output_velocity=velocity, motor_torque=torque)
    [found] = [p for p in check_record(r, RATIO).problems if p.kind == "slips"]
    fast = slips & (np.abs(velocity) > 0.3)
    assert found.channel == "output_angle"
    assert fast.sum() <= found.count <= slips.sum()
    assert not r.trusted["motor_torque"][fast].any()
    assert r.trusted["motor_torque"].sum() > 4000 - 21 * found.count - 1
    assert r.trusted["output_velocity"].all()


@pytest.mark.parametrize("read", ["noisy", "quantised", "filtered"])
def test_an_angle_and_a_velocity_that_agree_have_no_slips(read):
    t = np.arange(4000) / 1000.0
    rng = np.random.default_rng(3)
    angle = 0.3 * np.sin(2 * np.pi * 0.7 * t) + 0.1 * np.abs(np.sin(2 * np.pi * 0.3 * t))
    velocity = np.gradient(angle, t)
    if read == "noisy":
        angle, velocity = (
            angle + 1e-5 * rng.standard_normal(4000),
            velocity + 5e-3 * rng.standard_normal(4000),
        )
    elif read == "quantised":
        angle, velocity = np.round(angle / 1e-4) * 1e-4, np.round(velocity / 0.01) * 0.01
    else:
        velocity = np.convolve(velocity, np.ones(15) / 15)[:4000]
    r = record(output_angle=angle, output_velocity=velocity, motor_torque=rng.standard_normal(4000))
    assert not [p for p in check_record(r, RATIO).problems if p.kind == "slips"]
