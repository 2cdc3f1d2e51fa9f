"""The dead-zone that a gap makes of an approach, as printed and smoothed.

Source: Zhang et al. (2021), doi:10.21203/rs.3.rs-652069/v1, Eq. 14.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def dead_zone(x: ArrayLike, b: ArrayLike) -> Array:
    """Eq. 14: x - b above b, zero between -b and b, x + b below -b (at the two corners: zero, by continuity).

    Args:
        x: approach, m.
        b: half-gap, >= 0, m; broadcasts with ``x``.
    """
    x, b = np.asarray(x, dtype=float), np.asarray(b, dtype=float)
    return np.asarray(np.where(x > b, x - b, np.where(x < -b, x + b, 0.0)))


def dead_zone_derivative(x: ArrayLike, b: ArrayLike) -> Array:
    """Derivative of Eq. 14 with respect to x: 1 outside the gap, 0 inside and at the corners."""
    return np.asarray(np.abs(np.asarray(x, dtype=float)) > np.asarray(b, dtype=float), dtype=float)


def dead_zone_integral(x: ArrayLike, b: ArrayLike) -> Array:
    """Integral of Eq. 14 from 0 to x: half the square of its value, m^2."""
    return np.asarray(0.5 * dead_zone(x, b) ** 2)


def smooth_dead_zone(x: ArrayLike, b: ArrayLike, width: float) -> Array:
    """Eq. 14 with each corner replaced by a quartic over ``width`` to either side.

    g(x - b) - g(-x - b) with the ramp g(u) = 0 for u <= -w, u for u >= w and
    2 w (t^3 - t^4 / 2), t = (u + w) / 2w, between. Twice continuously differentiable, odd, never
    decreasing. Where w <= b it differs from ``dead_zone`` by at most 3 w / 16 (at the corners), and
    not at all farther than w from a corner. For b = 0 it is exactly x.

    Args:
        x: approach, m.
        b: half-gap, >= 0, m.
        width: w > 0, m.
    """
    x, b = np.asarray(x, dtype=float), np.asarray(b, dtype=float)
    return np.asarray(_ramp(x - b, width) - _ramp(-x - b, width))


def smooth_dead_zone_derivative(x: ArrayLike, b: ArrayLike, width: float) -> Array:
    """Derivative of ``smooth_dead_zone`` with respect to x, between 0 and 1."""
    x, b = np.asarray(x, dtype=float), np.asarray(b, dtype=float)
    return np.asarray(_step(x - b, width) + _step(-x - b, width))


def smooth_dead_zone_integral(x: ArrayLike, b: ArrayLike, width: float) -> Array:
    """Integral of ``smooth_dead_zone`` from 0 to x, m^2."""
    x, b = np.asarray(x, dtype=float), np.asarray(b, dtype=float)
    at_zero = 2.0 * _ramp_integral(-b, width)
    return np.asarray(_ramp_integral(x - b, width) + _ramp_integral(-x - b, width) - at_zero)


def _step(u: Array, width: float) -> Array:
    t = np.clip((u + width) / (2.0 * width), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _ramp(u: Array, width: float) -> Array:
    t = np.clip((u + width) / (2.0 * width), 0.0, 1.0)
    return np.asarray(np.where(u >= width, u, 2.0 * width * t**3 * (1.0 - 0.5 * t)))


def _ramp_integral(u: Array, width: float) -> Array:
    t = np.clip((u + width) / (2.0 * width), 0.0, 1.0)
    inner = 4.0 * width**2 * t**4 * (0.25 - 0.1 * t)
    return np.asarray(np.where(u >= width, 0.5 * u**2 + 0.1 * width**2, inner))
