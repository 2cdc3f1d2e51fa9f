"""Order spectra: the orders per wave-generator turn that a residual holds, over the measured angle."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import Predictor
from hdsim.estimate.records import Array

#: Order spectra: densely up to the first number, at integers up to the second.
DENSE_ORDER, HIGHEST_ORDER = 4.6, 60.0
#: Fewest periods of an order that make it one, in a turn and more, and in less than one, where no order comes
#: back to where it began (estimates: with fewer a slow change, or a loop of hysteresis, looks like it).
PERIODS, PERIODS_IN_PART = 1.5, 8.0
#: Highest frequency of an order at the usual speed, in sample rates. Beyond half of one it is read as another
#: one, but that lies above 0.4, where nothing slow can be meant.
QUICKEST = 0.6
#: Samples of which an order spectrum is made.
SPECTRUM_SAMPLES = 8000
#: Share of a channel's residual that a line of an order spectrum must hold to be listed.
LEAST_LINE = 0.02
#: Beats of two lines in a record for them to be two: they are looked for one apart (Rayleigh), and refining
#: moves the second by a quarter. With fewer it is what the first one's amplitude changes by, as with speed.
APART = 0.75


@dataclass(frozen=True)
class Line:
    """A peak of an order spectrum: order per wave-generator turn, amplitude (SI), share of the residual."""

    channel: str
    order: float
    amplitude: float
    share: float


def order_lines(
    bench: Bench, residuals: Sequence[Array], channel: str, most: int = 6, *, age_s: float = 0.0
) -> list[Line]:
    """Strongest orders per wave-generator turn in a channel's residual.

    The amplitude at an order is the least-squares one over the measured angle, so the speed may vary.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        channel: its name.
        most: lines.
        age_s: how late the channel is read beside the motion: without it high orders are blurred.
    """
    over = over_angle(bench, residuals, channel, age_s)
    if over is None:
        return []
    theta, e, turns, highest = over.angle, over.value, over.turns, over.highest
    power = float(np.mean(e**2))
    step = max(0.4 / turns, DENSE_ORDER / 600)
    dense = np.arange(over.lowest, min(DENSE_ORDER, highest), step)
    whole = np.arange(math.ceil(over.lowest), int(highest) + 1, dtype=float)
    orders, at = np.unique(np.concatenate([dense, whole]), return_index=True)
    if not len(orders):
        return []
    lines: list[Line] = []
    refused: list[float] = []
    rest = e
    while len(lines) < most:
        means = np.concatenate([means_over(theta, rest, even) for even in (dense, whole)])[at]
        shares = 2.0 * np.abs(means) ** 2 / power
        for order in (*(line.order for line in lines), *refused):
            shares[np.abs(orders - order) < 1.0 / turns] = 0.0
        k = int(np.argmax(shares))
        if shares[k] < max(LEAST_LINE, 10.0 * float(np.median(shares))):
            break
        found = [*(line.order for line in lines), _refined(theta, rest, float(orders[k]), step)]
        # Lines that are close pull at one another, so each is refined beside all others.
        for j in range(len(found) if len(found) > 1 else 0):
            alone, _ = _without(theta, e, found[:j] + found[j + 1 :])
            found[j] = _refined(theta, alone, found[j], 0.25 / turns)
        found = [_whole(order, turns) for order in found]
        if min(np.diff(sorted(found)), default=math.inf) < APART / turns:
            refused.append(float(orders[k]))
            continue
        # The next one is looked for in what all lines so far leave, so that no side lobe is taken for a line.
        rest, sizes = _without(theta, e, found)
        lines = [
            Line(channel, order, float(size), float(0.5 * size**2 / power))
            for order, size in zip(found, sizes, strict=True)
        ]
    return sorted(lines, key=lambda line: -line.share)


def lines_of(bench: Bench, residuals: Sequence[Array], delays: Mapping[str, float]) -> list[Line]:
    """Strongest orders of every compared channel, as in ``order_lines``; the channels' delays by name, s."""
    return [
        line
        for channel in bench.channels
        for line in order_lines(bench, residuals, channel, age_s=delays.get(channel, 0.0))
    ]


@dataclass(frozen=True)
class OverAngle:
    """A channel's residual over the motor's angle, shape (n,) each; of many samples a part.

    Attributes:
        angle: rad.
        velocity: rad/s.
        value: without its mean.
        turns: of the wave generator in the longest record.
        lowest: order that the motion lets be seen.
        highest: order that the sampling lets be seen.
        period_s: of the samples.
    """

    angle: Array
    velocity: Array
    value: Array
    turns: float
    lowest: float
    highest: float
    period_s: float


def over_angle(
    bench: Bench, residuals: Sequence[Array], channel: str, age_s: float = 0.0
) -> OverAngle | None:
    """The training samples of a channel; None where no order makes a period, or without anything left.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        channel: its name.
        age_s: how late it is read beside the motion; the angle is the one that its reading is of.
    """
    parts: list[tuple[Array, Array, Array]] = []
    fastest = turns = period = 0.0
    for series, residual in zip(bench.series, residuals, strict=True):
        if series.channel != channel or not len(residual) or not series.train.any():
            continue
        predictor, seen = bench.predictors[series.record], series.train
        angle = angle_read(predictor, age_s)
        parts.append((angle[seen], predictor.motor_velocity[seen], residual[seen]))
        turns = max(turns, float(np.ptp(parts[-1][0])) / (2 * np.pi))
        fastest = max(fastest, float(np.quantile(np.abs(predictor.motor_velocity), 0.5)) / (2 * np.pi))
        period = max(period, predictor.record.period_s)
    highest = min(HIGHEST_ORDER, QUICKEST / period / fastest) if fastest > 0.0 else 0.0
    lowest = max(0.5, (PERIODS if turns >= 1.0 else PERIODS_IN_PART) / max(turns, 1e-9))
    if lowest > highest:
        return None
    angle, velocity, value = (np.concatenate(column) for column in zip(*parts, strict=True))
    value = value - value.mean()
    if not np.any(value):
        return None
    if len(value) > SPECTRUM_SAMPLES:
        # A random part: taking every k-th would alias the high orders.
        part = np.sort(np.random.default_rng(0).choice(len(value), SPECTRUM_SAMPLES, replace=False))
        angle, velocity, value = angle[part], velocity[part], value[part]
    return OverAngle(angle, velocity, value, turns, lowest, highest, period)


def angle_read(predictor: Predictor, age_s: float) -> Array:
    """Motor angle that the readings of a channel are of, which are so late beside the motion: shape (n,)."""
    return np.asarray(predictor.motor_angle - age_s * predictor.motor_velocity)


def _refined(theta: Array, e: Array, order: float, step: float) -> float:
    """The order within one step of ``order`` whose line is strongest."""
    fine = order + step * np.linspace(-1.0, 1.0, 21)
    return float(fine[int(np.argmax(np.abs(means_over(theta, e, fine))))])


def means_over(angle: Array, values: Array, orders: Array) -> NDArray[np.complex128]:
    """Means of values times the waves e^(-i order angle) of evenly spaced orders, shape (m,).

    Each wave is a product of the one before, instead of a sine and a cosine.

    Args:
        angle: shape (n,), rad.
        values: shape (n,).
        orders: shape (m,), evenly spaced.
    """
    means = np.zeros(len(orders), dtype=np.complex128)
    if not len(orders):
        return means
    waves = np.exp(-1j * orders[0] * angle) * values
    # From the ends: two that are next to one another say little of how far apart they are.
    step = np.exp(-1j * (orders[-1] - orders[0]) / max(len(orders) - 1, 1) * angle)
    for k in range(len(orders)):
        means[k] = waves.mean()
        waves *= step
    return means


def power_of(
    bench: Bench, residuals: Sequence[Array], lines: Sequence[Line], ages_s: Mapping[str, float]
) -> float:
    """Whitened power that least squares finds at the orders of some lines in their channels' residuals.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        lines: peaks of order spectra.
        ages_s: how late channels are read beside the motion.
    """
    total = 0.0
    for series, residual in zip(bench.series, residuals, strict=True):
        orders = [line.order for line in lines if line.channel == series.channel]
        if not orders or not len(residual) or not series.train.any():
            continue
        own = residual[series.train] / series.sigma
        age_s = ages_s.get(series.channel, 0.0)
        theta = angle_read(bench.predictors[series.record], age_s)[series.train]
        left, _ = _without(theta, own - own.mean(), orders)
        total += float(np.sum((own - own.mean()) ** 2) - np.sum(left**2))
    return total


def _whole(order: float, turns: float) -> float:
    """The whole number next to an order, where the record is too short to tell it from that."""
    whole = round(order)
    return float(whole) if whole >= 1 and abs(order - whole) <= 0.5 / turns else order


def _without(theta: Array, e: Array, orders: Sequence[float]) -> tuple[Array, Array]:
    """What least squares leaves beside sines of these orders, and their amplitudes."""
    angles = np.outer(theta, orders)
    columns = np.hstack([np.sin(angles), np.cos(angles)])
    fitted, *_ = np.linalg.lstsq(columns, e, rcond=None)
    return e - columns @ fitted, np.hypot(fitted[: len(orders)], fitted[len(orders) :])
