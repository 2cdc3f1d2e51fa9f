"""Bidirectional positioning by ISO 230-2, and repeatability by ISO 9283."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.errors import InputError
from hdsim.plot import style
from hdsim.studies.bench._figure import SHADES, page, zero_lines
from hdsim.studies.bench._scenario import bench, with_bearing
from hdsim.studies.bench._servo import moves_between, position_loop
from hdsim.studies.known_metrics import find_metric
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.metrics.positioning import approaches, positioning_errors
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario


def targets_deg(travel_deg: float, number: int, seed: int) -> list[float]:
    """Target positions P_i = (i - 1) p + r, r random within +-30 % of the interval p (ISO 230-2, clause 5).

    The random part keeps the targets from always meeting a periodic error in the same phase.
    """
    interval = travel_deg / number
    spread = np.random.default_rng([seed, 230]).uniform(-0.3, 0.3, number)
    return [round(float(interval * (k + 0.5 + spread[k])), 3) for k in range(number)]


def build(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    travel_deg: float = 360.0,
    targets: int = 8,
    cycles: int = 5,
    motor_rpm: float = 2000.0,
    dwell_s: float = 0.6,
    load_inertia_kg_m2: float = 0.5,
    load_torque_nm: float = 0.0,
    bearing_friction_nm: float = 0.5,
) -> Scenario:
    """The standard test cycle: up through all targets and down again, with an overrun at both ends.

    Args:
        drive: section ``drive``.
        effects: section ``effects``; the encoders are ideal unless ``sensors`` says otherwise and the command
            is sampled.
        run: fields of ``run`` that win; ``seed`` also draws the targets.
        travel_deg: measuring travel of the axis.
        targets: their number; the standard asks for 8 at least on a rotary axis of more than 180 degrees.
        cycles: approaches of each target from each side, at least 2; the standard's is 5.
        motor_rpm: largest motor speed on the way.
        dwell_s: rest at each target; its last fifth is what counts.
        load_inertia_kg_m2: inertia of the table.
        load_torque_nm: constant torque on the table.
        bearing_friction_nm: Coulomb friction of the table's bearing, without which it rattles in the play;
            the effects' own ``load_side_friction`` wins.

    Raises:
        InputError: fewer than two cycles or no target.
    """
    if cycles < 2 or targets < 1:
        raise InputError(f"positioning needs at least 2 cycles and 1 target, found {cycles} and {targets}")
    made = Drive.model_validate(dict(drive))
    points = targets_deg(travel_deg, targets, int((run or {}).get("seed", 0)))
    overrun = 0.25 * travel_deg / targets
    up = [*points, travel_deg + overrun]
    down = [*reversed(points), -overrun]
    moves, seconds = moves_between(
        [-overrun, *(up + down) * cycles], ratio=made.ratio, motor_rpm=motor_rpm, dwell_s=dwell_s
    )
    return bench(
        drive,
        position_loop(made, load_inertia_kg_m2, moves),
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": {"type": "hold", "torque_nm": load_torque_nm}},
        {"duration_s": seconds, "sample_rate_hz": 200.0},
        name="bidirectional positioning",
        effects=with_bearing(effects, bearing_friction_nm),
        over=run,
    )


def plot(runs: Sequence[BenchRun]) -> Figure:
    """Deviations over the targets from both sides, with means and the band of two standard deviations."""
    recording = runs[0].recording
    targets, errors = positioning_errors(recording)
    at = np.degrees(targets)
    about = (
        f"A = {errors.accuracy:.1f}, E = {errors.systematic:.1f}, M = {errors.mean_error:.1f}, "
        f"B = {errors.reversal:.1f} (mean {errors.mean_reversal:.1f}), R = {errors.repeatability:.1f}, "
        f"R up = {errors.repeatability_up:.2g}, R down = {errors.repeatability_down:.2g} arcsec.\n"
        f"{len(at)} targets, {errors.up.shape[1]} approaches from each side. "
        "The motor's encoder closes the loop, the output is measured."
    )
    with page("Bidirectional positioning, ISO 230-2", about, recording) as figure:
        axes = figure.subplots()
        sides = (
            (errors.up, errors.mean_up, errors.deviation_up, style.BLUE, "approached upwards", ">"),
            (errors.down, errors.mean_down, errors.deviation_down, style.ORANGE, "approached downwards", "<"),
        )
        for single, mean, spread, colour, name, marker in sides:
            axes.fill_between(at, mean - 2 * spread, mean + 2 * spread, color=colour, alpha=0.15, linewidth=0)
            axes.plot(at, mean, color=colour, label=f"{name}: mean and band of ±2 s")
            axes.plot(
                np.repeat(at, single.shape[1]), single.ravel(), marker, color=colour, markersize=4, alpha=0.6
            )
        axes.plot(at, errors.mean, "--", color=style.GREY, label="mean of both sides")
        zero_lines(axes, vertical=False)
        worst = int(np.argmax(np.abs(errors.reversal_at)))
        axes.annotate(
            "",
            (at[worst], errors.mean_up[worst]),
            (at[worst], errors.mean_down[worst]),
            arrowprops={"arrowstyle": "<->", "color": style.BLACK, "shrinkA": 0, "shrinkB": 0},
        )
        axes.annotate(
            f"B = {errors.reversal:.1f}",
            (at[worst], errors.mean[worst]),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
        )
        low = min(np.min(m - 2 * s) for _, m, s, *_ in sides)
        high = max(np.max(m + 2 * s) for _, m, s, *_ in sides)
        for level in (low, high):
            axes.axhline(level, color=style.GREEN, linewidth=0.8, linestyle=":")
        axes.annotate(
            f"A = {errors.accuracy:.1f} between the dotted lines",
            (at[0], high),
            xytext=(0, 3),
            textcoords="offset points",
            color=style.GREEN,
        )
        axes.set(xlabel="target angle of the output (deg)", ylabel="attained less target angle (arcsec)")
        axes.margins(y=0.12)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure


POSITIONING = procedure(
    Procedure(
        name="positioning",
        title="bidirectional positioning",
        source="ISO 230-2:2014",
        build=build,
        metrics=(
            "positioning_accuracy",
            "positioning_accuracy_up",
            "positioning_accuracy_down",
            "positioning_repeatability",
            "positioning_repeatability_up",
            "positioning_repeatability_down",
            "positioning_reversal",
            "positioning_mean_reversal",
            "positioning_mean_error",
            "positioning_systematic",
            "positioning_systematic_up",
            "positioning_systematic_down",
        ),
        plot=plot,
    )
)


def build_repeatability(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    poses_deg: Sequence[float] = (0.0, 6.0, 12.0, -12.0, -6.0),
    cycles: int = 30,
    motor_rpm: float = 2000.0,
    dwell_s: float = 0.5,
    load_inertia_kg_m2: float = 0.5,
    load_torque_nm: float = 0.0,
    bearing_friction_nm: float = 0.5,
) -> Scenario:
    """Five poses in turn, thirty times, each always from the same side.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        poses_deg: output angles in the order in which they are visited.
        cycles: visits of each pose; the standard's is 30.
        motor_rpm: largest motor speed on the way.
        dwell_s: rest at each pose; its last fifth is what counts.
        load_inertia_kg_m2: inertia of the load.
        load_torque_nm: constant torque on the load.
        bearing_friction_nm: Coulomb friction of the output bearing; the effects' own
            ``load_side_friction`` wins.
    """
    made = Drive.model_validate(dict(drive))
    order = [*poses_deg[1:], poses_deg[0]]
    start = [] if poses_deg[0] == 0.0 else [poses_deg[0]]
    moves, seconds = moves_between(
        [*start, *order * cycles], ratio=made.ratio, motor_rpm=motor_rpm, dwell_s=dwell_s
    )
    return bench(
        drive,
        position_loop(made, load_inertia_kg_m2, moves),
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": {"type": "hold", "torque_nm": load_torque_nm}},
        {"duration_s": seconds, "sample_rate_hz": 200.0},
        name="repeatability",
        effects=with_bearing(effects, bearing_friction_nm),
        over=run,
    )


def plot_repeatability(runs: Sequence[BenchRun]) -> Figure:
    """Deviation of each visit from the mean of its pose."""
    recording, scenario = runs[0].recording, runs[0].scenario
    found = [one for one in approaches(recording) if len(one.deviations) > 1]
    figures = {
        name: find_metric(name)(recording, scenario)
        for name in ("repeatability", "repeatability_angle", "repeatability_positioning")
    }
    about = (
        f"Half range ±{figures['repeatability']:.3g} arcsec (as makers of gears state it); ISO 9283: "
        f"±3 S = ±{figures['repeatability_angle']:.3g} arcsec, "
        f"RP = {figures['repeatability_positioning']:.3g} arcsec.\n"
        "The run is deterministic: what scatters is the history of hysteresis and friction, not chance."
    )
    with page("Repeatability, ISO 9283", about, recording, 5.5) as figure:
        axes = figure.subplots()
        for colour, one in zip(SHADES, found, strict=False):
            visit = np.arange(1, len(one.deviations) + 1)
            side = "from below" if one.direction > 0 else "from above"
            axes.plot(
                visit,
                ARCSEC * (one.deviations - one.deviations.mean()),
                ".-",
                color=colour,
                linewidth=0.7,
                label=f"{np.degrees(one.target):g} deg {side}",
            )
        zero_lines(axes, vertical=False)
        axes.set(xlabel="visit", ylabel="attained angle less the pose's mean (arcsec)")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5)
    return figure


REPEATABILITY = procedure(
    Procedure(
        name="repeatability",
        title="unidirectional repeatability",
        source="ISO 9283:1998, 7.2.2",
        build=build_repeatability,
        metrics=("repeatability", "repeatability_angle", "repeatability_positioning"),
        plot=plot_repeatability,
    )
)
