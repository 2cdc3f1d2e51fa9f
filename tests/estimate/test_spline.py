"""Splines through measured channels."""

import time as clock

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from hdsim.estimate.spline import least_squares_spline


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
