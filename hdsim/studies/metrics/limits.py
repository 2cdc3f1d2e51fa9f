"""What a run asks of the gear: average torque and speed, life of the bearing, distance to what breaks it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.duty import PROCEDURE, averages, bearing_averages
from hdsim.drive.ratings import Ratings, bearing_life_h, ratings_of_preset
from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.drive.printed import Figure
    from hdsim.scenario import Scenario

_LLC = "Harmonic Drive LLC, CSF/CSG catalogue, p. 14"


def gear_of(scenario: Scenario) -> Ratings:
    """The ratings of a scenario's drive.

    Raises:
        InputError: nothing is printed about the drive.
    """
    gear = ratings_of_preset(scenario.drive.preset)
    if gear is None:
        raise InputError("this metric needs the catalogue's limits; the drive is no preset")
    return gear


def _averages(recording: Recording) -> tuple[float, float]:
    """Cubic mean of the output torque in N m, and mean input speed in rpm; 0 where nothing turns."""
    if len(recording.time) < 2:
        raise InputError("an average needs two samples")
    return averages(
        *bearing_averages(recording.time, recording["output_torque"], recording["motor_velocity"])
    )


@metric("average_load_torque", "N m", "cubic mean of the output torque, weighed by the speed", PROCEDURE)
def average_load_torque(recording: Recording, scenario: Scenario) -> float:
    """Cubic mean of the transmitted torque over the run, N m."""
    torque, speed = _averages(recording)
    if speed == 0.0:
        raise InputError("a mean weighed by the speed needs a motor that turns; here it stands")
    return torque


@metric("average_input_speed", "rpm", "mean of the wave generator's absolute speed over the run", PROCEDURE)
def average_input_speed(recording: Recording, scenario: Scenario) -> float:
    """Mean absolute speed, rpm."""
    return _averages(recording)[1]


@metric(
    "bearing_life",
    "h",
    "life L10 of the wave-generator bearing if the run is repeated for ever",
    f"{_LLC}, Eq. 8: L_n (T_r/T_av)^3 (n_r/n_av)",
)
def bearing_life(recording: Recording, scenario: Scenario) -> float:
    """Hours of such work that nine of ten bearings survive."""
    life = bearing_life_h(gear_of(scenario), *_averages(recording))
    if math.isinf(life):
        raise InputError(
            "the bearing's life needs a run in which the motor turns under load; here it does not"
        )
    return life


def _distance(recording: Recording, scenario: Scenario, name: str, figure: Figure | None) -> float:
    if figure is None:
        raise InputError(f"no source gives the {name} of {scenario.drive.preset}")
    largest = float(np.max(np.abs(recording["output_torque"])))
    if largest == 0.0:
        raise InputError(f"the distance to the {name} needs a run with an output torque; this one has none")
    return figure.value / largest


def _safety_metric(name: str, field: str, source: str) -> None:
    words = field.replace("_", " ")

    @metric(f"{name}_safety", "1", f"{words} over the largest output torque of the run", source)
    def safety(recording: Recording, scenario: Scenario) -> float:
        return _distance(recording, scenario, words, getattr(gear_of(scenario), field))


for _name, _field, _source in (
    ("repeated_peak", "repeated_peak_torque", PROCEDURE),
    ("momentary_peak", "momentary_peak_torque", PROCEDURE),
    ("ratcheting", "ratcheting_torque", _LLC),
    ("buckling", "buckling_torque", _LLC),
):
    _safety_metric(_name, _field, _source)
