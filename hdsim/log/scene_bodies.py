"""The bodies of a scene, drawn once, each in a frame of its own, and the legend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdsim.log import scene_teeth, shapes
from hdsim.log.scene_frames import WORLD
from hdsim.log.scene_geometry import SceneGeometry

_STEEL: shapes.Rgba = (0.42, 0.45, 0.50, 1.0)
_BLUE: shapes.Rgba = (0.20, 0.33, 0.50, 1.0)
_BRASS: shapes.Rgba = (0.62, 0.52, 0.25, 1.0)
_WHITE: shapes.Rgba = (1.0, 1.0, 1.0, 1.0)
_GREY: shapes.Rgba = (0.62, 0.64, 0.67, 1.0)
_RED: shapes.Rgba = (1.0, 0.25, 0.2, 1.0)
_GHOST: shapes.Rgba = (0.55, 0.80, 1.0, 0.75)
_TEXT_PX = 13.0


@dataclass(frozen=True)
class Shown:
    """What a run has to show besides the drive.

    Args:
        forces: on its teeth.
        error: of its output, to point at.
        measured: a measured machine beside it.
    """

    forces: bool = True
    error: bool = True
    measured: bool = False


def static_entities(g: SceneGeometry, at: int, shown: Shown) -> list[Any]:
    """The bodies, each in its own frame, and the legend.

    Args:
        g: the drive.
        at: log time in ns.
        shown: what there is besides.
    """
    r, h = g.pitch_radius_m, g.tooth_height
    around = np.linspace(0.0, 2 * np.pi, 181)[:-1]
    spline = new_entity("circular spline", "circular_spline", at)
    inner = scene_teeth.circular_spline_outline(g)
    # Each flank's triangles reach out to the middle of its own tooth, so that none lies over a space.
    sides = np.tile([-1, -1, -1, 1, 1, 1], g.circular_spline_teeth) * (np.pi / g.circular_spline_teeth)
    outer = shapes.polar(1.25 * r, scene_teeth.middles(inner) + sides)
    spline.triangles.append(shapes.prism(outer, inner, -0.10 * r, 0.10 * r, _STEEL))
    mark = shapes.polar(np.array([1.12, 1.25]) * r, np.zeros(2), 0.12 * r)
    _add_line(spline, shapes.segments(mark, _WHITE, 3.0))

    flexspline = new_entity("flexspline", scene_teeth.FRAME, at)
    toothed = scene_teeth.flexspline_outline(g)
    angle = scene_teeth.middles(toothed)
    under = shapes.polar(g.radius(angle) - 0.7 * h, angle)
    flexspline.triangles.append(shapes.prism(toothed, under, -0.10 * r, 0.105 * r, _BRASS))

    generator = new_entity("wave generator", "wave_generator", at)
    ellipse = shapes.polar(g.radius(around) - 1.6 * h, around)
    generator.triangles.append(shapes.prism(ellipse, 0.25 * ellipse, -0.08 * r, 0.08 * r, _BLUE))
    band = shapes.polar(g.radius(around) - 0.6 * h, around)
    generator.triangles.append(shapes.prism(band, ellipse, -0.10 * r, 0.10 * r, _BRASS))
    axis = shapes.polar(g.radius(np.array([0.0, np.pi])) - 2 * h, np.array([0.0, np.pi]), 0.12 * r)
    _add_line(generator, shapes.segments(axis, _WHITE, 3.0))

    output = new_entity("output", "output", at)
    disc = shapes.polar(0.85 * r, around)
    output.triangles.append(shapes.prism(disc, None, -0.40 * r, -0.30 * r, _GREY))
    arm = np.array([[0.0, -0.06], [1.55, -0.06], [1.55, 0.06], [0.0, 0.06]]) * r
    body = shapes.prism(arm - arm.mean(axis=0), None, -0.50 * r, -0.40 * r, _GREY)
    pointing = np.array([math.cos(g.arm_angle_rad), math.sin(g.arm_angle_rad)])
    body.pose.position.x, body.pose.position.y = (float(v) for v in arm[:, 0].mean() * pointing)
    body.pose.orientation.z = math.sin(0.5 * g.arm_angle_rad)
    body.pose.orientation.w = math.cos(0.5 * g.arm_angle_rad)
    output.triangles.append(body)
    output.spheres.append(_load(1.55 * r * pointing, 0.11 * r, -0.45 * r))
    entities = [spline, flexspline, generator, output]
    pointers = [(output, 1.42, _WHITE, 3.0)]
    if shown.error:
        entities.append(new_entity("error pointer", "error_pointer", at))
        pointers.append((entities[-1], 1.5, _RED, 5.0))
    if shown.measured:
        entities.append(new_entity("measured pointer", "measured_pointer", at))
        pointers.append((entities[-1], 1.6, _GHOST, 5.0))
    for entity, end, colour, width in pointers:
        needle = shapes.polar(np.array([1.27, end]) * r, np.full(2, g.arm_angle_rad), 0.14 * r)
        _add_line(entity, shapes.segments(needle, colour, width))
    return [*entities, _legend(g, at, shown)]


def _legend(g: SceneGeometry, at: int, shown: Shown) -> Any:
    r = g.pitch_radius_m
    legend = new_entity("legend", WORLD, at)

    def write(words: str, x: float, y: float) -> None:
        legend.texts.append(shapes.text(words, (x * r, y * r, 0.2 * r), _TEXT_PX))

    words = f"drawn larger: deflection x{g.deflection_factor:g}"
    if shown.error:
        words += f", error of the output x{g.error_factor:g} (red)"
    write(words, 0.0, 1.82)
    if shown.measured:
        write("pale blue: error of the measured machine", 0.0, -1.82)
    if shown.forces:
        steps = np.linspace(0.0, 1.0, 16)
        x = np.repeat(-0.6 + 0.075 * np.arange(16), 2) + np.tile([0.0, 0.075], 16)
        bar = np.column_stack([x, np.full(32, 1.68), np.full(32, 0.2)]) * r
        _add_line(legend, shapes.segments(bar, np.repeat(shapes.force_colours(steps), 2, axis=0), 9.0))
        write("tooth force 0 N", -1.2, 1.68)
        write(f"{g.largest_force_n:g} N", 0.9, 1.68)
    if g.gravity:
        arrow = np.array([[0, 0], [0, -0.45], [0, -0.45], [-0.07, -0.33], [0, -0.45], [0.07, -0.33]])
        points = np.column_stack([arrow + np.array([-1.6, -1.2]), np.full(6, 0.2)]) * r
        _add_line(legend, shapes.segments(points, _WHITE, 3.0))
        write("gravity", -1.6, -1.77)
    return legend


def new_entity(name: str, frame: str, at: int) -> Any:
    """An empty entity at a log time (ns) that turns with its frame."""
    from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity

    entity = SceneEntity(id=name, frame_id=frame, frame_locked=True)
    entity.timestamp.seconds, entity.timestamp.nanos = divmod(at, 1_000_000_000)
    return entity


def _add_line(entity: Any, line: bytes) -> None:
    entity.lines.add().MergeFromString(line)


def _load(at: shapes.Array, size: float, z: float) -> Any:
    from foxglove_schemas_protobuf.Color_pb2 import Color
    from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive

    sphere = SpherePrimitive(color=Color(r=0.85, g=0.55, b=0.2, a=1.0))
    p = sphere.pose.position
    p.x, p.y, p.z = float(at[0]), float(at[1]), z
    sphere.pose.orientation.w = 1.0
    sphere.size.x = sphere.size.y = sphere.size.z = 2 * size
    return sphere
