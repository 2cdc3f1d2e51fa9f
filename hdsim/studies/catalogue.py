"""The catalogue's lines for a drive, measured on its simulation as a test bench does on the drive."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.catalogue import CatalogueFigures
from hdsim.drive.parameters import Drive
from hdsim.drive.presets import catalogue_figures
from hdsim.errors import InputError
from hdsim.simulation.simulate import simulate
from hdsim.studies.bench import frequency, friction, torsion
from hdsim.studies.bench._scenario import bench
from hdsim.studies.known_metrics import find_metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario


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


def measured(metric: str, scenario: Scenario) -> float:
    """A metric of a simulated scenario, in its unit."""
    return find_metric(metric)(simulate(scenario), scenario)


def lumped(preset: str, **sections: Any) -> dict[str, Any]:
    """A preset without teeth: the friction and the masses do not depend on them."""
    return {"preset": preset, "mesh": {"model": "lumped"}} | sections


def resonance(preset: str, load_inertia_kg_m2: float) -> tuple[float, float]:
    """Frequency of the torsional mode without friction, motor not held: simulated and analytic, Hz.

    The analytic one is the two-mass value sqrt(K (1/J_l + 1/(i^2 J_m))) / 2 pi with the middle stiffness K2.
    """
    plain = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
    scenario = frequency.build(
        lumped(preset, friction=plain), load_inertia_kg_m2=load_inertia_kg_m2, amplitude_nm=0.01
    )
    expected = frequency.analytic_frequency(scenario.drive, load_inertia_kg_m2, locked=False)
    return measured("resonance_frequency", scenario), expected


def engagement_at_rated(preset: str, kind: str) -> tuple[float, float]:
    """Share of the teeth in contact and mean tangential force per tooth of them at rated torque, 1 and N.

    The default arcs hold 30 % of the teeth; one whose gap the load does not close stays out. The force is the
    mesh torque over the pitch radius and the number of engaged teeth; static load, motor locked.
    """
    figures = catalogue_figures(preset)
    scenario = bench(
        {"preset": preset, "mesh": {"engagement": {"kind": kind}}},
        {"type": "locked"},
        {
            "inertia_kg_m2": 0.01,
            "torque": {"type": "ramp", "rate_nm_per_s": figures.rated_torque.value, "duration_s": 1.0},
        },
        {"duration_s": 1.2, "sample_rate_hz": 200, "teeth_rate_hz": 200},
        name="engagement at rated torque",
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
    simulated, analytic = resonance(preset, 0.5)
    add("resonance, motor free, 0.5 kg m^2", "Hz", analytic, simulated, 0.01, "two-mass formula with K2")
    for kind in ("window", "clearance"):
        share, force = engagement_at_rated(preset, kind)
        add(
            f"teeth engaged at rated torque, {kind}",
            "1",
            0.30,
            share,
            0.05,  # printed to the ten, of "typical harmonic reducers"
            "Zhang et al. 2021",
            absolute=True,
        )
        if kind == "window":
            geometry = Drive.model_validate({"preset": preset}).geometry
            mean = figures.rated_torque.value / (share * geometry.flexspline_teeth * geometry.pitch_radius_m)
            source = "T / (N r), N teeth in contact"
            add("mean tangential tooth force at rated torque", "N", mean, force, 0.01, source)
    return lines


def _stiffness_lines(preset: str, figures: CatalogueFigures, add: Callable[..., None]) -> None:
    scenario = torsion.build({"preset": preset})
    recording = simulate(scenario)
    printed = (figures.stiffness_k1, figures.stiffness_k2, figures.stiffness_k3)
    for k, figure in enumerate(printed, 1):
        value = find_metric(f"stiffness_k{k}")(recording, scenario)
        add(f"torsional stiffness K{k}", "N m/rad", figure.value, value, 0.02, figure.source.citation)


def _friction_lines(preset: str, figures: CatalogueFigures, add: Callable[..., None]) -> None:
    drive = lumped(preset)
    if (figure := figures.input_starting_torque) is not None:
        value = measured("starting_torque", friction.build_starting(drive))
        add("starting torque", "N m", figure.value, value, 0.1, figure.source.citation)
    for rpm, figure in figures.running_torque:
        value = measured("running_torque", friction.build_running(drive, speeds_rpm=(rpm,)))
        add(f"no-load running torque, {rpm:g} rpm", "N m", figure.value, value, 0.1, figure.source.citation)
    if (figure := figures.back_driving_torque) is not None:
        value = measured("back_driving_torque", friction.build_back_driving(drive))
        add("back-driving torque", "N m", figure.value, value, 0.1, figure.source.citation)
    if (figure := figures.efficiency) is not None:
        scenario = friction.build_efficiency(drive, speeds_rpm=(2000.0,), load_shares=(1.0,))
        add(
            "efficiency, rated torque, 2000 rpm",
            "1",
            figure.value,
            measured("efficiency", scenario),
            0.03,
            figure.source.citation,
            absolute=True,
        )
