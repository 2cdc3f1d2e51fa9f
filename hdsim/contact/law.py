"""The contract of a contact law: one tooth pair, its normal force over penetration and the inverse."""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class ValidityWarning(UserWarning):
    """A contact law was used outside the range in which its assumptions hold."""


class ContactLaw(ABC):
    """Normal contact of one tooth pair.

    Penetration f (m) is what is left of the approach once the gap is closed; force F (N) pushes the flanks
    apart and never pulls: force, stiffness and energy are zero for f <= 0, penetration is zero for F <= 0.
    Force rises strictly with penetration, so every law has an inverse. All methods take numbers or arrays of
    any shape and return arrays of that shape (0-d for a number).

    A subclass defines ``_penetration``, ``_force``, ``_stiffness`` and ``_energy`` for flat arrays of
    positive numbers only.
    """

    def force(self, penetration_m: ArrayLike) -> Array:
        """Normal force F(f), N."""
        return self._told(_where_positive(self._force, penetration_m))

    def penetration(self, force_n: ArrayLike) -> Array:
        """Penetration f(F), m, the inverse of ``force``."""
        self._told(np.asarray(force_n, dtype=float))
        return _where_positive(self._penetration, force_n)

    def stiffness_at_force(self, force_n: ArrayLike) -> Array:
        """Tangent stiffness dF/df at a force, N/m."""
        self._told(np.asarray(force_n, dtype=float))
        return _where_positive(self._stiffness, force_n)

    def stiffness(self, penetration_m: ArrayLike) -> Array:
        """Tangent stiffness dF/df at a penetration, N/m."""
        return _where_positive(self._stiffness, self.force(penetration_m))

    def energy(self, penetration_m: ArrayLike) -> Array:
        """Stored energy U(f), the integral of F from 0 to f, J."""
        return _where_positive(self._energy, self.force(penetration_m))

    def energy_at_force(self, force_n: ArrayLike) -> Array:
        """Stored energy at a force, J."""
        self._told(np.asarray(force_n, dtype=float))
        return _where_positive(self._energy, force_n)

    @property
    def valid_up_to_n(self) -> float:
        """Force up to which the law's assumptions hold, N; larger ones are answered with a warning."""
        return math.inf

    @property
    def validity(self) -> str:
        """What fails above that force, for the warning."""
        return ""

    def warn_beyond_validity(self, force_n: float) -> None:
        """Warn when the law's assumptions do not hold up to a force, N."""
        self._told(np.asarray([force_n]))

    def _told(self, force: Array) -> Array:
        """Warn when a force is beyond the law's validity; hand it on."""
        if force.size and np.max(force) > self.valid_up_to_n:
            warnings.warn(f"{np.max(force):.4g} N: {self.validity}", ValidityWarning, stacklevel=3)
        return force

    @property
    def initial_stiffness_n_per_m(self) -> float:
        """Limit of dF/df as the penetration goes to zero from above, N/m."""
        return 0.0

    @abstractmethod
    def _penetration(self, force: Array) -> Array:
        """Penetration (m) at forces > 0 (N), both of shape (n,)."""

    @abstractmethod
    def _force(self, penetration: Array) -> Array:
        """Force (N) at penetrations > 0 (m), both of shape (n,)."""

    @abstractmethod
    def _stiffness(self, force: Array) -> Array:
        """dF/df (N/m) at forces > 0 (N), both of shape (n,)."""

    @abstractmethod
    def _energy(self, force: Array) -> Array:
        """Stored energy (J) at forces > 0 (N), both of shape (n,)."""


def _where_positive(function: Callable[[Array], Array], x: ArrayLike) -> Array:
    """Apply ``function`` where x > 0, zero elsewhere; NaN stays NaN."""
    x = np.asarray(x, dtype=float)
    result = np.where(np.isnan(x), np.nan, 0.0)
    positive = x > 0.0
    if positive.any():
        result[positive] = function(x[positive])
    return result
