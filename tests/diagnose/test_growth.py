"""Orders over speed: geometry stays, inertia grows, a resonance is where stiffness and inertia put it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from hdsim.diagnosis.growth import over_speed
from hdsim.diagnosis.tracking import hunting, mean_beside, periods
from hdsim.estimate.bench import Bench
from hdsim.estimate.orders import order_lines
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record

RATIO, ORDER = -100.0, 2.0
TIME = np.arange(8000) * 1e-3


def sweeps():
    """Motor angle and velocity of two records: up and down, and up the other way."""
    up = 10.0 + 70.0 * (0.5 - 0.5 * np.cos(2 * np.pi * TIME / 8.0))
    return [(cumulative_trapezoid(w, TIME, initial=0.0), w) for w in (up, -(12.0 + 8.0 * TIME))]


def told(values, seed, noise=0.005, channel="motor_torque"):
    """What is told of the order that stands out of a channel beside the two sweeps."""
    rng = np.random.default_rng(seed)
    noisy = [one + noise * rng.standard_normal(len(TIME)) for one in values]
    records = [
        Record(f"run {k}", TIME, {"motor_angle": angle, channel: one})
        for k, ((angle, _), one) in enumerate(zip(sweeps(), noisy, strict=True))
    ]
    bench = Bench(predictors(records, RATIO))
    [line] = order_lines(bench, noisy, channel, most=1)
    assert line.order == pytest.approx(ORDER, abs=0.05)
    return over_speed(bench, noisy, line)


def test_a_period_has_the_amplitude_and_phase_of_its_wave_beside_a_slope():
    angle, velocity = sweeps()[1]
    values = 0.3 * np.sin(ORDER * angle + 0.7) + 2.0 + 0.01 * TIME
    _, _, waves = periods(angle, velocity, values, np.ones(len(TIME), dtype=bool), ORDER)
    assert len(waves) > 90
    assert np.abs(waves) == pytest.approx(0.3, rel=0.02)
    assert np.angle(waves) == pytest.approx(0.7 - np.pi / 2, abs=0.03)


def test_an_angle_is_told_in_arcsec():
    errors = [5e-5 * np.sin(ORDER * angle) for angle, _ in sweeps()]
    found = told(errors, 0, noise=1e-7, channel="output_angle")
    assert found.unit == "rad"
    assert "10.3 arcsec in run 0" in found.sentence


@pytest.mark.parametrize("seed", range(12))
def test_geometry_does_not_grow(seed):
    found = told([0.01 * np.sin(ORDER * angle + seed) for angle, _ in sweeps()], seed)
    assert found.growth == "same"
    assert abs(found.exponent) < 0.3
    assert found.amplitude == pytest.approx(0.01, rel=0.05)
    # Of eight intervals of 95 % one or two may miss.
    assert (
        sum(low <= 0.01 <= high for low, high in (band.interval for band in found.bands))
        >= len(found.bands) - 2
    )
    assert {band.record for band in found.bands} == {"run 0", "run 1"}
    assert "does not grow with speed" in found.sentence


@pytest.mark.parametrize("seed", range(4))
def test_an_errors_inertia_grows_as_the_square_of_speed(seed):
    found = told([0.01 * (w / 40) ** 2 * np.sin(ORDER * angle) for angle, w in sweeps()], seed)
    assert found.growth == "grows"
    assert found.interval[0] <= 2.0 <= found.interval[1] or found.exponent == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_a_resonance_is_where_stiffness_and_inertia_put_it(seed):
    # A rotor on a spring that a kinematic error winds, by SciPy: J x'' + c x' + K (x - e) = 0.
    stiffness, inertia, damping = 1.6e4, 2.0, 0.08
    natural = np.sqrt(stiffness / inertia)
    torques = []
    for angle, _ in sweeps():

        def rates(t, y, angle=angle):
            error = 1e-6 * np.sin(ORDER * np.interp(t, TIME, angle))
            return [y[1], -(natural**2) * (y[0] - error) - 2 * damping * natural * y[1]]

        run = solve_ivp(rates, (0.0, TIME[-1]), [0.0, 0.0], t_eval=TIME, rtol=1e-7, atol=1e-12, max_step=2e-3)
        torques.append(stiffness * (run.y[0] - 1e-6 * np.sin(ORDER * angle)))
    found = told(torques, seed)
    assert found.growth == "resonance"
    assert found.resonance_rad_per_s == pytest.approx(natural / ORDER, rel=0.06)
    assert "resonance" in found.sentence


def test_one_speed_tells_no_growth():
    angle = 50.0 * TIME
    rng = np.random.default_rng(0)
    torque = 0.01 * np.sin(ORDER * angle) + 0.005 * rng.standard_normal(len(TIME))
    record = Record("steady", TIME, {"motor_angle": angle, "motor_torque": torque})
    [line] = order_lines(bench := Bench(predictors([record], RATIO)), [torque], "motor_torque", most=1)
    assert over_speed(bench, [torque], line).growth == "open"


#: Hunting orders of a drive with ratio 101, and their amplitudes, N m.
HUNTING = {2.0: 0.010, 2.0 * (1.0 - 1.0 / 101.0): 0.007}


def beating(noise, seed, ends=0.0):
    """Bench and torque of 70 turns at one speed, with ramps at its ends in which both orders are stronger."""
    speed = np.interp(TIME, [0.0, 0.8, 7.2, 8.0], [8.0, 70.0, 70.0, 8.0])
    angle = cumulative_trapezoid(speed, TIME, initial=0.0)
    larger = 1.0 + ends * np.exp(-(((speed - 40.0) / 10.0) ** 2))
    torque = sum(a * larger * np.sin(order * angle + 0.7 * order) for order, a in HUNTING.items())
    torque = torque + noise * np.random.default_rng(seed).standard_normal(len(TIME))
    record = Record("run", TIME, {"motor_angle": angle, "motor_torque": torque})
    return Bench(predictors([record], 101.0)), torque


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("ends", [0.0, 3.0])
def test_hunting_orders_are_told_apart_by_their_beat(ends, seed):
    bench, torque = beating(0.01, seed, ends)
    lines = order_lines(bench, [torque], "motor_torque", most=2)
    orders = hunting([line.order for line in lines], 101.0, bench.turns)
    assert sorted(orders) == pytest.approx(sorted(HUNTING), abs=1e-6)
    lines = [replace(line, order=order) for line, order in zip(lines, orders, strict=True)]
    for line in lines:
        found = over_speed(bench, [torque], line, beside=lines)
        steady = max(found.bands, key=lambda band: band.periods)
        # All of the stretch of one speed is one band.
        assert steady.velocity_rad_per_s == pytest.approx(70.0, rel=0.02)
        assert steady.periods > 120
        size = next(a for order, a in HUNTING.items() if abs(order - line.order) < 1e-6)
        assert steady.amplitude == pytest.approx(size, rel=0.15)
        alone = over_speed(bench, [torque], line)
        assert max(alone.bands, key=lambda band: band.periods).interval != steady.interval


def test_orders_that_make_no_beat_are_not_told_apart():
    # Half a beat: what one of them has is as well the other's.
    _, places, waves = periods(
        *(lambda angle: (angle, np.full(3000, 50.0), np.sin(2 * angle), np.ones(3000, dtype=bool), 2.0))(
            50.0 * TIME[:3000]
        )
    )
    assert mean_beside(waves, places, [0.02]) == mean_beside(waves, places, [])
    assert mean_beside(waves, places, [0.4]) != mean_beside(waves, places, [])


def test_a_line_is_a_hunting_order_only_beside_its_whole_one_and_where_the_record_tells_the_two():
    assert hunting([2.0, 1.985], 101.0, 80.0) == [2.0, pytest.approx(2.0 - 2.0 / 101.0)]
    assert hunting([2.0, 2.015], 101.0, 80.0) == [2.0, pytest.approx(2.0 + 2.0 / 101.0)]
    assert hunting([1.985], 101.0, 80.0) == [1.985]
    assert hunting([2.0, 1.94], 101.0, 80.0) == [2.0, 1.94]
    # In 30 turns the two do not beat once.
    assert hunting([2.0, 1.985], 101.0, 30.0) == [2.0, 1.985]
