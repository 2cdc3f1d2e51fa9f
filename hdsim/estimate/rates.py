"""Splines through an angle and its measured rate together.

An angle's errors may last: samples that a log repeats or loses, a clock that jitters, a resolver. Its rate
has errors of its own, and the slow errors of the one are the small ones of the other. How much each weighs,
and how fine the knots are, is what makes both readings likeliest (Bayesian information criterion, Schwarz
1978, Annals of Statistics 6:461) with Gaussian errors that last from one sample to the next (autoregressive
of order 1, each with its own variance): lasting errors then make no fine knots likely, as they would if they
were taken for white ones (Altman 1990, Journal of the American Statistical Association 85:749). That says
whether the rate is to be trusted; where it is, and both agree on what is fast, the motion is the likeliest
one behind them (``hdsim.estimate.motion``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.knots import SPACINGS, Rate, uniform
from hdsim.estimate.motion import Motion
from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.slips import around, find_slips

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: What an error of the rate weighs beside one of the angle, in sample periods (a grid of half decades).
WEIGHTS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
#: Fewest samples a knot: with fewer both readings are followed to the last digit, and no likelihood is left.
SAMPLES_A_KNOT = 4.0
#: Log-likelihood by which a spline through both must be the better one: odds of over 150 to 1, "very strong"
#: (Kass and Raftery 1995, Journal of the American Statistical Association 90:773).
CLEARLY = 5.0
#: Correlation of the rate's errors with the slopes of the angle's from which on it was differenced from the
#: same readings and tells nothing new: its square is half.
SAME = 0.7
#: What the likeliest motion may leave of the rate, in units of the rate's noise: of the power of twice of it
#: three quarters are no noise, but a filter's lag or the like, and tell nothing of what is fast.
AGREES = 2.0
#: Delays of a rate that are tried, in samples, and part of its variation that a slope must explain.
DELAYS = (0.0, *(2.0**k for k in np.arange(-1.0, 6.1, 0.5)))
EXPLAINED = 0.5


def beside_rate(
    time: Array, values: Array, chosen: BSpline, rate: Array, trusted: Mask, step: float = 0.0
) -> tuple[BSpline, Rate | Motion | None]:
    """The spline through both readings and what it was fitted to; ``chosen`` where that is no likelier.

    Only knots that are not finer than those of ``chosen`` are asked, and the rate must be foretold as well.

    Args:
        time: shape (n,), s.
        values: shape (n,).
        chosen: the spline through the values alone.
        rate: shape (n,), in any unit, and late as a filter makes it.
        trusted: shape (n,), samples of the rate that count.
        step: of the angle's sensor (0: none).
    """
    n = len(time)
    period = float(np.median(np.diff(time)))
    spacings = [
        s for s in SPACINGS if s >= max(SAMPLES_A_KNOT, 0.99 * n / len(chosen.c)) and int((n - 1) / s) >= 4
    ]
    if not spacings:
        return chosen, None
    read, late, noise = _in_its_unit(
        time, values, uniform(time, values, spacings[len(spacings) // 2]), rate, trusted
    )
    # A filter that is late by d samples takes out what is faster than a period of 2 pi d: two knots a period.
    spacings = [s for s in spacings if s >= np.pi * late]
    if read is None:
        return chosen, None
    slope_errors = (read - chosen(time, nu=1))[trusted]
    own_errors = np.diff(values - chosen(time), prepend=values[0] - float(chosen(time[0])))
    for differenced in (own_errors, 0.5 * (own_errors + np.roll(own_errors, -1))):
        if np.ptp(slope_errors) == 0.0 or abs(np.corrcoef(slope_errors, differenced[trusted])[0, 1]) > SAME:
            return chosen, None
    found: list[tuple[float, BSpline, Rate]] = []
    for spacing in spacings:
        for weight in WEIGHTS:
            beside = Rate(read, trusted, weight * period)
            spline = uniform(time, values, spacing, beside)
            if spline is not None:
                found.append((_unlikely(time, values, spline, read, trusted), spline, beside))
    least = _unlikely(time, values, chosen, read, trusted) - CLEARLY
    foretold = _missed(chosen(time, nu=1), rate, trusted)
    for unlikely, spline, beside in sorted(found, key=lambda one: one[0]):
        if unlikely >= least:
            break
        # What a filter has taken out of the rate must not go from the motion.
        if _missed(spline(time, nu=1), rate, trusted) <= foretold:
            likeliest = _followed(
                time, values, spline, Rate(read, trusted, noise), max(SAMPLES_A_KNOT, np.pi * late), step
            )
            if likeliest is not None:
                return likeliest.spline, likeliest
            return spline, beside
    return chosen, None


def _followed(
    time: Array, values: Array, spline: BSpline, rate: Rate, spacing: float, step: float
) -> Motion | None:
    """The motion in what is fast, too; None where the readings do not agree on one, or it is no likelier.

    Args:
        time: shape (n,), s.
        values: shape (n,).
        spline: with uniform knots through both readings.
        rate: in the values' unit a second, with the noise of its reading as weight.
        spacing: samples between knots.
        step: of the angle's sensor (0: none).
    """
    read, noise = rate.values, rate.weight
    trusted = rate.trusted & ~around(find_slips(time, values, read, rate.trusted))
    if not trusted.any():
        return None
    found = Motion(time, values, read, trusted, spacing, step)
    if found.believed.rate > AGREES * noise:
        return None
    # Of the same errors, white ones of the rate; a likelihood has half of each reading beside it.
    apart = found.unlikely - 0.5 * (len(time) + float(trusted.sum()))
    return found if apart < _unlikely(time, values, spline, read, trusted, white=True) - CLEARLY else None


def _missed(slope: Array, rate: Array, trusted: Mask) -> float:
    """Power of a rate that a slope behind the best of equal low-passes in series does not foretell."""
    from scipy.signal import lfilter

    best = np.inf
    for delay in DELAYS:
        for order in (1, 2):
            read, old = slope, delay / (delay + order)
            for _ in range(order if delay > 0 else 0):
                read, _ = lfilter([1.0 - old], [1.0, -old], read, zi=[old * read[0]])
            columns = np.column_stack([read, np.ones(len(read))])[trusted]
            ours, *_ = np.linalg.lstsq(columns, rate[trusted], rcond=None)
            best = min(best, float(np.sum((rate[trusted] - columns @ ours) ** 2)))
    return best


def _unlikely(
    time: Array, values: Array, spline: BSpline, rate: Array, trusted: Mask, *, white: bool = False
) -> float:
    """Half of the Bayesian information criterion of a spline, for the angle and its rate.

    Args:
        time: shape (n,), s.
        values: shape (n,).
        spline: through both.
        rate: shape (n,), unit a second.
        trusted: shape (n,), samples of the rate that count.
        white: take the rate's errors for ones that do not last.
    """
    n = len(time)
    total = 0.5 * len(spline.c) * np.log(n)
    lasts = [True, not white]
    for left, last in zip((values - spline(time), (rate - spline(time, nu=1))[trusted]), lasts, strict=True):
        left = left - left.mean()
        lasting = last * float(left[1:] @ left[:-1]) / max(float(left[:-1] @ left[:-1]), 1e-300)
        total += 0.5 * len(left) * np.log(float(np.mean((left[1:] - lasting * left[:-1]) ** 2)) + 1e-300)
    return float(total)


def _in_its_unit(
    time: Array, values: Array, slow: BSpline | None, rate: Array, trusted: Mask
) -> tuple[Array | None, float, float]:
    """The rate in the values' unit a second and at its own time, (n,); None where it is no rate of them.

    Also how late it was, in samples, and the noise of its reading in that unit.
    """
    if slow is None or not trusted.any():
        return None, 0.0, 0.0
    slope = slow(time, nu=1)
    period = float(np.median(np.diff(time)))
    noise = noise_floor(rate, trusted)
    best, found, late, unit = np.inf, None, 0.0, 1.0
    for delay in DELAYS:
        ahead = np.interp(time + delay * period, time, rate)
        columns = np.column_stack([slope, np.ones(len(time))])[trusted]
        (factor, offset), *_ = np.linalg.lstsq(columns, ahead[trusted], rcond=None)
        missed = float(np.sum((ahead[trusted] - columns @ [factor, offset]) ** 2))
        if missed < best and factor != 0.0:
            best, found, late, unit = missed, (ahead - offset) / factor, delay, abs(factor)
    varies = float(np.sum((rate[trusted] - rate[trusted].mean()) ** 2))
    return (found if best < (1.0 - EXPLAINED) * varies else None), late, noise / unit
