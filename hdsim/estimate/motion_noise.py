"""What the noise of a prescribed motion, and of a measured load, does to what is predicted.

A prediction answers to its motion's errors as to the motion: a lightly damped load swings with them. The
spring is wound up by the noise of the torque that is given. That is noise of the comparison, though no sensor
of the compared channel has it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.noise import usual_size
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.state import State


def hear_motion(bench: Bench, states: Sequence[State], predictions: Sequence[Array]) -> None:
    """Add to every series' noise what the noise of the prescribed motion and load does to its prediction.

    A fit leaves least where the model answers to that noise least (regression dilution: R. J. Carroll et al.,
    *Measurement Error in Nonlinear Models*, 2nd ed., Chapman and Hall 2006, section 1.1), as a rule by too
    much damping: of several models the one that answers most is heard. Where that is as a rule more than a
    channel's residual, it is less by as much: what is not there is no noise.

    Args:
        bench: the measured series; their noise is changed.
        states: the model as given, and at fitted numbers.
        predictions: of the last one.
    """
    left: dict[str, float] = {}
    for s, rest in zip(bench.series, bench.residuals(predictions), strict=True):
        if len(rest) and s.train.any():
            # The median: the stretches that something missing stirs up least.
            left[s.channel] = max(_spread(rest[s.train]), left.get(s.channel, 0.0))
    heard = [s.noise for s in bench.series]
    for state in states:
        for index, change in next(answers(bench, state, 1)).items():
            s, rows = bench.series[index], bench.series[index].train | bench.series[index].hold
            if not rows.any():
                continue
            usual = float(np.hypot(s.noise, _spread(change[rows])))
            whole = float(np.hypot(s.noise, np.std(change[rows])))
            # A channel without noise that is predicted without error has neither.
            share = min(left.get(s.channel, usual) / usual, 1.0) if usual > 0.0 else 1.0
            heard[index] = max(heard[index], whole * share)
    for s, noise in zip(bench.series, heard, strict=True):
        s.reading = float(np.hypot(s.reading, np.sqrt(noise**2 - s.noise**2)))
        s.noise = noise


def answers(bench: Bench, state: State, draws: int, *, everything: bool = True) -> Iterator[dict[int, Array]]:
    """What other readings of motion and load change in the series that a model then predicts.

    Args:
        bench: the measured series.
        state: the model.
        draws: how many of them.
        everything: of the held-out records too.

    Yields:
        Of each reading, by the series' numbers, those that could be predicted, shape (n,) each.
    """
    candidate, here = state.candidate(), {}
    for index in range(len(bench.predictors) if everything else bench.training):
        with contextlib.suppress(PredictionError):
            here[index] = bench.predictors[index].predict(candidate)
    for seed in range(draws):
        changes: dict[int, Array] = {}
        for index, own in here.items():
            predictor = bench.predictors[index]
            other = predictor.disturbed(seed)
            with contextlib.suppress(PredictionError):
                there = other.predict(candidate)
                for k, s in enumerate(bench.series):
                    if s.record != index:
                        continue
                    change = state.reading(s.channel, bench.time_of(s), there[s.channel] - own[s.channel])
                    if s.channel == "output_angle" and not predictor.plan.locked:
                        # It is compared beside the motor's angle, which has moved as well.
                        change = change - (other.motor_angle - predictor.motor_angle) / predictor.ratio
                    changes[k] = change
        yield changes


def _spread(values: Array) -> float:
    return usual_size(values - values.mean())
