"""The torsion cycle with the motor locked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.plot import style
from hdsim.studies.bench._figure import page, zero_lines
from hdsim.studies.bench._scenario import bench, with_bearing
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.metrics.torsion import TorsionLoop, torsion_loop
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario


def build(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    amplitude_nm: float | None = None,
    period_s: float = 16.0,
    load_inertia_kg_m2: float = 0.01,
    lever_damping_nm_s_per_rad: float = 5.0,
) -> Scenario:
    """Motor locked, the output loaded 0, +T, 0, -T, 0, +T, 0.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        amplitude_nm: T; rated torque when left out, or 1.5 T2 where that is larger.
        period_s: of the cycle, slow against inertia and damping. On a real bench the loop also depends on the
            rate of loading, which rate-independent hysteresis leaves out.
        load_inertia_kg_m2: inertia of the lever.
        lever_damping_nm_s_per_rad: damping of the loading device, which keeps the lever from bouncing where
            the torque crosses zero through the play. The effects' own ``load_side_friction`` wins.
    """
    made = Drive.model_validate(dict(drive))
    amplitude = amplitude_nm or max(made.rated_torque_nm, 1.5 * made.torsion.torque_t2_nm)
    torque = {"type": "triangle", "amplitude_nm": amplitude, "frequency_hz": 1.0 / period_s}
    return bench(
        drive,
        {"type": "locked"},
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": torque},
        {"duration_s": 1.5 * period_s, "sample_rate_hz": 8000.0 / period_s},
        name="torsion cycle",
        effects=with_bearing(effects, 0.0, lever_damping_nm_s_per_rad),
        over=run,
    )


def plot(runs: Sequence[BenchRun]) -> Figure:
    """The loop, and its middle part with hysteresis loss and lost motion drawn in."""
    recording, scenario = runs[0].recording, runs[0].scenario
    loop = torsion_loop(recording)
    rated = scenario.drive.rated_torque_nm
    loss, lost = ARCSEC * loop.hysteresis_loss, ARCSEC * loop.lost_motion(0.03 * rated)
    play = ARCSEC * loop.backlash(0.01 * rated, 0.03 * rated)
    about = (
        f"Hysteresis loss {loss:.1f} arcsec ({loss / 60.0:.2f} arcmin); lost motion at 3 % of rated torque "
        f"{lost:.1f} arcsec ({lost / 60.0:.2f} arcmin); play {play:.1f} arcsec.\n"
        "Motor locked, output loaded 0, +T, 0, -T, 0, +T. Play is the gap between both sides' elastic lines."
    )
    with page("Torsion cycle", about, recording, 6.8) as figure:
        whole, middle = figure.subplots(1, 2)
        _whole(whole, recording["output_angle"], recording["load_torque"], loop, scenario)
        _middle(middle, loop, 0.03 * rated, loss, lost)
    return figure


def _whole(axes: Axes, angle: Any, torque: Any, loop: TorsionLoop, scenario: Scenario) -> None:
    torsion = scenario.drive.torsion
    corners: tuple[float, ...] = (torsion.torque_t1_nm, torsion.torque_t2_nm, loop.peak)
    if corners[2] < 1.02 * corners[1]:
        corners = corners[:2]
    zero = float(np.interp(0.0, loop.torque, loop.centre))
    axes.plot(ARCSEC * (angle - zero), torque, color=style.BLUE, linewidth=0.9, label="measured")
    stiffness = loop.stiffness(corners)
    twist = np.concatenate([[0.0], np.cumsum(np.diff([0.0, *corners]) / np.array(stiffness))])
    for sign in (1, -1):
        axes.plot(
            sign * ARCSEC * twist,
            sign * np.array([0.0, *corners]),
            "o--",
            color=style.ORANGE,
            markersize=3.5,
            linewidth=0.9,
            label="secants of the centre line" if sign > 0 else None,
        )
    zero_lines(axes)
    for k, value in enumerate(stiffness):
        x, y = ARCSEC * 0.5 * (twist[k] + twist[k + 1]), 0.5 * ([0.0, *corners][k] + corners[k])
        axes.annotate(
            f"K{k + 1} = {value:,.0f} N m/rad",
            (x, y),
            xytext=(-10, 10),
            textcoords="offset points",
            ha="right",
            fontsize=9,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )
    axes.set(xlabel="output angle (arcsec)", ylabel="torque on the output (N m)")
    axes.set_title("Whole cycle")
    axes.legend(loc="upper left")


def _middle(axes: Axes, loop: TorsionLoop, edge: float, loss: float, lost: float) -> None:
    zero = float(np.interp(0.0, loop.torque, loop.centre))
    near = np.abs(loop.torque) <= 2.5 * edge
    torque = loop.torque[near]
    for branch, colour, name in (
        (loop.rising, style.BLUE, "torque rising"),
        (loop.falling, style.GREEN, "torque falling"),
    ):
        axes.plot(ARCSEC * (branch[near] - zero), torque, color=colour, linewidth=1.2, label=name)
    axes.plot(ARCSEC * (loop.centre[near] - zero), torque, "--", color=style.GREY, label="centre line")
    zero_lines(axes)
    low, high = (ARCSEC * (np.interp(t, loop.torque, loop.centre) - zero) for t in (-edge, edge))
    left, right = (ARCSEC * (np.interp(0.0, loop.torque, b) - zero) for b in (loop.rising, loop.falling))
    arrow = {"arrowstyle": "<->", "color": style.ORANGE, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (left, 0.0), (right, 0.0), arrowprops=arrow)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.annotate(
        f"hysteresis loss {loss:.1f} arcsec",
        (right, 0.0),
        xytext=(6, -14),
        textcoords="offset points",
        color=style.ORANGE,
        bbox=box,
    )
    level = -2.1 * edge
    axes.plot([low, high], [-edge, edge], "o", color=style.BLACK, markersize=4)
    for x, y in ((low, -edge), (high, edge)):
        axes.plot([x, x], [level, y], ":", color=style.BLACK, linewidth=0.8)
    axes.annotate("", (low, level), (high, level), arrowprops=arrow | {"color": style.BLACK})
    axes.annotate(
        f"lost motion {lost:.1f} arcsec between -{edge:.2g} and +{edge:.2g} N m",
        (0.5 * (low + high), level),
        xytext=(0, -13),
        textcoords="offset points",
        ha="center",
        bbox=box,
    )
    axes.set(
        xlabel="output angle (arcsec)", ylabel="torque on the output (N m)", ylim=(-2.7 * edge, 2.5 * edge)
    )
    axes.set_title("Around zero torque")
    axes.legend(loc="upper left")


TORSION = procedure(
    Procedure(
        name="torsion",
        title="torsion cycle with the motor locked",
        source="Harmonic Drive AG, CHA manual 1018854 (K1, K2, K3, hysteresis loss, lost motion)",
        build=build,
        metrics=(
            "stiffness_k1",
            "stiffness_k2",
            "stiffness_k3",
            "hysteresis_loss",
            "lost_motion",
            "lost_motion_4_percent",
            "backlash",
            "torsional_heat_per_cycle",
        ),
        plot=plot,
    )
)
