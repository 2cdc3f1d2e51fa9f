"""What a motion's noise does to predictions is as much as they are off by."""

from dataclasses import replace

import numpy as np
import pytest
from moves import positioned
from noisy import noisy
from scipy.interpolate import PPoly

import hdsim
from hdsim.estimate.motion_noise import hear_motion
from hdsim.estimate.opening import bench_for
from hdsim.estimate.spline import drawn_anew, spline_through
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

#: A lightly damped load behind a coarse encoder, few samples a second.
NOISE = {"motor_angle": 6e-4, "output_angle": 1e-6, "motor_torque": 3e-3}
SCENARIO = Scenario.model_validate({
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": positioned({"type": "sine", "amplitude_deg": 25.0, "frequency_hz": 0.4}),
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 10.0, "sample_rate_hz": 250.0},
})  # fmt: skip


def opened():
    run = hdsim.simulate(SCENARIO)
    return bench_for([noisy(run, NOISE, seed=4, begins_s=2.0)], [], SCENARIO, None)


def output_of(bench):
    return next(s for s in bench.series if s.channel == "output_angle")


def test_a_reading_drawn_anew_is_off_by_what_the_spline_is_stretch_by_stretch():
    """Knots every few samples, and a clock that jitters: the noise is ten times as much where it is fast."""
    time = np.arange(4000) / 1000.0
    truth = np.sin(2 * np.pi * 60.0 * time) + 40.0 * time
    noise = np.where(time < 2.0, 2e-3, 2e-2)
    off, drawn = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        values = truth + noise * rng.standard_normal(len(time))
        spline, _ = spline_through(time, values)
        assert len(spline.c) > 0.2 * len(time)
        coefficients = drawn_anew(time, values, spline, rng)
        breaks = np.unique(spline.t)
        off.append(spline(time) - truth)
        drawn.append(PPoly(coefficients[::-1], breaks)(time) - spline(time))
    for half in (time < 2.0, time >= 2.0):
        assert np.std(np.array(drawn)[:, half]) == pytest.approx(np.std(np.array(off)[:, half]), rel=0.2)


def test_the_noise_heard_is_what_the_true_model_leaves():
    bench, state = opened(), state_of(SCENARIO)
    predictions = bench.predict(state)
    series = output_of(bench)
    rest = next(r for s, r in zip(bench.series, bench.residuals(predictions), strict=True) if s is series)
    sensor = series.noise
    hear_motion(bench, (state,), predictions)
    assert np.std(rest[series.train]) > 2.0 * sensor
    assert series.noise == pytest.approx(np.std(rest[series.train]), rel=0.25)


def test_a_fit_with_too_much_damping_does_not_hide_the_noise():
    """It answers to the motion's noise less than the drive that made the record."""
    state = state_of(SCENARIO)
    torsion = state.drive.torsion
    damped = replace(
        state,
        drive=state.drive.model_copy(update={
            "torsion": torsion.model_copy(
                update={"damping_nm_s_per_rad": 10.0 * torsion.damping_nm_s_per_rad}
            )
        }),
    )  # fmt: skip
    heard = []
    for states in ((damped,), (state, damped)):
        bench = opened()
        hear_motion(bench, states, bench.predict(damped))
        heard.append(output_of(bench).noise)
    assert heard[1] > 1.2 * heard[0]


def test_the_noise_of_a_sensor_that_is_the_load_winds_the_spring_up():
    """Encoders that resolve a hundredth of what the sensor's noise turns: all that is left is that noise."""
    noise = {"motor_angle": 1e-6, "output_angle": 1e-8, "output_torque": 0.3}
    bench = bench_for([noisy(hdsim.simulate(SCENARIO), noise, seed=4)], [], SCENARIO, "output_torque")
    state = state_of(SCENARIO)
    predictions = bench.predict(state)
    series = output_of(bench)
    rest = next(r for s, r in zip(bench.series, bench.residuals(predictions), strict=True) if s is series)
    assert np.std(rest) > 30.0 * series.noise
    hear_motion(bench, [state], predictions)
    assert series.noise == pytest.approx(np.std(rest), rel=0.25)
