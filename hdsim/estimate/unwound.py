"""The locked zero: the encoder's angle at which a drive with a locked output carries nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array
from hdsim.estimate.state import State

#: Prior spread of the angle at which a locked drive carries nothing, as a part of the motor's travel, and the
#: number of samples that together tell as much as one independent one.
TURN, SAMPLES_A_FACT = 0.05, 50.0


def turn_to_zero(bench: Bench, state: State, predictions: Sequence[Array]) -> bool:
    """Where the output is locked, find the encoder's angle at which the drive carries nothing.

    Args:
        bench: the measured series; its predictors' zero is moved.
        state: a fitted model.
        predictions: what it predicts now.

    Returns:
        Whether a record was moved, so that predictions have to be made anew.
    """
    columns = unwound(bench, state, predictions)
    if not columns:
        return False
    rest = bench.stacked(bench.residuals(predictions))
    ranges = [float(np.ptp(bench.predictors[index].motor_angle)) for index in columns]
    # A linear spring does not tell the angle, as offsets are taken out: it then stays where it is.
    priors = TURN * np.array(ranges)
    design = np.column_stack(list(columns.values())) * priors
    ridge = SAMPLES_A_FACT * float(np.mean(rest**2)) * np.eye(len(priors))
    steps = priors * np.clip(np.linalg.solve(design.T @ design + ridge, design.T @ rest), -2.0, 2.0)
    for index, step in zip(columns, steps, strict=True):
        bench.predictors[index].turn(float(step))
    return True


def unwound(bench: Bench, state: State, predictions: Sequence[Array]) -> dict[int, Array]:
    """Change of the whitened predictions per rad of motor angle at zero torque, by locked record.

    Args:
        bench: the measured series.
        state: a fitted model.
        predictions: what it predicts now.

    Returns:
        Shape (rows,) each, by the number of the record.
    """
    found: dict[int, Array] = {}
    candidate = state.candidate()
    for index, predictor in enumerate(bench.predictors[: bench.training]):
        if not predictor.plan.locked:
            continue
        step = 1e-3 * max(float(np.ptp(predictor.motor_angle)), 1e-6)
        predictor.turn(step)
        there = predictor.predict(candidate)
        predictor.turn(-step)
        changed = [
            state.reading(s.channel, predictor.record.time, there[s.channel])
            for s in bench.series
            if s.record == index
        ]
        own = iter(changed)
        moved = [
            next(own) if s.record == index else p for s, p in zip(bench.series, predictions, strict=True)
        ]
        found[index] = bench.trace(predictions, moved) / step
    return found
