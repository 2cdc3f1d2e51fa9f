import math
from dataclasses import replace

import numpy as np
import pytest
from diagnose_bench import RATE, motion, rigid_record, scenario
from scipy.interpolate import CubicSpline, PPoly

from hdsim.actuation.loads import GravityArm
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting, Harmonic
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import robust_covariance
from hdsim.estimate.fit import base_intervals, fit
from hdsim.estimate.numbers import Free, Interval, base_freedoms
from hdsim.estimate.off import tie
from hdsim.estimate.predict import Predictor, plan_for, predictors
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit, together, with_delays
from hdsim.estimate.spline import pieces_of, smoothed, spline_through
from hdsim.estimate.state import Added, state_of
from hdsim.estimate.suspect import delays
from hdsim.estimate.write import fitted_numbers


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
        breaks, c = pieces_of(spline_through(t, measured, motion=may_jump)[0])
        errors.append(float(np.std((PPoly(c[::-1], breaks)(t, 2) - acceleration)[inside])))
    assert errors[1] < 0.7 * errors[0]
    # A motion without a jump is left as it is.
    t, angle, _, _ = motion(6.0)
    noisy = angle + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    assert len(spline_through(t, noisy, motion=True)[0].c) == len(spline_through(t, noisy)[0].c)


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
    gain = found.fit.state.gains.get("motor_torque", 1.0)
    # Nothing but the sensor ties torques to an absolute scale: products with its gain are what is measured.
    assert gain * coulomb.value == pytest.approx(0.04, rel=0.02)
    assert gain * viscous.value == pytest.approx(3.5e-4, rel=0.02)
    state = found.fit.state
    total = state.drive.inertia.motor_kg_m2 + 1.93e-5 + (state.load.inertia_kg_m2 + 2e-5) / 1e4
    assert gain * total == pytest.approx(1.3 * (6.93e-5 + 0.50002 / 1e4), rel=0.01)
    # Inertia and friction both a third too large: most simply the torque constant.
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


def test_a_delay_that_the_data_do_not_bound_is_not_told(tmp_path):
    bench = Bench(predictors([rigid_record(8.0, noise=5e-4)], -100.0))
    late, nan = {"delay_of": "motor_torque"}, math.nan
    bounded = Interval("motor_torque_delay_s", 0.05, 0.0, 0.04, 0.06, "s", True, [], **late)
    unbounded = Interval("motor_torque_delay_s", 0.05, 0.0, nan, nan, "s", False, [], **late)
    assert [p.kind for p in delays(bench, [bounded])] == ["clock"]
    assert not delays(bench, [unbounded])


def test_a_prior_stays_where_the_model_was_given():
    free = Free("load.gravity.mass_kg", ("load.gravity.mass_kg",), 0.4, 10.0)
    there = free.moved(math.log(1.5)).moved(-math.log(3.0))
    assert there.value == pytest.approx(5.0)
    assert there.at(there.none) == pytest.approx(10.0)


def test_a_weight_that_adds_to_an_arm_is_not_told_from_its_mass(tmp_path):
    # m g l sin(o) + g u cos(o + p): only the cosine's part of the unbalance is its own.
    base = scenario(tmp_path, mesh="lumped")
    gravity = GravityArm(mass_kg=4.0, centre_of_mass_m=0.3)
    state = state_of(base.model_copy(update={"load": base.load.model_copy(update={"gravity": gravity})}))
    record = rigid_record(6.0)
    zeros = {"output_angle": record.channels["motor_angle"] / -100.0, "output_torque": 0.0 * record.time}
    record = Record("r", record.time, {**record.channels, **zeros})
    (fitting,) = (f for f in catalogue()["unbalance"].fittings if f.label == "output")
    weight = Added("unbalance", fitting, (0.5, 0.8))
    truth = replace(state, added=(weight,))
    bench = Bench(predictors([record], -100.0))
    rng = np.random.default_rng(1)
    noises = {"motor_torque": 3e-3, "output_angle": 4e-6, "output_torque": 0.1}
    for series, found in zip(bench.series, bench.predict(truth), strict=True):
        series.noise = series.sigma = noises[series.channel]
        series.measured = found + series.noise * rng.standard_normal(len(found))
    frees = [free for free in base_freedoms(state, bench.channels) if "mass" in free.name]
    found = fit(bench, truth, frees, prune=False)
    spreads = np.sqrt(np.diag(found.covariance))
    assert spreads[0] > 0.2  # of the mass: its prior's
    assert spreads[1] < 0.3 < 2.0 < spreads[2]  # the coefficients of the cosine and of the sine
    found = fit(bench, truth, [], prune=False)
    assert np.sqrt(np.diag(found.covariance)).max() < 0.1


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
    assert "output_torque_gain" in free("motor_torque", "output_torque", locked=True)
    assert "output_torque_gain" not in free("output_torque", locked=True)
    assert "output_torque_gain" in free("output_torque", locked=False)


def test_a_harmonics_phase_is_as_sure_as_its_ellipse_is_narrow():
    harmonic = Fitting((Harmonic("output_kg_m", "output_phase_deg", 0.1),))

    def half_width(covariance):
        low, high = fitted_numbers(
            Added("unbalance", harmonic, (3.0, 0.0)), np.array(covariance), np.zeros(0)
        )["output_phase_deg"].interval
        return (high - low) / 2.0

    assert half_width([[0.01, 0.0], [0.0, 0.01]]) == pytest.approx(math.degrees(math.asin(0.2 / 3)), rel=1e-3)
    # Of a vector that may be none, the direction is not known.
    assert half_width([[3.0, 0.0], [0.0, 3.0]]) == 180.0
    # One that is long and slanting reaches round the origin without holding it.
    slanting = half_width([[4.0, 1.9], [1.9, 1.0]])
    assert 90.0 < slanting < 180.0


def test_an_effect_at_the_end_of_its_range_says_so():
    (fitting,) = catalogue()["stribeck_friction"].fittings
    (shape,) = fitting.shapes
    for value, at_limit in ((5.0, False), (shape.most, True), (0.99 * shape.most, True)):
        assert Added("stribeck_friction", fitting, (1.0,), (value,)).at_limit is at_limit


#: The curve of what has no name; a ripple that only a fit of frequency, damping and delay at once would find.
NEVER_FITTED = {"table", "resonant_torque_ripple"}


@pytest.mark.parametrize("name", sorted(set(catalogue()) - NEVER_FITTED))
def test_every_effect_can_be_built_from_its_fittings(name):
    kind = catalogue()[name]
    assert kind.fittings
    for fitting in kind.fittings:
        orders = (2.0, 12.0)
        count = fitting.count(orders)
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


def test_the_last_fit_holds_no_number_that_is_tied_to_another(tmp_path):
    # Rotor and load of a rigid drive show as one inertia, which is twice the model's: only their sum is seen.
    model = scenario(tmp_path)
    record = rigid_record(inertia=1.93e-5 + 2 * (5e-5 + 0.50002 / 1e4))
    bench = Bench(predictors([record], model.drive.ratio))
    found = together(bench, refit(bench, state_of(model)).fit)
    names = [free.name for free in found.frees]
    rotor, load = (names.index(name) for name in ("drive.inertia.motor_kg_m2", "load.inertia_kg_m2"))
    parts = {k: found.frees[k].at(float(found.theta[k])) for k in (rotor, load)}
    parts[load] /= 1e4
    assert sum(parts.values()) == pytest.approx(2 * 1e-4, rel=0.01)
    # Along the ridge a d(ln a) = -b d(ln b), priors of 0.5: ln a has spread 0.5 / sqrt(1 + (a / b)^2),
    # by up to 3.18 / 2 more where only four blocks of time tell (Student's t).
    for one, other in ((rotor, load), (load, rotor)):
        ridge = 0.5 / math.hypot(1.0, parts[one] / parts[other])
        assert 0.95 * ridge < math.sqrt(found.covariance[one, one]) < 1.65 * ridge


def test_a_number_known_no_better_than_before_is_not_determined(tmp_path):
    model = scenario(tmp_path)
    bench = Bench(predictors([rigid_record()], model.drive.ratio))
    base = refit(bench, state_of(model))
    found = base.fit
    k = [free.name for free in found.frees].index("drive.friction.coulomb_nm")
    assert base_intervals(found, base.freedoms)[k].determined
    vague = found.covariance.copy()
    vague[k, k] = (1.01 * found.frees[k].prior) ** 2
    one = base_intervals(replace(found, covariance=vague), base.freedoms)[k]
    assert not one.determined
    assert math.isnan(one.low)
    assert not one.moved


def test_an_interval_ends_where_its_field_does():
    backlash = catalogue()["output_backlash"]
    fitting = next(f for f in backlash.finer if any(shape.path == "film_share" for shape in f.shapes))
    added = Added("output_backlash", fitting, (1.0,), (0.9,), ())
    interval = fitted_numbers(added, np.eye(1), np.array([5.0]))["film_share"].interval
    assert interval == (0.0, 1.0)
