"""Step 7, prove: the gap on data that no step has seen, before, after the re-fit and with the effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdsim.estimate.beginning import hear_beginning
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.found import Gap
from hdsim.estimate.free_swing import swinging
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.series import Series
from hdsim.estimate.short_cut import whole_models
from hdsim.estimate.state import State
from hdsim.estimate.unwound import turned_to_zero
from hdsim.log.mapping import MEASURED

#: Draws of blocks for the intervals.
DRAWS = 500
#: Ratio of what held-out and training data leave above which they do not show the same (chosen).
APART = 3.0
#: The same where no effect is named: where none is missing, less is left (``EXCESS`` of a diagnosis).
SLIGHTLY = 1.25


def gaps(bench: Bench, states: Mapping[str, State]) -> tuple[dict[str, Gap], dict[str, list[Array]]]:
    """Gap of every channel for the states ``before``, ``refit`` and ``after``, and their predictions.

    Args:
        bench: the measured series with their held-out parts.
        states: the three models.
    """
    with whole_models(bench):
        predictions = {stage: _begun(bench, state) for stage, state in states.items()}
    hear_beginning(bench, predictions["after"], first=bench.training)
    residuals = {stage: bench.residuals(found, drift=True) for stage, found in predictions.items()}
    rng = np.random.default_rng(17)
    result = {}
    for channel in bench.channels:
        own = _held(bench, channel)
        if not own:
            continue
        numbers: dict[str, float] = {}
        intervals: dict[str, tuple[float, float]] = {}
        for stage, found in residuals.items():
            numbers[stage], intervals[stage] = held_out_gap(bench, channel, found, rng)
        result[channel] = Gap(
            before=numbers["before"],
            refit=numbers["refit"],
            after=numbers["after"],
            noise=float(np.sqrt(np.mean([bench.series[k].noise ** 2 for k in own]))),
            unit=MEASURED[channel],
            variation=variation(bench, own[0]),
            intervals=intervals,
        )
    return result, predictions


def _begun(bench: Bench, state: State) -> list[Array]:
    """Predictions of all series, each held-out record begun as suits the model best."""
    predictions = turned_to_zero(bench, state)
    # Where loads swing in the records that were learnt from, they may in the others.
    return swinging(bench, state, predictions, held_out=True)[1] if bench.swings else predictions


def borne_out(bench: Bench, before: Sequence[Array], after: Sequence[Array]) -> tuple[float, float]:
    """How much of what was added to a model shows in held-out data, with its standard error.

    With the held-out residual r and the change d of its prediction, the slope of r over d: 1 where all of d
    is there (and where nothing was added), 0 where none is. The error is clustered over blocks of time: data
    that hardly excite the change say so by a large one. Infinite where they do not at all.

    Args:
        bench: the measured series.
        before: predictions of all series without what was added.
        after: with it.
    """
    residuals = [bench.residuals(predictions, drift=True) for predictions in (before, after)]
    moments, powers = np.zeros(bench.blocks), np.zeros(bench.blocks)
    for series, without, there in zip(bench.series, *residuals, strict=True):
        if not len(without):
            continue
        r, d = without[series.hold] / series.sigma, (without - there)[series.hold] / series.sigma
        moments += np.bincount(series.block[series.hold], r * d, bench.blocks)
        powers += np.bincount(series.block[series.hold], d * d, bench.blocks)
    total, count = float(powers.sum()), int(np.sum(powers > 0))
    if total == 0.0 or count < 2:
        return 1.0, float("inf")
    slope = float(moments.sum()) / total
    away = moments - slope * powers
    return slope, float(np.sqrt(np.sum(away**2) * count / (count - 1))) / total


def unseen(bench: Bench, predictions: Sequence[Array], *, slightly: bool = False) -> list[Problem]:
    """Held-out records and stretches of which a model leaves much more than of what fits saw.

    What they show no step has been given to see, and a verdict of it there is none.

    Args:
        bench: the measured series.
        predictions: of all series.
        slightly: also those of which it leaves a quarter more: no effect is named that could miss them.
    """
    found, apart = [], SLIGHTLY if slightly else APART
    residuals = bench.residuals(predictions, drift=True)
    for channel in bench.channels:
        own = [
            (s, r) for s, r in zip(bench.series, residuals, strict=True) if s.channel == channel and len(r)
        ]
        trained = [_times_noise(s, r, s.train) for s, r in own if s.train.any()]
        for series, rest in own:
            if not trained or not series.hold.any():
                continue
            usual, times = max(trained), _times_noise(series, rest, series.hold)
            if times > apart * max(usual, 1.0):
                kind = "record" if series.record >= bench.training else "stretch"
                message = (
                    f"held-out data are missed by {times:.3g} times the noise, training data by {usual:.2g} "
                    f"times: this motion shows what no training {kind} does. Learn from one like it"
                )
                name = bench.predictors[series.record].record.name
                found.append(Problem(name, channel, "held out", "warning", message))
    return found


def _times_noise(series: Series, rest: Array, rows: Mask) -> float:
    """Root mean square of some samples of what is left of a series, in units of its noise."""
    return float(np.sqrt(np.mean(rest[rows] ** 2))) / max(series.noise, 1e-300)


def _held(bench: Bench, channel: str) -> list[int]:
    return [k for k, s in enumerate(bench.series) if s.channel == channel and s.hold.any()]


def held_out_gap(
    bench: Bench, channel: str, residuals: Sequence[Array], rng: np.random.Generator
) -> tuple[float, tuple[float, float]]:
    """Root mean square of a channel's residuals on held-out data, and its 95 % interval over blocks of time.

    Args:
        bench: the measured series.
        channel: one that has held-out samples.
        residuals: of every series, SI units.
        rng: draws the blocks.
    """
    powers, counts = [], []
    for k in _held(bench, channel):
        series = bench.series[k]
        rows = series.hold
        blocks = series.block[rows] - series.block.min()
        powers.append(np.bincount(blocks, residuals[k][rows] ** 2))
        counts.append(np.bincount(blocks))
    power, count = np.concatenate(powers), np.concatenate(counts)
    power, count = power[count > 0], count[count > 0]
    picks = rng.integers(0, len(power), size=(DRAWS, len(power)))
    draws = np.sqrt(power[picks].sum(axis=1) / count[picks].sum(axis=1))
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(np.sqrt(power.sum() / count.sum())), (float(low), float(high))


def variation(bench: Bench, index: int) -> float:
    """Standard deviation of what is to be predicted: of the output's angle, less motor angle over ratio."""
    series = bench.series[index]
    values = series.measured
    if series.channel == "output_angle":
        predictor = bench.predictors[series.record]
        values = values - predictor.motor_angle / predictor.ratio
    return float(np.std(values[series.train | series.hold]))
