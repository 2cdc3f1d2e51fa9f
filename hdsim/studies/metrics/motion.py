"""Positioning, following and settling: the one place that says what error and settling time are.

``hdsim run``, ``hdsim budget`` and ``hdsim study`` all take them from here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.simulation.limit_cycle import LimitCycle, limit_cycle
from hdsim.studies.metrics._spans import ARCSEC, Dwell, dwells, rests
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

_ATTAINED = "ISO 230-2:2014: attained less target position, attained being the mean of the dwell's last fifth"
_SETTLING = (
    "servo definition (Franklin, Powell and Emami-Naeini, Feedback Control, 3.4): within the band about the "
    "target for good; band: evaluation.settling_band_arcsec"
)
_POSE = "ISO 9283:1998, 7.4 (pose stabilization time), the band about the attained angle"
_OVERSHOOT = "ISO 9283:1998, 7.5 (pose overshoot): largest distance beyond the attained angle"
_TRACKING = "output angle less commanded angle"
_CYCLE = (
    "Nordin and Gutman 2002, Automatica 38:1633; three even periods that do not die, later half of a rest"
)


def settling(recording: Recording, dwell: Dwell, band: float, about: float | None = None) -> float:
    """Time from the end of the commanded move until the output stays within a band, s.

    Args:
        recording: the run.
        dwell: where the command rests.
        band: half-width, rad.
        about: middle of the band, rad; the target when None.

    Returns:
        The time; infinite where the output is outside the band in the last fifth of the dwell.
    """
    time, angle = recording.time[dwell.samples], recording["output_angle"]
    middle = dwell.target if about is None else about
    if np.any(np.abs(angle[dwell.last] - middle) > band):
        return math.inf
    outside = np.flatnonzero(np.abs(angle[dwell.samples] - middle) > band)
    return float(time[outside[-1] + 1] - time[0]) if len(outside) else 0.0


def overshoot(recording: Recording, dwell: Dwell) -> float:
    """Largest distance beyond the attained angle in the direction of the move, rad, at least 0."""
    angle = recording["output_angle"]
    beyond = np.sign(dwell.move) * (angle[dwell.samples] - dwell.attained(angle))
    return max(0.0, float(np.max(beyond)))


def deviation(recording: Recording, dwell: Dwell) -> float:
    """Attained less commanded angle at a dwell, arcsec, with its sign."""
    return ARCSEC * (dwell.attained(recording["output_angle"]) - dwell.target)


def worst_dwell(recording: Recording) -> Dwell:
    """The dwell with the largest deviation of either sign.

    Raises:
        InputError: the run has no dwell after a move.
    """
    return max(dwells(recording), key=lambda dwell: abs(deviation(recording, dwell)))


def largest_limit_cycle(recording: Recording) -> LimitCycle | None:
    """The limit cycle with the largest amplitude among the run's rests; None where none swings.

    Raises:
        InputError: the run has no commanded angle, or it never rests.
    """
    time, angle = recording.time, recording["output_angle"]
    resting = rests(recording)
    if not resting:
        raise InputError("a limit cycle at rest needs a command that rests; the commanded angle never does")
    found = [limit_cycle(time[r.samples], angle[r.samples] - r.target) for r in resting]
    return max((one for one in found if one), key=lambda one: one.amplitude_rad, default=None)


def band_rad(scenario: Scenario) -> float:
    """Half-width of the band that counts as settled, rad."""
    return scenario.evaluation.settling_band_arcsec / ARCSEC


@metric("positioning_error", "arcsec", "largest attained less commanded angle of the run's dwells", _ATTAINED)
def positioning_error(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute deviation of an attained angle, arcsec."""
    return abs(deviation(recording, worst_dwell(recording)))


@metric(
    "positioning_error_peak",
    "arcsec",
    "largest output less commanded angle in the last fifth of a dwell: what still swings, included",
    "largest value where positioning_error takes the mean",
)
def positioning_error_peak(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute error at rest, arcsec."""
    angle = recording["output_angle"]
    return ARCSEC * max(float(np.max(np.abs(angle[d.last] - d.target))) for d in dwells(recording))


@metric(
    "settling_time",
    "s",
    "from the end of the command until the output stays in the band about its target, worst move; inf: never",
    _SETTLING,
)
def settling_time(recording: Recording, scenario: Scenario) -> float:
    """Longest settling time of the run's moves, s; infinite where a move never settles."""
    return max(settling(recording, dwell, band_rad(scenario)) for dwell in dwells(recording))


@metric(
    "stabilization_time",
    "s",
    "from the end of the command until the output stays in the band about where it ends, worst move",
    _POSE,
)
def stabilization_time(recording: Recording, scenario: Scenario) -> float:
    """Longest pose stabilization time of the run's moves, s; infinite where a move never comes to rest."""
    angle, band = recording["output_angle"], band_rad(scenario)
    return max(settling(recording, d, band, d.attained(angle)) for d in dwells(recording))


@metric("overshoot", "arcsec", "largest distance beyond the attained angle, worst move", _OVERSHOOT)
def worst_overshoot(recording: Recording, scenario: Scenario) -> float:
    """Largest overshoot of the run's moves, arcsec."""
    return ARCSEC * max(overshoot(recording, dwell) for dwell in dwells(recording))


@metric(
    "limit_cycle_amplitude", "arcsec", "half of what the output swings at rest for ever; 0: it rests", _CYCLE
)
def limit_cycle_amplitude(recording: Recording, scenario: Scenario) -> float:
    """Amplitude of the largest limit cycle of the run's rests, arcsec; 0 without one."""
    found = largest_limit_cycle(recording)
    return 0.0 if found is None else ARCSEC * found.amplitude_rad


@metric("limit_cycle_frequency", "Hz", "frequency of the largest swing at rest", _CYCLE)
def limit_cycle_frequency(recording: Recording, scenario: Scenario) -> float:
    """Frequency of the largest limit cycle, Hz."""
    found = largest_limit_cycle(recording)
    if found is None:
        raise InputError("the frequency of a limit cycle needs one; the output comes to rest")
    return found.frequency_hz


@metric("tracking_error_rms", "arcsec", "root mean square of the tracking error over the run", _TRACKING)
def tracking_error_rms(recording: Recording, scenario: Scenario) -> float:
    """Root mean square of the tracking error, arcsec."""
    return ARCSEC * float(np.sqrt(np.mean(recording["tracking_error"] ** 2)))


@metric("tracking_error_max", "arcsec", "largest absolute tracking error of the run", _TRACKING)
def tracking_error_max(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute tracking error, arcsec."""
    return ARCSEC * float(np.max(np.abs(recording["tracking_error"])))


@metric("motor_torque_rms", "N m", "root mean square of the motor's torque", "thermal load of a motor")
def motor_torque_rms(recording: Recording, scenario: Scenario) -> float:
    """Root mean square of the motor's torque, N m."""
    return float(np.sqrt(np.mean(recording["motor_torque"] ** 2)))


@metric("motor_torque_max", "N m", "largest absolute torque of the motor", "peak load of a motor")
def motor_torque_max(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute torque of the motor, N m."""
    return float(np.max(np.abs(recording["motor_torque"])))


@metric(
    "output_torque_max", "N m", "largest absolute torque of the drive on the output", "held against the peaks"
)
def output_torque_max(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute torque that the drive transmits, N m."""
    return float(np.max(np.abs(recording["output_torque"])))


@metric("output_torque_rms", "N m", "root mean square of the drive's torque on the output", "thermal load")
def output_torque_rms(recording: Recording, scenario: Scenario) -> float:
    """Root mean square of the torque that the drive transmits, N m."""
    return float(np.sqrt(np.mean(recording["output_torque"] ** 2)))


@metric("input_speed_max", "rpm", "largest absolute speed of motor and wave generator", "catalogue's limit")
def input_speed_max(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute speed of the motor, rpm."""
    return float(np.max(np.abs(recording["motor_velocity"]))) * 30.0 / math.pi
