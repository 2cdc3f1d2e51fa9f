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
#: Most steps to a held-out record's zero, whose stiffness changes on the way, and the part of that prior
#: spread over which its slope is taken.
STEPS, SMALL = 4, 0.02


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


def zeros_beside(bench: Bench, state: State, predictions: Sequence[Array]) -> tuple[Array, Array]:
    """What stands beside a fit's numbers for the locked records' zeros, which it holds where they are.

    A spring's corner that is passed on one side alone lies elsewhere with another zero of angle and sensor.

    Args:
        bench: the measured series.
        state: the fitted model.
        predictions: what it predicts.

    Returns:
        Whitened columns, shape (rows, k), and their prior spreads, rad, (k,).
    """
    columns = unwound(bench, state, predictions)
    sizes = [TURN * float(np.ptp(bench.predictors[index].motor_angle)) for index in columns]
    rows = len(bench.stacked_series())
    return np.column_stack([np.zeros((rows, 0)), *columns.values()]), np.array(sizes)


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
    for index, predictor in enumerate(bench.predictors[: bench.training]):
        if not predictor.plan.locked:
            continue
        step = 1e-3 * max(float(np.ptp(predictor.motor_angle)), 1e-6)
        moved = _turned_on(bench, state, predictions, index, step)
        predictor.turn(-step)
        found[index] = bench.trace(predictions, moved) / step
    return found


def turned_to_zero(bench: Bench, state: State) -> list[Array]:
    """Predictions of all series, each held-out locked record turned to where the model carries nothing.

    No fit has seen that angle: it is the record's own, as an angle's zero is, and every model that is proved
    there gets the one that suits it best.

    Args:
        bench: the measured series; the zeros of held-out predictors are moved.
        state: a model.
    """
    predictions = bench.predict(state, everything=True)
    for index in range(bench.training, len(bench.predictors)):
        predictor = bench.predictors[index]
        if not predictor.plan.locked or not any(s.hold.any() for s in bench.series if s.record == index):
            continue
        reach = TURN * max(float(np.ptp(predictor.motor_angle)), 1e-6)
        rest = _held_rest(bench, predictions, index)
        for _ in range(STEPS):
            slope = _held_rest(bench, _turned_on(bench, state, predictions, index, SMALL * reach), index)
            slope = (slope - rest) / SMALL
            predictor.turn(-SMALL * reach)
            # As the training records' zeros: the same prior, and as many samples to a fact.
            ridge = SAMPLES_A_FACT * float(np.mean(rest**2))
            step = reach * float(np.clip(-(slope @ rest) / (slope @ slope + ridge + 1e-300), -2.0, 2.0))
            there = _turned_on(bench, state, predictions, index, step)
            now = _held_rest(bench, there, index)
            if now @ now >= rest @ rest:
                predictor.turn(-step)
                break
            predictions, rest = there, now
    return predictions


def _turned_on(
    bench: Bench, state: State, predictions: Sequence[Array], index: int, angle: float
) -> list[Array]:
    """Predictions with one record turned on by an angle, rad; its predictor stays there."""
    predictor = bench.predictors[index]
    predictor.turn(angle)
    there = predictor.predict(state.candidate())
    return [
        state.reading(s.channel, predictor.record.time, there[s.channel]) if s.record == index else p
        for s, p in zip(bench.series, predictions, strict=True)
    ]


def _held_rest(bench: Bench, predictions: Sequence[Array], index: int) -> Array:
    """Whitened residual of a record's held-out samples, shape (rows,)."""
    residuals = zip(bench.series, bench.residuals(predictions, drift=True), strict=True)
    return np.concatenate([rest[s.hold] / s.sigma for s, rest in residuals if s.record == index])
