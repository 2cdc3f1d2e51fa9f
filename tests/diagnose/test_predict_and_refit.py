import math

import numpy as np
import pytest
from diagnose_bench import RATE, motion, rigid_record, scenario
from scipy.interpolate import CubicSpline, PPoly

from hdsim.diagnose.bench import Bench
from hdsim.diagnose.fit import base_intervals, robust_covariance
from hdsim.diagnose.freedom import Added, base_freedoms, state_of
from hdsim.diagnose.measured import Record
from hdsim.diagnose.predict import Predictor, plan_for, predictors
from hdsim.diagnose.refit import refit, tie, with_delays
from hdsim.diagnose.spline import smoothed
from hdsim.diagnose.suspect import delays
from hdsim.effects import catalogue
from hdsim.errors import InputError


def test_smoothing_lets_the_acceleration_jump_where_friction_turns():
    # A rotor with dry friction under a swinging torque never sticks; its acceleration jumps at each reversal.
    fine, step = 20, 1e-3
    speed = angle = 0.0
    rows = []
    for k in range(3000 * fine):
        t = k * step / fine
        rate = 900.0 * math.sin(4 * math.pi * t) - 150.0 * math.copysign(1.0, speed)
        if k % fine == 0:
            rows.append((t, angle, rate))
        angle += step / fine * (speed + 0.5 * step / fine * rate)
        speed += step / fine * rate
    t, true, acceleration = np.array(rows).T
    measured = true + 3e-4 * np.random.default_rng(3).standard_normal(len(t))
    inside = slice(200, -200)
    errors = []
    for may_jump in (False, True):
        breaks, c = smoothed(t, measured, motion=may_jump)
        errors.append(float(np.std((PPoly(c[::-1], breaks)(t, 2) - acceleration)[inside])))
    assert errors[1] < 0.7 * errors[0]
    # A motion without a jump is left as it is.
    t, angle, _, _ = motion(6.0)
    noisy = angle + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    assert len(smoothed(t, noisy, motion=True)[0]) == len(smoothed(t, noisy)[0])


def test_smoothing_follows_the_motion_and_not_the_noise():
    t, angle, velocity, acceleration = motion(6.0)
    noisy = angle + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    breaks, c = smoothed(t, noisy)
    at = np.clip(np.searchsorted(breaks, t, side="right") - 1, 0, len(breaks) - 2)
    dt = t - breaks[at]
    inside = slice(100, -100)
    found = c[0, at] + dt * (c[1, at] + dt * (c[2, at] + dt * c[3, at]))
    assert np.std((found - angle)[inside]) < 4e-4
    rate = c[1, at] + dt * (2 * c[2, at] + dt * 3 * c[3, at])
    assert np.std((rate - velocity)[inside]) < 1e-3 * velocity.std()
    second = 2 * c[2, at] + 6 * dt * c[3, at]
    assert np.std((second - acceleration)[inside]) < 0.02 * acceleration.std()


def test_prescribed_motion_predicts_newtons_torque(tmp_path):
    record = rigid_record(4.0, noise=0.0)
    (predictor,) = predictors([record], -100.0)
    predicted = predictor.predict(state_of(scenario(tmp_path)).candidate())["motor_torque"]
    assert np.std(predicted - record.channels["motor_torque"]) < 2e-5


def test_the_output_seen_through_the_ratio_stands_for_a_missing_motor_encoder(tmp_path):
    record = rigid_record(4.0, noise=0.0)
    other = Record("o", record.time, {
        "output_angle": record.channels["motor_angle"] / -100.0,
        "motor_torque": record.channels["motor_torque"],
    })  # fmt: skip
    (predictor,) = predictors([other], -100.0)
    assert predictor.plan.motion == "output_angle"
    predicted = predictor.predict(state_of(scenario(tmp_path)).candidate())["motor_torque"]
    assert np.std(predicted - record.channels["motor_torque"]) < 2e-5


def test_a_record_that_answers_nothing_is_refused_with_what_is_missing():
    t = np.arange(500) / 500.0
    with pytest.raises(InputError, match="a motion is needed"):
        plan_for(Record("r", t, {"motor_torque": np.sin(t)}))
    with pytest.raises(InputError, match="motor_torque, output_torque or"):
        plan_for(Record("r", t, {"motor_angle": np.sin(t)}))
    with pytest.raises(InputError, match="nothing can be predicted"):
        plan_for(Record("r", t, {"motor_angle": np.sin(t), "motor_torque": np.ones(500)}))


def test_a_wrong_inertia_and_friction_are_found_with_honest_intervals(tmp_path):
    record = rigid_record(8.0, inertia=1.3 * (6.93e-5 + 0.50002 / 1e4), coulomb=0.04)
    bench = Bench(predictors([record], -100.0))
    found = refit(bench, state_of(scenario(tmp_path)))
    by_name = {i.name: i for i in found.intervals}
    coulomb = by_name["drive.friction.coulomb_nm"]
    viscous = by_name["drive.friction.viscous_nm_s_per_rad"]
    gain = found.fit.state.gain
    # Nothing but the sensor ties torques to an absolute scale: products with its gain are what is measured.
    assert gain * coulomb.value == pytest.approx(0.04, rel=0.02)
    assert gain * viscous.value == pytest.approx(3.5e-4, rel=0.02)
    state = found.fit.state
    total = state.drive.inertia.motor_kg_m2 + 1.93e-5 + (state.load.inertia_kg_m2 + 2e-5) / 1e4
    assert gain * total == pytest.approx(1.3 * (6.93e-5 + 0.50002 / 1e4), rel=0.01)
    # Inertia and friction both a third too large: most simply the torque constant.
    assert not found.moved
    assert [i.name for i in tie(bench, found.before, found.fit, found.intervals)] == ["motor_torque_gain"]
    # Two inertias that only add up cannot both be determined by the motor's torque.
    assert not all(i.determined for i in found.intervals)


@pytest.mark.parametrize("late", [-0.6, 0.0, 1.4])
def test_a_torque_that_is_stamped_late_or_early_does_not_bend_the_friction(tmp_path, late):
    record = rigid_record(8.0, noise=5e-4)
    t, period = record.time, 1.0 / RATE
    shifted = CubicSpline(t, record.channels["motor_torque"])(np.clip(t - late * period, t[0], t[-1]))
    record = Record("r", t, {**record.channels, "motor_torque": shifted})
    bench = Bench(predictors([record], -100.0))
    found = refit(bench, state_of(scenario(tmp_path)))
    # What it leaves is all that the record lacks, so it is believed at once; else it is asked last.
    last = with_delays(bench, found.fit)
    assert last is None or late < 1.0
    by_name = {i.name: i for i in base_intervals(last or found.fit, found.freedoms)}
    delay, viscous = by_name["motor_torque_delay_s"], by_name["drive.friction.viscous_nm_s_per_rad"]
    assert delay.value == pytest.approx(late * period, abs=0.1 * period)
    assert delay.low <= late * period <= delay.high
    assert viscous.low <= 3.5e-4 <= viscous.high
    assert not delay.moved
    told = delays(bench, by_name.values())
    assert [(p.channel, p.kind, "early" in p.message) for p in told] == (
        [("motor_torque", "clock", late < 0)] if late else []
    )


def test_intervals_are_students_with_the_blocks_that_tell():
    rng = np.random.default_rng(5)
    blocks = np.repeat(np.arange(12), 40)
    inside = {"all": 0, "four": 0}
    for _ in range(400):
        # White noise and a shock a block: that and nothing else is what a block shares.
        rest = rng.standard_normal(480) + rng.standard_normal(12)[blocks]
        for name, told in (("all", np.ones(480)), ("four", (blocks < 4).astype(float))):
            column = told[:, None]
            estimate = float(told @ rest / told.sum())
            covariance = robust_covariance(column, rest - estimate * told, blocks, np.array([1e3]))
            inside[name] += abs(estimate) <= 2.0 * math.sqrt(covariance[0, 0])
    assert 0.92 <= inside["all"] / 400 <= 0.98
    assert 0.92 <= inside["four"] / 400 <= 0.99


def test_what_the_data_do_not_determine_stays_and_is_named(tmp_path):
    t = np.arange(3000) / 500.0
    angle = 20.0 * t
    rng = np.random.default_rng(0)
    torque = 0.03 + 3.5e-4 * 20.0 + 2e-3 * rng.standard_normal(len(t))
    bench = Bench(predictors([Record("r", t, {"motor_angle": angle, "motor_torque": torque})], -100.0))
    found = refit(bench, state_of(scenario(tmp_path)))
    assert not any(i.determined for i in found.intervals)
    for interval in found.intervals:
        assert interval.value == interval.start
        assert math.isnan(interval.low)


def test_a_locked_drive_tells_its_torque_constant_only_beside_a_second_torque(tmp_path):
    # Its torque is the spring's: a factor on one is a factor on the other.
    def free(*channels, locked):
        return {each.name for each in base_freedoms(state_of(scenario(tmp_path)), channels, locked=locked)}

    assert "motor_torque_gain" in free("motor_torque", locked=False)
    assert "motor_torque_gain" in free("motor_torque", "output_torque", locked=True)
    assert "motor_torque_gain" not in free("motor_torque", locked=True)


@pytest.mark.parametrize("name", [name for name in catalogue() if name != "table"])
def test_every_effect_can_be_built_from_its_fittings(name):
    kind = catalogue()[name]
    assert kind.fittings
    for fitting in kind.fittings:
        from hdsim.diagnose.freedom import signed

        orders = (2.0, 12.0)
        count = len(signed(fitting, len(orders)))
        shapes = tuple(shape.starts[0] for shape in fitting.shapes)
        settings = Added(name, fitting, (1.0,) * count, shapes, orders).settings()
        kind(**settings)


def test_lead_in_lets_the_models_own_oscillation_die_away(tmp_path):
    record = rigid_record(3.0, noise=0.0)
    record.channels["output_angle"] = record.channels["motor_angle"] / -100.0
    record.__post_init__()
    predictor = Predictor(record, plan_for(record), -100.0)
    predicted = predictor.predict(state_of(scenario(tmp_path, "lumped")).candidate())
    error = predicted["output_angle"] - record.channels["motor_angle"] / -100.0
    # Far below resonance the output lags by J a / K1.
    wind_up = -0.50002 * motion(3.0)[3] / -100.0 / 1.6e4
    late = record.time > 1.0
    assert np.std((error - wind_up)[late]) < 0.05 * np.std(wind_up[late])
    # The swing begins with a step of acceleration, which at most doubles the wind-up.
    assert np.max(np.abs(error)) < 2.1 * np.max(np.abs(wind_up))
