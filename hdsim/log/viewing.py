"""Topics that exist for viewers only: the decimated twin of a table, and its torque-twist loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from hdsim.log import naming
from hdsim.log.naming import Array, ColumnSpec
from hdsim.log.streams import TableStream
from hdsim.log.view import MinMaxView, corners

ARCSEC_PER_RAD = 180 * 3600 / np.pi
LOOP_COLUMNS = ("twist_arcsec", "output_torque")
LOOP_NOW = "output_torque_now"
LOOP_SAMPLES = 2000
"""Samples of the view that a loop covers: half of them before its stretch begins, half from there on."""

LOOP_POINTS = 500
"""Points of a loop: those among its samples that keep its shape. A panel has no more pixels for them."""

LOOP_EVERY = 100
"""Samples of the view in a stretch: from one loop to the next."""


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

    Viewers draw a curve of one quantity over another only from arrays within a message, and show the last
    message whose time has come. So a message bears the time at which its stretch begins, and holds what lies
    around: `LOOP_SAMPLES`, at the ends of a run its first or last ones, older ones first, thinned to
    `LOOP_POINTS`, NaN where a run has fewer. It is written when these are known, half its length behind the
    view. A second array holds the torque of the stretch itself, NaN elsewhere, so that one sees where on the
    curve the drive is.

    Who watches the run while it is simulated can't see ahead: the watch gets messages of what there is so
    far, at the time of their last sample, with the latest stretch as the second array.

    Args:
        stream: the topic, with one array for each of `LOOP_COLUMNS` and one for the stretch.
        places: which columns of the view those are.
    """

    def __init__(self, stream: TableStream, places: Sequence[int]) -> None:
        self.stream = stream
        self._places = places
        self._recent = np.empty((len(places), 0))
        self._count = 0
        self._last = 0.0
        self._begun: deque[tuple[int, float]] = deque()
        self._shown = 0

    @classmethod
    def of(
        cls, columns: Sequence[ColumnSpec], make: Callable[[Sequence[ColumnSpec]], TableStream]
    ) -> LoopStream | None:
        """The loop of a table with these columns; None where it lacks one of `LOOP_COLUMNS`."""
        by_name = {c.name: (i, c) for i, c in enumerate(columns) if not c.repeated}
        if not all(name in by_name for name in LOOP_COLUMNS):
            return None
        chosen = [by_name[name] for name in LOOP_COLUMNS]
        shape = (LOOP_POINTS,)
        specs = [ColumnSpec(c.name, c.field, c.unit, c.description, shape) for _, c in chosen]
        specs.append(ColumnSpec(LOOP_NOW, LOOP_NOW, specs[-1].unit, "of the stretch that begins now", shape))
        return cls(make(specs), [i for i, _ in chosen])

    def feed(self, time: Array, columns: Sequence[Array]) -> None:
        """Take rows of the view."""
        begin = 0
        while begin < len(time):
            if self._count % LOOP_EVERY == 0:
                self._begun.append((self._count, float(time[begin])))
            end = min(len(time), begin + LOOP_EVERY - self._count % LOOP_EVERY)
            fresh = np.array([columns[i][begin:end] for i in self._places])
            self._recent = np.concatenate([self._recent, fresh], axis=1)[:, -LOOP_SAMPLES:]
            self._count += end - begin
            self._last = float(time[end - 1])
            begin = end
            while self._begun and self._count >= max(LOOP_SAMPLES, self._begun[0][0] + LOOP_SAMPLES // 2):
                self._write(*self._begun.popleft())
            # Soon and often at first, so that who watches needn't look at an empty panel.
            if self._count - self._shown >= min(max(1, self._shown), LOOP_EVERY):
                self._show()

    def finish(self) -> None:
        """Write the loops of the last stretches."""
        while self._begun:
            self._write(*self._begun.popleft())
        if self._count > self._shown:
            self._show()

    def _write(self, begin: int, at: float) -> None:
        time = np.array([at])
        self.stream.append(time, naming.to_ns(time), self._arrays(begin), shown=False)

    def _show(self) -> None:
        self._shown = self._count
        if self.stream.watched:
            time = np.array([self._last])
            self.stream.show(time, naming.to_ns(time), self._arrays(self._count - 1 - LOOP_EVERY))

    def _arrays(self, begin: int) -> list[Array]:
        """What a message holds: points of the samples at hand, and the torque of those from ``begin`` on."""
        size = self._recent.shape[1]
        every = -(-size // LOOP_POINTS)
        # Groups begin at multiples in the run, so that the same points are chosen from message to message.
        skipped = (size - self._count) % every
        across, up = self._recent[:, skipped:]
        chosen = skipped + corners(across, up, every)
        begin = max(0, begin - (self._count - size))
        stretch = (chosen >= begin) & (chosen <= begin + LOOP_EVERY)
        rows = np.full((len(self._places) + 1, 1, LOOP_POINTS), np.nan)
        rows[:-1, 0, : len(chosen)] = self._recent[:, chosen]
        rows[-1, 0, : len(chosen)] = np.where(stretch, self._recent[-1, chosen], np.nan)
        return list(rows)
