"""Curves over time, with what a pixel cannot show taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.recording import Recording

Array = NDArray[np.float64]

#: Points of a curve, at most: several for every pixel of a panel's width.
POINTS = 4000

#: What counts as nothing, in SI units: far below any sensor, above the rounding of long sums.
NOTHING = 1e-9


@dataclass(frozen=True)
class Curve:
    """A named line over the time of the state table."""

    label: str
    values: Array
    colour: str
    width: float = 1.1
    dashed: bool = False


def is_nothing(values: Array) -> bool:
    """Whether a channel is zero, or not a number, throughout."""
    finite = values[np.isfinite(values)]
    return not bool(np.any(np.abs(finite) > NOTHING))


def curve(
    recording: Recording, name: str, label: str, colour: str, factor: float = 1.0, **options: object
) -> list[Curve]:
    """The curve of a channel; an empty list when the channel is missing or zero-only."""
    if name not in recording:
        return []
    values = recording[name]
    if values.ndim != 1 or is_nothing(values):
        return []
    return [Curve(label, factor * values, colour, **options)]  # type: ignore[arg-type]


def thinned(time: Array, columns: Sequence[Array], points: int = POINTS) -> tuple[Array, list[Array]]:
    """At most about ``points`` samples, with every slot's extremes kept.

    Args:
        time: shape (n,), increasing.
        columns: arrays of shape (n,).
        points: how many samples are enough.

    Returns:
        Times and columns of the same, smaller length.
    """
    if len(time) <= points:
        return time, list(columns)
    from hdsim.log.view import MinMaxView

    view = MinMaxView(points / max(float(time[-1] - time[0]), 1e-300))
    first, last = view.feed(time, columns), view.finish()
    if last is None:
        return first
    return (
        np.concatenate([first[0], last[0]]),
        [np.concatenate(pair) for pair in zip(first[1], last[1], strict=True)],
    )
