"""A contact in series with the bending of its teeth."""

from __future__ import annotations

import numpy as np

from hdsim.contact.law import Array, ContactLaw
from hdsim.errors import InputError


class SeriesLaw(ContactLaw):
    """The same force in a contact and in a linear spring: f(F) = f_contact(F) + F / k.

    Args:
        law: the contact.
        bending_stiffness_n_per_m: stiffness k of the tooth pair in bending, N/m.
    """

    def __init__(self, law: ContactLaw, bending_stiffness_n_per_m: float) -> None:
        if not bending_stiffness_n_per_m > 0.0:
            raise InputError(f"bending stiffness must be positive, found {bending_stiffness_n_per_m} N/m")
        self.law = law
        self.bending_stiffness_n_per_m = bending_stiffness_n_per_m

    @property
    def initial_stiffness_n_per_m(self) -> float:
        """Limit of dF/df as the penetration goes to zero from above, N/m."""
        contact = self.law.initial_stiffness_n_per_m
        return contact * self.bending_stiffness_n_per_m / (contact + self.bending_stiffness_n_per_m)

    @property
    def valid_up_to_n(self) -> float:
        """Force up to which the contact's assumptions hold, N."""
        return self.law.valid_up_to_n

    @property
    def validity(self) -> str:
        """What fails above that force."""
        return self.law.validity

    def _penetration(self, force: Array) -> Array:
        return np.asarray(self.law._penetration(force) + force / self.bending_stiffness_n_per_m)

    def _force(self, penetration: Array) -> Array:
        from scipy.optimize.elementwise import find_root

        k = self.bending_stiffness_n_per_m
        upper = k * penetration

        def excess(force: Array, target: Array) -> Array:
            return self._penetration(np.maximum(force, np.finfo(float).tiny)) - target

        # A hair wider than the exact bracket, which rounding may close on the root.
        return np.asarray(
            find_root(excess, (np.zeros_like(upper), upper * (1.0 + 1e-9)), args=(penetration,)).x
        )

    def _stiffness(self, force: Array) -> Array:
        contact = self.law._stiffness(force)
        return np.asarray(
            contact * self.bending_stiffness_n_per_m / (contact + self.bending_stiffness_n_per_m)
        )

    def _energy(self, force: Array) -> Array:
        return np.asarray(self.law._energy(force) + force**2 / (2.0 * self.bending_stiffness_n_per_m))
