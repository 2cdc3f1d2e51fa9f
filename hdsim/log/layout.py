"""Layouts for viewers of the Foxglove family: which panels show what, as JSON that they import.

    python -m hdsim.log.layout FOLDER      writes all of them

The format is the layout export of Foxglove and Lichtblick: panels by id, a tree of splits, a playback speed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from hdsim.errors import InputError
from hdsim.log.facts import Facts, playback_speed
from hdsim.log.layout_trees import FIRST, NEEDED, NOT_ATTACHED
from hdsim.log.layout_trees import LAYOUTS as LAYOUTS
from hdsim.log.panels import Panel, Split, in_metres

Topics = Mapping[str, Collection[str]]
"""Fields of every topic of a log, by topic."""


def split_path(path: str) -> tuple[str, str]:
    """Topic and field of a message path: ``/hd/teeth.angle[:]`` is ``/hd/teeth`` and ``angle``."""
    topic, _, rest = path.partition(".")
    return topic, rest.partition("[")[0]


def build_layout(
    name: str,
    *,
    topics: Topics | None = None,
    duration: float | None = None,
    drive_radius: float = 0.025,
    facts: Facts | None = None,
) -> dict[str, Any]:
    """A layout as the viewer imports it.

    Args:
        name: one of `LAYOUTS`.
        topics: what a log has; lines and panels that it cannot fill are left out. None keeps all.
        duration: length of the run in s, for the playback speed.
        drive_radius: pitch radius in m, for the distance of the camera.
        facts: what else the layout is fitted to.

    Raises:
        InputError: an unknown name, or a log that has nothing to show in this layout.
    """
    try:
        tree: Panel | Split | None = LAYOUTS[name](facts or Facts())
    except KeyError:
        raise InputError(f"no layout {name!r}; there are: {', '.join(LAYOUTS)}") from None
    if topics is not None:
        if "/hd/state_view" not in topics and "/hd/measured_view" in topics:
            tree = _of_measured(tree)
        needed = NEEDED.get(name, ())
        fits = not needed or any(_has(path, topics) for path in needed)
        tree = _prune(tree, topics) if fits else None
    if tree is None or all(panel.kind in ("RosOut", "Parameters") for panel in _panels(tree)):
        raise InputError(f"the log has no topic that layout {name!r} shows")
    facts = facts or Facts()
    turning = any(panel.kind == "3D" for panel in _panels(tree))
    speed = playback_speed(duration or 0.0, facts.motor_speed_rad_per_s if turning else 0.0)
    return {
        "configById": {p.id: _settings(p, drive_radius) for p in _panels(tree)},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": speed},
        "layout": _nest(tree),
    }


def layouts_of_log(
    topics: Topics, duration: float, drive_radius: float = 0.025, facts: Facts | None = None
) -> dict[str, str]:
    """Layouts that have something to show in a log, by file name, as JSON; what it was for comes first."""
    found = {}
    for name in (*FIRST, *(name for name in LAYOUTS if name not in (*FIRST, *NOT_ATTACHED))):
        try:
            layout = build_layout(
                name, topics=topics, duration=duration, drive_radius=drive_radius, facts=facts
            )
        except InputError:
            continue
        found[f"layout-{name}.json"] = to_json(layout)
    return found


def to_json(layout: Mapping[str, Any]) -> str:
    """A layout as text."""
    return json.dumps(layout, indent=1, allow_nan=False) + "\n"


def _settings(panel: Panel, drive_radius: float) -> dict[str, Any]:
    settings = in_metres(panel.settings, drive_radius) if panel.kind == "3D" else dict(panel.settings)
    return {**settings, "foxglovePanelTitle": panel.title, "lichtblickPanelTitle": panel.title}


def _panels(tree: Panel | Split) -> Iterable[Panel]:
    if isinstance(tree, Panel):
        yield tree
    else:
        for _, part in tree.parts:
            yield from _panels(part)


def _nest(tree: Panel | Split) -> Any:
    """The viewer splits in two only: the first part against all the others."""
    if isinstance(tree, Panel):
        return tree.id
    (share, first), *rest = tree.parts
    if not rest:
        return _nest(first)
    total = share + sum(s for s, _ in rest)
    return {
        "first": _nest(first),
        "second": _nest(Split(tree.direction, tuple(rest))),
        "direction": tree.direction,
        "splitPercentage": round(100 * share / total, 1),
    }


def _has(path: str, topics: Topics) -> bool:
    topic, field = split_path(path)
    return topic in topics and (not field or field in topics[topic])


def _of_measured(tree: Panel | Split | None) -> Panel | Split | None:
    """The same panels on a measured run, for a log that has no simulated one."""
    if isinstance(tree, Split):
        parts = ((share, _of_measured(part)) for share, part in tree.parts)
        return Split(tree.direction, tuple((share, part) for share, part in parts if part is not None))
    if tree is None:
        return None

    def moved(text: str) -> str:
        return text.replace("/hd/state_", "/hd/measured_")

    settings = json.loads(moved(json.dumps(tree.settings)))
    return replace(
        tree, settings=settings, paths=tuple(map(moved, tree.paths)), point=tuple(map(moved, tree.point))
    )


def _prune(tree: Panel | Split | None, topics: Topics) -> Panel | Split | None:
    if isinstance(tree, Split):
        kept = [(share, _prune(part, topics)) for share, part in tree.parts]
        parts = tuple((share, part) for share, part in kept if part is not None)
        return Split(tree.direction, parts) if parts else None
    if tree is None or not tree.paths:
        return tree
    present = tuple(path for path in tree.paths if _has(path, topics))
    if not present or (tree.point and not any(_has(path, topics) for path in tree.point)):
        return None
    settings = dict(tree.settings)
    if tree.kind == "3D":
        settings["topics"] = {topic: settings["topics"][topic] for topic in present}
    elif tree.kind in ("Plot", "StateTransitions"):
        lines = [line for line in settings["paths"] if not line["value"].startswith("/")]
        shown = [line for line in settings["paths"] if _has(line["value"], topics)]
        x_path = settings.get("xAxisPath")
        if not shown or (x_path and not _has(x_path["value"], topics)):
            return None
        settings["paths"] = shown + lines
        if len(shown + lines) == 1:
            settings["legendDisplay"] = "none"
    return replace(tree, settings=settings, paths=present)


def main(folder: str) -> None:
    """Write every layout to ``folder``."""
    for name in LAYOUTS:
        Path(folder, f"{name}.json").write_text(to_json(build_layout(name)), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
