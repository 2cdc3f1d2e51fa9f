"""Panels of viewers of the Foxglove family, and how they share the screen: what layouts are made of."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

EVENTS = "/hd/events"
SCENE = "/hd/scene"
SCENE_STATIC = "/hd/scene_static"

_LEGEND_MARGIN_PX, _LETTER_PX = 80, 10
"""Width of a legend: more than its text takes, because the viewer narrows it in favour of the plot."""


@dataclass(frozen=True)
class Panel:
    """A panel: its type and title, its settings, and the message paths that it draws."""

    kind: str
    title: str
    settings: Mapping[str, Any]
    paths: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Name in the layout."""
        return f"{self.kind}!{re.sub('[^a-z0-9]+', '_', self.title.split('[')[0].lower()).strip('_')}"


@dataclass(frozen=True)
class Split:
    """Parts side by side (``row``) or over each other (``column``), with their shares of the room."""

    direction: str
    parts: tuple[tuple[float, Panel | Split], ...]


def row(*parts: tuple[float, Panel | Split]) -> Split:
    """Parts side by side."""
    return Split("row", parts)


def column(*parts: tuple[float, Panel | Split]) -> Split:
    """Parts over each other."""
    return Split("column", parts)


def plot(
    title: str,
    *paths: str,
    over: str | None = None,
    dots: bool = False,
    legend: bool = True,
    styles: Sequence[Mapping[str, Any]] = (),
) -> Panel:
    """Values over time; with ``over``, arrays over another of the message, or over ``index``.

    Viewers draw the first line over the second, and so on; ``styles`` are color and lineSize of each.
    """
    labels = _labels(paths)
    lines = [
        {
            "value": path,
            "enabled": True,
            "timestampMethod": "receiveTime",
            "label": label,
            "showLine": not dots,
            **style,
        }
        for path, label, style in zip(paths, labels, styles or [{}] * len(paths), strict=True)
    ]
    settings: dict[str, Any] = {
        "paths": lines,
        "showLegend": True,
        "legendDisplay": "left" if legend and len(paths) > 1 else "none",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": over is None,
        "xAxisVal": "timestamp" if over is None else "index" if over == "index" else "currentCustom",
        "sidebarDimension": _LEGEND_MARGIN_PX + _LETTER_PX * max(map(len, labels)),
    }
    drawn = paths
    if over not in (None, "index"):
        settings["xAxisPath"] = {"value": over, "enabled": True}
        drawn = (*paths, str(over))
    return Panel("Plot", title, settings, drawn)


def _labels(paths: tuple[str, ...]) -> list[str]:
    """What tells the lines of a plot from each other: topics, indexes, or what their fields don't share."""
    split = [path.partition(".")[::2] for path in paths]
    names = [re.sub(r"(_arcsec|_um)?(\[:\])?$", "", field) for _, field in split]
    if len(paths) > 1 and len(set(names)) == 1:
        return [topic.removeprefix("/hd/").removesuffix("_view") for topic, _ in split]
    found = [name.partition("[") for name in names]
    if all(index for *_, index in found):
        return [f"no. {index.removesuffix(']')}" for *_, index in found]
    # The title names the quantity: of motor_torque and load_torque motor and load are left.
    last = {name.rpartition("_")[2] for name in names}
    return [name.rpartition("_")[0] if len(paths) > 1 and len(last) == 1 else name for name in names]


def scene(title: str = "Drive") -> Panel:
    """The three-dimensional scene, seen along the axis."""
    settings = {
        "cameraState": {
            "perspective": False,
            "phi": 0,
            "thetaOffset": 0,
            "targetOffset": [0, 0, 0],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.001,
            "far": 10,
        },
        "followMode": "follow-none",
        "followTf": "world",
        "scene": {
            "backgroundColor": "#111318",
            "transforms": {"axisScale": 0, "showLabel": False, "visible": False},
        },
        "transforms": {},
        "topics": {SCENE: {"visible": True}, SCENE_STATIC: {"visible": True}},
        "layers": {},
        "publish": {},
        "imageMode": {},
    }
    return Panel("3D", title, settings, (SCENE, SCENE_STATIC))


def gauge(title: str, path: str, low: float, high: float) -> Panel:
    """One number as a needle."""
    settings = {
        "path": path,
        "minValue": low,
        "maxValue": high,
        "colorMap": "red-yellow-green",
        "colorMode": "colormap",
        "gradient": ["#0000ff", "#ff00ff"],
        "reverse": False,
    }
    return Panel("Gauge", title, settings, (path,))


def lamp(title: str, path: str, below: float, text: str, otherwise: str) -> Panel:
    """A field that turns red with ``text`` while a number is below a limit."""
    settings = {
        "path": path,
        "style": "background",
        "fallbackColor": "#339933",
        "fallbackLabel": otherwise,
        "rules": [{"operator": "<", "rawValue": str(below), "color": "#ee2222", "label": text}],
    }
    return Panel("Indicator", title, settings, (path,))


def events(title: str = "Events") -> Panel:
    """The events as they come."""
    settings = {"searchTerms": [], "minLogLevel": 1, "topicToRender": EVENTS, "nameFilter": {}}
    return Panel("RosOut", title, settings, (EVENTS,))
