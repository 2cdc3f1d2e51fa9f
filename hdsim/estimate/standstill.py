"""Where a measured motion does not tell which way a shaft turns, and so not its friction.

Coulomb friction at rest is whatever holds the shaft (Filippov 1988, Differential Equations with
Discontinuous Righthand Sides): no function of the motion, which is all that a prediction is given. Near rest
it is one as far as the speed is known. With Gaussian errors of standard deviation s the mean of sign(v) is
erf(v / (sqrt(2) s)), whose slope is that of tanh(v / (sqrt(pi / 2) s)); beyond 2 s the sign is certain.
"""

from __future__ import annotations

import numpy as np

from hdsim.drive.parameters import RESOLVED_RAD_PER_S, STICKS_RAD_PER_S
from hdsim.estimate.records import Array, Mask

#: Standard deviations of a speed beyond which its sign is certain (95 %).
CERTAIN = 2.0
#: Smoothing speed of a sign over the standard deviation of the speed.
SMOOTHED = float(np.sqrt(np.pi / 2.0))
#: Samples on either side that count with one of unknown sign: where friction's jump can be seen, the motion's
#: spline has knots that many samples apart, and smooths the jump in acceleration over them.
BESIDE = 4


def resolution(speed: Array, again: Array) -> float:
    """Smoothing speed of the sign of a measured speed, rad/s; at most that of the effects' own formulas.

    A speed is known no better than its noise, nor than what it changes by between two samples.

    Args:
        speed: shape (n,), rad/s.
        again: shape (n,), the same from other readings of the motion, rad/s.
    """
    apart = float(np.sqrt(np.mean((again - speed) ** 2)))
    between = float(np.median(np.abs(np.diff(speed))))
    return float(np.clip(SMOOTHED * np.hypot(apart, between), STICKS_RAD_PER_S, RESOLVED_RAD_PER_S))


def standing(speed: Array, smoothing: float) -> Mask:
    """Samples at which the shaft may rest or reverse, and those next to them, shape (n,).

    Args:
        speed: shape (n,), rad/s.
        smoothing: of the sign, ``resolution``, rad/s.
    """
    slow = np.abs(speed) < CERTAIN / SMOOTHED * smoothing
    turned = np.diff(np.sign(speed)) != 0
    slow[1:] |= turned
    slow[:-1] |= turned
    return np.convolve(slow, np.ones(2 * BESIDE + 1), "same") > 0
