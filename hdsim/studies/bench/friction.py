"""Starting and back-driving torque; running torque and efficiency over speed, load and temperature."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.errors import InputError
from hdsim.plot import style
from hdsim.studies.bench._figure import SHADES, page, zero_lines
from hdsim.studies.bench._scenario import bench
from hdsim.studies.metrics.friction import back_driving_torque, operating_points, starting_torque, turning_speed
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario

_SOURCE = "Harmonic Drive AG, engineering data: no-load starting, back-driving and running torque, efficiency"
_RAMP_S, _HOLD_S = 0.15, 0.35


def at_temperature(effects: Mapping[str, Any] | None, temperature_degc: float) -> dict[str, Any]:
    """The effects, with the lubricant held at a temperature; the drive's own friction is that at 20 degC."""
    found = dict(effects or {})
    thermal = dict(found.get("thermal_friction") or {})
    thermal |= {
        "ambient_degc": temperature_degc,
        "initial_degc": temperature_degc,
        "heat_capacity_j_per_k": 1e6,
    }
    found["thermal_friction"] = thermal
    return found


def build_starting(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    seconds: float = 5.0,
) -> Scenario:
    """The motor's torque grows slowly until the unloaded drive turns.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        seconds: length of the ramp, to 2.5 times the drive's Coulomb friction.
    """
    made = Drive.model_validate(dict(drive))
    rate = 2.5 * made.friction.coulomb_nm / seconds
    return bench(
        drive,
        {"type": "torque", "torque": {"type": "ramp", "rate_nm_per_s": rate}},
        {"inertia_kg_m2": 0.01},
        {"duration_s": 0.6 * seconds, "sample_rate_hz": 500.0},
        name="starting torque",
        effects=effects,
        over=run,
    )


def build_back_driving(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    seconds: float = 5.0,
) -> Scenario:
    """The torque on the output grows slowly until the drive with its motor free turns.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        seconds: length of the ramp, to 2.5 times the expected torque.
    """
    made = Drive.model_validate(dict(drive))
    friction = made.friction
    expected = abs(made.ratio) * friction.coulomb_nm / (1.0 - friction.load_coefficient)
    return bench(
        drive,
        {"type": "free"},
        {"inertia_kg_m2": 0.01, "torque": {"type": "ramp", "rate_nm_per_s": 2.5 * expected / seconds}},
        {"duration_s": 0.6 * seconds, "sample_rate_hz": 500.0},
        name="back-driving torque",
        effects=effects,
        over=run,
    )


def _staircase(
    drive: Mapping[str, Any],
    name: str,
    speeds_rpm: Sequence[float],
    loads_nm: Sequence[float],
    effects: Mapping[str, Any],
    run: Mapping[str, Any] | None,
) -> Scenario:
    """At each speed, every load in turn; the motor starts and stops between the speeds."""
    if not speeds_rpm or min(speeds_rpm) <= 0.0:
        raise InputError(f"speeds must be above 0 rpm, found {list(speeds_rpm)}")
    made = Drive.model_validate(dict(drive))
    against = -math.copysign(1.0, made.ratio)
    period = _RAMP_S + len(loads_nm) * (_RAMP_S + _HOLD_S) + _RAMP_S
    motion = [
        {
            "type": "ramp",
            "velocity_rpm": rpm,
            "acceleration_rpm_per_s": rpm / _RAMP_S,
            "duration_s": period,
        }
        for rpm in speeds_rpm
    ]
    torque: list[dict[str, Any]] = [{"type": "hold", "duration_s": _RAMP_S}]
    before = 0.0
    for load in (*loads_nm, 0.0):
        ramp = {"type": "ramp", "rate_nm_per_s": against * (load - before) / _RAMP_S, "duration_s": _RAMP_S}
        torque.append(ramp)
        if len(torque) < 2 * len(loads_nm) + 1:
            torque.append({"type": "hold", "duration_s": _HOLD_S})
        before = load
    return bench(
        drive,
        {"type": "motion", "trajectory": {"type": "sequence", "moves": motion}},
        {"inertia_kg_m2": 0.1, "torque": {"type": "sequence", "moves": torque, "repeat": len(speeds_rpm)}},
        {"duration_s": period * len(speeds_rpm), "sample_rate_hz": 1000.0},
        name=name,
        effects=effects,
        over=run,
    )


def build_running(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    speeds_rpm: Sequence[float] = (100.0, 250.0, 500.0, 1000.0, 1500.0, 2000.0),
    temperature_degc: float = 20.0,
) -> Scenario:
    """The unloaded drive at one speed after the other.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        speeds_rpm: motor speeds; the metric reads the fastest, the catalogue's is 2000 rpm.
        temperature_degc: of the lubricant.
    """
    return _staircase(
        drive, "running torque", speeds_rpm, (0.0,), at_temperature(effects, temperature_degc), run
    )


def build_efficiency(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    speeds_rpm: Sequence[float] = (250.0, 500.0, 1000.0, 1500.0, 2000.0),
    load_shares: Sequence[float] = (0.1, 0.25, 0.5, 0.75, 1.0),
    temperature_degc: float = 20.0,
) -> Scenario:
    """The drive against one load after the other, at one speed after the other.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        speeds_rpm: motor speeds; the catalogue's is 2000 rpm.
        load_shares: loads as shares of rated torque; negative ones drive (back-driving).
        temperature_degc: of the lubricant.
    """
    rated = Drive.model_validate(dict(drive)).rated_torque_nm
    loads = [share * rated for share in load_shares]
    return _staircase(drive, "efficiency", speeds_rpm, loads, at_temperature(effects, temperature_degc), run)


def plot_starting(runs: Sequence[BenchRun]) -> Figure:
    """Torque and speed over time, with the start of motion."""
    recording, scenario = runs[0].recording, runs[0].scenario
    backward = scenario.command.motor.type == "free"
    channel = "load_torque" if backward else "motor_torque"
    measured = (back_driving_torque if backward else starting_torque)(recording, scenario)
    unit, factor = ("N m", 1.0) if backward else ("mN m", 1e3)
    side = "output" if backward else "motor"
    title = "Back-driving torque" if backward else "Starting torque"
    about = (
        f"{title} {factor * measured:.3g} {unit}: the torque on the {side} at which the drive starts "
        "to turn.\n" + ("The motor is free." if backward else "The output is free and unloaded.")
    )
    torque = np.abs(recording[channel])
    begin = float(recording.time[np.searchsorted(torque, measured)])
    with page(title, about, recording, 5.8) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(recording.time, factor * torque, color=style.BLUE)
        above.plot([begin], [factor * measured], "o", color=style.ORANGE)
        above.annotate(
            f"{factor * measured:.3g} {unit}",
            (begin, factor * measured),
            xytext=(-8, 6),
            textcoords="offset points",
            ha="right",
            color=style.ORANGE,
        )
        above.set(ylabel=unit, title=f"Torque on the {side}")
        speed = np.abs(recording["motor_velocity"])
        limit = turning_speed(scenario)
        below.plot(recording.time, speed, color=style.BLUE)
        below.axhline(limit, color=style.GREY, linestyle=":", label="counts as turning")
        below.set(ylabel="rad/s", xlabel="time (s)", ylim=(0.0, 8.0 * limit), title="Motor speed")
        below.legend(loc="upper left")
        for axes in (above, below):
            axes.axvline(begin, color=style.ORANGE, linewidth=0.8, linestyle=":")
    return figure


def _temperature(run: BenchRun) -> str:
    return f"{run.options.get('temperature_degc', 20.0):g} °C"


def plot_running(runs: Sequence[BenchRun]) -> Figure:
    """No-load torque over speed, a curve for each temperature."""
    curves = [operating_points(run.recording) for run in runs]
    words = [
        f"{_temperature(run)}: {1e3 * points.motor_torque[np.argmax(points.speed)]:.0f} mN m at "
        f"{points.speed.max() * 30.0 / math.pi:.0f} rpm"
        for run, points in zip(runs, curves, strict=True)
    ]
    with page("No-load running torque", "; ".join(words) + ".", runs[0].recording, 5.5) as figure:
        axes = figure.subplots()
        for run, points, colour in zip(runs, curves, SHADES[1:], strict=False):
            rpm = points.speed * 30.0 / math.pi
            axes.plot(
                rpm, 1e3 * points.motor_torque, "o-", color=colour, markersize=4, label=_temperature(run)
            )
        zero_lines(axes)
        axes.set(xlabel="motor speed (rpm)", ylabel="motor torque (mN m)", xlim=(0.0, None), ylim=(0.0, None))
        axes.legend(loc="upper left")
    return figure


def plot_efficiency(runs: Sequence[BenchRun]) -> Figure:
    """Efficiency over speed and load as maps, one for each temperature."""
    maps = [operating_points(run.recording) for run in runs]
    words = []
    for run, points in zip(runs, maps, strict=True):
        best = int(
            np.nanargmax(np.where(np.isfinite(points.efficiency), points.load * points.speed, -np.inf))
        )
        words.append(
            f"{_temperature(run)}: {100 * points.efficiency[best]:.0f} % at {points.load[best]:.3g} N m, "
            f"{points.speed[best] * 30.0 / math.pi:.0f} rpm"
        )
    with page("Efficiency over speed and load", "; ".join(words) + ".", runs[0].recording, 5.2) as figure:
        row = figure.subplots(1, len(runs), squeeze=False, sharey=True)[0]
        drawn: Any = None
        for run, points, axes in zip(runs, maps, row, strict=True):
            speeds, loads, table = points.grid(100.0 * points.efficiency)
            rpm = speeds * 30.0 / math.pi
            drawn = axes.contourf(rpm, loads, table, levels=np.arange(0, 101, 5), cmap="viridis")
            lines = axes.contour(
                rpm, loads, table, levels=np.arange(10, 100, 10), colors="white", linewidths=0.8
            )
            axes.clabel(lines, fmt="%d %%", fontsize=8)
            axes.plot(points.speed * 30.0 / math.pi, points.load, ".", color="black", markersize=3)
            axes.grid(False)
            axes.set(
                xlabel="motor speed (rpm)",
                title=f"Lubricant at {_temperature(run)}",
                ylim=(loads[loads > 0].min(), loads.max()),
            )
        row[0].set_ylabel("load torque (N m)")
        figure.colorbar(drawn, ax=list(row), label="efficiency (%); dots: simulated", pad=0.01)
    return figure


_TEMPERATURES: tuple[dict[str, float], ...] = ({}, {"temperature_degc": 0.0}, {"temperature_degc": 40.0})

STARTING = procedure(
    Procedure(
        name="starting_torque",
        title="starting torque",
        source=_SOURCE,
        build=build_starting,
        metrics=("starting_torque",),
        plot=plot_starting,
    )
)
BACK_DRIVING = procedure(
    Procedure(
        name="back_driving_torque",
        title="back-driving torque",
        source=_SOURCE,
        build=build_back_driving,
        metrics=("back_driving_torque",),
        plot=plot_starting,
    )
)
RUNNING = procedure(
    Procedure(
        name="running_torque",
        title="no-load running torque over speed and temperature",
        source=_SOURCE,
        build=build_running,
        metrics=("running_torque",),
        plot=plot_running,
        variants=_TEMPERATURES,
    )
)
EFFICIENCY = procedure(
    Procedure(
        name="efficiency",
        title="efficiency over speed, load and temperature",
        source=_SOURCE,
        build=build_efficiency,
        metrics=("efficiency",),
        plot=plot_efficiency,
        variants=_TEMPERATURES,
    )
)
