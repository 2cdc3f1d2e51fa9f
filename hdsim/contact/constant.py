"""Linear contact: one stiffness."""

from __future__ import annotations

import numpy as np

from hdsim.contact.law import Array, ContactLaw
from hdsim.errors import InputError


class ConstantStiffness(ContactLaw):
    """F = K f.

    Args:
        stiffness_n_per_m: K, N/m.
    """

    def __init__(self, stiffness_n_per_m: float) -> None:
        if not stiffness_n_per_m > 0.0:
            raise InputError(f"contact stiffness must be positive, found {stiffness_n_per_m} N/m")
        self.stiffness_n_per_m = stiffness_n_per_m

    @property
    def initial_stiffness_n_per_m(self) -> float:
        """K, N/m."""
        return self.stiffness_n_per_m

    def _penetration(self, force: Array) -> Array:
        return force / self.stiffness_n_per_m

    def _force(self, penetration: Array) -> Array:
        return penetration * self.stiffness_n_per_m

    def _stiffness(self, force: Array) -> Array:
        return np.full_like(force, self.stiffness_n_per_m)

    def _energy(self, force: Array) -> Array:
        return np.asarray(force**2 / (2.0 * self.stiffness_n_per_m))
