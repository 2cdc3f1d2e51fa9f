"""The Majumdar-Bhushan contact of a fractal surface and a plane: Eq. 2-13 of the source, errata mended.

Source: Zhang et al. (2021), doi:10.21203/rs.3.rs-652069/v1, after Majumdar and Bhushan (1990),
J. Tribology 112:205, and Yan and Komvopoulos (1998), J. Appl. Phys. 84:3617. Two places are mended:

* Eq. 9 and 10 integrate the plastic asperities up to a_c even when the largest is smaller. The upper limit
  here is min(a_l, a_c); as printed the force below the all-plastic limit is too large by
  (a_c/a_l)^((3-D)/2).
* Eq. 8 has a singular factor 1/(5-2D), removable, and a branch for D = 2.5; here one form holds for all D.

Eq. 11 differentiates along the asperity's *size*; an asperity of fixed shape has, by Hertz, the factor 3/2
in place of (4-D)/(3-D). Both are offered.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from hdsim.contact.law import Array
from hdsim.errors import InputError

AsperityStiffness = Literal["printed", "fixed-asperity"]


def domain_extension_factor(D: float) -> float:
    """Root psi of Eq. 7, between e - 1 (D -> 3) and the square of the golden ratio (D -> 2).

    Args:
        D: fractal dimension, 2 < D < 3.
    """
    from scipy.optimize import brentq

    if not 2.0 < D < 3.0:
        raise InputError(f"fractal dimension D must lie between 2 and 3, found {D}")
    half = (3.0 - D) / 2.0

    def residual(log_psi: float) -> float:
        # Eq. 7 divided by (3-D), written with expm1: it keeps its digits as D tends to 3.
        second = -2.0 * half / (D - 1.0) * math.log1p(math.exp((1.0 - D) / 2.0 * log_psi))
        return (math.expm1(half * log_psi) - math.expm1(second)) / (2.0 * half) - 1.0 / (D - 1.0)

    return math.exp(brentq(residual, 0.0, 2.0, xtol=1e-15, rtol=1e-14))


@dataclass(frozen=True)
class Asperities:
    """The asperities of an equivalent rough surface, and what they carry together.

    Areas a are truncated areas of single asperities, a_l that of the largest in contact, all in m^2, numbers
    or arrays of any shape.

    Args:
        D: fractal dimension, 2 < D < 3.
        G_m: fractal roughness, m.
        reduced_modulus_pa: E, 1/E = (1-nu1^2)/E1 + (1-nu2^2)/E2, Pa.
        hardness_pa: hardness H of the softer flank, Pa.
        poisson_ratio: Poisson's ratio of the softer flank.
        gamma: density of asperities.
        asperity_stiffness: ``printed`` (Eq. 11) or ``fixed-asperity`` (Hertz).
    """

    D: float
    G_m: float
    reduced_modulus_pa: float
    hardness_pa: float
    poisson_ratio: float
    gamma: float = 1.5
    asperity_stiffness: AsperityStiffness = "printed"

    def __post_init__(self) -> None:
        if not 2.0 < self.D < 3.0:
            raise InputError(f"fractal dimension D must lie between 2 and 3, found {self.D}")
        if self.asperity_stiffness not in ("printed", "fixed-asperity"):
            raise InputError(
                f"asperity_stiffness must be 'printed' or 'fixed-asperity', found {self.asperity_stiffness!r}"
            )
        for name in ("G_m", "reduced_modulus_pa", "hardness_pa"):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise InputError(f"{name} must be positive, found {value}")
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(
                f"Poisson's ratio must lie above -1 and not above 0.5, found {self.poisson_ratio}"
            )
        if not self.gamma > 1.0:
            raise InputError(f"gamma must exceed 1, found {self.gamma}")

    @property
    def k(self) -> float:
        """Mean contact pressure at first yield over hardness, k = 0.454 + 0.41 nu."""
        return 0.454 + 0.41 * self.poisson_ratio

    @cached_property
    def psi(self) -> float:
        """Domain extension factor, Eq. 7."""
        return domain_extension_factor(self.D)

    @cached_property
    def _psi_power(self) -> float:
        return float(self.psi ** ((3.0 - self.D) / 2.0))

    def curvature_radius(self, a: ArrayLike) -> Array:
        """Radius R of an asperity, Eq. 2, m."""
        a, D = np.asarray(a, dtype=float), self.D
        below = 2.0 ** (5.0 - D) * math.pi ** ((D - 1.0) / 2.0) * math.sqrt(math.log(self.gamma))
        return np.asarray(a ** ((D - 1.0) / 2.0) * self.G_m ** (2.0 - D) / below)

    def deformation(self, a: ArrayLike) -> Array:
        """Deformation delta of an asperity of truncated radius r' = sqrt(a / pi), Eq. 3, m."""
        diameter = 2.0 * np.sqrt(np.asarray(a, dtype=float) / math.pi)
        return np.asarray(
            2.0 * diameter * (self.G_m / diameter) ** (self.D - 2.0) * math.sqrt(math.log(self.gamma))
        )

    def critical_deformation(self, a: ArrayLike) -> Array:
        """Deformation delta_c at which an asperity of size a yields, Eq. 4, m."""
        ratio = math.pi * self.k * self.hardness_pa / (2.0 * self.reduced_modulus_pa)
        return np.asarray(ratio**2 * self.curvature_radius(a))

    @cached_property
    def critical_area(self) -> float:
        """Truncated area a_c below which an asperity is plastic, Eq. 5, m^2."""
        D = self.D
        yielding = self.reduced_modulus_pa / (self.k * self.hardness_pa)
        bracket = 2.0 ** (11.0 - 2.0 * D) * math.log(self.gamma) * yielding**2 / math.pi ** (4.0 - D)
        exponent = math.log(bracket) / (D - 2.0) + 2.0 * math.log(self.G_m)
        if not -600.0 < exponent < 600.0:
            raise InputError(
                f"D = {self.D} with G = {self.G_m:g} m puts the critical area (Eq. 5) at e^{exponent:.0f} "
                "m^2, outside any contact; D is too close to 2"
            )
        return math.exp(exponent)

    def distribution(self, a: ArrayLike, a_l: ArrayLike) -> Array:
        """Number of asperities per truncated area, n(a) for 0 < a <= a_l, Eq. 6, 1/m^2."""
        q = (self.D - 1.0) / 2.0
        a, a_l = np.asarray(a, dtype=float), np.asarray(a_l, dtype=float)
        return np.asarray(q * self._psi_power * (a_l / a) ** q / a)

    def asperity_elastic_force(self, a: ArrayLike) -> Array:
        """Force of an elastic asperity, f_e = 4/3 E R^(1/2) delta^(3/2), N."""
        delta = self.deformation(a)
        return np.asarray(
            4.0 / 3.0 * self.reduced_modulus_pa * np.sqrt(self.curvature_radius(a) * delta) * delta
        )

    def asperity_plastic_force(self, a: ArrayLike) -> Array:
        """Force of a plastic asperity, f_p = H a, N."""
        return np.asarray(self.hardness_pa * np.asarray(a, dtype=float))

    def asperity_contact_stiffness(self, a: ArrayLike) -> Array:
        """Stiffness of an elastic asperity, Eq. 11, N/m."""
        return np.asarray(self._stiffness_coefficient * np.sqrt(np.asarray(a, dtype=float)))

    @property
    def _stiffness_coefficient(self) -> float:
        factor = (4.0 - self.D) / (3.0 - self.D) if self.asperity_stiffness == "printed" else 1.5
        return 2.0 * math.sqrt(2.0 / math.pi) / 3.0 * self.reduced_modulus_pa * factor

    def elastic_load(self, a_l: ArrayLike) -> Array:
        """Load F_e of all elastic asperities, Eq. 8, N; zero for a_l <= a_c."""
        D = self.D
        front = (
            2.0 ** ((11.0 - 2.0 * D) / 2.0) / (3.0 * math.pi ** ((4.0 - D) / 2.0)) * (D - 1.0) / 2.0
        ) * math.sqrt(math.log(self.gamma))
        front *= self.G_m ** (D - 2.0) * self.reduced_modulus_pa * self._psi_power
        a_l = np.asarray(a_l, dtype=float)
        return np.asarray(front * a_l ** ((D - 1.0) / 2.0) * self._power_integral(a_l, (5.0 - 2.0 * D) / 2.0))

    def plastic_load(self, a_l: ArrayLike) -> Array:
        """Load F_p of all plastic asperities, Eq. 9 with the upper limit min(a_l, a_c), N."""
        D = self.D
        a_l = np.asarray(a_l, dtype=float)
        limit = np.minimum(a_l, self.critical_area)
        front = self.hardness_pa * (D - 1.0) / (3.0 - D) * self._psi_power
        return np.asarray(front * a_l ** ((D - 1.0) / 2.0) * limit ** ((3.0 - D) / 2.0))

    def load(self, a_l: ArrayLike) -> Array:
        """Total load F, Eq. 10, N."""
        return np.asarray(self.elastic_load(a_l) + self.plastic_load(a_l))

    def load_slope(self, a_l: ArrayLike) -> Array:
        """Slope dF / d ln(a_l) of the load, N, for a_l >= a_c."""
        q = (self.D - 1.0) / 2.0
        return np.asarray(q * (self._psi_power * self.asperity_elastic_force(a_l) + self.load(a_l)))

    def stiffness(self, a_l: ArrayLike) -> Array:
        """Contact stiffness K of all elastic asperities, Eq. 12 and 13, N/m; zero for a_l <= a_c."""
        D = self.D
        a_l = np.asarray(a_l, dtype=float)
        front = self._stiffness_coefficient * (D - 1.0) / 2.0 * self._psi_power
        return np.asarray(front * a_l ** ((D - 1.0) / 2.0) * self._power_integral(a_l, (2.0 - D) / 2.0))

    def truncated_area(self, a_l: ArrayLike) -> Array:
        """Sum of all truncated areas, (D-1)/(3-D) psi^((3-D)/2) a_l, m^2."""
        return np.asarray((self.D - 1.0) / (3.0 - self.D) * self._psi_power * np.asarray(a_l, dtype=float))

    def _power_integral(self, a_l: Array, s: float) -> Array:
        """Integral of a^(s-1) from a_c to a_l, by one form for s = 0 and s != 0; zero for a_l <= a_c."""
        from scipy.special import exprel

        ratio = np.log(np.maximum(a_l / self.critical_area, 1.0))
        return np.asarray(self.critical_area**s * ratio * exprel(s * ratio))
