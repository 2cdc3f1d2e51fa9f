"""Least-squares cubic splines over given knots, through readings and, where it is measured, their rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.records import Array, Mask

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: Samples between knots that are tried.
SPACINGS = (1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 21.0, 32.0, 48.0, 72.0, 108.0, 160.0, 240.0)
#: Part of its own size that the other splines leave of a B-spline, squared, below which rounding decides.
SINGULAR = 1e-12


@dataclass(frozen=True)
class Rate:
    """A measured derivative of a channel.

    Attributes:
        values: shape (n,), unit of the channel a second.
        trusted: shape (n,), samples that count.
        weight: what an error of it weighs beside one of the channel, s.
    """

    values: Array
    trusted: Mask
    weight: float


def least_squares_spline(time: Array, values: Array, knots: Array, rate: Rate | None = None) -> BSpline:
    """The cubic spline of least squares, in a time that is linear in the samples.

    The normal equations of B-splines are banded and well conditioned (de Boor, A Practical Guide to Splines,
    ch. XIV); SciPy's ``make_lsq_spline`` takes a time that grows with samples times knots.

    Args:
        time: shape (n,), strictly increasing.
        values: shape (n,).
        knots: shape (c + 4,), increasing, four equal ones at either end.
        rate: what its derivative is fitted to beside them.

    Raises:
        LinAlgError: a stretch between knots has no samples.
        ValueError: a sample lies outside of the knots.
    """
    from scipy.interpolate import BSpline
    from scipy.linalg import cho_solve_banded, cholesky_banded

    c = len(knots) - 4
    design = BSpline.design_matrix(time, knots, 3)
    parts, at = design.data.reshape(-1, 4), design.indices.reshape(-1, 4)
    if rate is not None:
        slopes = rate.weight * slopes_of(time, knots, at) * rate.trusted[:, None]
        parts, at = np.vstack([parts, slopes]), np.vstack([at, at])
        values = np.concatenate([values, np.where(rate.trusted, rate.weight * rate.values, 0.0)])
    band, right = np.zeros((4, c)), np.zeros(c)
    for i in range(4):
        right += np.bincount(at[:, i], parts[:, i] * values, c)
        for below in range(4 - i):
            band[below] += np.bincount(at[:, i], parts[:, i] * parts[:, i + below], c)
    factor = cholesky_banded(band, lower=True)
    if np.any(factor[0] ** 2 <= SINGULAR * band[0]):
        raise np.linalg.LinAlgError("a stretch between knots has no samples")
    return BSpline(knots, cho_solve_banded((factor, True), right), 3)


def slopes_of(time: Array, knots: Array, at: Array) -> Array:
    """Derivatives of the four cubic B-splines at each time, shape (n, 4): de Boor, ch. X, Eq. 8.

    Args:
        time: shape (n,).
        knots: shape (c + 4,).
        at: numbers of the B-splines, shape (n, 4).
    """
    from scipy.interpolate import BSpline

    parabolas = BSpline.design_matrix(time, knots[1:-1], 2).data.reshape(-1, 3)
    first = at[:, :1] + np.arange(1, 4)
    heights = 3.0 * parabolas / (knots[first + 3] - knots[first])
    none = np.zeros((len(time), 1))
    return np.asarray(np.hstack([none, heights]) - np.hstack([heights, none]))


def uniform(time: Array, values: Array, spacing: float, rate: Rate | None = None) -> BSpline | None:
    """The least-squares spline with knots every so many samples; None where there is none."""
    n = len(time)
    # Uniform in samples, so that a gap in the clock leaves no piece without any.
    inner = np.interp(np.linspace(0, n - 1, int((n - 1) / spacing) + 1)[1:-1], np.arange(n), time)
    try:
        return least_squares_spline(
            time, values, np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4]), rate
        )
    except (ValueError, np.linalg.LinAlgError):
        return None  # a gap leaves a stretch between knots without samples
