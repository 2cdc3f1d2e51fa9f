"""The catalogue's lines for a drive, measured on its simulation as a test bench does on the drive."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdsim.drive.catalogue import CatalogueFigures
from hdsim.drive.parameters import Drive
from hdsim.drive.presets import catalogue_figures
from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.scenario.model import Scenario
from hdsim.simulation.setup import build_model
from hdsim.simulation.simulate import simulate

#: Speed beyond which a shaft counts as turning, as a multiple of the friction's smoothing speed.
TURNING = 6.0


@dataclass(frozen=True)
class Line:
    """One line of the table.

    Args:
        quantity: what was measured.
        unit: of both values.
        catalogue: printed or analytic value.
        simulated: value from the simulation.
        tolerance: allowed deviation; relative unless ``absolute``.
        absolute: whether the tolerance is in the unit.
        source: where the catalogue's value comes from.
    """

    quantity: str
    unit: str
    catalogue: float
    simulated: float
    tolerance: float
    absolute: bool
    source: str

    @property
    def deviation(self) -> float:
        """Simulated less catalogue, relative unless the tolerance is absolute."""
        difference = self.simulated - self.catalogue
        return difference if self.absolute else difference / self.catalogue

    @property
    def holds(self) -> bool:
        """Whether the deviation is within the tolerance."""
        return abs(self.deviation) <= self.tolerance


def bench(
    preset: str,
    command: dict[str, Any],
    load: dict[str, Any],
    run: dict[str, Any],
    *,
    mesh: dict[str, Any] | None = None,
    output: dict[str, Any] | None = None,
    effects: dict[str, Any] | None = None,
) -> Scenario:
    """A scenario of a bench test: a preset, what drives the motor, the load and the run."""
    drive: dict[str, Any] = {"preset": preset}
    if mesh is not None:
        drive["mesh"] = mesh
    commands: dict[str, Any] = {"motor": command}
    if output is not None:
        commands["output"] = output
    return Scenario.model_validate(
        {
            "drive": drive,
            "effects": effects or {},
            "command": commands,
            "load": load,
            "run": {"teeth_rate_hz": 0} | run,
        }
    )


def torsion_cycle(preset: str, *, mesh: dict[str, Any] | None = None, period_s: float = 8.0) -> Recording:
    """Motor locked, the output loaded slowly to plus and minus rated torque: one and a quarter cycles."""
    figures = catalogue_figures(preset)
    return simulate(
        bench(
            preset,
            {"type": "locked"},
            {
                "inertia_kg_m2": 0.01,
                "torque": {
                    "type": "triangle",
                    "amplitude_nm": figures.rated_torque.value,
                    "frequency_hz": 1 / period_s,
                },
            },
            {"duration_s": 1.25 * period_s, "sample_rate_hz": 500},
            mesh=mesh,
        )
    )


def secant_stiffness(cycle: Recording, torques_nm: tuple[float, ...]) -> tuple[float, ...]:
    """Secants of the torsion curve between 0 and the torques, N m/rad, mean of all branches and both signs.

    Source: the maker's definition of K1, K2, K3 (Harmonic Drive AG, CHA manual, torsional stiffness).
    """
    torque, twist = -cycle["output_torque"], cycle["transmission_error"]
    rising = np.gradient(torque) > 0
    corners = np.array([0.0, *torques_nm])
    found = []
    for sign in (1.0, -1.0):
        for branch in (rising, ~rising):
            reached = branch & (sign * torque >= 0) & (sign * torque <= 0.999 * corners[-1])
            order = np.argsort(sign * torque[reached])
            found.append(np.interp(corners, (sign * torque[reached])[order], (sign * twist[reached])[order]))
    mean = np.mean(found, axis=0)
    # The centre line of the loop passes zero torque at zero twist, play and hysteresis left and right of it.
    mean -= mean[0] if abs(mean[0]) > abs(mean[1]) else 0.0
    mean[0] = 0.0
    return tuple(np.diff(corners) / np.diff(mean))


def starting_torque(preset: str) -> float:
    """Motor torque at which an unloaded drive starts to turn under a slow ramp, N m."""
    scenario = bench(
        preset,
        {"type": "torque", "torque": {"type": "ramp", "rate_nm_per_s": 0.02}},
        {"inertia_kg_m2": 0.01},
        {"duration_s": 5.0, "sample_rate_hz": 200},
        mesh={"model": "lumped"},
    )
    recording = simulate(scenario)
    threshold = TURNING * scenario.drive.friction.smoothing_velocity_rad_per_s
    return float(recording["motor_torque"][_first(np.abs(recording["motor_velocity"]) > threshold)])


def back_driving_torque(preset: str) -> float:
    """Output torque at which the drive is turned from the output, motor free, under a slow ramp, N m."""
    scenario = bench(
        preset,
        {"type": "free"},
        {"inertia_kg_m2": 0.01, "torque": {"type": "ramp", "rate_nm_per_s": 1.0}},
        {"duration_s": 12.0, "sample_rate_hz": 200},
        mesh={"model": "lumped"},
    )
    recording = simulate(scenario)
    threshold = TURNING * scenario.drive.friction.smoothing_velocity_rad_per_s
    return float(recording["load_torque"][_first(np.abs(recording["motor_velocity"]) > threshold)])


def steady_run(preset: str, rpm: float, load_torque_nm: float) -> Recording:
    """A steady run at a motor speed against a load torque: one output turn, after the start has decayed."""
    ratio = Drive.model_validate({"preset": preset}).ratio
    speed = rpm * 2 * math.pi / 60
    turn = abs(ratio) * 60 / rpm
    recording = simulate(
        bench(
            preset,
            {"type": "motion", "trajectory": {"type": "ramp", "velocity_rpm": rpm}},
            {
                "inertia_kg_m2": 0.5,
                "torque": {"type": "hold", "torque_nm": -math.copysign(load_torque_nm, ratio)},
            },
            {
                "duration_s": 1.0 + turn,
                "sample_rate_hz": 500,
                "start": {"motor_velocity_rad_per_s": speed},
            },
            mesh={"model": "lumped"},
        )
    )
    keep = recording.time >= 1.0
    table = recording.state
    table.time = table.time[keep]
    for name, column in table.columns.items():
        table.columns[name] = type(column)(column.values[keep], column.unit, column.description)
    return recording


def running_torque(preset: str, rpm: float) -> float:
    """Mean motor torque without load at a speed, N m."""
    return float(np.mean(steady_run(preset, rpm, 0.0)["motor_torque"]))


def efficiency(preset: str, rpm: float, torque_nm: float) -> float:
    """Work delivered over work supplied in a steady run against a load torque."""
    recording = steady_run(preset, rpm, torque_nm)
    supplied, delivered = recording["work_supplied"], recording["work_delivered"]
    return float((delivered[-1] - delivered[0]) / (supplied[-1] - supplied[0]))


def resonance(preset: str, load_torque_nm: float, load_inertia_kg_m2: float) -> tuple[float, float]:
    """Frequency of the torsional mode under a load torque with the motor free: simulated and analytic, Hz.

    The simulated one is the strongest line of the twist's free oscillation; the analytic one is the two-mass
    value sqrt(K (1/J_l + 1/(i^2 J_m))) / 2 pi with K the tangent stiffness at that torque.
    """
    scenario = bench(
        preset,
        {"type": "torque", "torque": {"type": "hold", "torque_nm": 0.0}},
        {"inertia_kg_m2": load_inertia_kg_m2, "torque": {"type": "hold", "torque_nm": load_torque_nm}},
        {"duration_s": 1.0, "sample_rate_hz": 5000},
        mesh={"model": "lumped"},
    )
    drive = scenario.drive
    torsion = drive.torsion
    stiffness = torsion.stiffness_k2_nm_per_rad
    motor, _, output = build_model(scenario).inertias
    reduced = 1 / (1 / output + 1 / (drive.ratio**2 * motor))
    # Both sides accelerate together: the spring carries the motor's share of the load torque.
    carried = load_torque_nm * (drive.ratio**2 * motor) / (output + drive.ratio**2 * motor)
    rest = torsion.torque_t1_nm / torsion.stiffness_k1_nm_per_rad
    rest += (abs(carried) - torsion.torque_t1_nm) / stiffness
    friction = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
    data = scenario.model_dump()
    data["drive"]["friction"] |= friction
    data["drive"]["torsion"]["damping_nm_s_per_rad"] = 0.0
    data["run"]["start"]["output_twist_rad"] = -math.copysign(rest * 1.02, load_torque_nm)
    recording = simulate(Scenario.model_validate(data))
    twist = recording["twist"] - np.mean(recording["twist"])
    crossings = np.flatnonzero((twist[:-1] < 0) & (twist[1:] >= 0))
    fraction = twist[crossings] / (twist[crossings] - twist[crossings + 1])
    moments = (crossings + fraction) / scenario.run.sample_rate_hz
    simulated = (len(moments) - 1) / (moments[-1] - moments[0])
    return float(simulated), math.sqrt(stiffness / reduced) / (2 * math.pi)


def engagement_at_rated(preset: str, kind: str) -> tuple[float, float]:
    """Share of the teeth in contact and mean tangential force per tooth of them at rated torque, 1 and N.

    The force is the mesh torque over the pitch radius and the number of engaged teeth, both averaged over the
    wave generator's angle; loaded statically with the motor locked.
    """
    figures = catalogue_figures(preset)
    scenario = bench(
        preset,
        {"type": "locked"},
        {
            "inertia_kg_m2": 0.01,
            "torque": {"type": "ramp", "rate_nm_per_s": figures.rated_torque.value, "duration_s": 1.0},
        },
        {"duration_s": 1.2, "sample_rate_hz": 200, "teeth_rate_hz": 200},
        mesh={"engagement": {"kind": kind}},
    )
    recording = simulate(scenario)
    geometry = scenario.drive.geometry
    force = recording.tables["teeth"]["normal_force"][-1]
    pressure_angle = math.radians(geometry.pressure_angle_deg)
    share = float(recording["engaged_share"][-1])
    tangential = float(np.sum(np.abs(force))) * math.cos(pressure_angle) / (share * geometry.flexspline_teeth)
    return share, tangential


def catalogue_table(preset: str, on_line: Callable[[Line], object] | None = None) -> list[Line]:
    """Every line that the catalogue gives for the preset, measured on the simulation.

    Args:
        preset: name of a preset.
        on_line: called with each line as soon as it is measured.

    Raises:
        InputError: unknown preset.
    """
    try:
        figures = catalogue_figures(preset)
    except ValueError as error:
        raise InputError(str(error)) from None
    lines: list[Line] = []

    def add(
        quantity: str,
        unit: str,
        printed: float,
        simulated: float,
        tolerance: float,
        source: str,
        *,
        absolute: bool = False,
    ) -> None:
        lines.append(Line(quantity, unit, printed, simulated, tolerance, absolute, source))
        if on_line is not None:
            on_line(lines[-1])

    _stiffness_lines(preset, figures, add)
    _friction_lines(preset, figures, add)
    load = 0.6 * (figures.torque_t1.value + figures.torque_t2.value)
    simulated, analytic = resonance(preset, load, 0.5)
    add("resonance, motor free, 0.5 kg m^2", "Hz", analytic, simulated, 0.01, "two-mass formula with K2")
    for kind in ("window", "clearance"):
        share, force = engagement_at_rated(preset, kind)
        add(
            f"teeth engaged at rated torque, {kind}",
            "1",
            0.30,
            share,
            0.02,
            "Zhang et al. 2021",
            absolute=True,
        )
        if kind == "window":
            geometry = Drive.model_validate({"preset": preset}).geometry
            mean = figures.rated_torque.value / (0.3 * geometry.flexspline_teeth * geometry.pitch_radius_m)
            add("mean tangential tooth force at rated torque", "N", mean, force, 0.01, "T / (N r)")
    return lines


def _stiffness_lines(preset: str, figures: CatalogueFigures, add: Callable[..., None]) -> None:
    torques = (figures.torque_t1.value, figures.torque_t2.value)
    rated = max(figures.rated_torque.value, 1.05 * torques[1])
    measured = secant_stiffness(torsion_cycle(preset), (*torques, rated))
    printed = (figures.stiffness_k1, figures.stiffness_k2, figures.stiffness_k3)
    for k, (figure, value) in enumerate(zip(printed, measured, strict=True), 1):
        add(f"torsional stiffness K{k}", "N m/rad", figure.value, value, 0.02, figure.source.citation)


def _friction_lines(preset: str, figures: CatalogueFigures, add: Callable[..., None]) -> None:
    if (figure := figures.input_starting_torque) is not None:
        add("starting torque", "N m", figure.value, starting_torque(preset), 0.1, figure.source.citation)
    for rpm, figure in figures.running_torque:
        add(
            f"no-load running torque, {rpm:g} rpm",
            "N m",
            figure.value,
            running_torque(preset, rpm),
            0.1,
            figure.source.citation,
        )
    if (figure := figures.back_driving_torque) is not None:
        add(
            "back-driving torque",
            "N m",
            figure.value,
            back_driving_torque(preset),
            0.1,
            figure.source.citation,
        )
    if (figure := figures.efficiency) is not None:
        value = efficiency(preset, 2000.0, figures.rated_torque.value)
        add(
            "efficiency, rated torque, 2000 rpm",
            "1",
            figure.value,
            value,
            0.03,
            figure.source.citation,
            absolute=True,
        )


def _first(condition: Any) -> int:
    """Index of the first true sample.

    Raises:
        InputError: there is none.
    """
    found = np.flatnonzero(condition)
    if not len(found):
        raise InputError("the drive did not start to turn within the bench test's ramp")
    return int(found[0])
