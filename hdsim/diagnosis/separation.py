"""How far an experiment's records set two models apart.

What separates two models is the part of the difference of their records that no re-fit of either takes away,
in standard deviations of the noise: with S the sensitivities to the numbers of the one that is fitted and C
their covariance after the first data, and the difference D and S divided by the noise,

    d'^2 = D^T (1 + S C S^T)^-1 D

(Wald's distance of two Gaussian predictions; Box and Hill 1967, Technometrics 9:57, choose experiments for
telling models apart by it). Noise is what the best candidate leaves of the measured channels, counted by its
independent samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.fit import Fit
from hdsim.estimate.records import Array


def separated(
    truth: Any,
    fitted: Any,
    slopes: Sequence[Any],
    steps: Sequence[float],
    spread: Array,
    noise: Mapping[str, float],
    density: float,
) -> tuple[float, str, float, float]:
    """How far two models' records are apart, once the second one's numbers have moved towards the first.

    Args:
        truth: channels of the first model's record, by name, shape (n,) each, SI units.
        fitted: the same of the second one, whose numbers may move.
        slopes: the same with each of its p numbers a step away.
        steps: these steps, in the units of ``spread``.
        spread: a root of the covariance of the numbers, shape (p, p).
        noise: standard deviation of one independent sample of each channel, as `noise_of` finds it.
        density: samples of the data to one of these records.

    Returns:
        d', the channel that holds most of its square, the largest difference there (SI), and its sample.
    """
    weights = {channel: math.sqrt(density) / noise[channel] for channel in truth}

    def stacked(there: Any, here: Any) -> Array:
        parts = []
        for channel, weight in weights.items():
            change = there[channel] - here[channel]
            parts.append(weight * (change - change.mean()))
        return np.concatenate(parts)

    difference = stacked(truth, fitted)
    if slopes:
        columns = np.column_stack(
            [stacked(slope, fitted) / step for slope, step in zip(slopes, steps, strict=True)]
        )
        root = columns @ spread
        inner = np.eye(root.shape[1]) + root.T @ root
        # What is left of the difference once the numbers have moved as far as both data let them.
        taken = np.linalg.solve(inner, root.T @ difference)
        squared = float(difference @ difference - difference @ root @ taken)
        rest = difference - root @ taken
    else:
        squared, rest = float(difference @ difference), difference
    best, at = ("", 0.0, 0), 0
    largest = -math.inf
    for channel, weight in weights.items():
        n = len(truth[channel])
        part = difference[at : at + n]
        share = float(part @ rest[at : at + n])
        if share > largest:
            largest = share
            k = int(np.argmax(np.abs(part)))
            best = (channel, float(abs(part[k]) / weight), k)
        at += n
    return math.sqrt(max(squared, 0.0)), best[0], best[1], float(best[2])


def noise_of(bench: Bench, fit: Fit) -> dict[str, float]:
    """Standard deviation that one independent sample of each channel would have, from what a fit leaves."""
    found: dict[str, list[float]] = {}
    for series, rest in zip(bench.series, bench.residuals(fit.predictions), strict=True):
        rows = series.train
        if len(rest) and rows.any():
            power = float(np.mean(rest[rows] ** 2)) * correlation(rest[rows], series.block[rows])
            found.setdefault(series.channel, []).append(max(power, series.noise**2, 1e-30))
    return {channel: math.sqrt(float(np.mean(powers))) for channel, powers in found.items()}
