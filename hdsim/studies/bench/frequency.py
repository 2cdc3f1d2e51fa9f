"""Frequency response to motor torque and to output torque, and the resonance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hdsim.drive.parameters import Drive
from hdsim.plot import style
from hdsim.studies.bench._figure import page
from hdsim.studies.bench._scenario import bench
from hdsim.studies.metrics.frequency import (
    excitation,
    frequency_response,
    resonance,
    twist_rate,
    two_mass_frequency,
)
from hdsim.studies.registry import BenchRun, Procedure, procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario


def analytic_frequency(drive: Drive, load_inertia_kg_m2: float, *, locked: bool) -> float:
    """Natural frequency of the two-mass model with the middle stiffness K2, Hz."""
    motor = drive.inertia.rotor_kg_m2
    stiffness = drive.torsion.stiffness_k2_nm_per_rad
    return two_mass_frequency(stiffness, load_inertia_kg_m2, motor, drive.ratio, locked=locked)


def build(
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    excite: Literal["motor", "output"] = "motor",
    load_inertia_kg_m2: float = 0.5,
    load_torque_nm: float | None = None,
    amplitude_nm: float = 0.2,
    motor_rpm: float = 300.0,
    periods: int = 5,
) -> Scenario:
    """A multisine on the motor's torque while the drive runs under load, or on the output, motor locked.

    Args:
        drive: section ``drive``.
        effects: section ``effects``.
        run: fields of ``run`` that win.
        excite: ``motor`` (motor turning slowly against a load, its friction out of the way) or ``output``.
        load_inertia_kg_m2: inertia of the load.
        load_torque_nm: load that presses the flanks together; the middle of the segment of K2 when left out.
        amplitude_nm: of each of the lines, as a torque at the output.
        motor_rpm: speed at which the drive turns when the motor is excited.
        periods: of the multisine; the first one is thrown away.
    """
    made = Drive.model_validate(dict(drive))
    torsion = made.torsion
    bias = (
        load_torque_nm if load_torque_nm is not None else 0.5 * (torsion.torque_t1_nm + torsion.torque_t2_nm)
    )
    natural = analytic_frequency(made, load_inertia_kg_m2, locked=excite == "output")
    fundamental = float(f"{natural / 80.0:.1g}")
    lines = {
        "type": "multisine",
        "fundamental_hz": fundamental,
        "lowest_hz": natural / 4.0,
        "highest_hz": 2.5 * natural,
    }
    rate = math.ceil(max(20.0 * natural, 1000.0) / fundamental) * fundamental
    timing: dict[str, Any] = {"duration_s": periods / fundamental, "sample_rate_hz": rate}
    twist = bias / torsion.stiffness_k2_nm_per_rad
    if excite == "output":
        return bench(
            drive,
            {"type": "locked"},
            {
                "inertia_kg_m2": load_inertia_kg_m2,
                "torque": lines | {"amplitude_nm": amplitude_nm, "offset_nm": bias},
            },
            timing | {"start": {"output_twist_rad": -twist}},
            name="frequency response, output excited",
            effects=effects,
            over=run,
        )
    friction = made.friction
    speed = motor_rpm * math.pi / 30.0
    ideal = bias / abs(made.ratio)
    steady = (
        ideal * (1.0 + friction.load_coefficient)
        + friction.coulomb_nm
        + friction.viscous_nm_s_per_rad * speed
    )
    torque = lines | {"amplitude_nm": amplitude_nm / abs(made.ratio), "offset_nm": steady}
    # The motor turns in positive direction; the load is against the output's.
    load = {"type": "hold", "torque_nm": -math.copysign(bias, made.ratio)}
    start = {"motor_velocity_rad_per_s": speed, "output_twist_rad": math.copysign(twist, made.ratio)}
    return bench(
        drive,
        {"type": "torque", "torque": torque},
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": load},
        timing | {"start": start},
        name="frequency response, motor excited",
        effects=effects,
        over=run,
    )


def plot(runs: Sequence[BenchRun]) -> Figure:
    """Output velocity and wind-up rate over torque, phase and coherence, for each way of exciting it."""
    words, answers = [], []
    for one in runs:
        channel, lines, period = excitation(one.scenario)
        ratio = one.scenario.drive.ratio
        given = one.recording[channel] * (ratio if channel == "motor_torque" else 1.0)
        response = frequency_response(one.recording, given, one.recording["output_velocity"], lines, period)
        wind = frequency_response(one.recording, given, twist_rate(one.recording, ratio), lines, period)
        found = resonance(one.recording, one.scenario)
        locked = channel == "load_torque"
        name = "torque on the output, motor locked" if locked else "motor torque x ratio, motor running"
        plain = analytic_frequency(one.scenario.drive, one.scenario.load.inertia_kg_m2, locked=locked)
        answers.append((name, style.ORANGE if locked else style.BLUE, response, wind, found))
        words.append(
            f"{name}: resonance {found:.1f} Hz (two masses with K2: {plain:.1f}); order 2 of the "
            f"kinematic error meets it at {30.0 * found:.0f} rpm, order 4 at {15.0 * found:.0f} rpm."
        )
    with page("Frequency response", "\n".join(words), runs[0].recording, 7.4) as figure:
        gain, twisting, phase, coherent = figure.subplots(2, 2, sharex=True).ravel()
        for name, colour, response, wind, found in answers:
            gain.plot(response.frequency, np.abs(response.response), color=colour, label=name)
            twisting.plot(wind.frequency, np.abs(wind.response), color=colour)
            twisting.annotate(
                f"{found:.1f} Hz",
                (found, float(np.max(np.abs(wind.response)))),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                color=colour,
            )
            turned = np.degrees(np.unwrap(np.angle(response.response)))
            phase.plot(response.frequency, turned - 360.0 * np.round(turned[0] / 360.0), color=colour)
            coherent.plot(response.frequency, response.coherence, color=colour)
            for axes in (gain, twisting, phase, coherent):
                axes.axvline(found, color=colour, linewidth=0.7, linestyle=":")
        gain.set(xscale="log", yscale="log", ylabel="rad/s per N m", title="Output velocity over torque")
        gain.legend(loc="lower left")
        twisting.set(
            yscale="log", ylabel="rad/s per N m", title="Wind-up rate over torque: peaks at the resonance"
        )
        twisting.margins(y=0.12)
        phase.set(ylabel="deg", xlabel="frequency (Hz)", title="Phase of output velocity over torque")
        coherent.set(ylim=(0.0, 1.05), xlabel="frequency (Hz)", ylabel="1")
        coherent.set_title("Coherence: 1 where the torque explains the motion")
        _plain_ticks(gain, [response.frequency for _, _, response, _, _ in answers])
    return figure


def _plain_ticks(axes: Any, frequencies: Sequence[Any]) -> None:
    """Ticks on a logarithmic axis of frequency as plain numbers."""
    low, high = min(f[0] for f in frequencies), max(f[-1] for f in frequencies)
    ticks = [t for k in range(-1, 4) for t in (10**k, 2 * 10**k, 5 * 10**k) if low <= t <= high]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()


FREQUENCY = procedure(
    Procedure(
        name="frequency_response",
        title="frequency response and resonance",
        source="multisine over whole periods; Bendat and Piersol, Random Data, 4th ed.; two-mass model",
        build=build,
        metrics=(
            "resonance_frequency",
            "resonance_speed_order_1",
            "resonance_speed_order_2",
            "resonance_speed_order_4",
        ),
        plot=plot,
        variants=({"excite": "motor"}, {"excite": "output"}),
    )
)
