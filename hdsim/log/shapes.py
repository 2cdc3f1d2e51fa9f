"""Shapes of the three-dimensional scene as Foxglove primitives, from numpy arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.log.rows import DoubleField, varint

Array = NDArray[np.float64]
Rgba = tuple[float, float, float, float]

_LENGTH_DELIMITED = 2
_GRID_M = 2.0**-21
"""Coordinates are rounded to half a micrometre: nobody sees it, and the log is a third of the size."""
_FINE_GRID_M = 2.0**-24
"""Of bodies that are drawn once, whose flanks one looks at from near."""

_FORCE_COLOURS: Array = np.array(
    [
        [0.20, 0.35, 0.85, 1.0],
        [0.10, 0.70, 0.90, 1.0],
        [0.30, 0.85, 0.35, 1.0],
        [0.98, 0.80, 0.15, 1.0],
        [0.90, 0.15, 0.10, 1.0],
    ]
)


def force_colours(share: Array) -> Array:
    """Colours, shape (n, 4), of forces as shares (n,) of the largest: blue, green, yellow, red; 33 steps."""
    at = np.round(np.clip(share, 0.0, 1.0) * 32) / 32 * (len(_FORCE_COLOURS) - 1)
    return np.stack([np.interp(at, np.arange(len(_FORCE_COLOURS)), c) for c in _FORCE_COLOURS.T], axis=-1)


def embed(number: int, content: bytes) -> bytes:
    """A protobuf field that holds a message or text."""
    return varint(number << 3 | _LENGTH_DELIMITED) + varint(len(content)) + content


def repeated_vectors(number: int, vectors: Array) -> bytes:
    """A repeated field whose messages hold doubles in fields 1, 2, ...: points (n, 3), colours (n, 4).

    Laid out by numpy, as the rows of tables are.
    """
    size = vectors.shape[1]
    one = embed(number, bytes(size * 9))
    head = len(one) - size * 9
    out = np.empty((len(vectors), len(one)), np.uint8)
    out[:, :head] = np.frombuffer(one[:head], np.uint8)
    body = out[:, head:].reshape(len(vectors), size, 9)
    body[:, :, 0] = [DoubleField(i + 1, repeated=False).tag[0] for i in range(size)]
    body[:, :, 1:] = np.ascontiguousarray(vectors, "<f8").view(np.uint8).reshape(len(vectors), size, 8)
    return out.tobytes()


def segments(points: Array, colours: Array | Rgba, thickness: float) -> bytes:
    """A serialized LinePrimitive of separate segments.

    Args:
        points: (2 n, 3), in m; each two are the ends of a segment.
        colours: (2 n, 4), or one for all.
        thickness: in pixels.
    """
    from foxglove_schemas_protobuf.Color_pb2 import Color
    from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive

    line = LinePrimitive(type=LinePrimitive.LINE_LIST, thickness=thickness, scale_invariant=True)
    line.pose.orientation.w = 1.0
    data = b""
    if isinstance(colours, tuple):
        line.color.CopyFrom(Color(r=colours[0], g=colours[1], b=colours[2], a=colours[3]))
    else:
        data = repeated_vectors(LinePrimitive.COLORS_FIELD_NUMBER, colours)
    rounded = np.round(points / _GRID_M) * _GRID_M
    data += repeated_vectors(LinePrimitive.POINTS_FIELD_NUMBER, rounded)
    return line.SerializeToString(deterministic=True) + data


def polar(radius: Array | float, angle: Array, z: float = 0.0) -> Array:
    """Points (n, 3) at angles (n,)."""
    radius = np.broadcast_to(np.asarray(radius, np.float64), angle.shape)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full_like(angle, z)], axis=-1)


def prism(outer: Array, inner: Array | None, bottom: float, top: float, colour: Rgba) -> Any:
    """A TriangleListPrimitive: an outline, or the room between two, drawn out along z.

    Args:
        outer: (n, 2 or 3), counter-clockwise, seen from the centre of a star-shaped outline.
        inner: (n, ...) of as many points, or None for a solid.
        bottom: z in m.
        top: z in m.
        colour: of all.
    """
    from foxglove_schemas_protobuf.Color_pb2 import Color
    from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive

    n = len(outer)
    hole = np.zeros((n, 2)) if inner is None else inner[:, :2]
    rings = [
        np.column_stack([ring, np.full(n, z)])
        for ring, z in ((outer[:, :2], top), (hole, top), (outer[:, :2], bottom), (hole, bottom))
    ]
    points = np.round(np.concatenate(rings) / _FINE_GRID_M) * _FINE_GRID_M
    here, there = np.arange(n), (np.arange(n) + 1) % n
    out_top, in_top, out_low, in_low = (k * n for k in range(4))

    def band(a: int, b: int) -> NDArray[np.int64]:
        """Two triangles for each step along two rings."""
        first = np.stack([a + here, a + there, b + here], axis=1)
        second = np.stack([a + there, b + there, b + here], axis=1)
        return np.concatenate([first, second])

    faces = [band(out_top, in_top), band(out_low, out_top), band(in_low, out_low)]
    if inner is not None:
        faces.append(band(in_top, in_low))
    triangles = TriangleListPrimitive(color=Color(r=colour[0], g=colour[1], b=colour[2], a=colour[3]))
    triangles.pose.orientation.w = 1.0
    triangles.indices.extend(np.concatenate(faces).ravel().tolist())
    data = repeated_vectors(TriangleListPrimitive.POINTS_FIELD_NUMBER, points)
    return TriangleListPrimitive.FromString(triangles.SerializeToString(deterministic=True) + data)


def text(content: str, at: Sequence[float], size: float, colour: Rgba = (1.0, 1.0, 1.0, 1.0)) -> Any:
    """A TextPrimitive that faces the viewer; ``size`` in pixels, however near one looks."""
    from foxglove_schemas_protobuf.Color_pb2 import Color
    from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive

    primitive = TextPrimitive(
        billboard=True,
        scale_invariant=True,
        font_size=size,
        color=Color(r=colour[0], g=colour[1], b=colour[2], a=colour[3]),
        text=content,
    )
    p = primitive.pose
    p.position.x, p.position.y, p.position.z = at
    p.orientation.w = 1.0
    return primitive
