"""Majumdar-Bhushan fractal contact as a law: force, stiffness and energy over penetration."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.contact.asperities import Asperities, AsperityStiffness
from hdsim.contact.law import Array, ContactLaw, ValidityWarning
from hdsim.errors import InputError

#: A tenth of the mean tooth load of the source's drive at its rated torque (34.67 N).
FLOOR_FORCE_N = 3.5
#: Face width 10 mm times a tooth height of 0.5 mm: the whole flank.
NOMINAL_AREA_M2 = 5.0e-6
#: Force up to which the law is integrated; it goes on along its tangent beyond.
_TOP_FORCE_N = 1e6
_CELL = 0.125  # width of a quadrature cell in ln(a_l)
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class MajumdarBhushan(ContactLaw):
    """The law that Eq. 2-13 of Zhang et al. (2021) imply: df = dF / K(F).

    The equations (``equations``, see ``hdsim.contact.asperities``) give force and stiffness over the area a_l
    of the largest contact; eliminating it gives K(F), and the penetration is f(F) = integral of dF / K.
    Eq. 13 makes K zero as long as every asperity is plastic, so that integral diverges at its lower end. It
    starts from a floor instead:

        K(F) = max(K_MB(F), K_MB(F_floor)),

    hence F is linear in f up to F_floor and continuously differentiable for f > 0. F_floor is
    ``floor_force_n``, but at least the force at which the largest contact is twice the
    critical area, where K_MB is safely above zero; a warning tells when this raises the floor.

    A second warning tells when a force asks for more truncated area than the nominal area has.

    Args:
        D: fractal dimension of the equivalent surface, 2 < D < 3.
        G_m: its fractal roughness, m.
        reduced_modulus_pa: E, 1/E = (1-nu1^2)/E1 + (1-nu2^2)/E2, Pa.
        hardness_pa: hardness of the softer flank, Pa.
        poisson_ratio: Poisson's ratio of the softer flank.
        asperity_stiffness: ``printed`` (Eq. 11) or ``fixed-asperity`` (Hertz's factor 3/2).
        floor_force_n: force below which the stiffness is constant, N.
        nominal_area_m2: area on which the flanks can touch, m^2.
        gamma: density of asperities.
    """

    def __init__(
        self,
        D: float,
        G_m: float,
        reduced_modulus_pa: float,
        hardness_pa: float,
        poisson_ratio: float,
        asperity_stiffness: AsperityStiffness = "printed",
        *,
        floor_force_n: float = FLOOR_FORCE_N,
        nominal_area_m2: float = NOMINAL_AREA_M2,
        gamma: float = 1.5,
    ) -> None:
        if not floor_force_n > 0.0 or not nominal_area_m2 > 0.0:
            raise InputError(
                f"floor force and nominal area must be positive, found {floor_force_n} and {nominal_area_m2}"
            )
        self.equations = Asperities(
            D, G_m, reduced_modulus_pa, hardness_pa, poisson_ratio, gamma, asperity_stiffness
        )
        self.nominal_area_m2 = nominal_area_m2
        self.all_plastic_force_n = float(self.equations.load(self.critical_area))
        lowest = float(self.equations.load(2.0 * self.critical_area))
        if lowest > floor_force_n:
            warnings.warn(
                f"below {self.all_plastic_force_n:.3g} N every asperity is plastic and Eq. 13 gives no "
                f"stiffness; the constant stiffness reaches up to {lowest:.3g} N, not {floor_force_n:.3g} N",
                ValidityWarning,
                stacklevel=2,
            )
        self.floor_force_n = max(floor_force_n, lowest)
        self._integrate()
        largest = nominal_area_m2 / float(self.equations.truncated_area(1.0))
        self.area_bound_force_n = float(self.equations.load(largest))

    @property
    def critical_area(self) -> float:
        """Truncated area a_c below which an asperity is plastic, Eq. 5, m^2."""
        return self.equations.critical_area

    @property
    def initial_stiffness_n_per_m(self) -> float:
        """K_MB at the floor force, N/m."""
        return self._floor_stiffness

    def a_l(self, force_n: ArrayLike) -> Array:
        """Truncated area of the largest contact at a force (the inverse of Eq. 10), m^2."""
        from scipy.optimize.elementwise import find_root

        force = np.asarray(force_n, dtype=float)
        result = np.zeros_like(force)
        plastic = (force > 0.0) & (force <= self.all_plastic_force_n)
        result[plastic] = self.critical_area * force[plastic] / self.all_plastic_force_n
        elastic = force > self.all_plastic_force_n
        if elastic.any():
            # Above a_c the load grows at least as a_l^((D-1)/2), which bounds the root from above.
            q = (self.equations.D - 1.0) / 2.0
            low = math.log(self.critical_area)
            high = low + np.log(force[elastic] / self.all_plastic_force_n) / q
            result[elastic] = np.exp(
                self._root(find_root, force[elastic], np.full_like(high, low), high + 1e-9)
            )
        return result

    def truncated_area(self, force_n: ArrayLike) -> Array:
        """Sum of all truncated areas at a force, m^2; the law wants it below the nominal area."""
        return self.equations.truncated_area(self.a_l(force_n))

    def unfloored_stiffness(self, force_n: ArrayLike) -> Array:
        """K_MB(F) of Eq. 12 and 13 alone, zero below the all-plastic limit, N/m."""
        return self.equations.stiffness(self.a_l(force_n))

    def _root(self, find_root: Any, force: Array, low: Array, high: Array) -> Array:
        """ln(a_l) at forces between those of the bracket."""
        return np.asarray(
            find_root(lambda u, F: np.log(self.equations.load(np.exp(u)) / F), (low, high), args=(force,)).x
        )

    def _integrate(self) -> None:
        """Penetration and energy at nodes of u = ln(a_l), from the floor to the top force."""
        top = max(_TOP_FORCE_N, 1e3 * self.floor_force_n)
        first, last = np.log(self.a_l([self.floor_force_n, top]))
        self._nodes = np.linspace(first, last, 2 + math.ceil((last - first) / _CELL))
        self._node_force = self.equations.load(np.exp(self._nodes))
        self._floor_stiffness = float(self.equations.stiffness(math.exp(first)))
        self._top_stiffness = float(self.equations.stiffness(math.exp(last)))
        # The floor's own force, with the rounding of ln and exp in it, so that the pieces meet exactly.
        self.floor_force_n = float(self._node_force[0])
        f0 = self.floor_force_n / self._floor_stiffness
        steps = self._quadrature(self._nodes[:-1], self._nodes[1:])
        self._node_penetration = f0 + np.concatenate([[0.0], np.cumsum(steps[0])])
        self._node_energy = 0.5 * self.floor_force_n * f0 + np.concatenate([[0.0], np.cumsum(steps[1])])

    def _quadrature(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Integrals of dF/K and of F dF/K between two values of ln(a_l) in one cell."""
        half = 0.5 * (end - start)
        a = np.exp(start[..., None] + half[..., None] * (1.0 + _POINTS))
        slope = self.equations.load_slope(a) / self.equations.stiffness(a)
        return half * (slope @ _WEIGHTS), half * ((slope * self.equations.load(a)) @ _WEIGHTS)

    @property
    def valid_up_to_n(self) -> float:
        """Force from which on the truncated area exceeds the nominal area, N."""
        return self.area_bound_force_n

    @property
    def validity(self) -> str:
        """What fails above that force."""
        return (
            f"the truncated area exceeds the nominal {self.nominal_area_m2:.3g} m^2 from "
            f"{self.area_bound_force_n:.4g} N on; the asperities no longer fit on the flank"
        )

    def _area(self, force: Array) -> tuple[NDArray[np.intp], Array]:
        """Cell and ln(a_l) of forces between floor and top."""
        from scipy.optimize.elementwise import find_root

        cell = np.clip(np.searchsorted(self._node_force, force) - 1, 0, len(self._nodes) - 2)
        return cell, self._root(find_root, force, self._nodes[cell] - 1e-12, self._nodes[cell + 1] + 1e-12)

    def _penetration(self, force: Array) -> Array:
        floor, top = self.floor_force_n, self._node_force[-1]
        cell, u = self._area(np.clip(force, floor, top))
        inside = self._node_penetration[cell] + self._quadrature(self._nodes[cell], u)[0]
        above = np.maximum(force - top, 0.0) / self._top_stiffness
        return np.where(force <= floor, force / self._floor_stiffness, inside + above)

    def _force(self, penetration: Array) -> Array:
        from scipy.optimize.elementwise import find_root

        f0, f1 = self._node_penetration[0], self._node_penetration[-1]
        f = np.clip(penetration, f0, f1)
        cell = np.clip(np.searchsorted(self._node_penetration, f) - 1, 0, len(self._nodes) - 2)
        low, high = self._nodes[cell], self._nodes[cell + 1]

        def excess(u: Array, target: Array, start: Array, before: Array) -> Array:
            return before + self._quadrature(start, u)[0] - target

        args = (f, low, self._node_penetration[cell])
        u = find_root(excess, (low - 1e-12, high + 1e-12), args=args).x
        force = self.equations.load(np.exp(u)) + np.maximum(penetration - f1, 0.0) * self._top_stiffness
        force = np.where(penetration <= f0, penetration * self._floor_stiffness, force)
        return force

    def _stiffness(self, force: Array) -> Array:
        a = np.exp(self._area(np.clip(force, self.floor_force_n, self._node_force[-1]))[1])
        return np.maximum(self.equations.stiffness(a), self._floor_stiffness)

    def _energy(self, force: Array) -> Array:
        floor, top = self.floor_force_n, self._node_force[-1]
        cell, u = self._area(np.clip(force, floor, top))
        inside = self._node_energy[cell] + self._quadrature(self._nodes[cell], u)[1]
        above = np.maximum(force**2 - top**2, 0.0) / (2.0 * self._top_stiffness)
        return np.where(force <= floor, force**2 / (2.0 * self._floor_stiffness), inside + above)
