"""A measured motion as a smooth signal: least-squares cubic splines with cross-validated knots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.knots import SPACINGS, Rate, least_squares_spline, uniform
from hdsim.estimate.motion import Motion
from hdsim.estimate.noise import quantisation_step
from hdsim.estimate.rates import beside_rate
from hdsim.estimate.records import Array, Mask

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, CubicSpline

    from hdsim.actuation.signal_data import SignalData

#: Time after the record for which its last piece goes on, s.
TAIL_S = 0.02
#: What a spline may leave of a quantised reading in units of q / sqrt(12): a little noise comes on top.
STEPS_ALLOW = 1.1
#: A carried load may bend once in this part of a wave-generator turn, or in this time, s.
SLOW_KNOTS_TURNS, SLOW_KNOTS_S = 0.35, 0.25


def smoothed(time: Array, values: Array, *, step: float | None = None) -> tuple[Array, Array]:
    """Knots (k + 1,) and cubic coefficients (4, k) of the spline that ``spline_through`` takes."""
    return pieces_of(spline_through(time, values, step=step)[0])


def pieces_of(spline: BSpline | CubicSpline) -> tuple[Array, Array]:
    """Knots (k + 1,) and cubic coefficients (4, k), the constant terms first."""
    from scipy.interpolate import BSpline, PPoly

    pieces = PPoly.from_spline(spline) if isinstance(spline, BSpline) else spline
    keep = np.diff(pieces.x) > 0
    breaks = np.concatenate([pieces.x[:-1][keep], [pieces.x[-1]]])
    return breaks, np.asarray(pieces.c[::-1][:, keep])


def spline_through(
    time: Array,
    values: Array,
    *,
    motion: bool = False,
    step: float | None = None,
    rate: tuple[Array, Mask] | None = None,
    apart_s: float = 0.0,
) -> tuple[BSpline | CubicSpline, Motion | None]:
    """The spline that predicts left-out samples best, and the motion that it is the mean of, if any.

    Generalised cross-validation (Craven and Wahba 1979, Numerische Mathematik 31:377) of uniform
    least-squares splines: coarse knots when the data are noisy, the interpolating spline when they are not.
    The steps of a quantised reading are no white noise, and fine knots would follow them: of the splines that
    leave no more than the steps allow, q / sqrt(12), the coarsest is taken where it is coarser.

    Errors that last for some samples (a jittering clock, a resolver) are no white noise either: what is left
    out is foretold by its neighbours' errors, fine knots follow them (Altman 1990, Journal of the American
    Statistical Association 85:749), and differentiated twice they drown the acceleration. Where the rate is
    measured as well, the spline is fitted to both where that is likelier (``hdsim.estimate.rates``).

    Args:
        time: shape (n,), s, strictly increasing.
        values: shape (n,).
        motion: the values are an angle, whose acceleration may jump where friction changes its sign.
        step: q of the sensor; found in the values when None.
        rate: their measured derivative in any unit, shape (n,), and which samples of it count, shape (n,).
        apart_s: least time between knots that no rate speaks for, s.
    """
    from scipy.interpolate import CubicSpline

    step = quantisation_step(values) if step is None else step
    _, chosen = best_spline(time, values, step)
    if chosen is None:
        return CubicSpline(time, values), None
    beside: Rate | Motion | None = None
    if rate is not None:
        chosen, beside = beside_rate(time, values, chosen, *rate, step)
    if isinstance(beside, Motion):
        return chosen, beside
    apart = apart_s / float(np.median(np.diff(time)))
    if len(time) / len(chosen.c) < apart and len(time) >= 5.0 * apart:
        chosen = uniform(time, values, apart, beside) or chosen
    if motion:
        jumping = _jumping(time, values, chosen, beside)
        if jumping is not None and _score(time, values, jumping, beside) < _score(
            time, values, chosen, beside
        ):
            chosen = jumping
    return chosen, None


def drawn_anew(
    time: Array, values: Array, spline: BSpline | CubicSpline, rng: np.random.Generator
) -> Array | None:
    """Cubic coefficients (4, k), over the same knots, of a reading drawn about a spline with its noise.

    The noise is what the spline leaves, each with a sign of its own (the wild bootstrap: Wu 1986, Annals of
    Statistics 14:1261): more where a clock jitters and the shaft is fast, or at a corner that the spline
    rounds off. A spline of k numbers leaves the part 1 - k / n of the readings' variance.

    Args:
        time: shape (n,), s.
        values: as read, shape (n,).
        spline: through them.
        rng: of the draw.

    Returns:
        None where a knot a sample leaves no noise to be seen.
    """
    from scipy.interpolate import BSpline

    n = len(time)
    if not isinstance(spline, BSpline) or len(spline.c) >= n:
        return None
    smooth = spline(time)
    rest = (values - smooth) * np.sqrt(n / (n - len(spline.c)))
    try:
        drawn = least_squares_spline(time, smooth + rest * rng.choice((-1.0, 1.0), n), spline.t)
    except (ValueError, np.linalg.LinAlgError):
        return None
    return pieces_of(drawn)[1]


def best_spline(time: Array, values: Array, step: float | None = None) -> tuple[float, BSpline | None]:
    """The least-squares spline that ``spline_through`` takes, with its score; None where none can be made."""
    n = len(time)
    allowed = STEPS_ALLOW * (quantisation_step(values) if step is None else step) / np.sqrt(12.0)
    best, chosen = np.inf, None
    coarse: tuple[float, BSpline] | None = None
    rises = 0
    for spacing in SPACINGS:
        if int((n - 1) / spacing) < 4:
            break
        spline = uniform(time, values, spacing)
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


def _score(time: Array, values: Array, spline: BSpline, rate: Rate | None) -> float:
    """Generalised cross-validation's mean square of what is left."""
    n = len(time)
    left = float(np.mean((values - spline(time)) ** 2))
    if rate is not None:
        missed = (rate.values - spline(time, nu=1))[rate.trusted]
        left += rate.weight**2 * float(np.sum(missed**2)) / n
    return left / (1.0 - len(spline.c) / n) ** 2


def _jumping(time: Array, values: Array, spline: BSpline, rate: Rate | None) -> BSpline | None:
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
        return least_squares_spline(time, values, np.concatenate([spline.t[:4], inner, spline.t[-4:]]), rate)
    except (ValueError, np.linalg.LinAlgError):
        return None  # a gap leaves a stretch between knots without samples


def signal(breaks: Array, coefficients: Array, lead_in_s: float = 0.0, *, steady: bool = False) -> SignalData:
    """The spline as a signal of the simulation, after a lead-in at its initial slope.

    Args:
        breaks: shape (k + 1,), s.
        coefficients: shape (4, k), constant term first.
        lead_in_s: time before the first break, s.
        steady: lead in at its initial value. A motion goes on at its speed; a torque that is measured with
            noise has no slope that would hold for long.
    """
    from hdsim.actuation import _signal_kernel as law
    from hdsim.actuation.signal_data import Move, Segment, SignalData, hold

    if not np.all(np.isfinite(coefficients)):
        raise InputError("a measured channel cannot be smoothed: it holds values that are not finite")
    first, slope = coefficients[0, 0], 0.0 if steady else coefficients[1, 0]
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
