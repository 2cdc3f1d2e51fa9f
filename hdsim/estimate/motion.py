"""The likeliest motion behind an angle and its measured rate: a penalised spline through both readings.

A joint's acceleration is not as smooth as its set points: controllers jerk, motors ripple. A spline with
knots that are fine enough for that follows the readings' errors too, one with coarse ones leaves what is real
to the torque. Here the knots are fine and third differences of the coefficients are penalised (P-splines,
Eilers and Marx 1996, Statistical Science 11:89): the motion is believed to be one whose acceleration wanders,
and the spline is its mean given both readings, so that what a torque has to do with it is not watered down by
their errors (Berkson 1950, Journal of the American Statistical Association 45:164). How much it wanders, both
readings' variances and how long the angle's errors last (autoregressive of order 1) have the largest marginal
likelihood (Wecker and Ansley 1983, Journal of the American Statistical Association 78:81).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.estimate.knots import slopes_of
from hdsim.estimate.noise import usual_size
from hdsim.estimate.records import Array, Mask

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: Diagonals of the normal equations: rows of neighbouring samples, and third differences, reach this far.
DIAGONALS = 5
#: Logarithms of wandering, beside that of a motion with these readings' jerks, and lasting errors, from which
#: the likelihood is climbed; steps of either climb.
WANDERS, LASTS = (-4.0, -1.0), (0.0, 2.0)
CLIMBS = 240
#: Least part of their own size that differences of the readings leave as noise: rounding.
LEAST = 1e-9


@dataclass(frozen=True)
class Beliefs:
    """What makes both readings likeliest.

    Attributes:
        angle: standard deviation of the angle's errors from one sample to the next, in its unit.
        rate: the same of the rate's, unit a second.
        wanders: standard deviation of third differences of the spline's coefficients, unit of the angle.
        lasts: correlation of the angle's errors from one sample to the next.
    """

    angle: float
    rate: float
    wanders: float
    lasts: float


class Motion:
    """Spline of the largest posterior density given both readings.

    Args:
        time: shape (n,), s, strictly increasing.
        values: shape (n,).
        rate: shape (n,), unit a second.
        trusted: shape (n,), samples of the rate that count.
        spacing: samples between knots.
        step: of the angle's sensor (0: none).
    """

    def __init__(
        self, time: Array, values: Array, rate: Array, trusted: Mask, spacing: float, step: float = 0.0
    ) -> None:
        from scipy.interpolate import BSpline
        from scipy.sparse import csr_matrix, diags_array

        n = len(time)
        inner = np.interp(np.linspace(0, n - 1, int((n - 1) / spacing) + 1)[1:-1], np.arange(n), time)
        self.knots = np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4])
        self.time, self.trusted, self.least = time, trusted, step / np.sqrt(12.0)
        self._heights = BSpline.design_matrix(time, self.knots, 3)
        at = self._heights.indices.reshape(-1, 4)
        slopes = slopes_of(time, self.knots, at) * trusted[:, None]
        shape = self._heights.shape
        self._rates = csr_matrix((slopes.ravel(), self._heights.indices, self._heights.indptr), shape=shape)
        c = shape[1]
        thirds = diags_array(
            [np.full(c - 3, k) for k in (-1.0, 3.0, -3.0, 1.0)], offsets=[0, 1, 2, 3], shape=(c - 3, c)
        )
        self._thirds = csr_matrix(thirds)
        now, before = self._heights[1:], self._heights[:-1]
        self._grams = [_band(m) for m in (now.T @ now, now.T @ before + before.T @ now, before.T @ before)]
        self._rate_gram, self._penalty = (_band(m.T @ m) for m in (self._rates, self._thirds))
        self.believed = self._climbed(values, np.where(trusted, rate, 0.0))
        #: The spline, and minus the logarithm of the marginal likelihood, but for a constant.
        self.spline, self.unlikely = self._solved(self.believed, values, np.where(trusted, rate, 0.0))

    def disturbed(self, rng: np.random.Generator) -> BSpline:
        """The spline as other readings of the same motion would have given it (parametric bootstrap)."""
        from scipy.signal import lfilter

        one, n = self.believed, len(self.time)
        lasting = lfilter([1.0], [1.0, -one.lasts], one.angle * rng.standard_normal(n))
        rate = self.spline(self.time, nu=1) + one.rate * rng.standard_normal(n)
        return self._solved(one, self.spline(self.time) + lasting, np.where(self.trusted, rate, 0.0))[0]

    def _solved(self, one: Beliefs, values: Array, rate: Array) -> tuple[BSpline, float]:
        """The spline, and minus the logarithm of the readings' marginal likelihood but for a constant."""
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded, cholesky_banded

        a, r, w, lasts = one.angle, one.rate, one.wanders, one.lasts
        grams = self._grams[0] - lasts * self._grams[1] + lasts**2 * self._grams[2]
        band = grams / a**2 + self._rate_gram / r**2 + self._penalty / w**2
        fresh = values[1:] - lasts * values[:-1]
        pull = self._heights[1:].T @ fresh - lasts * (self._heights[:-1].T @ fresh)
        right = pull / a**2 + self._rates.T @ rate / r**2
        factor = cholesky_banded(band, lower=True)
        weights = cho_solve_banded((factor, True), right)
        left: Array = values - self._heights @ weights
        missed = rate - self._rates @ weights
        bends = self._thirds @ weights
        squares = (
            float(np.sum((left[1:] - lasts * left[:-1]) ** 2)) / a**2
            + float(missed @ missed) / r**2
            + float(bends @ bends) / w**2
        )
        sizes = (len(left) - 1) * np.log(a) + self.trusted.sum() * np.log(r) + len(bends) * np.log(w)
        unlikely = 0.5 * squares + float(np.log(factor[0]).sum() + sizes)
        return BSpline(self.knots, weights, 3), unlikely

    def _climbed(self, values: Array, rate: Array) -> Beliefs:
        from scipy.optimize import minimize

        def noise(of: Array) -> float:
            size = usual_size(np.diff(of, 4)) / math.sqrt(70.0)
            return max(size, LEAST * float(np.ptp(of)), 1e-300)

        angle, slope = max(noise(values), self.least), noise(rate[self.trusted])
        # Third differences of what the rate says between knots.
        apart = float(np.median(np.diff(np.unique(self.knots))))
        skip = max(1, round(apart / float(np.median(np.diff(self.time)))))
        wanders = max(float(np.std(np.diff(rate[::skip], 2))) * apart, 1e-300)

        def beliefs(x: Array) -> Beliefs:
            a, r, w = np.exp(np.clip(x[:3], -10.0, 10.0)) * (angle, slope, wanders)
            return Beliefs(max(a, self.least, 1e-300), r, w, float(np.tanh(np.clip(x[3], 0.0, 3.0))))

        def unlikely(x: Array) -> float:
            try:
                return self._solved(beliefs(x), values, rate)[1]
            except np.linalg.LinAlgError:
                return np.inf

        begun = [np.array([0.0, 0.0, w, lasts]) for w in WANDERS for lasts in LASTS]
        best = min(begun, key=unlikely)
        simplex = np.vstack([best, best + np.diag([1.0, 1.0, 1.0, 0.5])])
        options: Any = {"initial_simplex": simplex, "maxfev": CLIMBS, "xatol": 0.05, "fatol": 0.5}
        return beliefs(minimize(unlikely, best, method="Nelder-Mead", options=options).x)


def _band(matrix: Any) -> Array:
    """Lower diagonals of a symmetric banded matrix, shape (DIAGONALS, c)."""
    c = matrix.shape[0]
    found = np.zeros((DIAGONALS, c))
    for k in range(DIAGONALS):
        found[k, : c - k] = matrix.diagonal(-k)
    return found
