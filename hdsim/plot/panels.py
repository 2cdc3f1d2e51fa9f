"""The panels of a run's page: each looks for its channels and says whether there is anything to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hdsim.plot import style, units
from hdsim.plot.curves import Curve, curve, is_nothing, thinned
from hdsim.plot.origin import drive_of
from hdsim.plot.units import Unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hdsim.recording import Recording


@dataclass(frozen=True)
class Panel:
    """One set of axes: its title and how it is drawn."""

    title: str
    draw: Callable[[Axes], None]


def signed_ratio(recording: Recording) -> float | None:
    """Signed ratio motor angle / output angle, from the scenario in the metadata; None without one."""
    drive = drive_of(recording)
    if drive is None:
        return None
    try:
        teeth = drive["geometry"]
        flexspline, circular = float(teeth["flexspline_teeth"]), float(teeth["circular_spline_teeth"])
        fixed = drive["arrangement"]
    except (KeyError, TypeError, ValueError):
        return None
    difference = circular - flexspline
    return -flexspline / difference if fixed == "circular_spline_fixed" else circular / difference


def time_panels(recording: Recording) -> list[Panel]:
    """Everything over time, most important first."""
    ratio = signed_ratio(recording)
    found = [
        _output_angle(recording),
        _torques(recording, ratio),
        _speed(recording, ratio),
        _temperature(recording),
        _tracking_error(recording),
        _transmission_error(recording),
        _friction(recording),
    ]
    return [panel for panel in found if panel is not None]


def _lines(
    recording: Recording,
    title: str,
    curves: list[Curve],
    unit: Unit,
    *,
    zero: bool = False,
    legend: bool = False,
) -> Panel | None:
    """A panel of curves over time, or None when there is none."""
    if not curves:
        return None

    def draw(axes: Axes) -> None:
        clock = units.for_duration(float(recording.time[-1]))
        for one in curves:
            time, (values,) = thinned(recording.time, [one.values])
            axes.plot(
                clock.factor * time,
                unit.factor * values,
                color=one.colour,
                linewidth=one.width,
                linestyle="--" if one.dashed else "-",
                label=one.label,
                zorder=3 if one.dashed else 2,
            )
        if zero:
            axes.axhline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
        axes.set_ylabel(unit.name)
        axes.margins(x=0.0, y=0.08)
        if legend or len(curves) > 1:
            above_plot_legend(axes, len(curves))

    return Panel(title, draw)


def above_plot_legend(axes: Axes, columns: int) -> None:
    """A legend in one line on the right above the axes, where it hides no data."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns)


def _output_angle(recording: Recording) -> Panel | None:
    curves = curve(recording, "output_angle", "reached", style.BLUE)
    curves += curve(recording, "reference_angle", "commanded", style.ORANGE, dashed=True)
    unit = units.for_angle(units.largest(*(c.values for c in curves)))
    locked = "motor_angle" in recording and is_nothing(recording["motor_angle"])
    return _lines(recording, "Output angle (motor at rest)" if locked else "Output angle", curves, unit)


def _speed(recording: Recording, ratio: float | None) -> Panel | None:
    motor = curve(recording, "motor_velocity", "motor", style.BLUE, width=0.8)
    if ratio is None or not motor:
        return _lines(recording, "Motor speed", motor, units.RPM)
    output = curve(recording, "output_velocity", f"output x {ratio:g}", style.ORANGE, ratio, width=1.8)
    return _lines(recording, "Speed", output + motor, units.RPM)


def _torques(recording: Recording, ratio: float | None) -> Panel | None:
    curves = curve(recording, "output_torque", "drive on output", style.BLUE, width=1.8)
    curves += curve(recording, "load_torque", "load", style.ORANGE)
    if ratio is not None:
        curves += curve(recording, "motor_torque", f"motor x {ratio:g}", style.BLACK, ratio, width=0.7)
    unit = units.for_torque(units.largest(*(c.values for c in curves)))
    return _lines(recording, "Torque", curves, unit, zero=True, legend=True)


def _tracking_error(recording: Recording) -> Panel | None:
    curves = curve(recording, "tracking_error", "output less commanded angle", style.BLUE)
    unit = units.for_error(units.largest(*(c.values for c in curves)))
    return _lines(recording, "Tracking error (output less commanded)", curves, unit, zero=True)


def _transmission_error(recording: Recording) -> Panel | None:
    if "motor_angle" in recording and is_nothing(recording["motor_angle"]):
        return None  # The output angle is the same curve.
    curves = curve(recording, "transmission_error", "total", style.BLUE)
    if curves:
        curves += curve(recording, "kinematic_error", "kinematic error", style.ORANGE, width=0.9)
    unit = units.for_error(units.largest(*(c.values for c in curves)))
    return _lines(recording, "Transmission error", curves, unit, zero=True)


def _friction(recording: Recording) -> Panel | None:
    curves = curve(recording, "input_friction_torque", "on the motor shaft", style.BLUE)
    unit = units.for_torque(units.largest(*(c.values for c in curves)))
    return _lines(recording, "Friction torque on the motor shaft", curves, unit)


def _temperature(recording: Recording) -> Panel | None:
    return _lines(
        recording,
        "Temperature of the drive",
        curve(recording, "temperature", "drive", style.ORANGE),
        units.CELSIUS,
    )


def torsion_panel(recording: Recording) -> Panel | None:
    """Torque over wind-up: the loop whose slope is the stiffness and whose area is the hysteresis loss.

    The wind-up is motor angle / ratio + kinematic error - output angle.
    """
    if any(name not in recording for name in ("output_torque", "transmission_error")):
        return None
    torque = recording["output_torque"]
    wind_up = -recording["transmission_error"]
    if "kinematic_error" in recording:
        wind_up = wind_up + recording["kinematic_error"]
    if is_nothing(torque) or is_nothing(wind_up):
        return None

    def draw(axes: Axes) -> None:
        angle, moment = units.for_error(units.largest(wind_up)), units.for_torque(units.largest(torque))
        _, (x, y) = thinned(recording.time, [wind_up, torque], 20 * 1000)
        axes.plot(angle.factor * x, moment.factor * y, color=style.BLUE, linewidth=0.8)
        axes.axhline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
        axes.axvline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
        axes.set_xlabel(f"wind-up of the drive ({angle.name})")
        axes.set_ylabel(moment.name)

    return Panel("Torque of the drive over its wind-up", draw)
