"""Order spectra of what a model leaves: over part of a turn, and of torques that are read late."""

import numpy as np
import pytest

from hdsim.diagnosis.late import age_by_lines
from hdsim.estimate.bench import Bench
from hdsim.estimate.orders import order_lines
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record


def bench_of(time, angle, torque):
    return Bench(predictors([Record("r", time, {"motor_angle": angle, "motor_torque": torque})], -100.0))


def test_twelve_periods_are_a_line_though_they_fill_no_turn():
    time = np.arange(4000) * 1e-3
    angle = 0.75 * (1 - np.cos(2 * np.pi * 0.25 * time))  # to 1.5 rad and back
    error = 0.1 * np.sin(50 * angle + 0.3) + 0.05 * np.random.default_rng(1).standard_normal(len(time))
    [line] = order_lines(bench_of(time, angle, error), [error], "motor_torque")
    assert line.order == pytest.approx(50.0, abs=0.5)
    assert line.amplitude == pytest.approx(0.1, rel=0.05)


def test_a_loop_over_part_of_a_turn_is_no_line():
    time = np.arange(4000) * 1e-3
    angle = 0.75 * (1 - np.cos(2 * np.pi * 0.5 * time))
    loop = 0.1 * np.tanh(np.sin(2 * np.pi * 0.5 * time) / 0.2) + 0.05 * (angle - 0.75) ** 2
    assert order_lines(bench_of(time, angle, loop), [loop], "motor_torque") == []


@pytest.mark.parametrize("late", [-2, 0, 2.5])
def test_the_age_of_a_torque_is_told_by_the_order_that_it_blurs(late):
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time)) + 3.0 * time  # both ways, up to 94 rad/s
    then = np.interp(time - 1e-3 * late, time, angle)
    torque = 0.01 * np.sin(12 * then) + 0.004 * np.random.default_rng(2).standard_normal(len(time))
    bench = bench_of(time, angle, torque)
    age, _ = age_by_lines(bench, [torque], "motor_torque")
    assert age == pytest.approx(1e-3 * late, abs=2.5e-4)


def test_a_torque_without_lines_has_no_age():
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time))
    torque = 0.01 * np.sign(np.sin(0.5 * np.pi * time)) + 0.01 * np.random.default_rng(2).standard_normal(
        6000
    )
    assert age_by_lines(bench_of(time, angle, torque), [torque], "motor_torque")[0] == 0.0


def test_friction_that_ripples_is_not_late():
    # It turns its sign with the direction, as the phase of a late order does.
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time))
    turning = np.sign(np.sin(0.5 * np.pi * time))
    torque = 0.01 * turning * np.sin(2 * angle) + 0.001 * np.random.default_rng(2).standard_normal(6000)
    assert age_by_lines(bench_of(time, angle, torque), [torque], "motor_torque")[0] == 0.0
