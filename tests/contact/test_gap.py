import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from hdsim.contact import dead_zone, smooth_dead_zone
from hdsim.contact.gap import (
    dead_zone_derivative,
    dead_zone_integral,
    smooth_dead_zone_derivative,
    smooth_dead_zone_integral,
)

gaps = st.floats(0.0, 3.0)
widths = st.floats(0.01, 2.0)
places = st.floats(-8.0, 8.0)


def test_eq_14_as_printed():
    x = np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 5.0])
    assert dead_zone(x, 2.0).tolist() == [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0]
    assert dead_zone_derivative(x, 2.0).tolist() == [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert dead_zone(x[:, None], np.array([0.0, 2.0])).shape == (7, 2)


@given(x=places, b=gaps)
def test_the_integral_of_the_dead_zone(x, b):
    corner = [c for c in (-b, b) if min(0, x) < c < max(0, x)]
    area = quad(lambda s: float(dead_zone(s, b)), 0.0, x, points=corner or None)[0]
    assert dead_zone_integral(x, b) == pytest.approx(area, abs=1e-9)


@given(b=gaps, w=widths)
def test_the_smooth_dead_zone_stays_within_its_bound_and_is_exact_away_from_corners(b, w):
    x = np.linspace(-8.0, 8.0, 2001)
    error = np.abs(smooth_dead_zone(x, b, w) - dead_zone(x, b))
    assert (error <= 3.0 * w / 16.0 + 1e-12).all() or b < w
    far = np.abs(np.abs(x) - b) > w
    if b >= w:
        assert error[far].max(initial=0.0) < 1e-12
    at_corner = smooth_dead_zone(b, b, w) if b >= w else 3.0 * w / 16.0
    assert at_corner == pytest.approx(3.0 * w / 16.0)
    np.testing.assert_allclose(smooth_dead_zone(-x, b, w), -smooth_dead_zone(x, b, w), atol=1e-12)
    assert (np.diff(smooth_dead_zone(x, b, w)) >= -1e-12).all()


def test_no_gap_no_dead_zone():
    x = np.linspace(-2.0, 2.0, 101)
    np.testing.assert_allclose(smooth_dead_zone(x, 0.0, 0.5), x, atol=1e-14)


@given(x=places, b=gaps, w=widths)
def test_derivative_and_integral_of_the_smooth_dead_zone(x, b, w):
    h = 1e-5
    slope = (smooth_dead_zone(x + h, b, w) - smooth_dead_zone(x - h, b, w)) / (2 * h)
    assert smooth_dead_zone_derivative(x, b, w) == pytest.approx(float(slope), abs=1e-3 * h / w + 1e-7)
    corners = [c for c in (-b - w, -b + w, b - w, b + w) if min(0, x) < c < max(0, x)]
    area = quad(lambda s: float(smooth_dead_zone(s, b, w)), 0.0, x, points=corners or None)[0]
    assert smooth_dead_zone_integral(x, b, w) == pytest.approx(area, abs=1e-8)


def test_the_second_derivative_has_no_jump():
    b, w, h = 1.0, 0.3, 1e-4
    for corner in (b - w, b, b + w, -b - w, -b + w):
        second = [
            (smooth_dead_zone_derivative(c + h, b, w) - smooth_dead_zone_derivative(c - h, b, w)) / (2 * h)
            for c in (corner - 2 * h, corner + 2 * h)
        ]
        assert abs(second[0] - second[1]) < 4 * h * 6.0 / (4 * w**2) * 1.5
