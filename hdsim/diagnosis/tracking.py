"""Order tracking: one complex amplitude of each period of an order, and its mean in bands of speed.

A Hann window over two periods in the angle knows no constant and hardly a slope (Vold and Leuridan 1993, SAE
931288, for the idea of tracking). Orders that it does not separate, such as the hunting orders k and
k (1 - 1/i) of a gear, beat from period to period: over a stretch that holds a beat or more, least squares
give each of them its own mean.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.records import Array, Mask

#: Most bands of speed in each record and direction; fewest periods in one, and readings in a period.
BANDS, PERIODS, READINGS = 6, 4, 6
#: Ratio of speeds that are one: over it what inertia makes, the square of the speed, changes by a tenth.
LIKE = 1.05
#: Variance of a mean of windows that overlap by half, beside that of others: neighbours correlate by 1/6.
OVERLAP = 4.0 / 3.0


def mean_beside(
    waves: NDArray[np.complex128], places: Array, apart: Sequence[float]
) -> tuple[complex, float, int]:
    """Mean of an order's complex amplitudes beside other orders, its error, and the freedom of that.

    Args:
        waves: shape (n,).
        places: angle of the motor at each, shape (n,), rad.
        apart: how far other orders lie from it; those that make one beat or more are told apart from it.
    """
    beats = [one for one in apart if abs(one) * np.ptp(places) >= 2 * np.pi]
    beats = beats[: max(len(waves) - PERIODS, 0)]
    columns = np.exp(1j * np.outer(places, [0.0, *beats]))
    sizes = np.linalg.lstsq(columns, waves, rcond=None)[0]
    free = max(len(waves) - columns.shape[1], 1)
    scatter = float(np.sum(np.abs(waves - columns @ sizes) ** 2)) / free
    spread = float(np.linalg.pinv(columns.conj().T @ columns)[0, 0].real)
    # Of each of the two parts of a complex mean.
    return complex(sizes[0]), math.sqrt(OVERLAP * scatter * spread / 2), free


def periods(
    angle: Array, velocity: Array, values: Array, good: Mask, order: float
) -> tuple[Array, Array, NDArray[np.complex128]]:
    """Mean velocity, mean angle and complex amplitude of each period of an order, shape (m,) each.

    Args:
        angle: of the motor, shape (n,), rad.
        velocity: shape (n,), rad/s.
        values: in which the order is, shape (n,).
        good: samples that count, shape (n,).
        order: periods per turn.
    """
    phase = order * angle / (2 * np.pi)
    step = np.abs(np.gradient(phase))
    cuts = np.flatnonzero(np.diff(np.sign(velocity)) != 0) + 1
    speeds, places, waves = [], [], []
    for run in np.split(np.arange(len(angle)), cuts):
        gone = np.abs(phase[run] - phase[run[0]])
        for first in range(int(gone[-1]) - 1):
            own = run[(gone >= first) & (gone < first + 2)]
            kept = own[good[own]]
            if len(kept) < max(2 * READINGS, 0.9 * len(own)):
                continue
            at = np.abs(phase[kept] - phase[run[0]]) - first
            weight = step[kept] * (1.0 - np.cos(np.pi * at))
            turned = np.exp(-2j * np.pi * phase[kept])
            waves.append(2.0 * np.sum(weight * values[kept] * turned) / np.sum(weight))
            speeds.append(float(np.sum(weight * velocity[kept]) / np.sum(weight)))
            places.append(float(np.sum(weight * angle[kept]) / np.sum(weight)))
    return np.array(speeds), np.array(places), np.array(waves, dtype=complex)


def banded(speeds: Array) -> list[NDArray[np.intp]]:
    """Periods of a record in bands of like speed, each direction by itself, the fastest band first.

    A band holds its part of the periods, or all of one speed: a stretch of constant speed is one band.
    """
    found: list[NDArray[np.intp]] = []
    for direction in (-1.0, 1.0):
        own = np.flatnonzero(np.sign(speeds) == direction)
        own = own[np.argsort(-np.abs(speeds[own]))]
        least, sizes = max(PERIODS, math.ceil(len(own) / BANDS)), np.abs(speeds[own])
        while len(own) >= PERIODS:
            like = int(np.sum(sizes * LIKE >= sizes[0]))
            count = max(like, least)
            count = count if len(own) - count >= PERIODS else len(own)
            found.append(own[:count])
            own, sizes = own[count:], sizes[count:]
    return found


def hunting(orders: Sequence[float], ratio: float, turns: float) -> list[float]:
    """Orders of which those that beat with a whole one are that one's hunting orders.

    What a member of the mesh has k times a turn of the wave generator, the turning one has k (1 -+ 1/i) times
    (``KinematicError``, ``relative_turn``). Two lines that near pull at one another, the more so where a
    resonance makes them stronger in a part of the record: each is known to a line's width only.

    Args:
        orders: of lines of one channel.
        ratio: of the drive, signed.
        turns: of the wave generator in the longest record.
    """
    found = []
    for order in orders:
        wholes = [k for k in orders if k != order and k == round(k) and k / abs(ratio) >= 1.0 / turns]
        beating = [k * (1.0 + side / ratio) for k in wholes for side in (-1.0, 1.0)]
        nearest = min(beating, key=lambda one: abs(one - order), default=order)
        found.append(nearest if order != round(order) and abs(nearest - order) < 1.0 / turns else order)
    return found
