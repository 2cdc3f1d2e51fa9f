"""The likeliest motion behind an angle and its rate, against dense linear algebra and a hidden motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from hdsim.estimate.motion import Beliefs, Motion
from hdsim.estimate.spline import spline_through


def shaken(seed, duration_s=4.0):
    """Time, angle, velocity and acceleration of a slow swing that is shaken by 15 to 45 Hz, at 1 kHz."""
    time = np.arange(round(1000 * duration_s)) * 1e-3
    rng = np.random.default_rng(seed)
    found = np.zeros((3, len(time)))
    sines = [(1.0, 0.25)] + [(3.0 / (2 * np.pi * f) ** 2, f) for f in np.arange(15.0, 45.0, 1.7)]
    for size, hertz in sines:
        w, phase = 2 * np.pi * hertz, rng.uniform(0, 2 * np.pi)
        found += size * np.array([np.sin(w * time + phase), w * np.cos(w * time + phase),
                                  -w * w * np.sin(w * time + phase)])  # fmt: skip
    return time, *found


def test_it_is_the_mean_of_a_dense_gaussian_and_its_likelihood():
    time = np.arange(120) * 1e-3
    rng = np.random.default_rng(1)
    values = np.sin(20 * time) + 1e-3 * rng.standard_normal(120)
    rate = 20 * np.cos(20 * time) + 0.1 * rng.standard_normal(120)
    motion = Motion(time, values, rate, np.ones(120, dtype=bool), 6.0)
    heights, slopes, thirds = (m.toarray() for m in (motion._heights, motion._rates, motion._thirds))

    def dense(one):
        # Of what the penalty leaves free next to nothing is believed.
        prior = np.linalg.inv(thirds.T @ thirds / one.wanders**2 + 1e-2 * np.eye(heights.shape[1]))
        fresh = heights[1:] - one.lasts * heights[:-1]
        rows = np.vstack([fresh, slopes])
        errors = np.concatenate([np.full(119, one.angle**2), np.full(120, one.rate**2)])
        whole = rows @ prior @ rows.T + np.diag(errors)
        read = np.concatenate([values[1:] - one.lasts * values[:-1], rate])
        solved = np.linalg.solve(whole, read)
        return prior @ rows.T @ solved, -0.5 * (read @ solved + np.linalg.slogdet(whole)[1])

    one = Beliefs(1e-3, 0.1, 2e-4, 0.3)
    other = replace(one, angle=2e-3, wanders=8e-4, lasts=0.6)
    likely = []
    for each in (one, other):
        spline, unlikely = motion._solved(each, values, rate)
        mean, logarithm = dense(each)
        assert spline.c == pytest.approx(mean, abs=2e-4)
        likely.append(logarithm + unlikely)
    # The constant is the same for all beliefs.
    assert likely[0] == pytest.approx(likely[1], abs=0.05)


@pytest.mark.parametrize("lasts", [0.0, 0.9])
def test_errors_and_how_long_they_last_are_found(lasts):
    time, angle, velocity, _ = shaken(2)
    rng = np.random.default_rng(3)
    errors = lfilter([1.0], [1.0, -lasts], 2e-4 * rng.standard_normal(len(time)))
    rate = velocity + 5e-3 * rng.standard_normal(len(time))
    found = Motion(time, angle + errors, rate, np.ones(len(time), dtype=bool), 4.0).believed
    assert found.angle == pytest.approx(2e-4, rel=0.15)
    assert found.rate == pytest.approx(5e-3, rel=0.15)
    assert found.lasts == pytest.approx(lasts, abs=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_what_jerks_the_joint_is_in_its_acceleration_and_not_watered_down(seed):
    # An inertia is the slope of a torque over the acceleration: errors of that would make it small.
    time, angle, velocity, acceleration = shaken(seed)
    rng = np.random.default_rng(seed + 10)
    read = angle + lfilter([1.0], [1.0, -0.9], 1e-4 * rng.standard_normal(len(time)))
    rate = velocity + 5e-3 * rng.standard_normal(len(time)), np.ones(len(time), dtype=bool)
    spline, motion = spline_through(time, read, motion=True, rate=rate)
    assert motion is not None
    inside = slice(200, -200)
    own = spline(time, nu=2)[inside]
    true = acceleration[inside]
    assert np.std(own - true) < 0.45 * np.std(true)
    assert np.polyfit(own, true, 1)[0] == pytest.approx(1.0, abs=0.1)
    alone, _ = spline_through(time, read, motion=True)
    assert np.std(alone(time, nu=2)[inside] - true) > 0.8 * np.std(true)


def test_other_readings_of_the_same_motion_move_it_by_its_own_error():
    time, angle, velocity, acceleration = shaken(4)
    rng = np.random.default_rng(5)
    read = angle + 1e-4 * rng.standard_normal(len(time))
    rate = velocity + 5e-3 * rng.standard_normal(len(time)), np.ones(len(time), dtype=bool)
    spline, motion = spline_through(time, read, motion=True, rate=rate)
    again = motion.disturbed(np.random.default_rng(6))
    moved = np.std((again(time, nu=2) - spline(time, nu=2))[200:-200])
    missed = np.std((spline(time, nu=2) - acceleration)[200:-200])
    # Less than the error, a part of which is what the penalty keeps from every reading alike.
    assert 0.4 * missed < moved < 1.6 * missed


def test_a_rate_that_a_filter_delays_is_not_followed_in_what_is_fast():
    time, angle, velocity, _ = shaken(7)
    rng = np.random.default_rng(8)
    read = angle + 2e-5 * rng.standard_normal(len(time))
    late = lfilter(*butter(1, 20.0, fs=1000.0), velocity) + 2e-3 * rng.standard_normal(len(time))
    _, motion = spline_through(time, read, motion=True, rate=(late, np.ones(len(time), dtype=bool)))
    assert motion is None
