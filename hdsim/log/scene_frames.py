"""Where the bodies of a scene are turned to, and when: the transforms."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.log import scene_teeth
from hdsim.log.facts import playback_speed
from hdsim.log.rows import DoubleField, varint
from hdsim.log.scene_geometry import ERROR_CHANNELS, MEASURED_OUTPUT, SceneGeometry
from hdsim.log.shapes import Array, embed

if TYPE_CHECKING:
    from hdsim.recording import Table

WORLD = "world"

_VIEWER_FRAMES_PER_SECOND = 30.0
_MOST_FRAMES = 3600
_MOST_TURNS = 18_000
"""Of a run: frames at their rate, and those that a fast motor needs besides."""
_TURN = 2 * np.pi / 24
"""Turn of the motor after which there is another frame."""
_ROTATION_GRID = 2.0**-23
"""Rotations are rounded to this, a twentieth of an arc second, for the size of the log."""


def frames_per_second(duration: float) -> float:
    """Frames for each second of the run: 30 a second as played back, and at most 3600 a run."""
    if duration <= 0:
        return _VIEWER_FRAMES_PER_SECOND
    return min(_VIEWER_FRAMES_PER_SECOND / playback_speed(duration), _MOST_FRAMES / duration)


class Ticks:
    """Picks rows of a table: the first at or after each tick, however the table is cut into blocks."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._next: float | None = None

    def rows(self, time: Array) -> NDArray[np.intp]:
        """Rows of the next block, whose times are (n,)."""
        first = np.floor(time[0] * self._rate) if self._next is None else self._next
        last = np.floor(time[-1] * self._rate)
        ticks = np.arange(first, last + 1)
        rows = np.searchsorted(time, ticks / self._rate)
        rows = np.unique(rows[rows < len(time)])
        if len(rows):
            self._next = float(np.floor(time[rows[-1]] * self._rate)) + 1
        return rows


class Turns:
    """Picks rows at a rate, and where a body has turned on since: at most `_MOST_TURNS` of those in a run."""

    def __init__(self, rate: float, duration: float) -> None:
        self._rate = rate
        fine = max(rate, _MOST_TURNS / duration) if duration > 0 else rate
        self._fine = Ticks(fine)
        self._last: tuple[float, float] | None = None

    def rows(self, time: Array, angle: Array) -> NDArray[np.intp]:
        """Rows of the next block, by time (n,) and the body's angle (n,)."""
        rows = self._fine.rows(time)
        if not len(rows):
            return rows
        cells = np.stack([np.floor(time[rows] * self._rate), np.floor(angle[rows] / _TURN)])
        before = np.array([[np.nan], [np.nan]] if self._last is None else [[c] for c in self._last])
        self._last = (float(cells[0, -1]), float(cells[1, -1]))
        changed = (np.diff(cells, axis=1, prepend=before) != 0).any(axis=0)
        chosen: NDArray[np.intp] = rows[changed]
        return chosen


def frame_angles(g: SceneGeometry, state: Table, rows: NDArray[np.intp]) -> dict[str, Array]:
    """Angle (n,) about the axis of each frame, rad, in rows of a state; NaN where nothing is known."""

    def channel(name: str) -> Array | None:
        return state[name][rows] if name in state else None

    output, motor = state["output_angle"][rows], state["motor_angle"][rows]
    still = np.zeros(len(rows))
    ring = channel("ring_angle")
    spline = still if g.circular_spline_fixed else output
    twist = still
    if ring is not None:
        kinematic = channel("kinematic_error")
        twist = scene_teeth.mesh_twist(g, motor, output, ring, still if kinematic is None else kinematic)
    error = next((state[c][rows] for c in ERROR_CHANNELS if c in state), still)
    angles = {
        "circular_spline": spline,
        "wave_generator": motor,
        scene_teeth.FRAME: scene_teeth.mesh_angle(g, motor, spline, twist),
        "output": output,
        "error_pointer": output + g.error_factor * error,
    }
    measured = channel(MEASURED_OUTPUT)
    if measured is not None:
        angles["measured_pointer"] = output + g.error_factor * (measured - output + error)
    return angles


def transform_messages(times: list[int], angles: Mapping[str, Array]) -> list[bytes]:
    """Serialized FrameTransforms that turn frames about the axis.

    Args:
        times: n log times, ns.
        angles: (n,) by frame, rad; where one is not finite, its frame stays as it was.
    """
    rotation = {}
    for child, angle in angles.items():
        half = 0.5 * np.where(np.isfinite(angle), angle, 0.0)
        pair = np.stack([np.sin(half), np.cos(half)], axis=1)
        rotation[child] = (np.round(pair / _ROTATION_GRID) * _ROTATION_GRID).tolist()
    known = {child: np.isfinite(angle).tolist() for child, angle in angles.items()}
    # The translation is zero, but has to be there.
    names = {child: embed(2, WORLD.encode()) + embed(3, child.encode()) + embed(4, b"") for child in angles}
    z, w = (DoubleField(number, repeated=False).tag for number in (3, 4))
    pack = struct.Struct("<d").pack
    messages = []
    for k, at in enumerate(times):
        seconds, nanos = divmod(at, 1_000_000_000)
        stamp = embed(1, b"\x08" + varint(seconds) + (b"\x10" + varint(nanos) if nanos else b""))
        message = b""
        for child, name in names.items():
            if known[child][k]:
                sine, cosine = rotation[child][k]
                message += embed(1, stamp + name + embed(5, z + pack(sine) + w + pack(cosine)))
        messages.append(message)
    return messages
