"""Order spectra of what a model leaves: over part of a turn, and of torques that are read late."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.diagnosis.late import age_by_lines, lines_shown
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.orders import Line, means_over, order_lines, power_of
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


def test_an_order_that_grows_with_speed_is_one_line():
    """In 72 turns of a move from rest to rest; two orders that beat 1.4 times in them are two."""
    time = np.arange(3600) / 500.0
    angle = 72.0 * 2.0 * np.pi * (time / 7.2 - np.sin(2.0 * np.pi * time / 7.2) / (2.0 * np.pi))
    speed = 1.0 - np.cos(2.0 * np.pi * time / 7.2)
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(time))

    def orders(error):
        lines = order_lines(bench_of(time, angle, error), [error], "motor_torque")
        return sorted(line.order for line in lines)

    grown = orders(0.1 * speed**2 * np.sin(4 * angle) + noise)
    assert 4.0 in grown
    assert np.all(np.diff(grown) > 0.75 / 72.0)
    assert orders(0.1 * np.sin(2.0 * angle) + 0.1 * np.sin(1.98 * angle + 1.0) + noise) == pytest.approx(
        [1.98, 2.0], abs=0.003
    )


@pytest.mark.parametrize(
    "orders", [[2.0], [1.0, 2.0], np.arange(0.5, 4.6, 0.0077), np.linspace(11.9, 12.1, 21)]
)
def test_a_spectrum_by_products_of_waves_is_that_of_the_waves(orders):
    random = np.random.default_rng(3)
    angle, values = 40.0 * np.cumsum(random.random(500)), random.standard_normal(500)
    expected = np.exp(-1j * np.outer(orders, angle)) @ values / 500
    assert means_over(angle, values, np.array(orders)) == pytest.approx(expected, abs=1e-12)


def test_an_order_just_beyond_half_the_sample_rate_is_that_order():
    """Read as 110 Hz of 140, which at 14 turns a second is no whole order."""
    time = np.arange(1800) / 250.0
    angle = 2.0 * np.pi * (14.0 * time - 2.0 * np.exp(-2.0 * time))
    torque = 0.1 * np.sin(10 * angle) + 0.01 * np.random.default_rng(1).standard_normal(len(time))
    [line] = order_lines(bench_of(time, angle, torque), [torque], "motor_torque")
    assert line.order == pytest.approx(10.0, abs=0.01)
    assert line.amplitude == pytest.approx(0.1, rel=0.03)


@pytest.mark.parametrize("late", [-2, 0, 2.5])
def test_the_age_of_a_torque_is_told_by_the_order_that_it_blurs(late):
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time)) + 3.0 * time  # both ways, up to 94 rad/s
    then = np.interp(time - 1e-3 * late, time, angle)
    torque = 0.01 * np.sin(12 * then) + 0.004 * np.random.default_rng(2).standard_normal(len(time))
    bench = bench_of(time, angle, torque)
    age, _ = age_by_lines(bench, [torque], "motor_torque")
    assert age == pytest.approx(1e-3 * late, abs=2.5e-4)


@pytest.mark.parametrize("late", [-2, 2.5])
def test_an_order_that_a_late_reading_blurs_is_a_line_where_its_age_is_known(late):
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time)) + 3.0 * time
    then = np.interp(time - 1e-3 * late, time, angle)
    torque = 0.01 * np.sin(28 * then + 0.4) + 0.004 * np.random.default_rng(2).standard_normal(len(time))
    bench = bench_of(time, angle, torque)
    blurred = order_lines(bench, [torque], "motor_torque")
    assert not any(line.amplitude > 0.005 for line in blurred)
    line = order_lines(bench, [torque], "motor_torque", age_s=1e-3 * late)[0]
    assert line.order == 28.0
    assert line.amplitude == pytest.approx(0.01, rel=0.05)
    # What the lines hold is as blurred: of white noise and one sine their power is the sine's.
    power, sigma = 0.5 * 0.01**2 * bench.series[0].train.sum(), bench.series[0].sigma
    assert power_of(bench, [torque], [line], {"motor_torque": 1e-3 * late}) * sigma**2 == pytest.approx(
        power, rel=0.05
    )
    assert power_of(bench, [torque], [line], {}) * sigma**2 < 0.3 * power


def test_lines_that_an_age_brings_to_light_are_told():
    time = np.arange(6000) * 1e-3
    angle = 60.0 * (1 - np.cos(0.5 * np.pi * time)) + 3.0 * time
    then = np.interp(time - 2.5e-3, time, angle)
    noise = 0.004 * np.random.default_rng(2).standard_normal(len(time))
    torque = 0.01 * np.sin(28 * then) + 0.01 * np.sin(2 * then) + noise
    bench = bench_of(time, angle, torque)

    def read(**delays):
        return SimpleNamespace(predictions=[np.zeros(len(time))], state=SimpleNamespace(delays=delays))

    [line] = lines_shown(bench, read(), read(motor_torque=2.5e-3))
    assert line.order == 28.0
    assert lines_shown(bench, read(motor_torque=2.5e-3), read(motor_torque=2.5e-3)) == []


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


def test_beyond_the_strongest_lines_an_effect_has_whole_orders_only():
    (fitting,) = catalogue()["motor_torque_ripple"].fittings
    lines = [Line("motor_torque", order, 0.01, 0.1) for order in (12.0, 14.6, 28.0, 3.3, 24.0, 7.7)]
    (added,) = starts("motor_torque_ripple", fitting, lines, {})
    assert added.orders == (12.0, 14.6, 28.0, 24.0)
