"""Gaps in what a model is told: a spline bridges short ones, and a record is cut at the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.data_problems import Check, Problem, Severity
from hdsim.estimate.knots import uniform
from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import FEWEST_SAMPLES, SHORTEST_S, Record, long_enough
from hdsim.estimate.spline import best_spline

#: Steps between readings that are longer than this many periods are gaps.
GAP = 3.0
#: Places of a record in which a gap is tried, and knots beside it that decide how it is bridged.
PLACES, BESIDE = 40, 6
#: Part of a record that may be lost to pieces that are too short: beyond it, it is not cut.
LOST = 0.5


def cut(record: Record, given: Sequence[str], found: Check) -> list[Record]:
    """Records without gaps that no bridge spans, each beginning and ending with a reading of all given.

    A gap is bridged where a spline, tried across as long a gap in other places of the same record, is no
    farther off than a reading is by its noise. Behind any other the model would ring with what the bridge has
    done to it.

    Args:
        record: checked; it is not changed.
        given: the channels that a model is told.
        found: of its check; what was cut is said there.
    """
    told = np.logical_and.reduce([record.trusted[channel] for channel in given])
    at = np.flatnonzero(told).tolist()
    if len(at) == len(told) and np.diff(record.time).max() <= GAP * record.period_s:
        return [record]
    if len(at) < FEWEST_SAMPLES:
        return [record]
    steps = np.diff(record.time[at])
    wide = np.flatnonzero(steps > GAP * record.period_s).tolist()
    bridges = [_Bridge(record, channel) for channel in given] if wide else []
    ends = [k for k in wide if not all(one.spans(at[k], at[k + 1]) for one in bridges)]
    pieces = [
        slice(at[first], at[last] + 1)
        for first, last in zip([0, *(k + 1 for k in ends)], [*ends, len(at) - 1], strict=True)
    ]
    if not ends:
        return [_piece(record, pieces[0], record.name)]
    kept = [rows for rows in pieces if long_enough(record.time[rows])]
    part = sum(rows.stop - rows.start for rows in kept) / len(at)
    where = ", ".join(f"{steps[k]:.3g} s from {record.time[at[k]]:.4g} s" for k in ends[:3])
    where += ", ..." if len(ends) > 3 else ""
    said = f"{' or '.join(given)} is missing for {where}, which no spline bridges within its noise"
    refused = part < LOST
    if refused:
        said += (
            f"; between {len(ends)} such gaps, pieces of at least {FEWEST_SAMPLES} samples and "
            f"{SHORTEST_S:g} s have {100 * part:.2g} % of the readings (allowed: at least {100 * LOST:g} %)"
        )
    else:
        said += f": {len(kept)} pieces are records of their own"
        if len(kept) < len(pieces):
            short = len(pieces) - len(kept)
            said += f", {short} shorter than {FEWEST_SAMPLES} samples or {SHORTEST_S:g} s are left out"
    severity: Severity = "error" if refused else "warning"
    found.problems.append(Problem(record.name, given[0], "gap", severity, said, len(ends)))
    if refused:
        return [record]
    return [_piece(record, rows, f"{record.name} from {record.time[rows.start]:.4g} s") for rows in kept]


def _piece(record: Record, rows: slice, name: str) -> Record:
    """Some successive rows of a record, under a name."""
    begins = float(record.time[rows.start])
    return replace(
        record,
        name=name,
        time=record.time[rows] - begins,
        channels={channel: values[rows] for channel, values in record.channels.items()},
        trusted={channel: good[rows] for channel, good in record.trusted.items()},
        begins_s=record.begins_s + begins,
        joints={joint: angle[rows] for joint, angle in record.joints.items()},
    )


class _Bridge:
    """How far off bridges are in one channel of a record, by their length.

    Args:
        record: checked.
        channel: with readings that can be trusted.
    """

    def __init__(self, record: Record, channel: str) -> None:
        self._good = record.trusted[channel]
        self._times, self._period = record.time, record.period_s
        self._time, self._values = record.time[self._good], record.channels[channel][self._good]
        self._noise = noise_floor(record.channels[channel], self._good)
        _, chosen = best_spline(self._time, self._values)
        self._spacing = 0.0 if chosen is None else len(self._time) / len(chosen.c)
        self._known: dict[int, bool] = {}

    def spans(self, last: int, first: int) -> bool:
        """Whether the longest gap between two rows is bridged within the noise."""
        read = last + np.flatnonzero(self._good[last : first + 1])
        lasts_s = float(np.diff(self._times[read]).max())
        if lasts_s <= GAP * self._period:
            return True
        count = int(np.ceil(lasts_s / self._period)) - 1
        if count not in self._known:
            self._known[count] = self._off(count) <= self._noise
        return self._known[count]

    def _off(self, count: int) -> float:
        """Root mean square by which bridges over so many readings miss the spline through them, too.

        Infinite where none can be tried.
        """
        if not self._spacing:
            return math.inf
        margin = math.ceil(BESIDE * max(self._spacing, 2.0))
        whole = count + 2 * margin
        within = slice(margin, margin + count)
        beside = np.ones(whole, dtype=bool)
        beside[within] = False
        squares = []
        for start in np.unique(np.linspace(0, max(len(self._time) - whole, 0), PLACES).astype(int)):
            time, values = self._time[start : start + whole], self._values[start : start + whole]
            if len(time) < whole or np.diff(time).max() > GAP * self._period:
                continue
            spline = uniform(time, values, self._spacing)
            bridge = uniform(time[beside], values[beside], self._spacing)
            if spline is None or bridge is None:
                return math.inf
            squares.append(float(np.mean((bridge(time[within]) - spline(time[within])) ** 2)))
        return math.sqrt(np.mean(squares)) if squares else math.inf
