"""How a load swings where a record begins: two numbers of each record, as the zeros of its sensors are.

A prediction begins in balance with the record's first speed and load (``hdsim.estimate.lead_in``). Where a
record begins in the middle of a motion, or a motion with a jump, the load is elsewhere, and swings until its
damping has taken that away. Angle and speed of the output at the beginning tell how: the initial state of an
output-error model (L. Ljung, *System Identification*, 2nd ed., Prentice Hall 1999, section 4.3). They are
found by Gauss and Newton's steps, over a time that grows: at first a load flies as it was thrown, whatever
the model lacks, and a wrong frequency turns a step round later. It grows as long as no more is left than at
first. What a little more or less of the swing would do is taken out of residuals and of sensitivities, as
what a zero does is (``hdsim.estimate.swings``).
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.beginning import begins_at_rest
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import sample_power
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.standstill import CLEARLY
from hdsim.estimate.state import State
from hdsim.estimate.swings import Swing

#: Change of angle (rad) and of speed (rad/s) that is linearised.
SMALL = 1e-9
#: First time over which a swing is asked, s, and the factor by which it grows.
FIRST_S, GROWTH = 0.1, 3.0
#: Most steps over each, most halvings of one, and the part of the power that one must take to be followed.
STEPS, HALVINGS, FURTHER = 4, 3, 0.02
#: Largest swing, in wind-ups by the rated torque and their speed: a drive ratchets before
#: (catalogues give 3 to 10 times the rated torque).
MOST = 10.0
#: Times the mean square that is left over a shorter time above which a longer one tells more of what is
#: missing there (chosen), and the least of it that counts, in units of the noise's.
GROWN, AT_LEAST = 2.0, 4.0


@dataclass
class _Asked:
    """What a record leaves up to a time, whitened.

    Attributes:
        rest: shape (rows,).
        columns: what a swing as large as the rated torque's wind-up does, shape (rows, 2).
        blocks: shape (rows,).
        noise: mean square of the noise.
        series: what it does to each series, SI units, shape (n, 2) each.
        sizes: rad and rad/s of it, shape (2,).
    """

    rest: Array
    columns: Array
    blocks: NDArray[np.int64]
    noise: float
    series: dict[int, Array]
    sizes: Array

    def __post_init__(self) -> None:
        self.power = float(self.rest @ self.rest)
        u, s, vt = np.linalg.svd(self.columns, full_matrices=False)
        along = u.T @ self.rest
        left = self.rest - u @ along
        each = sample_power(left, self.blocks)
        clear = (along**2 > 2.0 * CLEARLY * each) & (s > 1e-6 * s[0])
        #: Whether a step clearly leaves less, by a part that matters.
        self.promises = bool(np.sum(along[clear] ** 2) > FURTHER * float(left @ left))
        #: Step, rad and rad/s, in the directions that do.
        self.step = self.sizes * (vt[clear].T @ (along[clear] / s[clear]))
        self._directions = vt[s**2 > each].T

    def told(self) -> Swing | None:
        """What swings in the directions of which the data tell do to each series; None where of none."""
        directions = self._directions
        if not directions.size:
            return None
        columns = {k: slopes @ directions for k, slopes in self.series.items()}
        return Swing(columns, self.sizes[:, None] * directions, MOST * self.sizes)


def swinging(
    bench: Bench, state: State, predictions: list[Array], *, held_out: bool = False
) -> tuple[State, list[Array]]:
    """The model with the swings of the training records' loads where these begin.

    Args:
        bench: the measured series, weighed; what swings do to them, which it takes out, is set.
        state: a model.
        predictions: what it predicts now.
        held_out: of the held-out records instead, as zeros of their sensors are: every model that is proved
            there gets the swing that suits it best, and nothing is taken out.

    Returns:
        The model, and what it predicts then.
    """
    given = state
    zeros, found = bench.offsets(predictions), {}
    for index in range(*((bench.training, len(bench.predictors)) if held_out else (bench.training,))):
        if begins_at_rest(bench.predictors[index]):
            continue
        with contextlib.suppress(PredictionError):
            state, swing = _swung(bench, state, index, zeros)
            if swing is not None:
                found[index] = swing
    if not held_out:
        bench.swings = found
    return state, predictions if state is given else bench.predict(state, everything=held_out)


def _swung(bench: Bench, state: State, index: int, zeros: Sequence[float]) -> tuple[State, Swing | None]:
    """The model with the swing of a record, and what a little more or less of it does."""
    asked = _asked(bench, state, index, zeros, np.inf)
    if asked is None:
        return state, None
    # What a few steps over all of it would do is not promised where the load rattles; at first it is.
    early = _asked(bench, state, index, zeros, GROWTH * FIRST_S)
    if asked.promises or (early is not None and early.promises):
        moved = _set_free(bench, state, index, zeros)
        if moved is not state:
            there = _asked(bench, moved, index, zeros, np.inf)
            if there is not None:
                return moved, there.told()
    return state, asked.told()


def _set_free(bench: Bench, state: State, index: int, zeros: Sequence[float]) -> State:
    """The model with the swing that leaves least, over a time that grows."""
    end = float(bench.predictors[index].record.time[-1])
    until, most = min(FIRST_S, end), np.inf
    while True:
        there, left = _nearest(bench, state, index, zeros, until)
        if left is not None and left > most:
            return state
        state = there
        if until == end:
            return state
        until = min(GROWTH * until, end)
        if left is not None:
            most = GROWN * left


def _nearest(
    bench: Bench, state: State, index: int, zeros: Sequence[float], until_s: float
) -> tuple[State, float | None]:
    """The swing that leaves least up to a time, and the mean square that it leaves; None: nothing tells."""
    now = _asked(bench, state, index, zeros, until_s)
    if now is None:
        return state, None
    for _ in range(STEPS):
        better = None
        for halving in range(HALVINGS + 1) if now.step.any() else ():
            swing = np.array(state.swings.get(index, (0.0, 0.0))) + now.step / 2**halving
            if (np.abs(swing) > MOST * now.sizes).any():
                continue
            moved = replace(state, swings={**state.swings, index: (float(swing[0]), float(swing[1]))})
            with contextlib.suppress(PredictionError):
                there = _asked(bench, moved, index, zeros, until_s)
                if there is not None and there.power < now.power:
                    better = moved, there
                    break
        if better is None:
            break
        before = now.power
        state, now = better
        if now.power > (1.0 - FURTHER) * before:
            break
    return state, max(now.power / len(now.rest), AT_LEAST * now.noise)


def _asked(bench: Bench, state: State, index: int, zeros: Sequence[float], until_s: float) -> _Asked | None:
    """What a record leaves up to a time, whitened; None where nothing swings, or nothing is seen.

    Raises:
        PredictionError: the model could not be predicted.
    """
    predictor = bench.predictors[index]
    time = predictor.record.time
    got, sizes = predictor.set_free(state.candidate(), SMALL * np.eye(2), until_s)
    series, parts = {}, []
    for k, s in enumerate(bench.series):
        if s.record != index or not got:
            continue
        here, *there = (state.reading(s.channel, time, one[s.channel]) for one in got)
        rows = (s.train if index < bench.training else s.hold) & (time <= until_s)
        if not rows.any():
            continue
        rest, zero = s.measured - here, zeros[k]
        slopes = np.column_stack([(each - here) / SMALL for each in there]) * sizes
        if until_s >= time[-1]:
            zero, slopes = float(rest[rows].mean()), slopes - slopes[rows].mean(axis=0)
        series[k] = slopes
        parts.append(((rest - zero)[rows] / s.sigma, slopes[rows] / s.sigma, s.block[rows]))
    if not parts:
        return None
    rest, columns, blocks = (np.concatenate(each) for each in zip(*parts, strict=True))
    noise = np.mean([(bench.series[k].noise / bench.series[k].sigma) ** 2 for k in series])
    return _Asked(rest, columns, blocks, float(noise), series, sizes)
