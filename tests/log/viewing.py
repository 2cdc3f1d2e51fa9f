"""A scene as a viewer shows it: the latest message of every topic up to an instant, in frames that turn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader

from hdsim.log import panels, scene

KINDS = {
    panels.SCENE_STATIC: SceneUpdate,
    panels.SCENE: SceneUpdate,
    scene.TRANSFORM_TOPIC: FrameTransforms,
}


def messages(path: Path, topic: str) -> list[tuple[int, Any]]:
    """Log times and messages of a topic of the scene."""
    with open(path, "rb") as file:
        return [
            (m.log_time, KINDS[topic].FromString(m.data))
            for _, _, m in make_reader(file).iter_messages([topic])
        ]


def turned(transform: Any) -> float:
    """Angle of a transform about the axis."""
    return 2 * math.atan2(transform.rotation.z, transform.rotation.w)


def views(path: Path) -> Iterator[tuple[int, dict[str, Any], dict[str, float]]]:
    """At each transform: its time, the entities that are drawn then, the angle of each frame."""
    updates = [*messages(path, panels.SCENE_STATIC), *messages(path, panels.SCENE)]
    updates.sort(key=lambda update: update[0])
    shown: dict[str, Any] = {}
    frames = {"world": 0.0}
    for at, message in messages(path, scene.TRANSFORM_TOPIC):
        while updates and updates[0][0] <= at:
            shown |= {entity.id: entity for entity in updates.pop(0)[1].entities}
        frames |= {t.child_frame_id: turned(t) for t in message.transforms}
        yield at, dict(shown), dict(frames)


def points_of(entity: Any) -> np.ndarray:
    """Points (n, 2) of an entity's lines and bodies, in its frame."""
    parts = [*entity.lines, *entity.triangles]
    return np.array([[p.x, p.y] for part in parts for p in part.points])


def major_axis(points: np.ndarray) -> float:
    """Angle of the longest diameter of points on an ellipse, modulo half a turn: by their second order."""
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1])
    columns = [np.ones_like(angle), np.cos(2 * angle), np.sin(2 * angle)]
    _, c, s = np.linalg.lstsq(np.stack(columns, axis=1), radius, rcond=None)[0]
    return 0.5 * math.atan2(s, c)


def apart(a: float, b: float, period: float) -> float:
    """How far two angles are apart, modulo a period."""
    return abs(math.remainder(a - b, period))
