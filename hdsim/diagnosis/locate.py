"""Step 4, locate: in which of the drive's own coordinates the rest of the residual is a function."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hdsim.diagnosis.coordinates import coordinates, hats, oscillators
from hdsim.diagnosis.screen import Residual
from hdsim.estimate.bench import Bench
from hdsim.estimate.orders import Line, angle_read, order_lines
from hdsim.estimate.records import Array

#: Corners of the piecewise linear curves over a coordinate; of a finer one over the output's angle, where a
#: catch or a stop is narrow.
CORNERS, FINE_CORNERS = 9, 40
#: Orders per wave-generator turn that are always tried: integers; with 2 z_c / z_f and its double.
LOBES = (1.0, 2.0, 3.0, 4.0)
#: The coordinate whose sharp lines no smooth curve over another one holds.
SHARP = "wave_generator_angle"


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
        chance: probability of such a share in a residual without structure.
    """

    coordinate: str
    channel: str
    share: float
    curve: Curve | None = None
    chance: float = 1.0


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

    def sharp(self, level: float) -> bool:
        """Whether some channel holds lines over the wave generator's angle with at most this chance."""
        return any(place.coordinate == SHARP and place.chance <= level for place in self.places)


def locate(bench: Bench, residual: Residual, residuals: list[Array], ages_s: Mapping[str, float]) -> Location:
    """Find the coordinates that explain a residual.

    Args:
        bench: the measured series.
        residual: the whitened training residual with the base model's directions removed.
        residuals: of every series, SI units.
        ages_s: how late channels are read beside the motion.
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
        age_s = ages_s.get(channel, 0.0)
        lines = order_lines(bench, residuals, channel, age_s=age_s)
        found.lines += lines
        best = 0.0
        channel_draws = []
        for name, columns, corners in _designs(bench, own, lines, residuals, age_s):
            share = residual.share(columns, rows)
            curve = None
            if corners is not None:
                sigma = float(np.mean([bench.series[k].sigma for k in own]))
                curve = Curve(corners, share.coefficients[: len(corners)] * sigma)
            chance = float((1 + np.sum(share.chance >= share.share)) / (1 + len(share.chance)))
            found.places.append(Place(name, channel, share.share, curve, chance))
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


def curves_over(
    bench: Bench,
    residuals: Sequence[Array],
    wanted: Collection[tuple[str, str]],
    ages_s: Mapping[str, float],
) -> Array:
    """Columns of smooth curves over coordinates of channels, shape (rows, k): what a law may leave there.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        wanted: coordinate and channel of every curve.
        ages_s: how late channels are read beside the motion.
    """
    columns: list[Array] = [np.zeros((len(bench.stacked_blocks()), 0))]
    for channel in bench.channels:
        names = {coordinate for coordinate, own in wanted if own == channel}
        if not names:
            continue
        own = [k for k, s in enumerate(bench.series) if s.channel == channel and s.record < bench.training]
        age_s = ages_s.get(channel, 0.0)
        lines = order_lines(bench, residuals, channel, age_s=age_s) if SHARP in names else []
        columns += [x for name, x, _ in _designs(bench, own, lines, residuals, age_s) if name in names]
    return np.hstack(columns)


def _designs(
    bench: Bench, own: list[int], lines: list[Line], residuals: Sequence[Array], age_s: float
) -> list[tuple[str, Array, Array | None]]:
    """Name, columns (rows, k) and corners of a curve for every coordinate of one channel."""
    everything = {k: coordinates(bench, bench.series[k], residuals) for k in own}
    names = list(dict.fromkeys(name for found in everything.values() for name in found))
    sensed = bench.of_the_load(bench.series[own[0]])
    if sensed:
        names = ["output_angle"]  # a load may vibrate, or depend on anything else
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
        if name in ("velocity", "torque", "output_angle") and not sensed:
            # Friction and loss are odd in speed: with the direction.
            turned = np.concatenate([everything[k]["direction"][bench.series[k].train] for k in own])
            size = values if name == "output_angle" else np.abs(values)
            both = np.hstack([hats(values, corners), turned[:, None] * hats(size, corners)])
            result.append((name, _placed(bench, own, both), None))
    if not sensed:
        ringing = np.vstack([oscillators(bench, bench.series[k])[bench.series[k].train] for k in own])
        result.append(("frequency", _placed(bench, own, ringing), None))
    angle = np.concatenate(
        [angle_read(bench.predictors[bench.series[k].record], age_s)[bench.series[k].train] for k in own]
    )
    ratio = bench.predictors[0].ratio
    relative = angle * (1.0 - 1.0 / ratio)
    turning = [*(n * angle for n in LOBES), 2.0 * relative, 4.0 * relative]
    turning += [line.order * angle for line in lines if line.order not in LOBES]
    harmonics = np.column_stack([part for a in turning for part in (np.sin(a), np.cos(a))])
    result.append((SHARP, _placed(bench, own, harmonics), None))
    return result


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
