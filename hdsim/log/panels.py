"""Panels of viewers of the Foxglove family, and how they share the screen: what layouts are made of."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

EVENTS = "/hd/events"
SCENE = "/hd/scene"
SCENE_STATIC = "/hd/scene_static"

_LEGEND_MARGIN_PX, _LETTER_PX = 62, 8.5
"""Width of a legend: what stands beside a label, and a letter of it."""
_DASHED = "#9aa4b2"
_SHORTER = {"input_friction": "friction"}


@dataclass(frozen=True)
class Panel:
    """A panel: its type and title, its settings, the message paths that it draws, and those it is there for.

    Without any of the latter it is left out, whatever else there is to draw.
    """

    kind: str
    title: str
    settings: Mapping[str, Any]
    paths: tuple[str, ...] = ()
    point: tuple[str, ...] = ()

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
    x_label: str = "time [s]",
    dots: bool = False,
    legend: bool = True,
    styles: Sequence[Mapping[str, Any]] = (),
    dashed: Mapping[str, float] | None = None,
    low: float | None = None,
    high: float | None = None,
) -> Panel:
    """Values over time; with ``over``, arrays over another of the message, or over ``index``.

    Viewers draw the first line over the second, and so on.

    Args:
        title: what is plotted, with its unit in square brackets at the end, which labels the axis.
        paths: what to plot.
        over: the array that it is plotted over.
        x_label: of the axis below.
        dots: points instead of lines.
        legend: whether to show one, if there is more than one line.
        styles: color and lineSize of each line.
        dashed: level lines, by their names.
        low: lower end of the axis; else as the data ask.
        high: upper end.
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
    for label, level in (dashed or {}).items():
        lines.append(
            {
                "value": f"{level:.6g}",
                "enabled": True,
                "timestampMethod": "receiveTime",
                "label": label,
                "color": _DASHED,
            }
        )
    settings: dict[str, Any] = {
        "paths": lines,
        "showLegend": True,
        "legendDisplay": "left" if legend and len(lines) > 1 else "none",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "xAxisLabel": x_label,
        "yAxisLabel": title[title.rindex("[") :] if title.endswith("]") else "",
        "isSynced": over is None,
        "xAxisVal": "timestamp" if over is None else "index" if over == "index" else "currentCustom",
        "sidebarDimension": round(_LEGEND_MARGIN_PX + _LETTER_PX * max(len(line["label"]) for line in lines)),
    }
    settings |= {k: v for k, v in (("minYValue", low), ("maxYValue", high)) if v is not None}
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
    short = [name.rpartition("_")[0] if len(paths) > 1 and len(last) == 1 else name for name in names]
    return [_SHORTER.get(name, name) for name in short]


def scene(title: str = "Drive") -> Panel:
    """The three-dimensional scene, seen along the axis."""
    return _three_d(title, "world", 3.8, (0.0, 0.0), 0.0)


def mesh(title: str = "Mesh, seen from the wave generator") -> Panel:
    """One end of the major axis, from near, as the wave generator sees it: the teeth roll through."""
    return _three_d(title, "wave_generator", 0.62, (0.93, 0.0), 90.0)


def _three_d(title: str, frame: str, height: float, middle: tuple[float, float], turned_deg: float) -> Panel:
    """A view along the axis; lengths are in pitch radii until `in_metres`."""
    settings = {
        "cameraState": {
            "perspective": False,
            "phi": 0,
            "thetaOffset": turned_deg,
            "targetOffset": [*middle, 0],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "distance": height,
            "fovy": 45,
            "near": 0.001,
            "far": 10,
        },
        "followMode": "follow-pose" if frame != "world" else "follow-none",
        "followTf": frame,
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


def in_metres(settings: Mapping[str, Any], radius: float) -> dict[str, Any]:
    """Settings of a scene for a drive of a pitch radius in m."""
    camera = dict(settings["cameraState"])
    camera["distance"] = camera["distance"] * radius
    camera["targetOffset"] = [x * radius for x in camera["targetOffset"]]
    return {**settings, "cameraState": camera}


def gauge(title: str, path: str, low: float, high: float) -> Panel:
    """One number as a needle, in colours that praise and blame nothing."""
    settings = {
        "path": path,
        "minValue": low,
        "maxValue": high,
        "colorMap": "turbo",
        "colorMode": "gradient",
        "gradient": ["#2b4a78", "#7fb2e6"],
        "reverse": False,
    }
    return Panel("Gauge", title, settings, (path,))


def words(title: str, text: str, path: str) -> Panel:
    """A few words; a field of the log is named because viewers ask for one."""
    settings = {
        "path": path,
        "style": "background",
        "fallbackColor": "#2b4a78",
        "fallbackLabel": text,
        "rules": [],
    }
    return Panel("Indicator", title, settings, (path,))


def transitions(title: str, *paths: str) -> Panel:
    """What texts change to, and when."""
    lines = [
        {"value": path, "label": path.rpartition(".")[2], "timestampMethod": "receiveTime"} for path in paths
    ]
    return Panel("StateTransitions", title, {"isSynced": True, "paths": lines, "showPoints": False}, paths)


def parameters(title: str = "Parameters") -> Panel:
    """What can be set while a run is watched live."""
    return Panel("Parameters", title, {})


def events(title: str = "Events") -> Panel:
    """The events as they come."""
    settings = {"searchTerms": [], "minLogLevel": 1, "topicToRender": EVENTS, "nameFilter": {}}
    return Panel("RosOut", title, settings, (EVENTS,))
