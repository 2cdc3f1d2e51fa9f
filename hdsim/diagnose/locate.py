"""Step 4, locate: in which of the drive's own coordinates the rest of the residual is a function."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hdsim.diagnose.screen import Residual
from hdsim.estimate.bench import Bench, Series
from hdsim.estimate.records import Array

#: Corners of the piecewise linear curves over a coordinate; of a finer one over the output's angle, where a
#: catch or a stop is narrow.
CORNERS, FINE_CORNERS = 9, 40
#: Orders per wave-generator turn that are always tried: integers; with 2 z_c / z_f and its double.
LOBES = (1.0, 2.0, 3.0, 4.0)
#: Order spectra: densely up to the first number, at integers up to the second.
DENSE_ORDER, HIGHEST_ORDER = 4.6, 60
#: Oscillators that stand for parts that ring: number, damping ratio (neighbours overlap), least frequency.
OSCILLATORS, DAMPING_RATIO, SLOWEST_HZ = 12, 0.2, 0.5
#: Highest frequency of an oscillator as a part of the sampling rate.
FASTEST = 0.3
#: Samples of which an order spectrum is made.
SPECTRUM_SAMPLES = 8000
#: Share of a channel's residual that a line of an order spectrum must hold to be listed.
LEAST_LINE = 0.02


@dataclass(frozen=True)
class Line:
    """A peak of an order spectrum: order per wave-generator turn, amplitude (SI), share of the residual."""

    channel: str
    order: float
    amplitude: float
    share: float


@dataclass
class Curve:
    """A residual as a function of a coordinate: shape (corners,) each, in SI units."""

    at: Array
    value: Array


@dataclass
class Place:
    """How much of a channel's residual is a function of one coordinate.

    Attributes:
        coordinate: its name, as effects' signatures use them.
        channel: the channel.
        share: cross-validated share of the residual's power.
        curve: the function, where the coordinate is one number.
    """

    coordinate: str
    channel: str
    share: float
    curve: Curve | None = None


@dataclass
class Location:
    """Where a residual lives.

    Attributes:
        places: by falling share.
        lines: peaks of the order spectra by falling share.
        structured: share of the whole weighed residual that the best coordinate of each channel explains.
        chance: probability to find such a share in a residual without structure.
        powers: whitened power of each channel's residual.
    """

    places: list[Place] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    structured: float = 0.0
    chance: float = 1.0
    powers: dict[str, float] = field(default_factory=dict)


def locate(bench: Bench, residual: Residual, residuals: list[Array]) -> Location:
    """Find the coordinates that explain a residual.

    Args:
        bench: the measured series.
        residual: the whitened training residual with the base model's directions removed.
        residuals: of every series, SI units.
    """
    found = Location()
    numbers = bench.stacked_series()
    draws: list[Array] = []
    explained = 0.0
    for channel in bench.channels:
        own = [k for k, s in enumerate(bench.series) if s.channel == channel and s.record < bench.training]
        rows = np.isin(numbers, own)
        power = float(np.sum(residual.values[rows] ** 2))
        found.powers[channel] = power
        if power <= 0:
            continue
        lines = order_lines(bench, residuals, channel)
        found.lines += lines
        best = 0.0
        channel_draws = []
        for name, columns, corners in _designs(bench, own, lines, residuals):
            share = residual.share(columns, rows)
            curve = None
            if corners is not None:
                sigma = float(np.mean([bench.series[k].sigma for k in own]))
                curve = Curve(corners, share.coefficients[: len(corners)] * sigma)
            found.places.append(Place(name, channel, share.share, curve))
            best = max(best, share.share)
            channel_draws.append(share.chance)
        explained += best * power
        if channel_draws:
            draws.append(np.max(np.stack(channel_draws), axis=0) * power)
    found.places.sort(key=lambda place: -place.share)
    found.lines.sort(key=lambda line: -line.share)
    if residual.power > 0 and draws:
        found.structured = max(0.0, explained / residual.power)
        by_chance = np.sum(np.maximum(np.stack(draws), 0.0), axis=0)
        found.chance = float((1 + np.sum(by_chance >= explained)) / (1 + len(by_chance)))
    return found


def curves_over(bench: Bench, residuals: Sequence[Array], wanted: Collection[tuple[str, str]]) -> Array:
    """Columns of smooth curves over coordinates of channels, shape (rows, k): what a law may leave there.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        wanted: coordinate and channel of every curve.
    """
    columns: list[Array] = [np.zeros((len(bench.stacked_blocks()), 0))]
    for channel in bench.channels:
        names = {coordinate for coordinate, own in wanted if own == channel}
        if not names:
            continue
        own = [k for k, s in enumerate(bench.series) if s.channel == channel and s.record < bench.training]
        lines = order_lines(bench, residuals, channel) if "wave_generator_angle" in names else []
        columns += [x for name, x, _ in _designs(bench, own, lines, residuals) if name in names]
    return np.hstack(columns)


def _model_torque(bench: Bench, series: Series, residuals: Sequence[Array]) -> Array | None:
    """Torque at the output as the model has it: the measured one would hold the residual itself."""
    for other, residual in zip(bench.series, residuals, strict=True):
        if other.record == series.record and other.channel == "output_torque":
            return np.asarray(other.measured - residual)
    predictor = bench.predictors[series.record]
    if predictor.plan.load != "scenario":
        return _smooth(predictor.record.filled(predictor.plan.load))
    return None


def coordinates(bench: Bench, series: Series, residuals: Sequence[Array]) -> dict[str, Array]:
    """The coordinates of one series at all its samples, shape (n,) each.

    Args:
        bench: the measured series.
        series: the one that is asked for.
        residuals: of all series; they say what torque the model has.
    """
    predictor = bench.predictors[series.record]
    record = predictor.record
    velocity = predictor.motor_velocity
    direction = _direction(velocity)
    since = _since_reversal(record.time, direction)
    found = {
        "time": record.time,
        "velocity": velocity,
        "direction": direction,
        "time_since_reversal": direction * np.log1p(since / 0.02),
        "output_angle": predictor.motor_angle / predictor.ratio,
    }
    for other, residual in zip(bench.series, residuals, strict=True):
        if other.record == series.record and other.channel == "motor_torque":
            found["motor_torque"] = other.measured - residual
    torque = _model_torque(bench, series, residuals)
    if torque is not None:
        found["torque"] = torque
    if "temperature" in record.channels and record.trusted["temperature"].sum() > 20:
        found["temperature"] = record.filled("temperature")
    return found


def order_lines(bench: Bench, residuals: Sequence[Array], channel: str, most: int = 6) -> list[Line]:
    """Strongest orders per wave-generator turn in a channel's residual.

    The amplitude at an order is the least-squares one over the measured angle, so the speed may vary.
    """
    angle: list[Array] = []
    value: list[Array] = []
    fastest = turns = 0.0
    rate = np.inf
    for series, residual in zip(bench.series, residuals, strict=True):
        if series.channel != channel or not len(residual) or not series.train.any():
            continue
        predictor = bench.predictors[series.record]
        angle.append(predictor.motor_angle[series.train])
        value.append(residual[series.train])
        turns = max(turns, float(np.ptp(angle[-1])) / (2 * np.pi))
        fastest = max(fastest, float(np.quantile(np.abs(predictor.motor_velocity), 0.5)) / (2 * np.pi))
        rate = min(rate, 1.0 / predictor.record.period_s)
    if not angle or turns < 1.0 or fastest == 0.0:
        return []
    theta, e = np.concatenate(angle), np.concatenate(value)
    e = e - e.mean()
    power = float(np.mean(e**2))
    if power == 0.0:
        return []
    highest = min(float(HIGHEST_ORDER), 0.4 * rate / fastest)
    step = max(0.4 / turns, DENSE_ORDER / 600)
    orders = np.arange(max(0.5, 1.5 / turns), min(DENSE_ORDER, highest), step)
    orders = np.unique(np.concatenate([orders, np.arange(1.0, int(highest) + 1)]))
    if not len(orders):
        return []  # too fast for the sampling to see any order
    # A random part of the samples: taking every k-th would alias the high orders.
    if len(theta) > SPECTRUM_SAMPLES:
        part = np.sort(np.random.default_rng(0).choice(len(theta), SPECTRUM_SAMPLES, replace=False))
        theta, e = theta[part], e[part]
    waves = np.exp(-1j * np.outer(orders, theta))
    lines: list[Line] = []
    rest = e
    while len(lines) < most:
        shares = 2.0 * np.abs(waves @ rest / len(rest)) ** 2 / power
        for near in (np.abs(orders - line.order) < 1.0 / turns for line in lines):
            shares[near] = 0.0
        k = int(np.argmax(shares))
        if shares[k] < max(LEAST_LINE, 10.0 * float(np.median(shares))):
            break
        order = _refined(theta, rest, float(orders[k]), step)
        whole = round(order)
        if whole >= 1 and abs(order - whole) <= 0.5 / turns:
            order = float(whole)
        lines.append(Line(channel, order, 2.0 * abs(np.mean(rest * np.exp(-1j * order * theta))), shares[k]))
        # The next one is looked for in what all lines so far leave, so that no side lobe is taken for a line.
        angles = np.outer(theta, [line.order for line in lines])
        columns = np.hstack([np.sin(angles), np.cos(angles)])
        fitted, *_ = np.linalg.lstsq(columns, e, rcond=None)
        rest = e - columns @ fitted
        half = len(lines)
        sizes = np.hypot(fitted[:half], fitted[half:])
        lines = [
            Line(channel, line.order, float(size), float(0.5 * size**2 / power))
            for line, size in zip(lines, sizes, strict=True)
        ]
    return sorted(lines, key=lambda line: -line.share)


def _refined(theta: Array, e: Array, order: float, step: float) -> float:
    """The order within one step of ``order`` whose line is strongest."""
    fine = order + step * np.linspace(-1.0, 1.0, 21)
    power = [abs(np.mean(e * np.exp(-1j * n * theta))) for n in fine]
    return float(fine[int(np.argmax(power))])


def _designs(
    bench: Bench, own: list[int], lines: list[Line], residuals: Sequence[Array]
) -> list[tuple[str, Array, Array | None]]:
    """Name, columns (rows, k) and corners of a curve for every coordinate of one channel."""
    everything = {k: coordinates(bench, bench.series[k], residuals) for k in own}
    names = list(dict.fromkeys(name for found in everything.values() for name in found))
    result: list[tuple[str, Array, Array | None]] = []
    for name in names:
        if not all(name in found for found in everything.values()):
            continue
        values = np.concatenate([everything[k][name][bench.series[k].train] for k in own])
        if np.ptp(values) == 0:
            continue
        if name == "direction":
            result.append((name, _placed(bench, own, values[:, None]), None))
            continue
        corners = np.unique(np.quantile(values, np.linspace(0, 1, CORNERS)))
        if len(corners) < 3:
            continue
        result.append((name, _placed(bench, own, hats(values, corners)), corners))
        if name == "output_angle":
            fine = np.linspace(values.min(), values.max(), FINE_CORNERS)
            result.append((name, _placed(bench, own, hats(values, fine)), fine))
        if name in ("velocity", "torque", "output_angle"):
            # Friction and loss are odd in speed: with the direction.
            turned = np.concatenate([everything[k]["direction"][bench.series[k].train] for k in own])
            size = values if name == "output_angle" else np.abs(values)
            both = np.hstack([hats(values, corners), turned[:, None] * hats(size, corners)])
            result.append((name, _placed(bench, own, both), None))
    ringing = np.vstack([oscillators(bench, bench.series[k])[bench.series[k].train] for k in own])
    result.append(("frequency", _placed(bench, own, ringing), None))
    angle = np.concatenate(
        [bench.predictors[bench.series[k].record].motor_angle[bench.series[k].train] for k in own]
    )
    ratio = bench.predictors[0].ratio
    relative = angle * (1.0 - 1.0 / ratio)
    turning = [*(n * angle for n in LOBES), 2.0 * relative, 4.0 * relative]
    turning += [line.order * angle for line in lines if line.order not in LOBES]
    harmonics = np.column_stack([part for a in turning for part in (np.sin(a), np.cos(a))])
    result.append(("wave_generator_angle", _placed(bench, own, harmonics), None))
    return result


def oscillators(bench: Bench, series: Series) -> Array:
    """What oscillators of several frequencies do when the motion shakes them, shape (n, 2 OSCILLATORS).

    x'' + 2 d w x' + w^2 x = -a with the motor's acceleration a: a part that hangs on the drive by a spring
    leaves a sum of such x and x' in torque and angle.
    """
    from scipy.signal import bilinear, lfilter

    predictor = bench.predictors[series.record]
    rate = 1.0 / predictor.record.period_s
    slowest = max(SLOWEST_HZ, 3.0 / predictor.record.duration_s)
    columns = []
    for frequency in np.geomspace(slowest, FASTEST * rate, OSCILLATORS):
        w = 2 * np.pi * frequency
        bottom = [1.0, 2.0 * DAMPING_RATIO * w, w * w]
        columns += [
            lfilter(*bilinear(top, bottom, rate), predictor.motor_acceleration)
            for top in ([0.0, 0.0, w * w], [0.0, w, 0.0])
        ]
    return np.column_stack(columns)


def hats(values: Array, corners: Array) -> Array:
    """Piecewise linear functions that are 1 at one corner and 0 at the others, shape (n, corners)."""
    columns = np.empty((len(values), len(corners)))
    for k in range(len(corners)):
        unit = np.zeros(len(corners))
        unit[k] = 1.0
        columns[:, k] = np.interp(values, corners, unit)
    return columns


def _placed(bench: Bench, own: list[int], columns: Array) -> Array:
    """Columns of one channel among the rows of all."""
    numbers = bench.stacked_series()
    whole = np.zeros((len(numbers), columns.shape[1]))
    at = 0
    for k in own:
        rows = numbers == k
        count = int(rows.sum())
        whole[rows] = columns[at : at + count]
        at += count
    return whole


def _direction(velocity: Array) -> Array:
    """Sign of the velocity; below a thousandth of the largest the last one."""
    small = np.abs(velocity) < 1e-3 * np.max(np.abs(velocity))
    sign = np.where(small, 0.0, np.sign(velocity))
    index = np.where(sign != 0, np.arange(len(sign)), 0)
    held: Array = sign[np.maximum.accumulate(index)]
    return held


def _since_reversal(time: Array, direction: Array) -> Array:
    turned: NDArray[np.bool_] = np.concatenate([[False], np.diff(direction) != 0])
    last = np.maximum.accumulate(np.where(turned, np.arange(len(time)), 0))
    return np.asarray(time - time[last])


def _smooth(values: Array, samples: int = 15) -> Array:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(values, samples, mode="nearest"))
