"""The teeth of a run: play that their rough flanks leave, stiffness and wind-up of their contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.contact.law import ContactLaw
    from hdsim.drive.parameters import ToothedMesh
    from hdsim.scenario import Scenario

_PAPER = "Zhang et al. 2021, doi:10.21203/rs.3.rs-652069/v1"


def _mesh(scenario: Scenario) -> ToothedMesh:
    from hdsim.drive.parameters import ToothedMesh

    mesh = scenario.drive.mesh
    if not isinstance(mesh, ToothedMesh):
        raise InputError(f"this metric is about teeth; the mesh model {mesh.model!r} has none")
    return mesh


def lever_m(scenario: Scenario) -> float:
    """Angle of the output per metre of approach of the flanks, inverted, m."""
    geometry = scenario.drive.geometry
    lever = geometry.pitch_radius_m * math.cos(math.radians(geometry.pressure_angle_deg))
    if scenario.drive.arrangement == "flexspline_fixed":
        lever *= geometry.circular_spline_teeth / geometry.flexspline_teeth
    return lever


def mean_tooth_force_n(scenario: Scenario, torque_nm: float) -> float:
    """Mean normal force of the engaged teeth by an output torque, T / (N r cos alpha), N."""
    teeth = _mesh(scenario).engagement.share * scenario.drive.geometry.flexspline_teeth
    return torque_nm / (teeth * lever_m(scenario))


def contact_law(scenario: Scenario) -> ContactLaw:
    """Contact of one tooth pair, without the tooth's bending."""
    mesh = _mesh(scenario)
    return mesh.contact.build(mesh.flanks.equivalent())


def _largest_force_n(recording: Recording, scenario: Scenario) -> float:
    torque = float(np.max(np.abs(recording["load_torque"])))
    if torque == 0.0:
        raise InputError("the stiffness of the teeth needs a load torque; this run has none")
    return mean_tooth_force_n(scenario, torque)


def _mean_gap_m(recording: Recording, scenario: Scenario) -> float:
    _mesh(scenario)
    return float(np.mean(recording.static["tooth_half_gap"].values))


@metric("mean_half_gap", "um", "half-gap between the flanks, mean of all teeth", f"{_PAPER}, Eq. 15, Table 4")
def mean_half_gap(recording: Recording, scenario: Scenario) -> float:
    """Mean half-gap, um."""
    return 1e6 * _mean_gap_m(recording, scenario)


@metric(
    "mean_tooth_play",
    "arcsec",
    "play of a drive whose teeth all had the mean gap: twice the half-gap over the lever arm",
    f"{_PAPER}, Eq. 14 with b as half of the gap",
)
def mean_tooth_play(recording: Recording, scenario: Scenario) -> float:
    """Twice the mean half-gap, at the output, arcsec. The closest teeth make the drive's own play smaller."""
    return 2.0 * ARCSEC * _mean_gap_m(recording, scenario) / lever_m(scenario)


@metric(
    "tooth_contact_stiffness",
    "N/m",
    "stiffness of one tooth contact at the mean tooth force of the run's largest load torque",
    f"{_PAPER}, Eq. 12",
)
def tooth_contact_stiffness(recording: Recording, scenario: Scenario) -> float:
    """dF/df of a contact, bending left out, N/m; where every asperity is plastic it is the law's floor."""
    return float(contact_law(scenario).stiffness_at_force(_largest_force_n(recording, scenario)))


@metric(
    "contact_wind_up",
    "arcsec",
    "turn of the output by the teeth's contacts alone, at the run's largest load torque, gaps closed",
    f"{_PAPER}, Eq. 12: integral of dF/K(F) to the mean tooth force, over the lever arm",
)
def contact_wind_up(recording: Recording, scenario: Scenario) -> float:
    """Penetration at the mean tooth force, at the output, arcsec."""
    force = _largest_force_n(recording, scenario)
    return ARCSEC * float(contact_law(scenario).penetration(force)) / lever_m(scenario)


@metric(
    "tooth_force_max", "N", "largest normal force of any tooth, at run.teeth_rate_hz", f"{_PAPER}, Eq. 13, 14"
)
def tooth_force_max(recording: Recording, scenario: Scenario) -> float:
    """Largest normal force of a tooth in the teeth table, N.

    Raises:
        InputError: the run kept no forces of teeth.
    """
    _mesh(scenario)
    if "teeth" not in recording.tables:
        raise InputError(
            "the load of the teeth needs their forces; this run keeps none (run.teeth_rate_hz: 0)"
        )
    return float(np.max(np.abs(recording.tables["teeth"]["normal_force"])))
