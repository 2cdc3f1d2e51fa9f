"""Which column is the time, and how it counts."""

from __future__ import annotations

import math

import numpy as np

from hdsim.errors import InputError
from hdsim.log.clock import spread
from hdsim.log.guess.findings import Answer, Candidate, Draft, Ground
from hdsim.log.guess.relations import Array
from hdsim.log.guess.survey import Survey
from hdsim.log.readers.contract import missing
from hdsim.log.units import TIME_UNITS, unit_of

#: Usual rates of recordings, Hz; each decade beyond costs 1. So does a unit that a fractional number seldom
#: has.
USUAL_HZ = (50.0, 20_000.0)
_OF_UNIT = {"s": 0.0, "ms": 0.3, "us": 0.5, "ns": 1.0}
_FRACTIONS = {"s": 0.0, "ms": 1.0, "us": 2.0, "ns": 3.0}
_COUNTER_FALLS = 0.02


def find_time(
    survey: Survey, said: dict[str, str], draft: Draft
) -> tuple[Array, dict[str, tuple[float, float]]]:
    """Write what is known of the time into the draft.

    Returns:
        Recorded times (n,) that increase, and the units that they may have: length in s and cost.
    """
    count = len(survey.columns[0].values)
    if survey.stamps is not None:
        draft.time["topic"] = Answer(
            survey.topic, Ground.SHOWN, "the topic with the most messages; their stamps count"
        )
        return _increasing(survey.stamps), {"s": (1.0, 0.0)}
    if "rate_hz" in said:
        rate = float(said["rate_hz"])
        draft.time["rate_hz"] = Answer(rate, Ground.SAID)
        return np.arange(count) / rate, {"s": (1.0, 0.0)}
    column = _column(survey.columns, said.get("column"))
    if column is None:
        draft.time["rate_hz"] = Answer(None, Ground.OPEN, "no column counts time")
        draft.ask("the sample rate in Hz, as no column is a time", "time.rate_hz", "1000")
        return np.arange(count, dtype=float), {"s": (1.0, 0.0)}
    named = column.meaning.quantity == "time"
    draft.time["column"] = Answer(
        column.origin.column,
        Ground.STATED if named else Ground.ASSUMED,
        "by its name" if named else "it increases evenly",
    )
    if column.values.dtype.kind == "M":
        draft.time["unit"] = Answer("iso", Ground.SHOWN, "dates or times of day")
        seconds = (column.values - column.values[0]) / np.timedelta64(1, "s")
        if column.values[0] < np.datetime64("1970-01-02"):
            seconds = np.unwrap(seconds, period=86400.0)
        return _ticks(np.asarray(seconds, np.float64), draft), {"s": (1.0, 0.0)}
    time = _ticks(_unwrapped(np.asarray(column.values, np.float64), draft), draft)
    unit = said.get("unit") or _stated(column)
    if unit:
        draft.time["unit"] = Answer(
            unit, Ground.SAID if "unit" in said else Ground.STATED, _words(column, said)
        )
        return time, {unit: (TIME_UNITS[unit], 0.0)}
    step = float(np.median(np.diff(time)))
    whole = bool(np.all(time % 1 == 0))
    low, high = USUAL_HZ
    costs = {}
    for unit, second in TIME_UNITS.items():
        rate = 1.0 / (step * second)
        beyond = abs(math.log10(rate / min(max(rate, low), high)))
        costs[unit] = (second, beyond + (_OF_UNIT if whole else _FRACTIONS)[unit])
    least = min(cost for _, cost in costs.values())
    return time, {
        unit: (second, cost - least) for unit, (second, cost) in costs.items() if cost - least < 6.0
    }


def _stated(column: Candidate) -> str:
    known = unit_of(column.meaning.unit)
    return known[1] if known and known[0] == "time" and known[1] in TIME_UNITS else ""


def _words(column: Candidate, said: dict[str, str]) -> str:
    return "" if "unit" in said else f"the file says {column.meaning.unit!r}"


def _column(columns: list[Candidate], said: str | None) -> Candidate | None:
    if said is not None:
        found = next((c for c in columns if said in (c.label, str(c.origin.column))), None)
        if found is None:
            raise missing("--set time.column", "column", said, [c.label for c in columns])
        if not _counts(found):
            raise InputError(f"--set time.column: the numbers of {said!r} do not count time: they fall")
        return found
    dated = [c for c in columns if c.values.dtype.kind == "M" and _counts(c)]
    named = [c for c in columns if c.quantity == "time" and c.meaning.measured and _counts(c)]
    for found in (*named, *dated):
        return found
    first = columns[0]
    if not first.quantity and _counts(first) and first.values.dtype.kind != "M":
        steps = np.diff(first.values)
        if np.all(steps > 0) and np.ptp(steps) <= 0.5 * float(np.median(steps)):
            return first
    return None


def _counts(column: Candidate) -> bool:
    """Whether the numbers hardly ever fall."""
    steps = np.diff(column.values)
    if steps.dtype.kind == "m":
        steps = steps.astype(np.float64)  # a date beside the time of day stands still
    elif not np.all(np.isfinite(column.values)):
        return False
    return bool((steps > 0).any() and (steps < 0).mean() < _COUNTER_FALLS)


def _unwrapped(values: Array, draft: Draft) -> Array:
    """A counter that starts anew, joined."""
    falls = np.flatnonzero(np.diff(values) < 0)
    if not len(falls):
        return values
    step = float(np.median(np.diff(values)))
    before, after = values[falls], values[falls + 1]
    spans = before - after + step
    power = 2.0 ** round(math.log2(max(float(np.median(spans)), 1.0)))
    period = power if abs(np.median(spans) - power) < 0.02 * power else float(np.round(np.median(spans), 6))
    if float(np.ptp(spans)) > 0.1 * period or float(np.min(before)) < 0.9 * period:
        draft.time["wraps_at"] = Answer(None, Ground.OPEN, f"it falls {len(falls)} times, at no fixed number")
        draft.ask(
            f"the time falls {len(falls)} times, first after sample {falls[0] + 1}: cut or sort the recording"
        )
        return np.arange(len(values), dtype=np.float64) * step
    draft.time["wraps_at"] = Answer(period, Ground.SHOWN, f"it starts anew {len(falls)} times")
    joined: Array = np.unwrap(values, period=period).astype(np.float64)
    return joined


def _ticks(time: Array, draft: Draft) -> Array:
    """Times that increase: samples that share one are spread, as the import does."""
    same = np.diff(time) == 0
    if (np.diff(time) < 0).any() or not same.any():
        return time
    draft.time["quantised"] = Answer(
        True, Ground.SHOWN, f"{int(same.sum())} samples share the time of the one before"
    )
    return spread(time, draft.title)


def _increasing(time: Array) -> Array:
    return np.asarray(np.maximum.accumulate(time) + 1e-12 * np.arange(len(time)))
