"""The drive in three dimensions: circular spline, flexspline, wave generator, output, tooth forces, error.

The bodies are drawn once, each in a frame of its own, on ``/hd/scene_static``; ``/hd/transforms`` turns the
frames; ``/hd/scene`` brings the flexspline's teeth, which no frame can turn because the wave generator
deforms them. What would not be seen at its size is drawn larger, by factors that the scene states:
the flexspline's deflection and the error of the output.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log import layout, naming, panels, schemas, shapes
from hdsim.log.shapes import Array

if TYPE_CHECKING:
    from hdsim.log.writer import LogWriter
    from hdsim.recording import Recording, Table

TRANSFORM_TOPIC = "/hd/transforms"
WORLD = "world"
GEOMETRY_RECORD = "hdsim.scene"
GEOMETRY_KEY = "geometry"
"""Entry of a run's metadata: JSON of the fields of `SceneGeometry` that are known."""

_VIEWER_FRAMES_PER_SECOND = 30.0
_MOST_FRAMES = 3600
_ANGLES = ("motor_angle", "output_angle")
_ERROR_CHANNELS = ("transmission_error", "tracking_error")

_STEEL: shapes.Rgba = (0.45, 0.48, 0.53, 1.0)
_BLUE: shapes.Rgba = (0.20, 0.33, 0.50, 1.0)
_BRASS: shapes.Rgba = (0.62, 0.52, 0.25, 1.0)
_WHITE: shapes.Rgba = (1.0, 1.0, 1.0, 1.0)
_RED: shapes.Rgba = (1.0, 0.25, 0.2, 1.0)
_GREY: shapes.Rgba = (0.62, 0.64, 0.67, 1.0)


@dataclass(frozen=True)
class SceneGeometry:
    """What the scene has to know of the drive.

    Args:
        flexspline_teeth: number of teeth.
        circular_spline_teeth: number of teeth.
        pitch_radius_m: radius of the circle on which the teeth meet.
        circular_spline_fixed: the flexspline is the output; else the circular spline is.
        deflection_factor: by how much the flexspline's deflection is exaggerated.
        error_factor: by how much the error of the output is exaggerated.
        largest_force_n: force at the end of the colour scale.
    """

    flexspline_teeth: int = 200
    circular_spline_teeth: int = 202
    pitch_radius_m: float = 0.025
    circular_spline_fixed: bool = True
    deflection_factor: float = 6.0
    error_factor: float = 500.0
    largest_force_n: float = 50.0

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, str]) -> SceneGeometry:
        """What a run's metadata say under ``geometry``; the defaults for the rest."""
        try:
            found = json.loads(metadata.get(GEOMETRY_KEY, "{}"))
            kinds = {name: type(value) for name, value in asdict(cls()).items()}
            return cls(**{name: kind(found[name]) for name, kind in kinds.items() if name in found})
        except (ValueError, TypeError) as error:
            raise InputError(f"the metadata's {GEOMETRY_KEY} is no drive geometry: {error}") from None

    @property
    def drawn_deflection(self) -> float:
        """Radial deflection as drawn, in m: the difference of the two pitch radii times its factor."""
        difference = 1.0 - self.flexspline_teeth / self.circular_spline_teeth
        return self.pitch_radius_m * difference * self.deflection_factor

    @property
    def tooth_height(self) -> float:
        """Height of a tooth as drawn, in m."""
        return 0.045 * self.pitch_radius_m

    def radius(self, angle: Array) -> Array:
        """Pitch radius of the flexspline as drawn, at angles from the major axis; it meets the circular
        spline on the major axis.
        """
        return self.pitch_radius_m - self.drawn_deflection * (1.0 - np.cos(2.0 * angle))


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
        missing = [c for c in _ANGLES if c not in state]
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
        error = next((state[c][rows] for c in _ERROR_CHANNELS if c in state), still)
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
        lines = shapes.segments(points[~engaged].reshape(-1, 3), _GREY, 2.0)
        coloured = np.repeat(shapes.force_colours(share[engaged]), 2, axis=0)
        loaded = shapes.segments(points[engaged].reshape(-1, 3), coloured, 4.0)
        entity = _entity("teeth", WORLD, at, locked=False).SerializeToString(deterministic=True)
        for line, used in ((lines, not engaged.all()), (loaded, engaged.any())):
            if used:
                entity += shapes.embed(SceneEntity.LINES_FIELD_NUMBER, line)
        return shapes.embed(SceneUpdate.ENTITIES_FIELD_NUMBER, entity)

    def _write_static(self, state: Table) -> None:
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        self._log.write_metadata(GEOMETRY_RECORD, {k: repr(v) for k, v in asdict(self._geometry).items()})
        at = int(naming.to_ns(state.time[:1])[0])
        has_error = any(c in state for c in _ERROR_CHANNELS)
        update = SceneUpdate(entities=static_entities(self._geometry, at, with_error=has_error))
        self._log.write_messages(
            panels.SCENE_STATIC,
            "foxglove.SceneUpdate",
            _scene_schema,
            [at],
            [update.SerializeToString(deterministic=True)],
        )


def static_entities(g: SceneGeometry, at: int, *, with_error: bool) -> list[Any]:
    """The bodies, each in its own frame, and the legend.

    Args:
        g: the drive.
        at: log time in ns.
        with_error: whether there is an error to point at.
    """
    r, h = g.pitch_radius_m, g.tooth_height
    around = np.linspace(0.0, 2 * np.pi, 181)[:-1]
    spline = _entity("circular spline", "circular_spline", at)
    inner = shapes.toothed(r, h, g.circular_spline_teeth)
    outer = shapes.polar(1.25 * r, np.arctan2(inner[:, 1], inner[:, 0]))
    spline.triangles.append(shapes.prism(outer, inner, -0.10 * r, 0.10 * r, _STEEL))
    mark = shapes.polar(np.array([1.12, 1.25]) * r, np.zeros(2), 0.12 * r)
    _add_line(spline, shapes.segments(mark, _WHITE, 3.0))

    generator = _entity("wave generator", "wave_generator", at)
    ellipse = shapes.polar(g.radius(around) - 1.6 * h, around)
    generator.triangles.append(shapes.prism(ellipse, 0.25 * ellipse, -0.08 * r, 0.08 * r, _BLUE))
    band = shapes.polar(g.radius(around) - h, around)
    generator.triangles.append(shapes.prism(band, ellipse, -0.10 * r, 0.11 * r, _BRASS))
    axis = shapes.polar(g.radius(np.array([0.0, np.pi])) - 2 * h, np.array([0.0, np.pi]), 0.12 * r)
    _add_line(generator, shapes.segments(axis, _WHITE, 3.0))

    output = _entity("output", "output", at)
    disc = shapes.polar(0.85 * r, around)
    output.triangles.append(shapes.prism(disc, None, -0.40 * r, -0.30 * r, _GREY))
    arm = np.array([[0.0, -0.06], [1.75, -0.06], [1.75, 0.06], [0.0, 0.06]]) * r
    output.triangles.append(shapes.prism(arm - arm.mean(axis=0), None, -0.50 * r, -0.40 * r, _GREY))
    output.triangles[-1].pose.position.x = float(arm[:, 0].mean())
    output.spheres.append(_load(1.75 * r, 0.12 * r, -0.45 * r))
    nominal = shapes.polar(np.array([1.28, 1.6]) * r, np.zeros(2), 0.12 * r)
    _add_line(output, shapes.segments(nominal, _WHITE, 3.0))

    legend = _entity("legend", WORLD, at)
    size = 0.09 * r
    lines = [f"flexspline deflection drawn x{g.deflection_factor:g}"]
    if with_error:
        lines.append(f"red pointer: error of the output x{g.error_factor:g}")
    for k, line in enumerate(lines):
        legend.texts.append(shapes.text(line, (0.0, (2.15 - 0.14 * k) * r, 0.2 * r), size))
    height = 2.15 - 0.14 * len(lines)
    steps = np.linspace(0.0, 1.0, 16)
    x = np.repeat(-0.8 + 0.1 * np.arange(16), 2) + np.tile([0.0, 0.1], 16)
    bar = np.column_stack([x, np.full(32, height), np.full(32, 0.2)]) * r
    _add_line(legend, shapes.segments(bar, np.repeat(shapes.force_colours(steps), 2, axis=0), 10.0))
    for side, words in ((-0.8, "0 N"), (0.0, "tooth force"), (0.8, f"{g.largest_force_n:.3g} N")):
        legend.texts.append(shapes.text(words, (side * r, (height - 0.14) * r, 0.2 * r), size))

    entities = [spline, generator, output, legend]
    if with_error:
        pointer = _entity("error pointer", "error_pointer", at)
        needle = shapes.polar(np.array([1.28, 1.7]) * r, np.zeros(2), 0.14 * r)
        _add_line(pointer, shapes.segments(needle, _RED, 5.0))
        entities.append(pointer)
    return entities


def geometry_of(recording: Recording) -> SceneGeometry:
    """Geometry that a recording tells: its metadata's, its tooth count, scales for its forces and errors."""
    g = SceneGeometry.from_metadata(recording.metadata)
    teeth = recording.tables.get("teeth")
    count, force = g.flexspline_teeth, g.largest_force_n
    if teeth is not None and "normal_force" in teeth and len(teeth):
        count = teeth["normal_force"].shape[1]
        largest = float(np.nanmax(np.abs(teeth["normal_force"])))
        force = largest if largest > 0 else force
    factor = g.error_factor
    error = next((recording[c] for c in _ERROR_CHANNELS if c in recording), None)
    if error is not None and np.isfinite(error).any() and np.nanmax(np.abs(error)) > 0:
        # The largest error points a sixth of a turn away, by a factor of one digit.
        wanted = np.pi / 6 / float(np.nanmax(np.abs(error[np.isfinite(error)])))
        power = 10.0 ** np.floor(np.log10(wanted))
        factor = max(1.0, float(np.floor(wanted / power) * power))
    difference = g.circular_spline_teeth - g.flexspline_teeth
    return replace(
        g,
        flexspline_teeth=count,
        circular_spline_teeth=count + difference,
        error_factor=factor,
        largest_force_n=force,
    )


def write_scene(log: LogWriter, recording: Recording, geometry: SceneGeometry | None = None) -> None:
    """Write the scene of a recording that has the two angles; the geometry is `geometry_of` it by default."""
    state = recording.tables.get("state")
    if state is None or not len(state) or not all(c in state and state[c].ndim == 1 for c in _ANGLES):
        return
    time = state.time
    chosen = geometry or geometry_of(recording)
    SceneWriter(log, chosen, float(time[-1] - time[0])).write(recording.tables)


def _scene_schema() -> bytes:
    from foxglove_schemas_protobuf import SceneUpdate_pb2

    return schemas.descriptor_set(SceneUpdate_pb2.DESCRIPTOR)


def _entity(name: str, frame: str, at: int, *, locked: bool = True) -> Any:
    from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity

    entity = SceneEntity(id=name, frame_id=frame, frame_locked=locked)
    entity.timestamp.seconds, entity.timestamp.nanos = divmod(at, 1_000_000_000)
    return entity


def _add_line(entity: Any, line: bytes) -> None:
    entity.lines.add().MergeFromString(line)


def _load(x: float, size: float, z: float) -> Any:
    from foxglove_schemas_protobuf.Color_pb2 import Color
    from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive

    sphere = SpherePrimitive(color=Color(r=0.85, g=0.55, b=0.2, a=1.0))
    sphere.pose.position.x, sphere.pose.position.z = x, z
    sphere.pose.orientation.w = 1.0
    sphere.size.x = sphere.size.y = sphere.size.z = 2 * size
    return sphere
