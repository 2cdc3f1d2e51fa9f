"""Following and settling: tracking error, settling time, overshoot, torque of the motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.recording import Recording
from hdsim.studies.metrics._spans import ARCSEC, Dwell, dwells
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Half-width of the band that counts as settled, rad: 0.5 arcmin, half of what catalogues allow the gear.
BAND = 30.0 / ARCSEC

_POSE = "ISO 9283:1998, 7.4 (pose stabilization time), band +-30 arcsec about the attained angle"
_OVERSHOOT = "ISO 9283:1998, 7.5 (pose overshoot): largest distance beyond the attained angle"
_TRACKING = "output angle less commanded angle"


def settling(recording: Recording, dwell: Dwell, band: float = BAND) -> float:
    """Time from the end of the commanded move until the output stays within a band, s.

    Args:
        recording: the run.
        dwell: where the command rests.
        band: half-width about the attained angle, rad.
    """
    time, angle = recording.time[dwell.samples], recording["output_angle"]
    outside = np.flatnonzero(np.abs(angle[dwell.samples] - dwell.attained(angle)) > band)
    last = outside[-1] + 1 if len(outside) else 0
    return float(time[min(last, len(time) - 1)] - time[0])


def overshoot(recording: Recording, dwell: Dwell) -> float:
    """Largest distance beyond the attained angle in the direction of the move, rad, at least 0."""
    angle = recording["output_angle"]
    beyond = np.sign(dwell.move) * (angle[dwell.samples] - dwell.attained(angle))
    return max(0.0, float(np.max(beyond)))


@metric("settling_time", "s", "from the end of the command to within +-30 arcsec for good, worst move", _POSE)
def settling_time(recording: Recording, scenario: Scenario) -> float:
    """Longest settling time of the run's moves, s."""
    return max(settling(recording, dwell) for dwell in dwells(recording))


@metric("overshoot", "arcsec", "largest distance beyond the attained angle, worst move", _OVERSHOOT)
def worst_overshoot(recording: Recording, scenario: Scenario) -> float:
    """Largest overshoot of the run's moves, arcsec."""
    return ARCSEC * max(overshoot(recording, dwell) for dwell in dwells(recording))


@metric("positioning_error", "arcsec", "largest attained less commanded angle of the run's dwells", _TRACKING)
def positioning_error(recording: Recording, scenario: Scenario) -> float:
    """Largest absolute deviation of an attained angle, arcsec."""
    angle = recording["output_angle"]
    return ARCSEC * max(abs(dwell.attained(angle) - dwell.target) for dwell in dwells(recording))


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
