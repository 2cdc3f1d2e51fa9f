"""Angular transmission error over one output turn, both ways."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.plot import style
from hdsim.studies.bench._figure import page, zero_lines
from hdsim.studies.bench._scenario import bench, with_bearing
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.metrics.transmission import both_ways, orders
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario
    from hdsim.studies.metrics.transmission import TransmissionError

#: Output turns each way, of which the last one counts; the rest lets the start and the reversal decay.
_TURNS = 1.05


def build(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    motor_rpm: float = 300.0,
    load_inertia_kg_m2: float = 0.005,
    bearing_friction_nm: float = 0.5,
) -> Scenario:
    """A turn of the output forward and back at a constant motor speed, without load.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        motor_rpm: speed; slow against the resonance at order 4, so that the error is the gear's own.
        load_inertia_kg_m2: inertia of the bench's encoder and coupling.
        bearing_friction_nm: Coulomb friction of the bench's output bearing and seal, which keeps the flanks
            in contact; 0 for none. The effects' own ``load_side_friction`` wins.
    """
    ratio = Drive.model_validate(dict(drive)).ratio
    speed = math.copysign(motor_rpm, ratio)
    seconds = _TURNS * abs(ratio) * 60.0 / motor_rpm
    slope = motor_rpm / 0.1
    way = {"type": "ramp", "acceleration_rpm_per_s": slope, "duration_s": seconds + 0.1}
    moves = [way | {"velocity_rpm": speed}, way | {"velocity_rpm": -speed}]
    return bench(
        drive,
        {"type": "motion", "trajectory": {"type": "sequence", "moves": moves}},
        {"inertia_kg_m2": load_inertia_kg_m2},
        {"duration_s": 2.0 * (seconds + 0.1), "sample_rate_hz": max(500.0, motor_rpm / 60.0 * 128.0)},
        name="angular transmission error",
        effects=with_bearing(effects, bearing_friction_nm),
        over=run,
    )


def plot(runs: Sequence[BenchRun]) -> Figure:
    """Error over the output's turn both ways, and the amplitudes of its orders."""
    recording, scenario = runs[0].recording, runs[0].scenario
    forward, backward = both_ways(recording, scenario)
    lag = ARCSEC * (forward.mean - backward.mean)
    worse = ARCSEC * max(forward.peak_to_peak, backward.peak_to_peak)
    about = (
        f"Accuracy {worse:.1f} arcsec ({worse / 60.0:.2f} arcmin) peak to peak over one output turn; forward "
        f"{ARCSEC * forward.peak_to_peak:.1f}, backward {ARCSEC * backward.peak_to_peak:.1f} arcsec.\n"
        f"Between the ways lie {abs(lag):.1f} arcsec: play, hysteresis and wind-up by the bearing's friction."
    )
    with page(
        "Angular transmission error: output angle less motor angle / ratio", about, recording
    ) as figure:
        over, spectrum = figure.subplots(2, 1, height_ratios=[1.1, 1.0])
        for one, colour, name in ((forward, style.BLUE, "forward"), (backward, style.ORANGE, "backward")):
            angle = np.degrees(one.motor_angle / one.ratio) % 360.0
            order = np.argsort(angle)
            shown = ARCSEC * (one.error + one.mean)
            over.plot(angle[order], shown[order], color=colour, linewidth=0.7, label=name)
        zero_lines(over, vertical=False)
        over.set(xlim=(0.0, 360.0), xlabel="output angle (deg)", ylabel="transmission error (arcsec)")
        over.set_xticks(range(0, 361, 30))
        over.set_title("One output turn each way")
        over.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        _orders(spectrum, forward, scenario)
    return figure


def _orders(axes: Axes, error: TransmissionError, scenario: Scenario) -> None:
    """Amplitudes over orders from 1 per output turn to 10 per motor turn, lines of a spectrum."""
    order, amplitude = error.spectrum
    shown = (order <= 10.0) & (ARCSEC * amplitude > 1e-3)
    order, amplitude = order[shown], ARCSEC * amplitude[shown]
    axes.vlines(order, 1e-3, amplitude, color=style.BLUE, linewidth=0.8)
    axes.plot(order, amplitude, ".", color=style.BLUE, markersize=3)
    axes.set(
        xscale="log",
        yscale="log",
        xlim=(0.008, 11.0),
        ylim=(1e-3 * amplitude.max(), 4 * amplitude.max()),
    )
    axes.set_xticks([0.01, 0.02, 0.1, 1, 2, 4, 8], ["0.01", "0.02", "0.1", "1", "2", "4", "8"])
    axes.minorticks_off()
    axes.set(xlabel="order: periods per motor turn", ylabel="amplitude (arcsec)")
    axes.set_title("Orders, forward: 0.01 is once per output turn, 2 is twice per wave-generator turn")
    for name, at in orders(scenario).items():
        height = ARCSEC * error.amplitude(at)
        if height < 0.05:
            continue
        relative = name.endswith("_relative")
        axes.annotate(
            f"{at:g}: {height:.1f}",
            (at, height),
            xytext=(8, -2) if relative else (0, 4),
            textcoords="offset points",
            ha="left" if relative else "center",
            fontsize=8.5,
            color=style.ORANGE if relative else style.BLACK,
        )


TRANSMISSION_ERROR = procedure(
    Procedure(
        name="transmission_error",
        title="angular transmission error over one output turn, both ways",
        source="Harmonic Drive, CSF/CSG catalogue, angular transmission accuracy",
        build=build,
        metrics=(
            "transmission_accuracy",
            "transmission_accuracy_forward",
            "transmission_accuracy_backward",
            "transmission_reversal",
            "transmission_error_order_1_output",
            "transmission_error_order_2_output",
            "transmission_error_order_1",
            "transmission_error_order_2",
            "transmission_error_order_2_relative",
            "transmission_error_order_4",
        ),
        plot=plot,
    )
)
