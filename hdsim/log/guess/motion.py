"""Units, sides and ratio of the angles and velocities of one axis, as far as the numbers tell.

With R = 1 for numbers that refer to the output and R = N for those of the motor, each column of a motion is
R times the output's angle or its derivative. The slope of a column over a reference column is thus known from
their units, the time's unit and N. All readings (`readings.py`) are tried; those whose slope is another than
the measured one are out. What is common to all that are left is shown by the data; otherwise the usual one is
assumed, and where several are usual it stays open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hdsim.log.guess.findings import Candidate
from hdsim.log.guess.readings import CONTRADICTED, UNFIT, Reading
from hdsim.log.guess.relations import Array, Slope, integral, slope

#: Relative difference of slopes that are taken to be the same: of angles, and where a velocity takes part.
TOLERANCE = 0.01
TOLERANCE_OF_VELOCITY = 0.04
#: Ratios that are made in series.
SERIES = (30, 50, 51, 80, 81, 100, 101, 120, 121, 160, 161)
#: Costs of a ratio that is not made in series, of one beyond what is made at all, and of one that is no
#: integer: more than that of a unit which the file states wrongly.
NO_SERIES, BEYOND, NO_INTEGER = 1.5, 2.0, CONTRADICTED + 1.0
_MADE = (25, 320)
_INTEGER = 0.004
_NO_FAMILY = 1.0

Key = tuple[str, int]
"""What is decided: ("time", 0), ("ratio", 0), or ("reading", place of the column)."""


@dataclass
class Motion:
    """What fits.

    Args:
        best: the least unusual reading of every column, by its place; None where no column was given.
        time: unit of time that goes with it.
        ratio: signed ratio that goes with it, or None where all refer to one side.
        costs: by what is decided and each value that it may take, the least cost of all beside it, over the
        best. slopes: of the columns over the reference, by place.
        reference: its place.
        signs: direction of each column, by place.
    """

    best: dict[int, Reading | None]
    time: str
    ratio: float | None
    costs: dict[Key, dict[object, float]]
    slopes: dict[int, Slope]
    reference: int
    signs: dict[int, int] = field(default_factory=dict)

    def rivals(self, key: Key, chosen: object, within: float) -> list[object]:
        """Other values that cost less than ``within`` more than the best."""
        return [v for v, cost in sorted(self.costs.get(key, {}).items(), key=lambda i: i[1])
                if v != chosen and cost < within]  # fmt: skip


def solve(
    columns: list[Candidate],
    values: list[Array],
    options: list[list[Reading]],
    time: Array,
    times: dict[str, tuple[float, float]],
    ratio: float | None,
    torque: Array | None,
) -> Motion | None:
    """Find the readings that fit.

    Args:
        columns: angles and velocities of one axis, all moving.
        values: their numbers (n,), turns joined.
        options: the readings of each.
        time: recorded times (n,), increasing.
        times: for each unit that they may have its length in s and its cost.
        ratio: a ratio that the user says.
        torque: a torque (n,) that may wind up the drive, or None.

    Returns:
        None for no columns.
    """
    if not columns:
        return None
    angles = [k for k, column in enumerate(columns) if column.quantity == "angle"]
    # The reference is the angle that is told in the finest steps.
    reference = max(angles or [0], key=lambda k: len(np.unique(values[k])))
    slopes = _slopes(columns, values, time, reference, torque)
    costs: dict[Key, dict[object, float]] = {}
    best: tuple[float, str, Reading, float | None, dict[int, Reading | None]] | None = None
    for unit, (second, of_time) in times.items():
        for first in options[reference]:
            fits = {
                k: list(_fitting(columns, options[k], slopes[k], first, second, k, reference)) for k in slopes
            }
            for ratio_tried in _ratios(fits, ratio):
                chosen: dict[int, Reading | None] = {reference: first}
                cost = of_time + first.cost + _of_ratio(ratio_tried)
                tables: dict[int, dict[object, float]] = {}
                for k in range(len(columns)):
                    if k == reference:
                        continue
                    table = _table(fits.get(k), options[k], first, ratio_tried)
                    least = min(table, key=lambda reading: table[reading])
                    chosen[k] = least
                    cost += table[least]
                    tables[k] = {each: each_cost - table[least] for each, each_cost in table.items()}
                _note(costs, ("time", 0), unit, cost)
                _note(costs, ("ratio", 0), ratio_tried and round(ratio_tried, 3), cost)
                _note(costs, ("reading", reference), first, cost)
                for k, each_table in tables.items():
                    for each, more in each_table.items():
                        _note(costs, ("reading", k), each, cost + more)
                if best is None or cost < best[0]:
                    best = (cost, unit, first, ratio_tried, chosen)
    if best is None:
        return None
    costs = {key: {v: c - best[0] for v, c in table.items()} for key, table in costs.items()}
    found = Motion(best[4], best[1], best[3], costs, slopes, reference)
    for k, each_slope in slopes.items():
        reading = best[4].get(k)
        crosses = reading is not None and reading.side != best[2].side
        along = math.copysign(1.0, best[3]) if crosses and best[3] else 1.0
        found.signs[k] = 1 if reading is None or each_slope.factor * along > 0 else -1
    return found


def _slopes(
    columns: list[Candidate], values: list[Array], time: Array, reference: int, torque: Array | None
) -> dict[int, Slope]:
    """Clear slopes of the columns over the reference, or over its derivative per recorded unit of time."""
    base = values[reference]
    found = {}
    for k, column in enumerate(columns):
        if k == reference:
            continue
        if column.quantity == columns[reference].quantity:
            each = slope(values[k], base, torque)
        else:
            over = slope(base, integral(values[k], time))
            each = Slope(1.0 / over.factor, over.explained) if over is not None and over.factor else None
        if each is not None and each.clear:
            found[k] = each
    return found


def _fitting(
    columns: list[Candidate],
    options: list[Reading],
    each: Slope,
    first: Reading,
    second: float,
    k: int,
    reference: int,
) -> Iterable[tuple[Reading, float | None]]:
    """Readings of a column that go with the reference's; with the ratio that they ask for, or None."""
    of_velocity = columns[k].quantity != columns[reference].quantity
    tolerance = (
        TOLERANCE_OF_VELOCITY
        if "velocity" in (columns[k].quantity, columns[reference].quantity)
        else TOLERANCE
    )
    for reading in options:
        quotient = each.factor * reading.scale / first.scale * (second if of_velocity else 1.0)
        if reading.side == first.side:
            if abs(abs(quotient) - 1.0) < tolerance:
                yield reading, None
            continue
        asked = quotient if reading.side == "motor" else 1.0 / quotient
        if 2.0 <= abs(asked) <= 1000.0:
            yield reading, asked


def _ratios(fits: dict[int, list[tuple[Reading, float | None]]], said: float | None) -> list[float | None]:
    asked: list[float] = []
    for readings in fits.values():
        for _, each in readings:
            if each is not None and not any(
                abs(each - known) < TOLERANCE_OF_VELOCITY * abs(known) for known in asked
            ):
                asked.append(each)
    if said is not None:
        asked = [each for each in asked if abs(abs(each) - abs(said)) < TOLERANCE_OF_VELOCITY * abs(said)]
    return [None, *asked]


def _of_ratio(ratio: float | None) -> float:
    if ratio is None:
        return 0.0
    whole = round(abs(ratio))
    cost = 0.0 if abs(abs(ratio) - whole) < _INTEGER * whole else NO_INTEGER
    cost += 0.0 if whole in SERIES else NO_SERIES
    return cost + (0.0 if _MADE[0] <= abs(ratio) <= _MADE[1] else BEYOND)


def _table(
    fitting: list[tuple[Reading, float | None]] | None,
    options: list[Reading],
    first: Reading,
    ratio: float | None,
) -> dict[Reading | None, float]:
    """Cost of each reading of a column beside the reference's and a ratio; None for that none fits."""
    if fitting is None:  # no clear relation: every reading is possible
        return {reading: reading.cost for reading in options} or {None: UNFIT}
    found: dict[Reading | None, float] = {None: UNFIT}
    for reading, asked in fitting:
        if asked is not None and (
            ratio is None or abs(abs(asked) - abs(ratio)) > TOLERANCE_OF_VELOCITY * abs(ratio)
        ):
            continue
        strange = {reading.family(), first.family()} == {"rad", "deg"}
        found[reading] = reading.cost + (_NO_FAMILY if strange else 0.0)
    return found


def _note(costs: dict[Key, dict[object, float]], key: Key, value: object, cost: float) -> None:
    table = costs.setdefault(key, {})
    table[value] = min(cost, table.get(value, math.inf))
