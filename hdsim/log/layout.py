"""Layouts for viewers of the Foxglove family: which panels show what, as JSON that they import.

    python -m hdsim.log.layout FOLDER      writes all of them

The format is the layout export of Foxglove and Lichtblick: panels by id, a tree of splits, a playback speed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from hdsim.errors import InputError
from hdsim.log.facts import SPEEDS as SPEEDS
from hdsim.log.facts import Facts
from hdsim.log.facts import playback_speed as playback_speed
from hdsim.log.panels import Panel, Split, column, events, gauge, lamp, plot, row, scene

STATE = "/hd/state_view"
TEETH = "/hd/teeth"
MEASURED = "/hd/measured_view"
LOOP = "/hd/state_loop"
STATIC = "/hd/static_view"

Topics = Mapping[str, Collection[str]]
"""Fields of every topic of a log, by topic."""

_NOW_STYLE = {"color": "#ff3b30", "lineSize": 2.0}
_CURVE_STYLE = {"color": "#4e98e2", "lineSize": 0.8}
_AFTER_STYLE, _BEFORE_STYLE, _MEASURED_STYLE = ({"color": c} for c in ("#128a3c", "#f5774d", "#7fa8d8"))
_CAMERA_DISTANCE = 5.0
"""Of the camera from the drive, in pitch radii."""


def _motion() -> Panel:
    return plot("Output angle [rad]", f"{STATE}.output_angle", f"{STATE}.reference_angle")


def _torques() -> Panel:
    return plot("Torque at the output [N m]", f"{STATE}.output_torque", f"{STATE}.load_torque")


def _profile() -> Panel:
    return plot(
        "Tooth force now [N] over angle from the major axis [rad]",
        f"{TEETH}.normal_force[:]",
        over=f"{TEETH}.angle[:]",
        dots=True,
    )


def _loop() -> Panel:
    return plot(
        "Torque [N m] over twist [arcsec], red: now",
        f"{LOOP}.output_torque_now[:]",
        f"{LOOP}.output_torque[:]",
        over=f"{LOOP}.twist_arcsec[:]",
        legend=False,
        styles=(_NOW_STYLE, _CURVE_STYLE),
    )


def _contact_lamp() -> Panel:
    return lamp("Contact", f"{STATE}.engaged_share", 0.005, "IN THE GAP", "IN CONTACT")


def overview() -> Split:
    """The drive turning, where it should be, how far off it is, and what loads it."""
    errors = plot("Error [arcsec]", f"{STATE}.tracking_error_arcsec", f"{STATE}.transmission_error_arcsec")
    small = row((50, gauge("Engaged share", f"{STATE}.engaged_share", 0, 1)), (50, _contact_lamp()))
    return row(
        (40, column((60, scene()), (15, small), (25, events()))),
        (30, column((33, _motion()), (33, errors), (34, _torques()))),
        (
            30,
            column(
                (33, plot("Motor torque [N m]", f"{STATE}.motor_torque", f"{STATE}.input_friction_torque")),
                (33, _profile()),
                (34, _loop()),
            ),
        ),
    )


def positioning_error() -> Split:
    """Where the error of the output comes from."""
    return row(
        (
            35,
            column(
                (34, plot("Transmission error [arcsec]", f"{STATE}.transmission_error_arcsec")),
                (33, plot("Tracking error [arcsec]", f"{STATE}.tracking_error_arcsec")),
                (33, plot("Kinematic error [arcsec]", f"{STATE}.kinematic_error_arcsec")),
            ),
        ),
        (35, column((34, plot("Twist [arcsec]", f"{STATE}.twist_arcsec")), (33, _torques()), (33, _loop()))),
        (30, column((55, scene()), (25, _motion()), (20, events()))),
    )


def tooth_contact() -> Split:
    """Which teeth carry the load."""
    some = [f"{TEETH}.normal_force[{tooth}]" for tooth in (0, 5, 10)]
    return row(
        (45, column((70, scene()), (30, _profile()))),
        (
            55,
            column(
                (30, plot("Force of three teeth over time [N]", *some)),
                (25, plot("Engaged share", f"{STATE}.engaged_share")),
                (
                    25,
                    plot(
                        "Half-gap of each tooth [um]",
                        f"{STATIC}.tooth_half_gap_um[:]",
                        over="index",
                        dots=True,
                    ),
                ),
                (20, row((60, _loop()), (40, _contact_lamp()))),
            ),
        ),
    )


def diagnose() -> Split:
    """A measured run, and the model before and after an effect was added to it."""

    def three(title: str, channel: str) -> Panel:
        # What was measured lies lowest: with its noise it would hide the others.
        paths = [f"/hd/{run}_view.{channel}" for run in ("after", "before", "measured")]
        return plot(title, *paths, styles=(_AFTER_STYLE, _BEFORE_STYLE, _MEASURED_STYLE))

    def left(title: str, channel: str) -> Panel:
        paths = [f"/hd/{run}_view.{channel}" for run in ("after", "before")]
        return plot(title, *paths, styles=(_AFTER_STYLE, _BEFORE_STYLE))

    return row(
        (
            50,
            column(
                (34, three("Transmission error [arcsec]", "transmission_error_arcsec")),
                (33, three("Output torque [N m]", "output_torque")),
                (33, three("Motor torque [N m]", "motor_torque")),
            ),
        ),
        (
            50,
            column(
                (22, left("Measured less model: output angle [arcsec]", "output_angle_error_arcsec")),
                (22, left("Measured less model: output torque [N m]", "output_torque_error")),
                (22, left("Measured less model: motor torque [N m]", "motor_torque_error")),
                (17, three("Output angle [rad]", "output_angle")),
                (17, three("Motor velocity [rad/s]", "motor_velocity")),
                (17, events()),
            ),
        ),
    )


LAYOUTS: dict[str, Callable[[], Split]] = {
    "overview": overview,
    "positioning-error": positioning_error,
    "tooth-contact": tooth_contact,
    "diagnose": diagnose,
}


NEEDED = {"tooth-contact": TEETH}
"""Topics without which a layout has nothing of its own to show."""


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
        tree: Panel | Split | None = LAYOUTS[name]()
    except KeyError:
        raise InputError(f"no layout {name!r}; there are: {', '.join(LAYOUTS)}") from None
    if topics is not None:
        if STATE not in topics and MEASURED in topics:
            tree = _of_measured(tree)
        tree = _prune(tree, topics) if NEEDED.get(name) in (None, *topics) else None
    if tree is None or all(panel.kind == "RosOut" for panel in _panels(tree)):
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
    """All layouts that have something to show in a log, by file name, as JSON."""
    found = {}
    for name in LAYOUTS:
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
    settings = dict(panel.settings)
    if panel.kind == "3D":
        settings["cameraState"] = {**settings["cameraState"], "distance": _CAMERA_DISTANCE * drive_radius}
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
    return Panel(tree.kind, tree.title, settings, tuple(moved(path) for path in tree.paths))


def _prune(tree: Panel | Split | None, topics: Topics) -> Panel | Split | None:
    if isinstance(tree, Split):
        kept = [(share, _prune(part, topics)) for share, part in tree.parts]
        parts = tuple((share, part) for share, part in kept if part is not None)
        return Split(tree.direction, parts) if parts else None
    if tree is None or not tree.paths:
        return tree
    present = [path for path in tree.paths if _has(path, topics)]
    if tree.kind != "Plot":
        return tree if present else None
    lines = [line for line in tree.settings["paths"] if _has(line["value"], topics)]
    x_path = tree.settings.get("xAxisPath")
    if not lines or (x_path and not _has(x_path["value"], topics)):
        return None
    return Panel(tree.kind, tree.title, {**tree.settings, "paths": lines}, tuple(present))


def main(folder: str) -> None:
    """Write every layout to ``folder``."""
    for name in LAYOUTS:
        Path(folder, f"{name}.json").write_text(to_json(build_layout(name)), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
