"""What went wrong on real machines, made anew by simulation: numbers that stayed away, currents of the other
side, and delays that are none."""

import numpy as np
import pytest
from diagnose_bench import motion, rigid_record, scenario
from scipy.integrate import solve_ivp

from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of

FRICTIONLESS = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
RATIO = -100.0


def regressed(bench):
    """Power that least squares of the torque over acceleration, velocity, its sign and a constant leaves."""
    [series], [predictor] = bench.series, bench.predictors
    w = predictor.motor_velocity
    terms = np.column_stack([predictor.motor_acceleration, w, np.tanh(w / 0.5), np.ones(len(w))])
    rows = series.train
    weights, *_ = np.linalg.lstsq(terms[rows], series.measured[rows], rcond=None)
    return float(np.mean((series.measured - terms @ weights)[rows] ** 2))


@pytest.mark.parametrize("times", [0.1, 10.0])
@pytest.mark.parametrize("friction", [0.3, 3.0])
def test_a_refit_leaves_what_least_squares_leaves_however_far_the_base_is(tmp_path, times, friction):
    numbers = {"coulomb_nm": 0.03 * friction, "viscous_nm_s_per_rad": 3.5e-4 * friction}
    base = scenario(tmp_path, friction=numbers)
    inertia = base.drive.inertia.model_copy(update={"motor_kg_m2": 5e-5 * times})
    base = base.model_copy(update={"drive": base.drive.model_copy(update={"inertia": inertia})})
    bench = Bench(predictors([rigid_record()], RATIO))
    found = refit(bench, state_of(base)).fit
    [rest] = bench.residuals(found.predictions)
    left = float(np.mean(rest[bench.series[0].train] ** 2))
    assert left < 1.1 * regressed(bench)


def one_way(seconds=8.0, seed=0):
    """A joint that turns one way, starting and stopping once, with a trusted torque."""
    t = np.arange(round(500 * seconds)) / 500.0
    ramp = np.clip(np.minimum(t, seconds - t) / 1.0, 0.0, 1.0)
    speed = 80.0 * (0.5 - 0.5 * np.cos(np.pi * ramp))
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    rate = np.gradient(speed, t)
    torque = (6.93e-5 + 0.50002 / 1e4) * rate + 0.07 * np.tanh(speed / 0.5) + 9e-4 * speed
    noise = 2e-3 * np.random.default_rng(seed).standard_normal(len(t))
    return Record("one way", t, {"motor_angle": angle, "motor_torque": torque + noise})


@pytest.mark.parametrize("times", [0.2, 0.3])
def test_friction_that_is_far_too_small_comes_back_where_the_torque_has_no_zero(tmp_path, times):
    base = scenario(tmp_path, friction={"coulomb_nm": 0.07 * times, "viscous_nm_s_per_rad": 9e-4 * times})
    bench = Bench(predictors([one_way()], RATIO), zeros="trusted")
    found = refit(bench, state_of(base)).fit
    [rest] = bench.residuals(found.predictions)
    friction = found.state.drive.friction
    steady = friction.coulomb_nm + 80.0 * friction.viscous_nm_s_per_rad
    assert steady == pytest.approx(0.07 + 80.0 * 9e-4, rel=0.05)
    assert np.std(rest[bench.series[0].train]) < 0.01


@pytest.mark.slow
def test_a_current_of_the_other_side_is_suspected_where_the_base_has_no_friction(tmp_path):
    record = rigid_record()
    record.channels["motor_torque"] = 100.0 * record.channels["motor_torque"]
    found = diagnose([record], scenario(tmp_path, friction=FRICTIONLESS), force=True).verdict
    said = [p for p in found.data_problems if p.kind in ("side", "unit", "drive")]
    assert any("side" in p.message or "unit" in p.message for p in said)
    assert found.sentence.startswith("Check the data first")


@pytest.mark.slow
def test_the_same_friction_on_its_own_side_is_not_suspected(tmp_path):
    found = diagnose([rigid_record()], scenario(tmp_path, friction=FRICTIONLESS)).verdict
    assert not [p for p in found.data_problems if p.kind in ("side", "unit", "sign", "drive")]
    assert found.effects[0].name == "input_coulomb_viscous"


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [0.5])
def test_presliding_is_no_delay(tmp_path, stiffness):
    # Dahl's bristles, by SciPy: friction lags behind the direction over T_c / stiffness rad of the motor.
    t, angle, velocity, acceleration = motion(8.0)

    def bent(now, z):
        w = np.interp(now, t, velocity)
        return w - abs(w) * z * stiffness / 0.06

    run = solve_ivp(bent, (0.0, t[-1]), [0.0], t_eval=t, max_step=2e-3, rtol=1e-6, atol=1e-9)
    torque = (6.93e-5 + 0.50002 / 1e4) * acceleration + stiffness * run.y[0] + 3.5e-4 * velocity
    noisy = torque + 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    record = Record("bristles", t, {"motor_angle": angle, "motor_torque": noisy})
    found = diagnose([record], scenario(tmp_path, friction={"coulomb_nm": 0.06})).verdict
    assert not [p for p in found.data_problems if p.kind == "clock"]
