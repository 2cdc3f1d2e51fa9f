"""Moves there and back: settling, overshoot and tracking error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.plot import style
from hdsim.studies.bench._figure import page, zero_lines
from hdsim.studies.bench._scenario import bench, with_bearing
from hdsim.studies.bench._servo import moves_between, position_loop
from hdsim.studies.known_metrics import find_metric
from hdsim.studies.metrics._spans import ARCSEC, dwells
from hdsim.studies.metrics.motion import band_rad, overshoot, settling
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario


def build(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    distance_deg: float = 30.0,
    motor_rpm: float = 2000.0,
    dwell_s: float = 0.6,
    load_inertia_kg_m2: float = 0.5,
    load_torque_nm: float = 0.0,
    bearing_friction_nm: float = 0.5,
) -> Scenario:
    """A move of the output there and back, with dwells.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        distance_deg: of the move.
        motor_rpm: largest motor speed on the way.
        dwell_s: rest after each move, long enough to come to rest.
        load_inertia_kg_m2: inertia of the load.
        load_torque_nm: constant torque on the load.
        bearing_friction_nm: Coulomb friction of the output bearing; the effects' own
            ``load_side_friction`` wins.
    """
    made = Drive.model_validate(dict(drive))
    moves, seconds = moves_between(
        [distance_deg, 0.0], ratio=made.ratio, motor_rpm=motor_rpm, dwell_s=dwell_s
    )
    return bench(
        drive,
        position_loop(made, load_inertia_kg_m2, moves),
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": {"type": "hold", "torque_nm": load_torque_nm}},
        {"duration_s": seconds, "sample_rate_hz": 2000.0},
        name="move and settle",
        effects=with_bearing(effects, bearing_friction_nm),
        over=run,
    )


def plot(runs: Sequence[BenchRun]) -> Figure:
    """Motion, tracking error, and the approach of each target with its band."""
    recording, scenario = runs[0].recording, runs[0].scenario
    time, angle = recording.time, recording["output_angle"]
    rests = dwells(recording)
    rms, largest = (find_metric(f"tracking_error_{k}")(recording, scenario) for k in ("rms", "max"))
    band = scenario.evaluation.settling_band_arcsec
    settled = [1e3 * settling(recording, dwell, band_rad(scenario)) for dwell in rests]
    beyond = ARCSEC * max(overshoot(recording, dwell) for dwell in rests)
    when = f"{max(settled):.0f} ms after the end of the command" if math.isfinite(max(settled)) else "never"
    about = (
        f"Settles within ±{band:g} arcsec of its target: {when}; overshoot {beyond:.1f} arcsec.\n"
        f"Tracking error {rms:.1f} arcsec rms, {largest:.1f} arcsec at most."
    )
    with page("Move and settle", about, recording, 7.2) as figure:
        motion, error, near = figure.subplots(3, 1)
        motion.plot(time, np.degrees(angle), color=style.BLUE, label="output")
        motion.plot(
            time, np.degrees(recording["reference_angle"]), "--", color=style.ORANGE, label="commanded"
        )
        motion.set(ylabel="deg", xlabel="time (s)", title="Output angle", xlim=(0.0, time[-1]))
        motion.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        error.plot(time, ARCSEC * recording["tracking_error"], color=style.BLUE)
        for dwell in rests:
            error.axvspan(time[dwell.samples.start], time[dwell.samples.stop - 1], color="#EEEEEE", zorder=0)
        zero_lines(error, vertical=False)
        error.set(ylabel="arcsec", xlabel="time (s)", xlim=(0.0, time[-1]))
        error.set_title("Tracking error: output less commanded angle (grey: command at rest)")
        for dwell, after, colour, name in zip(
            rests, settled, (style.BLUE, style.ORANGE), ("there", "back"), strict=False
        ):
            since = time[dwell.samples] - time[dwell.samples.start]
            off = np.sign(dwell.move) * ARCSEC * (angle[dwell.samples] - dwell.target)
            told = f"settled after {after:.0f} ms" if math.isfinite(after) else "never settles"
            near.plot(1e3 * since, off, color=colour, label=f"{name}: {told}")
            if math.isfinite(after):
                near.axvline(after, color=colour, linewidth=0.8, linestyle=":")
        near.axhspan(-band, band, color=style.GREEN, alpha=0.12, linewidth=0)
        zero_lines(near, vertical=False)
        longest = 1e3 * float(since[-1])
        near.set(
            xlim=(0.0, min(longest, max(3.0 * max(settled), 100.0))),
            ylim=(-6 * band, 6 * band),
            xlabel="time since the end of the command (ms)",
            ylabel="arcsec",
        )
        near.set_title(f"From the target, overshoot upwards (green: ±{band:g} arcsec)")
        near.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return figure


SETTLING = procedure(
    Procedure(
        name="settling",
        title="move and settle",
        source="servo definition of settling; ISO 9283:1998, 7.4 and 7.5",
        build=build,
        metrics=(
            "settling_time",
            "stabilization_time",
            "overshoot",
            "positioning_error",
            "tracking_error_rms",
            "tracking_error_max",
            "motor_torque_rms",
            "motor_torque_max",
        ),
        plot=plot,
    )
)
