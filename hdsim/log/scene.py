"""The drive in three dimensions: circular spline, flexspline, wave generator, output, tooth forces, error.

The bodies are drawn once, each in a frame of its own, on ``/hd/scene_static``; ``/hd/transforms`` turns the
frames; ``/hd/scene`` brings the flexspline's teeth, which no frame can turn because the wave generator
deforms them. What would not be seen at its size is drawn larger, by factors that the scene states:
the flexspline's deflection and the error of the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log import layout, naming, panels, schemas, shapes
from hdsim.log.scene_bodies import GREY, WORLD, new_entity, static_entities
from hdsim.log.scene_geometry import ANGLES, ERROR_CHANNELS, GEOMETRY_RECORD, geometry_of
from hdsim.log.scene_geometry import SceneGeometry as SceneGeometry
from hdsim.log.shapes import Array

if TYPE_CHECKING:
    from hdsim.log.writer import LogWriter
    from hdsim.recording import Recording, Table

TRANSFORM_TOPIC = "/hd/transforms"

_VIEWER_FRAMES_PER_SECOND = 30.0
_MOST_FRAMES = 3600


def frames_per_second(duration: float) -> float:
    """Frames for each second of the run: 30 a second as played back, and at most 3600 a run."""
    if duration <= 0:
        return _VIEWER_FRAMES_PER_SECOND
    return min(_VIEWER_FRAMES_PER_SECOND / layout.playback_speed(duration), _MOST_FRAMES / duration)


class SceneWriter:
    """Adds the scene to a log while the run goes on.

    Args:
        log: where to.
        geometry: the drive.
        duration: expected length of the run in s, for the number of frames.
    """

    def __init__(self, log: LogWriter, geometry: SceneGeometry, duration: float) -> None:
        if geometry.largest_force_n <= 0 or geometry.pitch_radius_m <= 0:
            raise InputError("the scene needs a pitch radius and a largest force greater than 0")
        self._log = log
        log.drive_radius = geometry.pitch_radius_m
        self._geometry = geometry
        self._rate = frames_per_second(duration)
        self._next: dict[str, float] = {}
        self._begun = self._has_teeth = False

    def write(self, tables: Mapping[str, Table]) -> None:
        """Take the next block of the run's tables: ``state``, and ``teeth`` of the same stretch of time."""
        state = tables["state"]
        if not len(state):
            return
        missing = [c for c in ANGLES if c not in state]
        if missing:
            raise InputError(f"the scene needs the channel {missing[0]!r} in the state")
        if not self._begun:
            self._begun = True
            self._write_static(state)
        self._write_transforms(state)
        self._has_teeth = self._has_teeth or "teeth" in tables
        if "teeth" in tables:
            self._write_teeth(state, tables["teeth"])
        elif not self._has_teeth:
            self._write_teeth(state, None)

    def _frames(self, topic: str, time: Array) -> NDArray[np.intp]:
        """Rows of a block that become frames: the first at or after each tick."""
        first = self._next.get(topic, float(np.floor(time[0] * self._rate)))
        last = np.floor(time[-1] * self._rate)
        ticks = np.arange(first, last + 1)
        rows = np.searchsorted(time, ticks / self._rate)
        rows = np.unique(rows[rows < len(time)])
        if len(rows):
            self._next[topic] = float(np.floor(time[rows[-1]] * self._rate)) + 1
        return rows

    def _write_transforms(self, state: Table) -> None:
        from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

        rows = self._frames("transforms", state.time)
        output = state["output_angle"][rows]
        ring = state["ring_angle"][rows] if "ring_angle" in state else output
        still = np.zeros(len(rows))
        fixed = self._geometry.circular_spline_fixed
        error = next((state[c][rows] for c in ERROR_CHANNELS if c in state), still)
        angles = {
            "circular_spline": still if fixed else output,
            "flexspline": ring if fixed else still,
            "wave_generator": state["motor_angle"][rows],
            "output": output,
            "error_pointer": output + self._geometry.error_factor * error,
        }
        times = naming.to_ns(state.time[rows]).tolist()
        payloads = []
        for k, at in enumerate(times):
            message = FrameTransforms()
            for child, angle in angles.items():
                if not np.isfinite(angle[k]):
                    continue
                transform = message.transforms.add(parent_frame_id=WORLD, child_frame_id=child)
                transform.timestamp.seconds, transform.timestamp.nanos = divmod(at, 1_000_000_000)
                transform.translation.x = 0.0
                half = 0.5 * float(angle[k])
                transform.rotation.z, transform.rotation.w = float(np.sin(half)), float(np.cos(half))
            payloads.append(message.SerializeToString(deterministic=True))
        self._log.write_messages(
            TRANSFORM_TOPIC,
            "foxglove.FrameTransforms",
            lambda: schemas.descriptor_set(FrameTransforms.DESCRIPTOR.file),
            times,
            payloads,
        )

    def _write_teeth(self, state: Table, teeth: Table | None) -> None:
        g = self._geometry
        time = state.time if teeth is None else teeth.time
        if not len(time):
            return
        rows = self._frames("teeth", time)
        motor = np.interp(time[rows], state.time, state["motor_angle"])
        if teeth is None:
            output = state["output_angle"][rows]
            ring = state["ring_angle"][rows] if "ring_angle" in state else output
            turned = (ring if g.circular_spline_fixed else np.zeros(len(rows))) - motor
            angle = turned[:, None] + np.arange(g.flexspline_teeth) * (2 * np.pi / g.flexspline_teeth)
            force = np.zeros_like(angle)
        else:
            angle, force = teeth["angle"][rows], np.abs(np.nan_to_num(teeth["normal_force"][rows]))
        times = naming.to_ns(time[rows]).tolist()
        payloads = [
            self._teeth_frame(at, m, a, f) for at, m, a, f in zip(times, motor, angle, force, strict=True)
        ]
        self._log.write_messages(panels.SCENE, "foxglove.SceneUpdate", _scene_schema, times, payloads)

    def _teeth_frame(self, at: int, motor: float, angle: Array, force: Array) -> bytes:
        """One frame: idle teeth grey, engaged ones coloured, with a bar inwards as long as the force."""
        from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        g = self._geometry
        share = force / g.largest_force_n
        engaged = share > 1e-3
        root = g.radius(angle) - g.tooth_height
        tip = root + 1.3 * g.tooth_height
        foot = root - np.where(engaged, np.minimum(share, 1.2), 0.0) * 0.3 * g.pitch_radius_m
        top = 0.16 * g.pitch_radius_m
        points = np.stack(
            [shapes.polar(foot, angle + motor, top), shapes.polar(tip, angle + motor, top)], axis=1
        )
        lines = shapes.segments(points[~engaged].reshape(-1, 3), GREY, 2.0)
        coloured = np.repeat(shapes.force_colours(share[engaged]), 2, axis=0)
        loaded = shapes.segments(points[engaged].reshape(-1, 3), coloured, 4.0)
        entity = new_entity("teeth", WORLD, at, locked=False).SerializeToString(deterministic=True)
        for line, used in ((lines, not engaged.all()), (loaded, engaged.any())):
            if used:
                entity += shapes.embed(SceneEntity.LINES_FIELD_NUMBER, line)
        return shapes.embed(SceneUpdate.ENTITIES_FIELD_NUMBER, entity)

    def _write_static(self, state: Table) -> None:
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        self._log.write_metadata(GEOMETRY_RECORD, {k: repr(v) for k, v in asdict(self._geometry).items()})
        at = int(naming.to_ns(state.time[:1])[0])
        has_error = any(c in state for c in ERROR_CHANNELS)
        update = SceneUpdate(entities=static_entities(self._geometry, at, with_error=has_error))
        self._log.write_messages(
            panels.SCENE_STATIC,
            "foxglove.SceneUpdate",
            _scene_schema,
            [at],
            [update.SerializeToString(deterministic=True)],
        )


def write_scene(log: LogWriter, recording: Recording, geometry: SceneGeometry | None = None) -> None:
    """Write the scene of a recording that has the two angles; the geometry is `geometry_of` it by default."""
    state = recording.tables.get("state")
    if state is None or not len(state) or not all(c in state and state[c].ndim == 1 for c in ANGLES):
        return
    time = state.time
    chosen = geometry or geometry_of(recording)
    SceneWriter(log, chosen, float(time[-1] - time[0])).write(recording.tables)


def _scene_schema() -> bytes:
    from foxglove_schemas_protobuf import SceneUpdate_pb2

    return schemas.descriptor_set(SceneUpdate_pb2.DESCRIPTOR)
