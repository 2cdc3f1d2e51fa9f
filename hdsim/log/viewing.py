"""Topics that exist for viewers only: the decimated twin of a table, and its torque-twist loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hdsim.log import naming
from hdsim.log.naming import Array, ColumnSpec
from hdsim.log.streams import TableStream
from hdsim.log.view import MinMaxView

ARCSEC_PER_RAD = 180 * 3600 / np.pi
LOOP_COLUMNS = ("twist_arcsec", "output_torque")
LOOP_SAMPLES = 1000
"""Samples of the view that a loop shows: the last ones before its time."""

LOOP_EVERY = 100
"""Samples of the view from one loop to the next."""


def display_columns(columns: Sequence[ColumnSpec]) -> list[tuple[int, float, ColumnSpec]]:
    """Columns that a view holds once more in a unit in which their numbers are not tiny.

    Viewers label and scale axes in steps of 0.001 at the finest, which an angle error in rad never fills.

    Returns:
        For each: its position among ``columns``, the factor, and the column in the new unit.
    """
    found = []
    for index, column in enumerate(columns):
        if column.unit == "rad" and column.name.endswith(("error", "twist")):
            unit, factor = "arcsec", ARCSEC_PER_RAD
        elif column.unit == "m":
            unit, factor = "um", 1e6
        else:
            continue
        name = f"{column.name}_{unit}"
        if not any(c.field == f"{column.field}_{unit}" for c in columns):
            about = ColumnSpec(name, f"{column.field}_{unit}", unit, column.description, column.shape)
            found.append((index, factor, about))
    return found


def scaled(values: Array, factor: float) -> Array:
    """Values in another unit; numbers too large for it become infinite."""
    with np.errstate(over="ignore"):
        return values * factor


class ViewStream:
    """The decimated twin of a table.

    Args:
        view: what thins the rows.
        stream: where they go: the table's columns, and `display_columns` of them.
        extra: position and factor of those.
        loop: the loop topic that is fed with them, if any.
    """

    def __init__(
        self,
        view: MinMaxView,
        stream: TableStream,
        extra: Sequence[tuple[int, float]],
        loop: LoopStream | None,
    ) -> None:
        self._view = view
        self._extra = extra
        self._stream = stream
        self._loop = loop

    def feed(self, time: Array, columns: Sequence[Array]) -> None:
        """Take rows of the table."""
        self._write(*self._view.feed(time, columns))

    def finish(self) -> None:
        """Write what was held back."""
        rest = self._view.finish()
        if rest is not None:
            self._write(*rest)
        if self._loop is not None:
            self._loop.finish()
        self.flush()

    def flush(self) -> None:
        """Write the chunks that are not full yet."""
        self._stream.flush()
        if self._loop is not None:
            self._loop.stream.flush()

    def _write(self, time: Array, columns: Sequence[Array]) -> None:
        columns = [*columns, *(scaled(columns[i], factor) for i, factor in self._extra)]
        begin = 0
        while begin < len(time):
            rows = slice(begin, begin + self._stream.room)
            self._stream.append(time[rows], naming.to_ns(time[rows]), [c[rows] for c in columns])
            begin = rows.stop
        if self._loop is not None:
            self._loop.feed(time, columns)


class LoopStream:
    """Torque over twist as arrays, one message for every stretch of the view.

    Viewers draw a curve of one quantity over another only from arrays within a message. Each message holds
    the last samples before its time, older ones first; where the run is younger, NaN.

    Args:
        stream: the topic, with one array for each of `LOOP_COLUMNS`.
        places: which columns of the view those are.
    """

    def __init__(self, stream: TableStream, places: Sequence[int]) -> None:
        self.stream = stream
        self._places = places
        self._recent = np.full((len(places), LOOP_SAMPLES), np.nan)
        self._since = LOOP_EVERY - 1  # the first at once, so that a log opens on something
        self._last: float | None = None

    @classmethod
    def of(
        cls, columns: Sequence[ColumnSpec], make: Callable[[Sequence[ColumnSpec]], TableStream]
    ) -> LoopStream | None:
        """The loop of a table with these columns; None where it lacks one of `LOOP_COLUMNS`."""
        by_name = {c.name: (i, c) for i, c in enumerate(columns) if not c.repeated}
        if not all(name in by_name for name in LOOP_COLUMNS):
            return None
        chosen = [by_name[name] for name in LOOP_COLUMNS]
        specs = [ColumnSpec(c.name, c.field, c.unit, c.description, (LOOP_SAMPLES,)) for _, c in chosen]
        return cls(make(specs), [i for i, _ in chosen])

    def feed(self, time: Array, columns: Sequence[Array]) -> None:
        """Take rows of the view."""
        begin = 0
        while begin < len(time):
            end = min(len(time), begin + LOOP_EVERY - self._since)
            fresh = np.array([columns[i][begin:end] for i in self._places])
            self._recent = np.concatenate([self._recent[:, end - begin :], fresh], axis=1)
            self._since += end - begin
            self._last = float(time[end - 1])
            if self._since == LOOP_EVERY:
                self._write()
            begin = end

    def finish(self) -> None:
        """Write the loop at the end of the run."""
        if self._last is not None and self._since:
            self._write()

    def _write(self) -> None:
        time = np.array([self._last])
        self.stream.append(time, naming.to_ns(time), list(self._recent[:, None, :]))
        self._since = 0
