"""What a run asks of the gear: average torque and speed, life of the bearing, distance to what breaks it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.duty import PROCEDURE, average_torque
from hdsim.drive.ratings import Ratings, bearing_life_h, ratings
from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.study.registry import metric

if TYPE_CHECKING:
    from hdsim.drive.printed import Figure
    from hdsim.scenario import Scenario

_LLC = "Harmonic Drive LLC, CSF/CSG catalogue, p. 14"


def gear_of(scenario: Scenario) -> Ratings:
    """The ratings of a scenario's drive.

    Raises:
        InputError: the drive is no preset, so that nothing is printed about it.
    """
    preset = scenario.drive.preset
    if preset is None:
        raise InputError("this metric needs the catalogue's limits; the drive has no preset")
    return ratings("csg-20-100" if preset == "seed-2021" else preset)


def _average_torque_nm(recording: Recording) -> float:
    steps = np.gradient(recording.time) if len(recording.time) > 1 else np.ones(1)
    return average_torque(recording["output_torque"], recording["motor_velocity"], steps)


def _average_input_speed_rpm(recording: Recording) -> float:
    time = recording.time
    if len(time) < 2:
        raise InputError("an average speed needs two samples")
    turned = float(np.trapezoid(np.abs(recording["motor_velocity"]), time))
    return turned / float(time[-1] - time[0]) * 30.0 / math.pi


@metric("average_load_torque", "N m", "cubic mean of the output torque, weighed by the speed", PROCEDURE)
def average_load_torque(recording: Recording, scenario: Scenario) -> float:
    """Cubic mean of the transmitted torque over the run, N m; 0 where nothing turns."""
    return _average_torque_nm(recording)


@metric("average_input_speed", "rpm", "mean of the wave generator's absolute speed over the run", PROCEDURE)
def average_input_speed(recording: Recording, scenario: Scenario) -> float:
    """Mean absolute speed, rpm."""
    return _average_input_speed_rpm(recording)


@metric(
    "bearing_life",
    "h",
    "life L10 of the wave-generator bearing if the run is repeated for ever",
    f"{_LLC}, Eq. 8: L_n (T_r/T_av)^3 (n_r/n_av)",
)
def bearing_life(recording: Recording, scenario: Scenario) -> float:
    """Hours of such work that nine of ten bearings survive."""
    gear = gear_of(scenario)
    return bearing_life_h(gear, _average_torque_nm(recording), _average_input_speed_rpm(recording))


def _distance(recording: Recording, scenario: Scenario, name: str, figure: Figure | None) -> float:
    if figure is None:
        raise InputError(f"no source gives the {name} of {scenario.drive.preset}")
    largest = float(np.max(np.abs(recording["output_torque"])))
    return math.inf if largest == 0.0 else figure.value / largest


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
