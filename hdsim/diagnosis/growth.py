"""Whether an order of what is left grows with speed, which it does where something is shaken, or does not.

Order tracking (``tracking.py``) gives an order's mean amplitude in bands of speed, with intervals from its
scatter. They are compared with a power of the speed: of exponent 0 is what is cut into teeth, scales and
magnets, of 2 what inertia makes of such an error (T = J e'' = J k^2 w^2 e). What passes a resonance goes as 1
or r^2 over |1 - r^2 + 2 i d r|, with r the speed over that of the resonance (den Hartog, Mechanical
Vibrations, ch. 2: a constant force, and a shaken base), where that is better by an F test.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from hdsim.diagnosis.locate import SHARP, Location
from hdsim.diagnosis.tracking import banded, hunting, mean_beside, periods
from hdsim.estimate.bench import Bench
from hdsim.estimate.found import Part
from hdsim.estimate.orders import Line, angle_read
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State
from hdsim.log.mapping import MEASURED
from hdsim.plot import units

#: Most lines of a channel that are tracked.
MOST_LINES = 3
#: Distance of orders, in units of order over ratio, below which one is the hunting order of the other.
NEXT = 1.1
#: Ratio of the fastest to the slowest band without which no growth can be seen.
SPEEDS = 1.5
#: What a resonance's peak must be beside both ends of the speeds: twice the power. Chance of less than this
#: that a power of the speed does as well.
PEAK, CHANCE = math.sqrt(2.0), 0.01
#: Part of its power that must repeat itself for an order to be said to do anything with speed (estimate).
STEADY = 0.25
#: Exponents of speed that must be excluded for an order to be said not to grow, or not to fall.
PROPORTIONAL = 1.0

Growth = Literal["same", "grows", "falls", "resonance", "open"]
_WORDS = {
    "same": "which does not grow with speed: geometry, a magnet or a sensor",
    "grows": "which grows with speed: dynamic",
    "falls": "which falls with speed: something follows it late, or filters it",
    "resonance": "which is largest at {at:.3g} rad/s, {hertz:.3g} Hz: it passes a resonance",
    "open": "of which these data do not tell whether it grows with speed",
}


class Band(Part):
    """Amplitude of an order in a band of speed of one record."""

    record: str
    """Name of the record."""
    velocity_rad_per_s: float
    """Mean speed of the motor, signed."""
    amplitude: float
    """Amplitude, in the channel's unit."""
    interval: tuple[float, float]
    """Its 95 % interval."""
    periods: int
    """Periods of the order that it is the mean of."""


class TrackedOrder(Part):
    """How an order of what is left goes with speed."""

    channel: str
    """Channel."""
    order: float
    """Periods per turn of the wave generator."""
    unit: str
    """Unit of the amplitudes."""
    amplitude: float
    """Mean amplitude."""
    growth: Growth
    """What it does with speed."""
    exponent: float | None = None
    """Power of the speed with which it goes; None where too few speeds are there."""
    interval: tuple[float, float] | None = None
    """Its 95 % interval."""
    resonance_rad_per_s: float | None = None
    """Speed at which it is largest, where it passes a resonance."""
    steady: float
    """Part of its power that repeats itself from period to period, with one amplitude and phase in a band."""
    bands: list[Band] = []
    """By record and speed."""
    sentence: str = ""
    """All that in words."""


def tracked(bench: Bench, state: State, locations: Sequence[Location]) -> list[TrackedOrder]:
    """The located lines over speed, strongest first.

    Args:
        bench: the measured series; both what fits and what only the proof have seen is looked at.
        state: the final model; its effects that make lines are left out.
        locations: where the residuals of the search's passes live.
    """
    lines: list[Line] = []
    for line in sorted((line for place in locations for line in place.lines), key=lambda line: -line.share):
        apart = 0.5 / max(bench.turns, 0.5)
        own = [abs(other.order - line.order) for other in lines if other.channel == line.channel]
        if len(own) < MOST_LINES and min(own, default=math.inf) >= apart:
            lines.append(line)
    if not lines:
        return []
    for channel in {line.channel for line in lines}:
        places = [k for k, line in enumerate(lines) if line.channel == channel]
        orders = hunting([lines[k].order for k in places], bench.predictors[0].ratio, bench.turns)
        for k, order in zip(places, orders, strict=True):
            lines[k] = replace(lines[k], order=order)
    # Two side lobes of one hunting order are one line, the stronger.
    lines = list({(line.channel, line.order): line for line in reversed(lines)}.values())[::-1]
    smooth = replace(state, added=tuple(one for one in state.added if one.lives_in[0] != SHARP))
    try:
        residuals = bench.residuals(bench.predict(smooth, everything=True), drift=True)
    except PredictionError:
        return []
    delays = state.delays
    found = [over_speed(bench, residuals, o, delays.get(o.channel, 0.0), beside=lines) for o in lines]
    return [one for one in found if one is not None]


def over_speed(
    bench: Bench,
    residuals: Sequence[Array],
    line: Line,
    age_s: float = 0.0,
    *,
    beside: Sequence[Line] = (),
) -> TrackedOrder | None:
    """One order of what a model leaves over speed; None where no band of speed has periods enough.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        line: channel and order.
        age_s: how late the channel is read beside the motion.
        beside: other lines; of the channel's those that are its hunting orders are told apart from it.
    """
    # Other lines nearby are as well an amplitude that wanders.
    hunting_apart = NEXT * line.order / abs(bench.predictors[0].ratio)
    apart = [
        other.order - line.order
        for other in beside
        if other.channel == line.channel and 0.0 < abs(other.order - line.order) < hunting_apart
    ]
    bands: list[Band] = []
    means: list[tuple[float, float]] = []
    steady = power = 0.0
    for series, rest in zip(bench.series, residuals, strict=True):
        if series.channel != line.channel or not len(rest):
            continue
        predictor = bench.predictors[series.record]
        velocity = predictor.motor_velocity
        angle = angle_read(predictor, age_s)
        speeds, places, waves = periods(angle, velocity, rest, series.train | series.hold, line.order)
        for picked in banded(speeds):
            own, n = waves[picked], len(picked)
            mean, error, free = mean_beside(own, places[picked], apart)
            size = math.sqrt(max(abs(mean) ** 2 - error**2, 0.0))
            half = _student(free) * error
            bands.append(
                Band(
                    record=predictor.record.name,
                    velocity_rad_per_s=float(speeds[picked].mean()),
                    amplitude=size,
                    interval=(max(size - half, 0.0), size + half),
                    periods=n,
                )
            )
            means.append((size, error))
            steady += n * (abs(mean) ** 2 - 2.0 * error**2)
            power += float(np.sum(np.abs(own) ** 2))
    if not bands:
        return None
    weights = np.array([band.periods for band in bands], dtype=float)
    sizes, errors = (np.array(column) for column in zip(*means, strict=True))
    found = TrackedOrder(
        channel=line.channel,
        order=line.order,
        unit=MEASURED[line.channel],
        amplitude=float(np.average(sizes, weights=weights)),
        growth="open",
        steady=float(np.clip(steady / max(power, 1e-300), 0.0, 1.0)),
        bands=bands,
    )
    _judge(found, np.abs([band.velocity_rad_per_s for band in bands]), sizes, errors)
    found.sentence = _sentence(found)
    return found


def _judge(found: TrackedOrder, speeds: Array, sizes: Array, errors: Array) -> None:
    """Set what the order does with speed."""
    if len(sizes) < 3 or speeds.max() < SPEEDS * speeds.min():
        return
    middle = float(np.exp(np.mean(np.log(speeds))))
    errors = np.maximum(errors, 1e-6 * max(float(sizes.max()), 1e-300))

    def power_of(w: Array, size: float, power: float) -> Array:
        return np.asarray(size * (w / middle) ** power)

    def forced(w: Array, size: float, at: float, damping: float) -> Array:
        ratio = (w / at) ** 2
        return np.asarray(size / np.hypot(1.0 - ratio, 2.0 * damping * np.sqrt(ratio)))

    def shaken(w: Array, size: float, at: float, damping: float) -> Array:
        return np.asarray((w / at) ** 2 * forced(w, size, at, damping))

    plain = _least(power_of, speeds, sizes, errors, (found.amplitude, 0.0))
    if plain is None:
        return
    (_, power), covariance, missed = plain
    free = len(sizes) - 2
    half = _student(free) * math.sqrt(float(covariance[1, 1]) * max(missed / free, 1.0))
    low, high = float(power) - half, float(power) + half
    if math.isfinite(half):
        found.exponent, found.interval = float(power), (low, high)
    peaks = {
        law: [
            _least(law, speeds, sizes, errors, (found.amplitude, at, 0.1))
            for at in np.quantile(speeds, (0.2, 0.4, 0.6, 0.8))
        ]
        for law in (forced, shaken)
    }
    tried = [(*one, law) for law in (forced, shaken) for one in peaks[law] if one is not None]
    if found.steady < STEADY:
        return
    if tried and free > 1:
        numbers, _, best, law = min(tried, key=lambda one: one[2])
        fine = np.linspace(speeds.min(), speeds.max(), 400)
        course = law(fine, *numbers)
        stands_out = course.max() > PEAK * max(course[0], course[-1])
        if stands_out and _clearly(missed, best, free - 1):
            found.growth, found.resonance_rad_per_s = "resonance", float(fine[np.argmax(course)])
            return
    if not math.isfinite(half):
        return
    if low > 0.0:
        found.growth = "grows"
    elif high < 0.0:
        found.growth = "falls"
    elif low > -PROPORTIONAL and high < PROPORTIONAL:
        found.growth = "same"


def _least(
    law: Callable[..., Array], speeds: Array, sizes: Array, errors: Array, begun: Sequence[float]
) -> tuple[Array, Array, float] | None:
    """Numbers of a law of least squares, their covariance, and what it misses in units of the errors."""
    from scipy.optimize import OptimizeWarning, curve_fit

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OptimizeWarning)  # an infinite covariance says the same
        try:
            best, covariance = curve_fit(
                law, speeds, sizes, begun, sigma=errors, absolute_sigma=True, maxfev=4000
            )
        except RuntimeError:
            return None
    return best, covariance, float(np.sum(((sizes - law(speeds, *best)) / errors) ** 2))


def _clearly(plain: float, freer: float, free: int) -> bool:
    """Whether one more number explains more than chance would (F test)."""
    from scipy.stats import f

    return (plain - freer) / max(freer / free, 1.0) > float(f.ppf(1.0 - CHANCE, 1, free))


def _sentence(found: TrackedOrder) -> str:
    at = found.resonance_rad_per_s or 0.0
    words = _WORDS[found.growth].format(at=at, hertz=found.order * at / (2 * np.pi))
    if found.growth in ("same", "grows", "falls") and found.interval is not None:
        low, high = found.interval
        words += f" (as its power {found.exponent:.2g}, {low:.2g} to {high:.2g})"
    spoken = found.channel.replace("_", " ")
    records = list(dict.fromkeys(band.record for band in found.bands))
    unit = units.for_error(found.amplitude) if found.unit == "rad" else units.Unit(found.unit, 1.0)
    sizes = []
    for name in records:
        own = [band for band in found.bands if band.record == name]
        mean = np.average([b.amplitude for b in own], weights=[b.periods for b in own])
        sizes.append(f"{unit.factor * mean:.3g} {unit.name}{f' in {name}' if len(records) > 1 else ''}")
    repeats = f"{100 * found.steady:.0f} % of its power repeats itself from period to period"
    return f"order {found.order:.4g} of the {spoken}, {' and '.join(sizes)}, {words}; {repeats}"


def _student(freedom: int) -> float:
    """Student's t of a 95 % interval."""
    from scipy.stats import t

    return float(t.ppf(0.975, max(freedom, 1)))
