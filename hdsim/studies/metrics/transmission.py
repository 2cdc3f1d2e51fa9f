"""Angular transmission error: over one output turn each way, and its spectrum of orders."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.metrics._spans import ARCSEC, one_way_turn
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

_ACCURACY = (
    "Harmonic Drive, CSF/CSG catalogue, angular transmission accuracy: largest less smallest difference of "
    "actual and theoretical output angle over one output turn, one way"
)
_ORDERS = "Fourier sum over exactly one output turn, resampled over the motor's angle (order tracking)"


@dataclass(frozen=True)
class TransmissionError:
    """Transmission error over exactly one output turn, one way.

    Args:
        motor_angle: equidistant over the turn, rad, shape (n,); increasing or decreasing as the motor turned.
        error: output angle less motor angle over ratio, mean taken out, rad, shape (n,).
        mean: the mean, rad.
        ratio: signed ratio motor angle / output angle.
    """

    motor_angle: Array
    error: Array
    mean: float
    ratio: float

    @property
    def peak_to_peak(self) -> float:
        """Accuracy by the catalogue's definition, rad."""
        return float(np.ptp(self.error))

    @property
    def spectrum(self) -> tuple[Array, Array]:
        """Orders per motor turn (multiples of 1/|ratio|) and amplitudes in rad, both of shape (n/2 - 1,)."""
        n = len(self.error)
        amplitude = 2.0 * np.abs(np.fft.rfft(self.error)) / n
        return np.arange(1, n // 2) / abs(self.ratio), amplitude[1 : n // 2]

    def amplitude(self, order: float) -> float:
        """Amplitude at an order per motor turn, rad.

        On the grid (multiples of 1/|ratio|: all errors that repeat with the output) this is the Fourier sum
        and free of leakage.
        """
        phase = order * (self.motor_angle - self.motor_angle[0])
        return float(2.0 * np.abs(np.mean(self.error * np.exp(-1j * phase))))


def transmission_error(recording: Recording, ratio: float, direction: int) -> TransmissionError:
    """Transmission error over the last steady turn of the output in a direction.

    TE(theta) = theta_out - theta_motor / ratio, resampled over the motor's angle with a cubic spline: one
    output turn is |ratio| motor turns, so that orders 1/|ratio| apart (2 and 2.02 for ratio 100) fall on
    different lines of the Fourier transform.

    Args:
        recording: a run with ``motor_angle``, ``motor_velocity`` and ``output_angle``.
        ratio: signed ratio motor angle / output angle.
        direction: +1 or -1, of the output.

    Raises:
        InputError: the output does not turn once that way at a steady speed.
    """
    channels = tuple(recording[name] for name in ("motor_angle", "motor_velocity", "output_angle"))
    kept = _kept.setdefault(recording, {})
    before = kept.get((ratio, direction))
    # Only for the very same samples: tables of a recording may be changed.
    if before is None or any(now is not then for now, then in zip(channels, before[0], strict=True)):
        before = kept[ratio, direction] = channels, _transmission_error(recording, ratio, direction)
    return before[1]


#: Transmission errors of recordings that somebody still holds, by ratio and direction, and what they were
#: taken from: several metrics ask for the same.
_kept: WeakKeyDictionary[Recording, dict[tuple[float, int], tuple[tuple[Array, ...], TransmissionError]]] = (
    WeakKeyDictionary()
)


def _transmission_error(recording: Recording, ratio: float, direction: int) -> TransmissionError:
    """Compute it."""
    from scipy.interpolate import CubicSpline

    part = one_way_turn(recording, ratio, direction)
    motor = recording["motor_angle"][part]
    error = recording["output_angle"][part] - motor / ratio
    way = math.copysign(1.0, motor[-1] - motor[0])
    increasing = np.concatenate([[True], np.diff(np.maximum.accumulate(way * motor)) > 0.0])
    turn = 2.0 * math.pi * abs(ratio)
    points = 2 * math.ceil(np.count_nonzero(increasing) / 2)
    wanted = motor[-1] + way * (np.arange(points) / points - 1.0) * turn
    resampled = CubicSpline(way * motor[increasing], error[increasing])(way * wanted)
    mean = float(np.mean(resampled))
    return TransmissionError(wanted, resampled - mean, mean, ratio)


def both_ways(recording: Recording, scenario: Scenario) -> tuple[TransmissionError, TransmissionError]:
    """Transmission errors in positive and in negative direction of the output."""
    ratio = scenario.drive.ratio
    return transmission_error(recording, ratio, +1), transmission_error(recording, ratio, -1)


def either_way(recording: Recording, scenario: Scenario) -> TransmissionError:
    """Transmission error in positive direction or, if the run has no such turn, in negative direction."""
    try:
        return transmission_error(recording, scenario.drive.ratio, +1)
    except InputError:
        return transmission_error(recording, scenario.drive.ratio, -1)


@metric(
    "transmission_accuracy",
    "arcsec",
    "angular transmission accuracy: peak to peak over one output turn, the worse of the ways in the run",
    _ACCURACY,
)
def transmission_accuracy(recording: Recording, scenario: Scenario) -> float:
    """Peak to peak of the transmission error, the larger of both ways if the run has both, arcsec."""
    found = [either_way(recording, scenario)]
    with contextlib.suppress(InputError):
        found.append(transmission_error(recording, scenario.drive.ratio, -1))
    return ARCSEC * max(one.peak_to_peak for one in found)


@metric(
    "transmission_accuracy_forward", "arcsec", "the same, output turning in positive direction", _ACCURACY
)
def transmission_accuracy_forward(recording: Recording, scenario: Scenario) -> float:
    """Peak to peak of the transmission error in positive direction, arcsec."""
    return ARCSEC * transmission_error(recording, scenario.drive.ratio, +1).peak_to_peak


@metric(
    "transmission_accuracy_backward", "arcsec", "the same, output turning in negative direction", _ACCURACY
)
def transmission_accuracy_backward(recording: Recording, scenario: Scenario) -> float:
    """Peak to peak of the transmission error in negative direction, arcsec."""
    return ARCSEC * transmission_error(recording, scenario.drive.ratio, -1).peak_to_peak


@metric(
    "transmission_reversal",
    "arcsec",
    "mean transmission error forward less backward: what a reversal costs while turning",
    "difference of the means of both ways' transmission error",
)
def transmission_reversal(recording: Recording, scenario: Scenario) -> float:
    """Mean transmission error in positive less negative direction, arcsec; negative when the output lags."""
    forward, backward = both_ways(recording, scenario)
    return ARCSEC * (forward.mean - backward.mean)


def orders(scenario: Scenario) -> dict[str, float]:
    """Orders per motor turn at which a two-lobed drive errs, by the name that the metrics give them.

    Source: Yao et al. 2022 (multiples of the wave generator's order 2 and of 2 z_c/z_f), kinematics.
    """
    ratio = scenario.drive.ratio
    relative = abs(1.0 - 1.0 / ratio)
    return {
        "order_1": 1.0,
        "order_2": 2.0,
        "order_2_relative": 2.0 * relative,
        "order_4": 4.0,
        "order_4_relative": 4.0 * relative,
        "order_1_output": 1.0 / abs(ratio),
        "order_2_output": 2.0 / abs(ratio),
    }


def _order_metric(name: str, what: str) -> None:
    @metric(f"transmission_error_{name}", "arcsec", f"amplitude of the transmission error {what}", _ORDERS)
    def amplitude(recording: Recording, scenario: Scenario) -> float:
        return ARCSEC * either_way(recording, scenario).amplitude(orders(scenario)[name])


for _name, _what in {
    "order_1": "once per wave-generator turn (eccentricity of the wave generator)",
    "order_2": "twice per wave-generator turn (errors of the fixed spline)",
    "order_2_relative": "2 z_c/z_f per wave-generator turn, 2.02 at ratio 100 (errors of the turning spline)",
    "order_4": "four times per wave-generator turn",
    "order_4_relative": "4 z_c/z_f per wave-generator turn, 4.04 at ratio 100",
    "order_1_output": "once per output turn (eccentricity of the output)",
    "order_2_output": "twice per output turn (beat of orders 2 and 2.02, ovality of the output)",
}.items():
    _order_metric(_name, _what)


@metric(
    "transmission_error_peak_to_peak",
    "arcsec",
    "largest less smallest transmission error of the whole run, start and reversals included",
    "as the angular transmission accuracy, over whatever motion the run has",
)
def transmission_error_peak_to_peak(recording: Recording, scenario: Scenario) -> float:
    """Peak to peak over the whole run, arcsec."""
    return ARCSEC * float(np.ptp(recording["transmission_error"]))


@metric(
    "transmission_error_rms",
    "arcsec",
    "standard deviation of the transmission error over the whole run",
    "root mean square about the mean",
)
def transmission_error_rms(recording: Recording, scenario: Scenario) -> float:
    """Standard deviation over the whole run, arcsec."""
    return ARCSEC * float(np.std(recording["transmission_error"]))
