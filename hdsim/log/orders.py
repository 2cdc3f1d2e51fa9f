"""Transmission error of a run at one speed over the output's angle, and its orders: topics for viewers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdsim.log.naming import RUN_TABLES, Array
from hdsim.log.viewing import ARCSEC_PER_RAD

ORDERS, OVER_ANGLE = "orders", "over_angle"

_TURN = 2 * np.pi
_PER_TURN = 64
"""Samples of the error in a turn of the motor."""
_LEAST_TURNS, _MOST_TURNS = 5, 4096
_LEAST_PER_TURN = 16
_STEADY = 0.1
"""Spread of the time that turns take, as a share of their mean, up to which a run has one speed."""
_HIGHEST_ORDER = 10.0
_MOST_POINTS = 2000


@dataclass(frozen=True)
class Spectrum:
    """What `OrderCollector` finds; errors in arcsec, arrays of equal length in pairs.

    Args:
        order: per turn of the wave generator.
        amplitude: of each order.
        output_angle: degrees.
        error: there.
    """

    order: Array
    amplitude: Array
    output_angle: Array
    error: Array


class OrderCollector:
    """Keeps the error at equal steps of the motor's angle, while a run's tables are written."""

    def __init__(self) -> None:
        self._table = ""
        self._cell = np.nan
        self._kept: list[Array] = []
        self._size = 0
        self._previous: Array | None = None

    def feed(self, table: str, time: Array, columns: Mapping[str, Array]) -> None:
        """Take the next rows of a table; only a state's, or a measured one's, count."""
        needed = ("motor_angle", "output_angle", "transmission_error")
        if self._table not in ("", table) or table not in RUN_TABLES or not len(time):
            return
        if any(name not in columns or columns[name].ndim != 1 for name in needed):
            return
        if self._size >= _PER_TURN * _MOST_TURNS:
            return
        self._table = table
        rows = np.stack([time, *(columns[name] for name in needed)])
        rows = rows[:, np.isfinite(rows).all(axis=0)]
        cell = np.floor(rows[1] / (_TURN / _PER_TURN))
        first = np.diff(cell, prepend=self._cell) != 0
        if len(cell):
            self._cell = float(cell[-1])
        self._kept.append(rows[:, first])
        self._size += int(first.sum())

    def spectrum(self) -> Spectrum | None:
        """The orders, if the motor turned at one speed for at least five turns that are sampled well."""
        if not self._kept:
            return None
        time, motor, output, error = np.concatenate(self._kept, axis=1)
        turns = abs(motor[-1] - motor[0]) / _TURN if len(motor) else 0.0
        if turns < _LEAST_TURNS or len(motor) < _LEAST_PER_TURN * turns:
            return None
        if motor[-1] < motor[0]:
            motor = -motor
        if np.diff(motor).min() <= 0:
            return None
        whole = np.arange(motor[0], motor[-1], _TURN)
        lasted = np.diff(np.interp(whole, motor, time))
        if np.ptp(lasted) > _STEADY * lasted.mean():
            return None
        cycles = len(whole) - 1
        order, amplitude = order_spectrum(motor, ARCSEC_PER_RAD * error, cycles, cycles * _PER_TURN)
        highest = min(_HIGHEST_ORDER, 0.4 * len(motor) / turns)
        shown = order <= highest
        order, amplitude = _peaks(order[shown], amplitude[shown])
        step = max(1, -(-len(motor) // _MOST_POINTS))
        return Spectrum(order, amplitude, np.degrees(output[::step]), ARCSEC_PER_RAD * error[::step])


def order_spectrum(
    angle: Array, values: Array, turns: float | None = None, count: int | None = None
) -> tuple[Array, Array]:
    """Amplitude spectrum over orders, of samples at any increasing or decreasing angle.

    A Hann window: what is no whole number of cycles leaks to its neighbours only.

    Args:
        angle: shape (n,), rad, strictly monotonic.
        values: shape (n,).
        turns: from the first angle on, of which to make it; all by default.
        count: even steps of the angle in them; n by default.

    Returns:
        Orders per turn, shape (m,), and amplitudes of the sines at them, shape (m,).
    """
    if angle[-1] < angle[0]:
        angle = -angle
    turns, count = turns or (angle[-1] - angle[0]) / _TURN, count or len(angle)
    even = np.interp(angle[0] + turns * _TURN / count * np.arange(count), angle, values)
    window = np.hanning(count + 1)[:-1]
    spectrum = np.fft.rfft(window * (even - even.mean()))
    return np.arange(len(spectrum)) / turns, 2.0 * np.abs(spectrum) / float(window.sum())


def _peaks(order: Array, amplitude: Array) -> tuple[Array, Array]:
    """At most so many points, of each group the highest."""
    step = max(1, -(-len(order) // _MOST_POINTS))
    if step == 1:
        return order, amplitude
    groups = np.append(amplitude, np.zeros(-len(order) % step)).reshape(-1, step)
    places = np.minimum(np.argmax(groups, axis=1) + step * np.arange(len(groups)), len(order) - 1)
    return order[places], amplitude[places]
