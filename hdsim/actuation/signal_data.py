"""Signals as the simulation sees them: a kernel, packed numbers, and the times where they are not smooth.

The shapes of ``hdsim.actuation.shapes`` produce a ``Move``; a ``SignalData`` is a move made ready to run.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hdsim.actuation import _signal_kernel as law

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from hdsim.kernel import Kernel

    Array = NDArray[np.float64]

#: Relative jump of the value and of its first two derivatives below which a joint counts as smooth.
JUMP_TOLERANCE = (1e-12, 1e-9, 1e-9)

Row = tuple[float, ...]


@dataclass(frozen=True)
class Segment:
    """Consecutive pieces of one kind: their start times in s and their records (see ``_signal_kernel``)."""

    kind: int
    starts: Sequence[float]
    rows: Sequence[Row]

    def moved(self, time: float, value: float) -> Segment:
        """The same pieces ``time`` (s) later and ``value`` higher."""
        starts = [start + time for start in self.starts]
        return Segment(self.kind, starts, [(row[0] + value, *row[1:]) for row in self.rows])

    def scaled(self, factor: float) -> Segment:
        """The same pieces with values times ``factor``."""
        if self.kind == law.CUBIC:
            rows: list[Row] = [tuple(factor * number for number in row) for row in self.rows]
        elif self.kind == law.SINES:
            rows = [
                (factor * row[0], row[1], *(n if k % 3 else factor * n for k, n in enumerate(row[2:])))
                for row in self.rows
            ]
        else:
            rows = [(factor * row[0], factor * row[1], *row[2:]) for row in self.rows]
        return Segment(self.kind, self.starts, rows)


@dataclass(frozen=True)
class Move:
    """A stretch of a signal that begins at time 0.

    Args:
        segments: its pieces, in order of time.
        duration: s, infinite when it never ends.
        initial: value before it.
        final: value that is held after its end; without meaning when it never ends.
    """

    segments: tuple[Segment, ...]
    duration: float
    initial: float
    final: float

    def delayed(self, time: float) -> Move:
        """The move ``time`` (s) later, its initial value held before."""
        if time == 0.0:
            return self
        held = hold(0.0, self.initial)
        later = tuple(segment.moved(time, 0.0) for segment in self.segments)
        return Move((held, *later), self.duration + time, self.initial, self.final)


def hold(start: float, value: float) -> Segment:
    """One constant piece from ``start`` (s)."""
    return Segment(law.CUBIC, [start], [(value, 0.0, 0.0, 0.0)])


def profile(phases: Sequence[tuple[float, float, float]], final: float, velocity: float = 0.0) -> Move:
    """Integrate phases of constant third derivative, from 0.

    Args:
        phases: (duration in s, second derivative at its start, third derivative) each.
        final: exact value at the end, held there.
        velocity: first derivative at the start.
    """
    starts: list[float] = []
    rows: list[Row] = []
    time = value = 0.0
    for duration, acceleration, jerk in phases:
        if duration <= 0.0:
            continue
        starts.append(time)
        rows.append((value, velocity, acceleration / 2.0, jerk / 6.0))
        value += duration * (velocity + duration * (acceleration / 2.0 + duration * jerk / 6.0))
        velocity += duration * (acceleration + duration * jerk / 2.0)
        time += duration
    moving = (Segment(law.CUBIC, starts, rows),) if starts else ()
    return Move((*moving, hold(time, final)), time, 0.0, final)


def joined(moves: Sequence[Move], initial: float = 0.0) -> Move:
    """Moves one after the other, each added to the last value of the one before."""
    segments: list[Segment] = []
    time, value = 0.0, initial
    for move in moves:
        segments += [segment.moved(time, value) for segment in move.segments]
        time += move.duration
        value += move.final
    first = moves[0].initial if moves else 0.0
    return Move((*segments,), time, initial + first, value)


#: Points of a wave at which its size is looked at.
_POINTS = 2001


def _stacked(segment: Segment, used: Any, lengths: Array) -> Iterator[tuple[Any, Any]]:
    """Records and lengths of a segment's pieces: cubics all at once, shape (n, 1), others one by one."""
    import numpy as np

    if segment.kind == law.CUBIC:
        if len(used):
            rows = np.array([segment.rows[k] for k in used]).T[:, :, None]
            yield rows, lengths[used][:, None]
        return
    for k in used:
        yield segment.rows[k], float(lengths[k])


def _evaluated(kind: int, row: Any, t: Array) -> Array:
    """Value and two derivatives of a piece, as in ``_signal_kernel``: shape (3, ...)."""
    import numpy as np

    if kind == law.CUBIC:
        c0, c1, c2, c3 = row
        return np.array(
            [c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2 * c2 + t * 3 * c3), 2 * c2 + 6 * c3 * t]
        )
    offset, amplitude = row[0], row[1]
    if kind == law.SINES:
        waves = np.array(row[2:]).reshape(-1, 3)
        sines = waves[:, 0, None] * np.exp(1j * (waves[:, 1, None] * t + waves[:, 2, None]))
        rates = 1j * waves[:, 1, None]
        return np.array(
            [offset + sines.sum(0).imag, (rates * sines).sum(0).imag, (rates**2 * sines).sum(0).imag]
        )
    if kind == law.TRIANGLE:
        return np.array([offset + amplitude + 0 * t, 4 * row[2] * amplitude + 0 * t, 0 * t])
    rate = row[3]
    omega = row[2] + rate * t if kind == law.LINEAR_CHIRP else row[2] * np.exp(rate * t)
    # The envelope of a sweep: a wave's own phase hardly matters to its largest value.
    return np.array([abs(offset) + abs(amplitude) + 0 * t, amplitude * omega, amplitude * omega**2])


class SignalData:
    """A signal made ready to run: what ``Builder.signal`` takes.

    Args:
        move: the signal from time 0. SI units.
    """

    kernel: Kernel = law.pieces

    def __init__(self, move: Move) -> None:
        self.move = move

    @property
    def end_time(self) -> float:
        """Time in s after which the signal is constant; infinite when it never is."""
        return self.move.duration

    def scaled(self, factor: float) -> SignalData:
        """The signal times ``factor``."""
        move = self.move
        segments = tuple(segment.scaled(factor) for segment in move.segments)
        return SignalData(Move(segments, move.duration, factor * move.initial, factor * move.final))

    def largest(self, duration: float) -> tuple[float, float, float]:
        """Largest size of value, first and second derivative up to a time, without compiled code.

        Args:
            duration: time, s.

        Returns:
            SI units. Exact for holds, steps, ramps and trapezoids; of waves the largest of many points.
        """
        import numpy as np

        starts = [start for segment in self.move.segments for start in segment.starts]
        found = np.array([abs(self.move.initial), 0.0, 0.0])
        index = 0
        for segment in self.move.segments:
            n = len(segment.starts)
            stops = np.minimum(np.array([*starts, np.inf])[index + 1 : index + n + 1], duration)
            lengths = stops - np.asarray(segment.starts)
            index += n
            used = np.flatnonzero(lengths >= 0.0)
            points = 5 if segment.kind == law.CUBIC else _POINTS
            for rows, length in _stacked(segment, used, lengths):
                t = np.linspace(0.0, 1.0, points) * length
                sizes = np.abs(_evaluated(segment.kind, rows, t))
                found = np.maximum(found, sizes.reshape(3, -1).max(axis=1))
        return float(found[0]), float(found[1]), float(found[2])

    def pack(self) -> Array:
        """Parameters of the kernel, float64."""
        return self._packed[0]

    def corners(self, start: float, end: float) -> Array:
        """Times in (start, end), in s, where the signal or one of its first two derivatives jumps. Sorted."""
        import numpy as np

        _, first, starts = self._packed
        times = [starts[first == np.arange(len(starts))]]
        index = 0
        for segment in self.move.segments:
            if segment.kind == law.TRIANGLE:
                for k, row in enumerate(segment.rows):
                    after = index + k + 1
                    stop = min(end, starts[after]) if after < len(starts) else end
                    times.append(_peaks(starts[after - 1], stop, row[2]))
            index += len(segment.starts)
        found = np.unique(np.concatenate(times))
        return found[(found > start) & (found < end)]

    def joints(self, start: float, end: float) -> Array:
        """Times in (start, end), in s, where pieces meet: what does not jump there may bend. Sorted."""
        starts = self._packed[2]
        return starts[(starts > start) & (starts < end)]

    def values(self, times: ArrayLike, inside: ArrayLike | None = None) -> Array:
        """Value and three derivatives, shape (4, n), at ``times`` (s), shape (n,).

        ``inside`` (s), shape (n,), chooses the smooth run of each time; by default the one that begins
        at or holds the time.
        """
        import numpy as np

        from hdsim.actuation._signal_values import evaluate

        t = np.ascontiguousarray(np.atleast_1d(times), dtype=float)
        chosen = t if inside is None else np.ascontiguousarray(np.broadcast_to(inside, t.shape), dtype=float)
        result: Array = evaluate(self.kernel.address, t, chosen, self.pack())
        return result

    @cached_property
    def _packed(self) -> tuple[Array, Any, Array]:
        """Parameters, index of the first piece of each piece's smooth run, and start times."""
        import numpy as np

        segments = self.move.segments
        starts = np.concatenate([np.asarray(segment.starts, dtype=float) for segment in segments])
        n = len(starts)
        joint = np.ones(n, dtype=bool)
        cubic = np.concatenate([np.full(len(s.starts), s.kind == law.CUBIC) for s in segments])
        c = np.zeros((n, 4))
        c[cubic] = np.array([row for s in segments if s.kind == law.CUBIC for row in s.rows]).reshape(-1, 4)
        both = cubic[1:] & cubic[:-1]
        joint[1:] = ~both | _jumps(starts, c, cubic)
        index = np.arange(n)
        first = np.maximum.accumulate(np.where(joint, index, 0))
        ends = np.append(joint[1:], True)
        last = np.minimum.accumulate(np.where(ends, index, n)[::-1])[::-1]

        rate, buckets = _buckets(starts)
        base = law.HEADER + 4 * n + len(buckets)
        lengths = np.concatenate([np.full(len(s.starts), 1 + len(s.rows[0])) for s in segments])
        positions = base + np.concatenate([[0], np.cumsum(lengths)[:-1]])
        records = [
            np.column_stack([np.full(len(s.starts), float(s.kind)), np.asarray(s.rows, dtype=float)]).ravel()
            for s in segments
        ]
        header = [n, self.move.initial, rate, len(buckets) - 1]
        packed = np.concatenate([header, starts, first, last, positions, buckets, *records])
        return np.ascontiguousarray(packed, dtype=float), first, starts


def _buckets(starts: Array) -> tuple[float, Any]:
    """Buckets a second, and the last piece that has started at each border: shape (buckets + 1,)."""
    import numpy as np

    n = len(starts)
    length = float(starts[-1] - starts[0])
    if not 0.0 < length < math.inf:
        return 0.0, np.array([0, n - 1])
    borders = np.linspace(starts[0], starts[-1], n)
    return (n - 1) / length, np.searchsorted(starts, borders, side="right") - 1


def _peaks(start: float, stop: float, frequency: float) -> Array:
    """Times in s of the peaks of a triangle of ``frequency`` (Hz) that begins at ``start``."""
    import numpy as np

    if not math.isfinite(stop):
        raise ValueError("a triangle has endlessly many corners: give a finite end")
    count = max(0, math.ceil(2.0 * frequency * (stop - start) + 0.5))
    peaks = start + (np.arange(count) + 0.5) / (2.0 * frequency)
    # A peak that rounding puts next to the end of the piece would leave an empty span.
    return np.asarray(peaks[peaks < stop - 1e-9 / frequency], dtype=np.float64)


def _jumps(starts: Array, c: Array, cubic: Any) -> Any:
    """Whether each piece (but the first) jumps against the one before; shape (n - 1,), for cubics."""
    import numpy as np

    t = np.diff(starts)
    left = np.array(
        [
            c[:-1, 0] + t * (c[:-1, 1] + t * (c[:-1, 2] + t * c[:-1, 3])),
            c[:-1, 1] + t * (2.0 * c[:-1, 2] + t * 3.0 * c[:-1, 3]),
            2.0 * c[:-1, 2] + 6.0 * c[:-1, 3] * t,
        ]
    )
    right = np.array([c[1:, 0], c[1:, 1], 2.0 * c[1:, 2]])
    both = cubic[1:] & cubic[:-1]
    left, right = left * both, right * both
    largest = [float(np.max(np.abs([left[k], right[k]]), initial=0.0)) for k in range(3)]
    largest.append(float(np.max(np.abs(6.0 * c[:, 3]), initial=0.0)))
    rounding = 4.0 * sys.float_info.epsilon * np.abs(starts[1:])
    jump = np.zeros(len(t), dtype=bool)
    for k in range(3):
        jump |= np.abs(left[k] - right[k]) > JUMP_TOLERANCE[k] * largest[k] + rounding * largest[k + 1]
    return jump
