"""What a model's field says of itself to a fit: that it may move, how far, and between which bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Number:
    """An annotation of a field whose value a fit may scale: ``Annotated[float, Number(0.4)]``.

    The unit is the one that the field's name ends with, the bounds are the field's own (``gt``, ``ge``,
    ``lt``, ``le``).

    Args:
        prior: standard deviation of the value's logarithm that an engineer would believe before the
            measurement; 0: no fit moves it.
        group: fields of one model with the same group scale together, unless one is asked to move apart.
        compliance: it is the stiffness of a compliance in series with the output: a model is linear in its
            inverse.
        matters: tells from the section's model (the drive, the load) whether it changes anything there.
        far: factor from the model's value beyond which a fitted one is suspect.
        may_vanish: it may well be far smaller than thought, so that only a larger one is suspect.
        asked: it moves only in a fit that asks for it by its path: most records tell little of it.
    """

    prior: float
    group: str = ""
    compliance: bool = False
    matters: Callable[[Any], bool] | None = None
    far: float = 5.0
    may_vanish: bool = False
    asked: bool = False


#: Of a number that a measurement leaves as it is: a smoothing, a constant of nature, a choice of origin.
FIXED = Number(0.0)


def declared(metadata: Iterable[Any]) -> Number | None:
    """The annotation among a field's metadata."""
    return next((each for each in metadata if isinstance(each, Number)), None)


def limits(metadata: Iterable[Any]) -> tuple[float, float]:
    """Least and largest value that a field allows, from its ``gt``, ``ge``, ``lt`` and ``le``."""
    least, most = -math.inf, math.inf
    for each in metadata:
        for name in ("gt", "ge"):
            least = max(least, float(_or(getattr(each, name, None), least)))
        for name in ("lt", "le"):
            most = min(most, float(_or(getattr(each, name, None), most)))
    return least, most


def _or(value: Any, other: float) -> Any:
    return other if value is None else value
