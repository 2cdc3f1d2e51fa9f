"""What each layout shows, and where: trees of panels for all that a log may hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hdsim.log.facts import Facts
from hdsim.log.panels import (
    Panel,
    Split,
    column,
    events,
    gauge,
    mesh,
    parameters,
    plot,
    row,
    scene,
    transitions,
    words,
)
from hdsim.log.scene_geometry import rounded_up

STATE = "/hd/state_view"
TEETH = "/hd/teeth"
MEASURED = "/hd/measured_view"
AFTER = "/hd/after_view"
LOOP = "/hd/state_loop"
STATIC = "/hd/static_view"
STATES = "/hd/states"
ORDERS = "/hd/orders"
OVER_ANGLE = "/hd/over_angle"

_NOW_STYLE = {"color": "#ff3b30", "lineSize": 2.0}
_CURVE_STYLE = {"color": "#4e98e2", "lineSize": 0.8}
_STAGE_STYLES: dict[str, dict[str, Any]] = {
    "after": {"color": "#2fbf71"},
    "refit": {"color": "#b07be0", "lineSize": 0.8},
    "before": {"color": "#f5774d"},
    "measured": {"color": "#7fa8d8"},
}
_SEEN_SHARE = 0.4
"""Share of a limit that a run has to reach for the limit to be drawn."""


def _motion() -> Panel:
    return plot("Output angle [rad]", f"{STATE}.output_angle", f"{STATE}.reference_angle")


def _speed() -> Panel:
    return plot("Motor speed [rad/s]", f"{STATE}.motor_velocity")


def _errors() -> Panel:
    return plot("Error [arcsec]", f"{STATE}.tracking_error_arcsec", f"{STATE}.transmission_error_arcsec")


def _limited(
    title: str, paths: tuple[str, ...], name: str, limit: float, lowest: float, highest: float
) -> Panel:
    """Torques, and a limit in sight where the run comes near it."""
    dashed, low, high = {}, None, None
    if limit > 0 and highest >= _SEEN_SHARE * limit:
        dashed[name], high = limit, max(1.1 * limit, 1.05 * highest)
    if limit > 0 and lowest <= -_SEEN_SHARE * limit:
        dashed[f"-{name}"], low = -limit, min(-1.1 * limit, 1.05 * lowest)
    return plot(title, *paths, dashed=dashed, low=low, high=high)


def _torques(facts: Facts) -> Panel:
    paths = (f"{STATE}.output_torque", f"{STATE}.load_torque")
    ends = facts.lowest_output_torque_nm, facts.highest_output_torque_nm
    return _limited("Torque at the output [N m]", paths, "rated", facts.rated_torque_nm, *ends)


def _motor_torques(facts: Facts) -> Panel:
    paths = (f"{STATE}.motor_torque", f"{STATE}.input_friction_torque")
    ends = facts.lowest_motor_torque_nm, facts.highest_motor_torque_nm
    return _limited("Motor torque [N m]", paths, "limit", facts.torque_limit_nm, *ends)


def _profile(facts: Facts) -> Panel:
    end = rounded_up(facts.largest_force_n) if facts.largest_force_n > 0 else None
    return plot(
        "Tooth forces now [N]",
        f"{TEETH}.normal_force[:]",
        over=f"{TEETH}.angle[:]",
        x_label="angle from the major axis [rad]",
        dots=True,
        # An axis that keeps still while the forces come and go.
        low=None if end is None else -end if facts.lowest_force_n < 0 else -0.05 * end,
        high=None if end is None else end if facts.highest_force_n > 0 else 0.05 * end,
    )


def _loop() -> Panel:
    return plot(
        "Torque over twist, red: now [N m]",
        f"{LOOP}.output_torque_now[:]",
        f"{LOOP}.output_torque[:]",
        over=f"{LOOP}.twist_arcsec[:]",
        x_label="twist [arcsec]",
        legend=False,
        styles=(_NOW_STYLE, _CURVE_STYLE),
    )


def _spectrum() -> Panel:
    return plot(
        "Orders of the transmission error [arcsec]",
        f"{ORDERS}.transmission_error_arcsec[:]",
        over=f"{ORDERS}.order[:]",
        x_label="order per turn of the wave generator",
    )


def _over_angle() -> Panel:
    return plot(
        "Transmission error over the angle [arcsec]",
        f"{OVER_ANGLE}.transmission_error_arcsec[:]",
        over=f"{OVER_ANGLE}.output_angle_deg[:]",
        x_label="output angle [deg]",
    )


def _states() -> Panel:
    return transitions("Flank and limits", *(f"{STATES}.{field}" for field in ("flank", "torque", "motor")))


def overview(facts: Facts) -> Split:
    """The drive turning, where it should be, how far off it is, and what loads it."""
    return row(
        (37, column((53, scene()), (30, _states()), (17, events()))),
        (31, column((34, mesh()), (33, _motion()), (33, _errors()))),
        (
            32,
            column((24, _speed()), (25, _torques(facts)), (24, _motor_torques(facts)), (27, _loop())),
        ),
    )


def positioning_error(facts: Facts) -> Split:
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
        (
            33,
            column(
                (34, plot("Twist [arcsec]", f"{STATE}.twist_arcsec")), (33, _torques(facts)), (33, _loop())
            ),
        ),
        (32, column((55, scene()), (25, _motion()), (20, _speed()))),
    )


def tooth_contact(facts: Facts) -> Split:
    """Which teeth carry the load."""
    some = [f"{TEETH}.normal_force[{tooth}]" for tooth in (0, 5, 10)]
    gaps = plot(
        "Half-gap of each tooth [um]",
        f"{STATIC}.tooth_half_gap_um[:]",
        over="index",
        x_label="tooth",
        dots=True,
    )
    # The force of one tooth says something where it is sampled often enough to be seen to rise and fall.
    single = ((28, plot("Force of three teeth [N]", *some)),) if facts.teeth_follow_the_mesh else ()
    share = plot("Engaged share [1]", f"{STATE}.engaged_share")
    return row(
        (36, column((58, scene()), (42, mesh()))),
        (
            34,
            column(
                (34, _profile(facts)),
                *single,
                (33, row((70, share), (30, gauge("Now", f"{STATE}.engaged_share", 0, 1)))),
            ),
        ),
        (30, column((30, _states()), (35, gaps), (35, _loop()))),
    )


def orders(facts: Facts) -> Split:
    """A run at one speed: its transmission error over the angle, and the orders in it."""
    return row(
        (
            58,
            column(
                (36, _over_angle()),
                (36, _spectrum()),
                (28, plot("Transmission error [arcsec]", f"{STATE}.transmission_error_arcsec")),
            ),
        ),
        (42, column((54, scene()), (23, _speed()), (23, _motor_torques(facts)))),
    )


def warm_up(facts: Facts) -> Split:
    """A drive that warms up: its temperature, its friction, and what they do to the motor."""
    heat = plot("Heat since the start [J]", f"{STATE}.heat", f"{STATE}.work_supplied")
    return row(
        (
            55,
            column(
                (50, plot("Temperature [degC]", f"{STATE}.temperature", f"{STATE}.ambient_temperature")),
                (50, plot("Friction at the motor [N m]", f"{STATE}.input_friction_torque")),
            ),
        ),
        (
            45,
            column((26, _motor_torques(facts)), (26, _speed()), (26, heat), (22, events())),
        ),
    )


def diagnose(facts: Facts) -> Split:
    """A measured run, and the model before and after an effect was added to it."""

    def stages(title: str, channel: str, *left_out: str) -> Panel:
        # What was measured lies lowest: with its noise it would hide the others.
        shown = [stage for stage in _STAGE_STYLES if stage not in left_out]
        paths = [f"/hd/{stage}_view.{channel}" for stage in shown]
        return plot(title, *paths, styles=[_STAGE_STYLES[stage] for stage in shown])

    def compared(title: str, channel: str) -> Panel:
        # What was measured and not predicted says nothing of the model.
        panel = stages(title, channel)
        return replace(panel, point=tuple(path for path in panel.paths if "/measured_" not in path))

    def left(title: str, channel: str) -> Panel:
        return stages(title, channel, "measured")

    found = ((10, words("Verdict", facts.verdict, f"{MEASURED}.time")),) if facts.verdict else ()
    angle = stages("Output angle [rad]", "output_angle")
    return row(
        (30, column(*found, (48, scene("Measured and modelled")), (20, angle), (22, events()))),
        (
            35,
            column(
                (26, compared("Transmission error [arcsec]", "transmission_error_arcsec")),
                (26, compared("Output torque [N m]", "output_torque")),
                (26, compared("Motor torque [N m]", "motor_torque")),
                (22, stages("Motor speed [rad/s]", "motor_velocity")),
            ),
        ),
        (
            35,
            column(
                (34, left("Measured less model: output angle [arcsec]", "output_angle_error_arcsec")),
                (33, left("Measured less model: output torque [N m]", "output_torque_error")),
                (33, left("Measured less model: motor torque [N m]", "motor_torque_error")),
            ),
        ),
    )


def live(facts: Facts) -> Split:
    """A run while it is simulated, or played to a live viewer: what can be set, and what it does."""
    return row(
        (36, column((50, scene()), (25, parameters()), (25, events()))),
        (32, column((34, mesh()), (33, _motion()), (33, _errors()))),
        (32, column((33, _speed()), (34, _torques(facts)), (33, _motor_torques(facts)))),
    )


LAYOUTS: dict[str, Callable[[Facts], Split]] = {
    "overview": overview,
    "positioning-error": positioning_error,
    "tooth-contact": tooth_contact,
    "orders": orders,
    "warm-up": warm_up,
    "diagnose": diagnose,
    "live": live,
}

#: Fields without which a layout has nothing of its own to show, any of them.
NEEDED = {
    "tooth-contact": (f"{TEETH}.normal_force",),
    "orders": (f"{ORDERS}.order",),
    "warm-up": (f"{STATE}.temperature",),
    "diagnose": (f"{AFTER}.time", "/hd/before_view.time"),
}
#: What a run was for, by what its log holds: these come before the others, the first one first.
FIRST = ("diagnose", "warm-up", "orders")
#: Layouts that no finished log needs.
NOT_ATTACHED = ("live",)
