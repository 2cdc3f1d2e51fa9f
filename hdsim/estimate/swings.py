"""What a little more or less of a load's swing does, taken out of residuals as the sensors' zeros are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdsim.estimate.records import Array
from hdsim.estimate.series import Series


@dataclass(frozen=True)
class Swing:
    """What swings of a record's load do to its series, the zeros of their sensors taken out.

    Attributes:
        columns: by the number of the series, SI units, shape (n, k) each.
        turned: angle (rad) and speed (rad/s) of the swing in each column, shape (2, k).
        most: of angle and speed, shape (2,).
    """

    columns: Mapping[int, Array]
    turned: Array
    most: Array

    def moves(self, series: Sequence[Series], values: Sequence[Array]) -> Array | None:
        """How much of each column leaves least of some values, shape (k,); None where nothing tells."""
        there = [k for k in self.columns if len(values[k]) and series[k].train.any()]
        if not there:
            return None
        columns = np.concatenate([self.columns[k][series[k].train] / series[k].sigma for k in there])
        rest = np.concatenate([values[k][series[k].train] / series[k].sigma for k in there])
        return np.asarray(np.linalg.lstsq(columns, rest, rcond=None)[0])


Swings = Mapping[int, Swing]


def without_swings(series: Sequence[Series], values: Sequence[Array], swings: Swings) -> list[Array]:
    """Residuals, or changes of predictions, less as much of each record's swing as leaves least.

    Args:
        series: all of them.
        values: shape (n,) each, zeros taken out, or (0,) where nothing was predicted.
        swings: by the number of the record.
    """
    found = list(values)
    for swing in swings.values():
        moves = swing.moves(series, values)
        if moves is None:
            continue
        for k, columns in swing.columns.items():
            if len(values[k]):
                found[k] = values[k] - columns @ moves
    return found


def swung_on(
    series: Sequence[Series],
    values: Sequence[Array],
    swings: Swings,
    now: Mapping[int, tuple[float, float]],
) -> dict[int, tuple[float, float]]:
    """The swings that leave least, where what they do stays as it is.

    Args:
        series: all of them.
        values: residuals beside the swings that are now, shape (n,) each, zeros taken out.
        swings: by the number of the record.
        now: angle (rad) and speed (rad/s), likewise.
    """
    found = dict(now)
    for index, swing in swings.items():
        moves = swing.moves(series, values)
        if moves is not None:
            there = np.array(now.get(index, (0.0, 0.0))) + swing.turned @ moves
            angle, speed = np.clip(there, -swing.most, swing.most).tolist()
            found[index] = angle, speed
    return found


def swing_columns(series: Sequence[Series], training: int, swings: Swings) -> Array:
    """What the swings do to the whitened training samples, shape (rows, swings)."""
    seen = [k for k, one in enumerate(series) if one.record < training]
    sizes = [int(series[k].train.sum()) for k in seen]
    columns = []
    for swing in swings.values():
        parts = [
            swing.columns[k][series[k].train] / series[k].sigma
            if k in swing.columns
            else np.zeros((size, swing.turned.shape[1]))
            for k, size in zip(seen, sizes, strict=True)
        ]
        columns.append(np.concatenate(parts))
    return np.hstack([np.zeros((sum(sizes), 0)), *columns])
