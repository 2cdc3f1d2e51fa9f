"""Angles whose readings jump: an encoder that loses counts, a coupling that slips.

From one sample on, all readings are off by the same. No effect of a drive does that once and then never again
(a play changes sides with the torque, again and again), so it is asked where a model leaves nothing else: the
best step of a series' residual (least squares over all samples at which it may be, Page 1955, Biometrika
42:523) must be nearly all that the noise does not say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.records import Array

#: Part of what is left beyond the noise that a step must explain (a ramp's best step explains 3/4 of it).
ALL = 0.9
#: Standard deviations of a reading that a step must have to be told from a drift of the motion's spline.
SEEN = 5.0
#: Fewest samples on either side of it: a few that are off are spikes, or the motion's spline at its ends.
FEWEST = 20


@dataclass(frozen=True)
class Jump:
    """A jump that was taken back: in which record and channel, when, s, and by how much, rad."""

    record: int
    channel: str
    time_s: float
    size_rad: float


def take_back_jumps(bench: Bench, predictions: list[Array]) -> list[Jump]:
    """Take jumps of angles back that are nearly all that a model leaves of them.

    Args:
        bench: the measured series; those that jump are changed (the records are not).
        predictions: of all series.

    Returns:
        The jumps.
    """
    found = []
    for series, rest in zip(bench.series, bench.residuals(predictions), strict=True):
        rows = series.train | series.hold
        if not len(rest) or not series.channel.endswith("angle") or rows.sum() <= 2 * FEWEST:
            continue
        first, size, part = best_step(rest[rows], series.noise)
        if part < ALL or abs(size) < SEEN * series.reading:
            continue
        time = bench.time_of(series)
        begins = time[np.flatnonzero(rows)[first]]
        series.measured = series.measured - size * (time >= begins)
        found.append(Jump(series.record, series.channel, float(begins), size))
    return found


def best_step(rest: Array, noise: float) -> tuple[int, float, float]:
    """The step that explains most of a residual.

    Args:
        rest: shape (n,), more than twice ``FEWEST`` samples.
        noise: its standard deviation.

    Returns:
        First sample behind it, its size, and the part that it explains of what is more than the noise.
    """
    rest = rest - rest.mean()
    n = len(rest)
    before = np.arange(FEWEST, n - FEWEST + 1)
    power = np.cumsum(rest)[before - 1] ** 2 * n / (before * (n - before))
    best = int(np.argmax(power))
    first = int(before[best])
    beyond = float(np.sum(rest**2)) - n * noise**2
    size = float(rest[first:].mean() - rest[:first].mean())
    return first, size, float(power[best]) / beyond if beyond > 0.0 else 0.0


def jumped(bench: Bench, jumps: list[Jump]) -> list[Problem]:
    """What was taken back, for the report."""
    return [
        Problem(
            bench.predictors[jump.record].record.name,
            jump.channel,
            "jump",
            "warning",
            f"jumps by {jump.size_rad:.2g} rad at {jump.time_s:.4g} s and stays there: lost counts, or a "
            "coupling that slips? Taken back",
        )
        for jump in jumps
    ]
