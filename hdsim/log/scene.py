"""The drive in three dimensions: circular spline, flexspline, wave generator, output, tooth forces, error.

The bodies are drawn once, each in a frame of its own, on ``/hd/scene_static``; ``/hd/transforms`` turns the
frames, the flexspline's teeth too (`hdsim.log.scene_teeth` says how a body can show them); ``/hd/scene``
brings the forces on the teeth when they are sampled. Between two samples the forces stay where they were on
the ellipse, and turn with it. What would not be seen at its size is drawn larger, by factors that the scene
states: the flexspline's deflection and the error of the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.log import naming, panels, scene_teeth, schemas, shapes
from hdsim.log.scene_bodies import Shown, new_entity, static_entities
from hdsim.log.scene_frames import Ticks, Turns, frame_angles, frames_per_second, transform_messages
from hdsim.log.scene_geometry import (
    ANGLES,
    ERROR_CHANNELS,
    GEOMETRY_RECORD,
    MEASURED_OUTPUT,
    drawn_state,
    geometry_of,
)
from hdsim.log.scene_geometry import SceneGeometry as SceneGeometry

if TYPE_CHECKING:
    from hdsim.log.writer import LogWriter
    from hdsim.recording import Recording, Table

TRANSFORM_TOPIC = "/hd/transforms"


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
        rate = frames_per_second(duration)
        self._turns, self._ticks = Turns(rate, duration), Ticks(rate)
        self._begun = False

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
            self._write_static(state, with_forces="teeth" in tables)
        self._write_transforms(state)
        if "teeth" in tables and len(tables["teeth"]):
            self._write_forces(tables["teeth"])

    def _write_transforms(self, state: Table) -> None:
        from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

        rows = self._turns.rows(state.time, state["motor_angle"])
        times = naming.to_ns(state.time[rows]).tolist()
        self._log.write_messages(
            TRANSFORM_TOPIC,
            "foxglove.FrameTransforms",
            lambda: schemas.descriptor_set(FrameTransforms.DESCRIPTOR.file),
            times,
            transform_messages(times, frame_angles(self._geometry, state, rows)),
        )

    def _write_forces(self, teeth: Table) -> None:
        """Bars on the teeth that carry load, in the frame of the teeth."""
        from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        rows = self._ticks.rows(teeth.time)
        times = naming.to_ns(teeth.time[rows]).tolist()
        forces = np.abs(np.nan_to_num(teeth["normal_force"][rows]))
        payloads = []
        for at, angle, force in zip(times, teeth["angle"][rows], forces, strict=True):
            entity = new_entity("tooth forces", scene_teeth.FRAME, at).SerializeToString(deterministic=True)
            bars = scene_teeth.force_bars(self._geometry, angle, force)
            if bars:
                entity += shapes.embed(SceneEntity.LINES_FIELD_NUMBER, bars)
            payloads.append(shapes.embed(SceneUpdate.ENTITIES_FIELD_NUMBER, entity))
        self._log.write_messages(panels.SCENE, "foxglove.SceneUpdate", _scene_schema, times, payloads)

    def _write_static(self, state: Table, *, with_forces: bool) -> None:
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        self._log.write_metadata(GEOMETRY_RECORD, {k: repr(v) for k, v in asdict(self._geometry).items()})
        at = int(naming.to_ns(state.time[:1])[0])
        has_error = any(c in state for c in ERROR_CHANNELS)
        shown = Shown(forces=with_forces, error=has_error, measured=MEASURED_OUTPUT in state)
        entities = static_entities(self._geometry, at, shown)
        update = SceneUpdate(entities=entities)
        self._log.write_messages(
            panels.SCENE_STATIC,
            "foxglove.SceneUpdate",
            _scene_schema,
            [at],
            [update.SerializeToString(deterministic=True)],
        )


def write_scene(log: LogWriter, recording: Recording, geometry: SceneGeometry | None = None) -> None:
    """Write the scene of a recording that has the two angles; the geometry is `geometry_of` it by default."""
    state = drawn_state(recording)
    if state is None:
        return
    chosen = geometry or geometry_of(recording)
    tables = {"state": state}
    if "teeth" in recording.tables:
        tables["teeth"] = recording.tables["teeth"]
    SceneWriter(log, chosen, float(state.time[-1] - state.time[0])).write(tables)


def _scene_schema() -> bytes:
    from foxglove_schemas_protobuf import SceneUpdate_pb2

    return schemas.descriptor_set(SceneUpdate_pb2.DESCRIPTOR)
