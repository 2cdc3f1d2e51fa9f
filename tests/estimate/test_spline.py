"""Splines through measured channels."""

import time as clock

import numpy as np
import pytest
from scipy.interpolate import PPoly, make_lsq_spline
from scipy.signal import butter, lfilter

from hdsim.estimate.knots import least_squares_spline
from hdsim.estimate.spline import pieces_of, spline_through


def knots_for(time, spacing):
    n = len(time)
    inner = np.interp(np.linspace(0, n - 1, int((n - 1) / spacing) + 1)[1:-1], np.arange(n), time)
    return np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4])


@pytest.mark.parametrize("spacing", [1.5, 2.0, 4.0, 48.0])
def test_the_spline_is_scipys_to_rounding(spacing):
    rng = np.random.default_rng(1)
    time = np.sort(np.arange(3000) + rng.uniform(-0.3, 0.3, 3000)) * 1e-3
    values = 300.0 * np.sin(4.0 * time) + 1e-5 * rng.standard_normal(3000)
    knots = knots_for(time, spacing)
    own, scipys = least_squares_spline(time, values, knots), make_lsq_spline(time, values, knots, k=3)
    assert np.max(np.abs(own(time) - scipys(time))) < 1e-11
    accelerations = own(time, 2), scipys(time, 2)
    assert np.max(np.abs(accelerations[0] - accelerations[1])) < 1e-6 * np.max(np.abs(accelerations[1]))


def test_double_knots_are_allowed():
    time = np.linspace(0.0, 2.0, 900)
    knots = np.sort(np.concatenate([knots_for(time, 20.0), [1.0, 1.0]]))
    values = np.where(time < 1.0, 0.0, (time - 1.0) ** 2)
    assert np.max(np.abs(least_squares_spline(time, values, knots)(time) - values)) < 1e-12


def test_a_stretch_between_knots_without_samples_is_refused():
    time = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(2.0, 3.0, 200)])
    knots = np.concatenate([[0.0] * 4, np.linspace(0.0, 3.0, 61)[1:-1], [3.0] * 4])
    with pytest.raises(np.linalg.LinAlgError):
        least_squares_spline(time, np.sin(time), knots)


def test_its_time_grows_with_the_samples_alone():
    def seconds(n):
        time = np.linspace(0.0, 1.0, n)
        knots = knots_for(time, 2.0)
        began = clock.process_time()
        least_squares_spline(time, np.sin(time), knots)
        return clock.process_time() - began

    few, many = (min(seconds(n) for _ in range(3)) for n in (10_000, 80_000))
    assert many < 24.0 * few  # 8 where it is linear, 64 where it is not


def swing(seed, errors):
    """Time, angle as read, true velocity and true acceleration of a swing of 100 rad/s^2 at 1 kHz.

    Args:
        seed: of the errors.
        errors: serial correlation of the angle's errors of 4 mrad, from one sample to the next.
    """
    time = np.arange(5000) * 1e-3
    parts = ((30.0, 2 * np.pi * 0.25), (1.2, 2 * np.pi * 1.1))
    angle = sum(a * (1 - np.cos(w * time)) for a, w in parts)
    velocity = sum(a * w * np.sin(w * time) for a, w in parts)
    acceleration = sum(a * w * w * np.cos(w * time) for a, w in parts)
    white = np.random.default_rng(seed).standard_normal(len(time))
    lasting = np.sqrt(1.0 - errors**2) * lfilter([1.0], [1.0, -errors], white)
    return time, angle + 4e-3 * lasting, velocity, acceleration


def followed(time, values, rate=None):
    """Knots and coefficients of a motion."""
    return pieces_of(spline_through(time, values, motion=True, rate=rate)[0])


def acceleration_error(time, found, true):
    breaks, coefficients = found
    inside = slice(200, -200)
    own = PPoly(coefficients[::-1], breaks)(time, 2)
    return float(np.std((own - true)[inside]) / np.std(true[inside]))


@pytest.mark.parametrize("seed", range(3))
def test_a_measured_rate_keeps_lasting_errors_out_of_the_acceleration(seed):
    time, angle, velocity, acceleration = swing(seed, 0.8)
    noisy = 0.01 * velocity + 0.05 * np.random.default_rng(seed + 10).standard_normal(len(time))
    everywhere = np.ones(len(time), dtype=bool)
    alone = followed(time, angle)
    judged = followed(time, angle, rate=(noisy, everywhere))
    assert acceleration_error(time, alone, acceleration) > 5.0
    assert acceleration_error(time, judged, acceleration) < 0.25


@pytest.mark.parametrize("seed", range(3))
def test_a_rate_of_the_same_readings_changes_nothing(seed):
    # Differenced from the angle, as many controllers do: it tells nothing that the angle does not.
    time, angle, *_ = swing(seed, 0.0)
    rate = np.gradient(angle, time)
    judged = followed(time, angle, rate=(rate, np.ones(len(time), dtype=bool)))
    for one, other in zip(judged, followed(time, angle), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize(("order", "corner"), [(1, 10.0), (1, 40.0), (2, 50.0)])
def test_a_filtered_rate_leaves_what_is_fast_and_real(order, corner):
    # 40 Hz of 300 rad/s^2 beside the swing, and a rate through a low-pass.
    time, angle, velocity, acceleration = swing(0, 0.0)
    w = 2 * np.pi * 40.0
    angle = angle + 300.0 / w**2 * (1 - np.cos(w * time))
    velocity, acceleration = velocity + 300.0 / w * np.sin(w * time), acceleration + 300.0 * np.cos(w * time)
    rate = lfilter(*butter(order, corner, fs=1000.0), velocity)
    judged = followed(time, angle, rate=(rate, np.ones(len(time), dtype=bool)))
    alone = acceleration_error(time, followed(time, angle), acceleration)
    assert acceleration_error(time, judged, acceleration) < 1.1 * alone


def test_samples_that_a_log_repeats_and_loses_stay_out_of_the_acceleration():
    # Every 190 ms a sample is repeated; 9 ms later one is lost, and the angle has caught up.
    time, angle, velocity, acceleration = swing(0, 0.0)
    late = np.zeros(len(time), dtype=int)
    for start in range(190, len(time) - 200, 190):
        late[start : start + 9] = 1
    seen = np.arange(len(time)) - late
    true = angle - 4e-3 * np.random.default_rng(0).standard_normal(len(time))  # without the errors of `swing`
    read = true[seen] + 2e-5 * np.random.default_rng(5).standard_normal(len(time))
    rate = velocity[seen] + 0.02 * np.random.default_rng(6).standard_normal(len(time))
    judged = followed(time, read, rate=(rate, np.ones(len(time), dtype=bool)))
    assert acceleration_error(time, followed(time, read), acceleration) > 20.0
    assert acceleration_error(time, judged, acceleration) < 0.1
