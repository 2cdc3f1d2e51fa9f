"""A measured motion as a smooth signal: least-squares cubic splines with cross-validated knots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.noise import quantisation_step
from hdsim.estimate.records import Array, Mask

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from hdsim.actuation.signal_data import SignalData

#: Time after the record for which its last piece goes on, s.
TAIL_S = 0.02
#: Samples between knots that are tried.
SPACINGS = (1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 21.0, 32.0, 48.0, 72.0, 108.0, 160.0, 240.0)
#: What a spline may leave of a quantised reading in units of q / sqrt(12): a little noise comes on top.
STEPS_ALLOW = 1.1
#: Stretches of time over which a rate judges two splines, and standard errors by which one must be better.
STRETCHES, CLEARLY = 30, 2.0
#: Delays of a rate's low-pass that are tried, in samples.
DELAYS = (0.0, *(2.0**k for k in np.arange(-1.0, 6.1, 0.5)))
#: Part of its own size that the other splines leave of a B-spline, squared, below which rounding decides.
SINGULAR = 1e-12
#: A carried load may bend once in this part of a wave-generator turn, or in this time, s.
SLOW_KNOTS_TURNS, SLOW_KNOTS_S = 0.35, 0.25


def smoothed(
    time: Array,
    values: Array,
    *,
    motion: bool = False,
    step: float | None = None,
    rate: tuple[Array, Mask] | None = None,
) -> tuple[Array, Array]:
    """Knots (k + 1,) and cubic coefficients (4, k) of the spline that predicts left-out samples best.

    Generalised cross-validation (Craven and Wahba 1979, Numerische Mathematik 31:377) of uniform
    least-squares splines: coarse knots when the data are noisy, the interpolating spline when they are not.
    The steps of a quantised reading are no white noise, and fine knots would follow them: of the splines that
    leave no more than the steps allow, q / sqrt(12), the coarsest is taken where it is coarser.

    Errors that last for some samples (a jittering clock, a resolver) are no white noise either: what is left
    out is foretold by its neighbours' errors, fine knots follow them (Altman 1990, Journal of the American
    Statistical Association 85:749), and differentiated twice they drown the acceleration. Where the rate is
    measured as well, the splines are judged by it: by what they were not fitted to.

    Args:
        time: shape (n,), s, strictly increasing.
        values: shape (n,).
        motion: the values are an angle, whose acceleration may jump where friction changes its sign.
        step: q of the sensor; found in the values when None.
        rate: their measured derivative in any unit, shape (n,), and which samples of it count, shape (n,).
    """
    from scipy.interpolate import CubicSpline, PPoly

    best, chosen = best_spline(time, values, step)
    if chosen is None:
        exact = CubicSpline(time, values)
        return np.asarray(exact.x), np.asarray(exact.c[::-1])
    if rate is not None:
        chosen = borne_out(time, values, chosen, *rate)
        best = _score(time, values, chosen)
    if motion:
        jumping = _jumping(time, values, chosen)
        if jumping is not None and _score(time, values, jumping) < best:
            chosen = jumping
    pieces_of = PPoly.from_spline(chosen)
    keep = np.diff(pieces_of.x) > 0
    breaks = np.concatenate([pieces_of.x[:-1][keep], [time[-1]]])
    return breaks, np.asarray(pieces_of.c[::-1][:, keep])


def least_squares_spline(time: Array, values: Array, knots: Array) -> BSpline:
    """The cubic spline of least squares, in a time that is linear in the samples.

    The normal equations of B-splines are banded and well conditioned (de Boor, A Practical Guide to Splines,
    ch. XIV); SciPy's ``make_lsq_spline`` takes a time that grows with samples times knots.

    Args:
        time: shape (n,), strictly increasing.
        values: shape (n,).
        knots: shape (c + 4,), increasing, four equal ones at either end.

    Raises:
        LinAlgError: a stretch between knots has no samples.
        ValueError: a sample lies outside of the knots.
    """
    from scipy.interpolate import BSpline
    from scipy.linalg import cho_solve_banded, cholesky_banded

    c = len(knots) - 4
    design = BSpline.design_matrix(time, knots, 3)
    parts, at = design.data.reshape(-1, 4), design.indices.reshape(-1, 4)
    band, right = np.zeros((4, c)), np.zeros(c)
    for i in range(4):
        right += np.bincount(at[:, i], parts[:, i] * values, c)
        for below in range(4 - i):
            band[below] += np.bincount(at[:, i], parts[:, i] * parts[:, i + below], c)
    factor = cholesky_banded(band, lower=True)
    if np.any(factor[0] ** 2 <= SINGULAR * band[0]):
        raise np.linalg.LinAlgError("a stretch between knots has no samples")
    return BSpline(knots, cho_solve_banded((factor, True), right), 3)


def best_spline(time: Array, values: Array, step: float | None = None) -> tuple[float, BSpline | None]:
    """The least-squares spline that ``smoothed`` takes, with its score; None where none can be made."""
    n = len(time)
    allowed = STEPS_ALLOW * (quantisation_step(values) if step is None else step) / np.sqrt(12.0)
    best, chosen = np.inf, None
    coarse: tuple[float, BSpline] | None = None
    rises = 0
    for spacing in SPACINGS:
        if int((n - 1) / spacing) < 4:
            break
        spline = _uniform(time, values, spacing)
        if spline is None:
            continue
        rest = float(np.mean((values - spline(time)) ** 2))
        score = rest / (1.0 - len(spline.c) / n) ** 2
        if rest <= allowed**2:
            coarse = score, spline
        if score < best:
            best, chosen, rises = score, spline, 0
        else:
            rises += 1
            if rises >= 3 and rest > allowed**2:
                break
    if coarse is not None and chosen is not None and len(coarse[1].c) < len(chosen.c):
        return coarse
    return best, chosen


def borne_out(time: Array, values: Array, chosen: BSpline, rate: Array, trusted: Mask) -> BSpline:
    """The spline, or a coarser one whose derivative clearly foretells the measured rate better.

    Only coarser ones are asked: a rate that was differenced from the same readings shares their errors, and
    would have finer ones follow them. A rate may be filtered, and its filter follows from the slow motion
    that both splines have: behind it the detail that one of them lacks must show, if it is real.

    Args:
        time: shape (n,), s.
        values: shape (n,).
        chosen: the spline through the values.
        rate: shape (n,), in any unit.
        trusted: shape (n,), samples of the rate that count.
    """
    stretch = (np.arange(len(time)) * STRETCHES // len(time))[trusted]

    def missed(slope: Array, delay: float, order: int) -> Array:
        """Power of the rate in each stretch that a derivative behind a filter does not foretell."""
        read = _filtered(slope, delay, order)
        columns = np.column_stack([read, np.ones(len(time))])[trusted]
        ours, *_ = np.linalg.lstsq(columns, rate[trusted], rcond=None)
        left = (rate[trusted] - columns @ ours) ** 2
        return np.asarray(np.bincount(stretch, left, STRETCHES) + 1e-300, dtype=float)

    best, least, chosen_slope = chosen, np.inf, chosen(time, nu=1)
    for spacing in SPACINGS:
        if int((len(time) - 1) / spacing) < 4:
            break
        spline = _uniform(time, values, spacing)
        if spline is None or len(spline.c) >= len(chosen.c):
            continue
        slope = spline(time, nu=1)
        tried = [(missed(slope, delay, order), delay, order) for delay in DELAYS for order in (1, 2)]
        now, delay, order = min(tried, key=lambda one: float(one[0].sum()))
        # Of the logarithms a hiccup of the log counts as one stretch among the others.
        better = np.log(missed(chosen_slope, delay, order) / now)
        clear = float(better.mean()) > CLEARLY * float(better.std()) / np.sqrt(STRETCHES)
        if clear and now.sum() < least:
            best, least = spline, float(now.sum())
    return best


def _filtered(values: Array, delay: float, order: int) -> Array:
    """Values behind equal first-order low-passes in series, which together delay by so many samples."""
    from scipy.signal import lfilter

    old = delay / (delay + order)
    for _ in range(order if delay > 0 else 0):
        values, _ = lfilter([1.0 - old], [1.0, -old], values, zi=[old * values[0]])
    return values


def _uniform(time: Array, values: Array, spacing: float) -> BSpline | None:
    """The least-squares spline with knots every so many samples; None where there is none."""
    n = len(time)
    # Uniform in samples, so that a gap in the clock leaves no piece without any.
    inner = np.interp(np.linspace(0, n - 1, int((n - 1) / spacing) + 1)[1:-1], np.arange(n), time)
    try:
        return least_squares_spline(time, values, np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4]))
    except (ValueError, np.linalg.LinAlgError):
        return None  # a gap leaves a stretch between knots without samples


def _score(time: Array, values: Array, spline: BSpline) -> float:
    """Generalised cross-validation's mean square of what is left."""
    n = len(time)
    return float(np.mean((values - spline(time)) ** 2)) / (1.0 - len(spline.c) / n) ** 2


def _jumping(time: Array, values: Array, spline: BSpline) -> BSpline | None:
    """The spline with a double knot, at which its second derivative may jump, at every reversal.

    None where there is no reversal with room for one.
    """
    from scipy.interpolate import PPoly

    knots = spline.t[4:-4]
    if len(knots) < 4:
        return None
    spacing = float(np.median(np.diff(knots)))
    at = PPoly.from_spline(spline.derivative()).roots(discontinuity=False, extrapolate=False)
    at = np.unique(at[np.isfinite(at)])
    at = at[(at > knots[1]) & (at < knots[-2])]
    # At rest the noise reverses it all the time: only what goes on for a while is a reversal.
    apart = np.diff(at, prepend=-np.inf, append=np.inf) > 2.0 * spacing
    at = at[apart[:-1] & apart[1:]]
    if not len(at):
        return None
    following = np.clip(np.searchsorted(at, knots), 0, len(at) - 1)
    nearest = np.minimum(np.abs(knots - at[following]), np.abs(knots - at[np.maximum(following - 1, 0)]))
    inner = np.sort(np.concatenate([knots[nearest > 0.5 * spacing], at, at]))
    try:
        return least_squares_spline(time, values, np.concatenate([spline.t[:4], inner, spline.t[-4:]]))
    except (ValueError, np.linalg.LinAlgError):
        return None  # a gap leaves a stretch between knots without samples


def signal(breaks: Array, coefficients: Array, lead_in_s: float = 0.0) -> SignalData:
    """The spline as a signal of the simulation, after a lead-in at its initial slope.

    Args:
        breaks: shape (k + 1,), s.
        coefficients: shape (4, k), constant term first.
        lead_in_s: time before the first break, s.
    """
    from hdsim.actuation import _signal_kernel as law
    from hdsim.actuation.signal_data import Move, Segment, SignalData, hold

    if not np.all(np.isfinite(coefficients)):
        raise InputError("a measured channel cannot be smoothed: it holds values that are not finite")
    first, slope = coefficients[0, 0], coefficients[1, 0]
    starts = breaks[:-1] - breaks[0] + lead_in_s
    rows = [tuple(row) for row in coefficients.T.tolist()]
    times = starts.tolist()
    if lead_in_s > 0:
        times = [0.0, *times]
        rows = [(float(first - slope * lead_in_s), float(slope), 0.0, 0.0), *rows]
    width = breaks[-1] - breaks[-2]
    c = coefficients[:, -1]
    # The last piece goes on beyond the record, so that its last samples still see the motion and not a stop.
    width += TAIL_S
    end = float(breaks[-1] - breaks[0] + lead_in_s) + TAIL_S
    final = float(c[0] + width * (c[1] + width * (c[2] + width * c[3])))
    segment = Segment(law.CUBIC, times, rows)
    return SignalData(Move((segment, hold(end, final)), end, rows[0][0], final))


class SlowPart:
    """What of a channel is slower than a part of a wave-generator turn: a least-squares cubic spline.

    Args:
        time: shape (n,), s.
        turns: shape (n,), angle of the wave generator, turns.
    """

    def __init__(self, time: Array, turns: Array) -> None:
        n = len(time)
        steps = np.abs(np.diff(turns)) / SLOW_KNOTS_TURNS + np.diff(time) / SLOW_KNOTS_S
        # A knot every few samples at most: finer ones would follow the noise.
        clock = np.concatenate([[0.0], np.cumsum(np.minimum(steps, 0.1))])
        inner = np.interp(np.arange(1.0, np.floor(clock[-1])), clock, time)
        self.time = time
        self._knots = np.concatenate([[time[0]] * 4, inner[: n // 4], [time[-1]] * 4])

    def of(self, values: Array) -> Array:
        """The slow part of values of shape (n,)."""
        return np.asarray(least_squares_spline(self.time, values, self._knots)(self.time))
