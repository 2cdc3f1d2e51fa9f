"""Frequency response from a simulated test, and the resonance in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.actuation.waves import Multisine
from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

_TWO_MASS = "peak of twist rate over torque, which a two-mass drive has at sqrt(K (1/J_l + 1/(i^2 J_m)))/2 pi"
_SPEED = "n = 60 f / order: the order of the kinematic error meets the resonance (Tuttle and Seering 1996)"

#: Least samples of a run whose response is estimated: eight half-overlapping windows of eight samples.
_SHORTEST = 36


@dataclass(frozen=True)
class FrequencyResponse:
    """A measured frequency response.

    Args:
        frequency: Hz, shape (n,).
        response: output over input, complex, shape (n,).
        coherence: share of the output's power that the input explains at each frequency, shape (n,).
    """

    frequency: Array
    response: Array
    coherence: Array

    def peak(self) -> float:
        """Frequency of the largest response, a parabola through the three highest lines in dB, Hz."""
        height = 20.0 * np.log10(np.abs(self.response))
        k = int(np.argmax(height))
        if not 0 < k < len(height) - 1:
            raise InputError(
                f"the response is largest at the end of the band, {self.frequency[k]:.3g} Hz: "
                "widen the excitation"
            )
        fit = np.polynomial.Polynomial.fit(self.frequency[k - 1 : k + 2], height[k - 1 : k + 2], 2)
        return float(fit.deriv().roots()[0].real)


def excitation(scenario: Scenario) -> tuple[str, list[float], float | None]:
    """What a scenario excites the drive with: channel, its frequencies (Hz) and its period (s).

    Chirps have the frequencies of their ends and no period.

    Raises:
        InputError: neither motor torque nor load torque is a multisine or a chirp.
    """
    motor = scenario.command.motor
    for channel, signal in (
        ("motor_torque", motor.torque if motor.type == "torque" else None),
        ("load_torque", scenario.load.torque),
    ):
        kind = getattr(signal, "type", None)
        if kind == "multisine" and signal is not None:
            shape = signal.si
            assert isinstance(shape, Multisine)
            grid = shape.grid()
            period = 1.0 / shape.fundamental_hz if shape.fundamental_hz else None
            return channel, grid, period
        if kind == "chirp" and signal is not None:
            chirp = signal.si
            return channel, sorted((chirp.start_frequency_hz, chirp.end_frequency_hz)), None  # type: ignore[attr-defined]
    raise InputError(
        "a frequency response needs a multisine or a chirp as motor torque (command.motor.torque) or as "
        "load torque (load.torque)"
    )


def frequency_response(
    recording: Recording, given: Array, answer: Array, frequencies: list[float], period_s: float | None
) -> FrequencyResponse:
    """Frequency response of ``answer`` to ``given``.

    A periodic excitation is evaluated at its own lines over whole periods, the first period left out: no
    leakage, and the scatter between periods gives the coherence. Anything else goes through Welch's
    cross-spectral estimate with eight half-overlapping windows (Bendat and Piersol, Random Data, 4th ed.,
    section 6.1).

    Args:
        recording: the run that the channels come from.
        given: input, shape (n,).
        answer: output, shape (n,).
        frequencies: lines of a periodic excitation, or the ends of the band, Hz.
        period_s: period of the excitation, s; None when it has none.

    Raises:
        InputError: the run is shorter than two periods.
    """
    time = recording.time
    if len(time) < _SHORTEST:
        raise InputError(f"a frequency response needs {_SHORTEST} samples, found {len(time)}")
    rate = (len(time) - 1) / (time[-1] - time[0])
    if period_s is None:
        from scipy.signal import coherence, csd, welch

        length = max(8, 2 * len(time) // 9)
        frequency, power = welch(given, rate, nperseg=length)
        _, cross = csd(given, answer, rate, nperseg=length)
        _, coherent = coherence(given, answer, rate, nperseg=length)
        band = (frequency >= frequencies[0]) & (frequency <= frequencies[-1]) & (frequency > 0.0)
        if np.count_nonzero(band) < 3:
            raise InputError("a frequency response needs a longer run: found no three lines in the band")
        return FrequencyResponse(frequency[band], (cross / power)[band], coherent[band])
    samples = round(period_s * rate)
    periods = (len(time) - 1) // samples
    if periods < 2:
        raise InputError(f"a periodic excitation of {period_s:.3g} s needs a run of at least two periods")
    first = len(time) - (periods - 1) * samples
    lines = np.rint(np.asarray(frequencies) * period_s).astype(int)
    spectra = [
        np.fft.rfft(values[first:].reshape(periods - 1, samples), axis=1)[:, lines]
        for values in (given, answer)
    ]
    cross = np.mean(np.conj(spectra[0]) * spectra[1], axis=0)
    power, answered = (np.mean(np.abs(one) ** 2, axis=0) for one in spectra)
    return FrequencyResponse(np.asarray(frequencies), cross / power, np.abs(cross) ** 2 / (power * answered))


def twist_rate(recording: Recording, ratio: float) -> Array:
    """Rate of wind-up of the drive, motor velocity over ratio less output velocity, rad/s."""
    return np.asarray(recording["motor_velocity"] / ratio - recording["output_velocity"])


def resonance(recording: Recording, scenario: Scenario) -> float:
    """Frequency at which the drive winds up most, Hz.

    The wind-up rate over the torque is s/(s^2 + 2 zeta w s + w^2) times a constant for two masses and a
    spring, whose peak is at w whatever the damping.
    """
    channel, lines, period = excitation(scenario)
    rate = twist_rate(recording, scenario.drive.ratio)
    return frequency_response(recording, recording[channel], rate, lines, period).peak()


@metric("resonance_frequency", "Hz", "frequency at which the drive winds up most", _TWO_MASS)
def resonance_frequency(recording: Recording, scenario: Scenario) -> float:
    """Resonance, Hz."""
    return resonance(recording, scenario)


def _speed_metric(order: int) -> None:
    @metric(
        f"resonance_speed_order_{order}",
        "rpm",
        f"motor speed at which order {order} of the kinematic error meets the resonance",
        _SPEED,
    )
    def speed(recording: Recording, scenario: Scenario) -> float:
        return 60.0 * resonance(recording, scenario) / order


for _order in (1, 2, 4):
    _speed_metric(_order)


def two_mass_frequency(stiffness: float, load: float, motor: float, ratio: float, *, locked: bool) -> float:
    """Natural frequency of load, spring and motor, Hz.

    Args:
        stiffness: at the output, N m/rad.
        load: inertia of output and load, kg m^2.
        motor: inertia of motor and wave generator, kg m^2.
        ratio: motor angle / output angle.
        locked: whether the motor is held.
    """
    reduced = load if locked else 1.0 / (1.0 / load + 1.0 / (ratio**2 * motor))
    return math.sqrt(stiffness / reduced) / (2.0 * math.pi)
