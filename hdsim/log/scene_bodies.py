"""The bodies of a scene, drawn once, each in a frame of its own, and the legend."""

from __future__ import annotations

from typing import Any

import numpy as np

from hdsim.log import shapes
from hdsim.log.scene_geometry import SceneGeometry

WORLD = "world"
_STEEL: shapes.Rgba = (0.45, 0.48, 0.53, 1.0)
_BLUE: shapes.Rgba = (0.20, 0.33, 0.50, 1.0)
_BRASS: shapes.Rgba = (0.62, 0.52, 0.25, 1.0)
_WHITE: shapes.Rgba = (1.0, 1.0, 1.0, 1.0)
GREY: shapes.Rgba = (0.62, 0.64, 0.67, 1.0)
_RED: shapes.Rgba = (1.0, 0.25, 0.2, 1.0)


def static_entities(g: SceneGeometry, at: int, *, with_error: bool) -> list[Any]:
    """The bodies, each in its own frame, and the legend.

    Args:
        g: the drive.
        at: log time in ns.
        with_error: whether there is an error to point at.
    """
    r, h = g.pitch_radius_m, g.tooth_height
    around = np.linspace(0.0, 2 * np.pi, 181)[:-1]
    spline = new_entity("circular spline", "circular_spline", at)
    inner = shapes.toothed(r, h, g.circular_spline_teeth)
    outer = shapes.polar(1.25 * r, np.arctan2(inner[:, 1], inner[:, 0]))
    spline.triangles.append(shapes.prism(outer, inner, -0.10 * r, 0.10 * r, _STEEL))
    mark = shapes.polar(np.array([1.12, 1.25]) * r, np.zeros(2), 0.12 * r)
    _add_line(spline, shapes.segments(mark, _WHITE, 3.0))

    generator = new_entity("wave generator", "wave_generator", at)
    ellipse = shapes.polar(g.radius(around) - 1.6 * h, around)
    generator.triangles.append(shapes.prism(ellipse, 0.25 * ellipse, -0.08 * r, 0.08 * r, _BLUE))
    band = shapes.polar(g.radius(around) - h, around)
    generator.triangles.append(shapes.prism(band, ellipse, -0.10 * r, 0.11 * r, _BRASS))
    axis = shapes.polar(g.radius(np.array([0.0, np.pi])) - 2 * h, np.array([0.0, np.pi]), 0.12 * r)
    _add_line(generator, shapes.segments(axis, _WHITE, 3.0))

    output = new_entity("output", "output", at)
    disc = shapes.polar(0.85 * r, around)
    output.triangles.append(shapes.prism(disc, None, -0.40 * r, -0.30 * r, GREY))
    arm = np.array([[0.0, -0.06], [1.75, -0.06], [1.75, 0.06], [0.0, 0.06]]) * r
    output.triangles.append(shapes.prism(arm - arm.mean(axis=0), None, -0.50 * r, -0.40 * r, GREY))
    output.triangles[-1].pose.position.x = float(arm[:, 0].mean())
    output.spheres.append(_load(1.75 * r, 0.12 * r, -0.45 * r))
    nominal = shapes.polar(np.array([1.28, 1.6]) * r, np.zeros(2), 0.12 * r)
    _add_line(output, shapes.segments(nominal, _WHITE, 3.0))

    legend = new_entity("legend", WORLD, at)
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
        pointer = new_entity("error pointer", "error_pointer", at)
        needle = shapes.polar(np.array([1.28, 1.7]) * r, np.zeros(2), 0.14 * r)
        _add_line(pointer, shapes.segments(needle, _RED, 5.0))
        entities.append(pointer)
    return entities


def new_entity(name: str, frame: str, at: int, *, locked: bool = True) -> Any:
    """An empty entity of a frame at a log time (ns)."""
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
