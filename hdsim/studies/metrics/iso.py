"""ISO 230-2 and ISO 9283: positioning figures from tables of deviations, in whatever unit these have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PositioningErrors:
    """Figures of ISO 230-2:2014 for one axis; the unit is that of the deviations.

    Symbols are the standard's, arrows as ``up`` (approached in positive direction) and ``down``.

    Args:
        up: deviations x_ij of the attained from the target position, approached upwards, shape (m, n).
        down: the same, approached downwards, shape (m, n).
    """

    up: Array
    down: Array

    @property
    def mean_up(self) -> Array:
        """Mean unidirectional deviation at each position, upwards, shape (m,)."""
        return np.asarray(np.mean(self.up, axis=1))

    @property
    def mean_down(self) -> Array:
        """Mean unidirectional deviation at each position, downwards, shape (m,)."""
        return np.asarray(np.mean(self.down, axis=1))

    @property
    def mean(self) -> Array:
        """Mean bidirectional deviation at each position, shape (m,)."""
        return 0.5 * (self.mean_up + self.mean_down)

    @property
    def reversal_at(self) -> Array:
        """Reversal error B_i = mean_up - mean_down at each position, shape (m,), signed."""
        return self.mean_up - self.mean_down

    @property
    def reversal(self) -> float:
        """Reversal error of the axis, B = max |B_i|."""
        return float(np.max(np.abs(self.reversal_at)))

    @property
    def mean_reversal(self) -> float:
        """Mean reversal error of the axis, mean of B_i, signed."""
        return float(np.mean(self.reversal_at))

    @property
    def deviation_up(self) -> Array:
        """Estimator s_i of the standard deviation at each position, upwards, with n - 1, shape (m,)."""
        return np.asarray(np.std(self.up, axis=1, ddof=1))

    @property
    def deviation_down(self) -> Array:
        """The same, downwards, shape (m,)."""
        return np.asarray(np.std(self.down, axis=1, ddof=1))

    @property
    def repeatability_up_at(self) -> Array:
        """Unidirectional repeatability R_i = 4 s_i at each position, upwards, shape (m,)."""
        return 4.0 * self.deviation_up

    @property
    def repeatability_down_at(self) -> Array:
        """The same, downwards, shape (m,)."""
        return 4.0 * self.deviation_down

    @property
    def repeatability_at(self) -> Array:
        """Bidirectional repeatability R_i = max(2 s_up + 2 s_down + |B_i|, R_i_up, R_i_down), shape (m,)."""
        spread = 2.0 * self.deviation_up + 2.0 * self.deviation_down + np.abs(self.reversal_at)
        return np.maximum(spread, np.maximum(self.repeatability_up_at, self.repeatability_down_at))

    @property
    def repeatability_up(self) -> float:
        """Unidirectional repeatability of the axis, upwards."""
        return float(np.max(self.repeatability_up_at))

    @property
    def repeatability_down(self) -> float:
        """Unidirectional repeatability of the axis, downwards."""
        return float(np.max(self.repeatability_down_at))

    @property
    def repeatability(self) -> float:
        """Bidirectional repeatability of the axis, R = max R_i."""
        return float(np.max(self.repeatability_at))

    @property
    def systematic_up(self) -> float:
        """Unidirectional systematic positioning error, upwards: range of the means."""
        return float(np.ptp(self.mean_up))

    @property
    def systematic_down(self) -> float:
        """Unidirectional systematic positioning error, downwards."""
        return float(np.ptp(self.mean_down))

    @property
    def systematic(self) -> float:
        """Bidirectional systematic positioning error E: range of the means of both directions together."""
        return float(np.ptp(np.concatenate([self.mean_up, self.mean_down])))

    @property
    def mean_error(self) -> float:
        """Mean bidirectional positioning error M: range of the bidirectional means."""
        return float(np.ptp(self.mean))

    @property
    def accuracy_up(self) -> float:
        """Unidirectional accuracy A, upwards: max(mean + 2 s) - min(mean - 2 s)."""
        return _spread([self.mean_up], [self.deviation_up])

    @property
    def accuracy_down(self) -> float:
        """Unidirectional accuracy A, downwards."""
        return _spread([self.mean_down], [self.deviation_down])

    @property
    def accuracy(self) -> float:
        """Bidirectional accuracy A: the same over both directions together."""
        return _spread([self.mean_up, self.mean_down], [self.deviation_up, self.deviation_down])


def iso_230_2(up: ArrayLike, down: ArrayLike) -> PositioningErrors:
    """Positioning errors of an axis by ISO 230-2:2014.

    Args:
        up: deviations at m positions (rows) of n approaches in positive direction.
        down: the same in negative direction.

    Raises:
        InputError: the tables differ in shape, or there are fewer than two approaches.
    """
    tables = [np.atleast_2d(np.asarray(table, dtype=float)) for table in (up, down)]
    if tables[0].shape != tables[1].shape or tables[0].shape[1] < 2:
        raise InputError(
            "ISO 230-2 needs the same positions from both sides, each approached at least twice; found "
            f"tables of shape {tables[0].shape} and {tables[1].shape}"
        )
    return PositioningErrors(tables[0], tables[1])


@dataclass(frozen=True)
class Repeatability:
    """Repeatability by ISO 9283:1998, 7.2.2; the unit is that of the positions.

    Args:
        mean_distance: mean l of the distances from the barycentre.
        deviation: standard deviation S_l of these distances, with n - 1.
    """

    mean_distance: float
    deviation: float

    @property
    def positioning(self) -> float:
        """Positioning repeatability RP_l = l + 3 S_l."""
        return self.mean_distance + 3.0 * self.deviation


def iso_9283_repeatability(attained: ArrayLike) -> Repeatability:
    """Positioning repeatability of attained points.

    Args:
        attained: points, shape (n, k) for k coordinates, or (n,) for one.

    Raises:
        InputError: fewer than two points.
    """
    points = np.asarray(attained, dtype=float)
    points = points[:, None] if points.ndim == 1 else points
    _at_least_two(points)
    distance = np.linalg.norm(points - np.mean(points, axis=0), axis=1)
    return Repeatability(float(np.mean(distance)), float(np.std(distance, ddof=1)))


def iso_9283_angle_repeatability(attained: ArrayLike) -> float:
    """Repeatability of an angle, RP = 3 S (stated as +-RP), S with n - 1 about the mean (ISO 9283, 7.2.2).

    Args:
        attained: angles, shape (n,).

    Raises:
        InputError: fewer than two.
    """
    angles = np.asarray(attained, dtype=float)
    _at_least_two(angles)
    return 3.0 * float(np.std(angles, ddof=1))


def half_range(attained: ArrayLike) -> float:
    """Half of the largest difference of repeated approaches: how makers of the gears state repeatability.

    Source: Harmonic Drive AG, glossary: half the largest difference, preceded by +-.
    """
    return 0.5 * float(np.ptp(np.asarray(attained, dtype=float)))


def _spread(means: list[Array], deviations: list[Array]) -> float:
    mean, deviation = np.concatenate(means), np.concatenate(deviations)
    return float(np.max(mean + 2.0 * deviation) - np.min(mean - 2.0 * deviation))


def _at_least_two(points: Array) -> None:
    if len(points) < 2:
        raise InputError(f"repeatability needs at least two approaches, found {len(points)}")
