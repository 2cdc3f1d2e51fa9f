"""Line contact of two smooth flanks."""

from __future__ import annotations

import math

import numpy as np

from hdsim.contact.law import Array, ContactLaw
from hdsim.errors import InputError


class HertzLine(ContactLaw):
    """Cylinder of finite length on a half-space: Hertz pressure over a strip, Boussinesq displacement.

    A semi-elliptic pressure of total force F over a strip of length l and half-width b,
    b^2 = 4 F R / (pi E* l), displaces the middle of the strip by

        f(F) = F / (pi E* l) * (1 + ln(pi E* l^3 / (F R)))

    with 1/E* = (1-nu1^2)/E1 + (1-nu2^2)/E2; the depth of the bodies does not enter because the length is
    finite. Then dF/df = pi E* l / ln(pi E* l^3 / (F R)), and F(f) is a Lambert W function.

    Sources: Puttock and Thwaite (1969), Elastic Compression of Spheres and Cylinders at Point and Line
    Contact, CSIRO, case of a cylinder on a plane; Johnson (1985), Contact Mechanics, sections 4.2(c) and 5.6.

    The formula needs b << l. It is continued along its tangent beyond b = l / 4, with a warning.

    Args:
        length_m: length l of the line of contact (face width), m.
        radius_m: relative radius of curvature R, 1/R = 1/R1 + 1/R2, m.
        reduced_modulus_pa: E*, Pa.
    """

    def __init__(self, length_m: float, radius_m: float, reduced_modulus_pa: float) -> None:
        for name, value in (
            ("length", length_m),
            ("radius", radius_m),
            ("reduced modulus", reduced_modulus_pa),
        ):
            if not value > 0.0:
                raise InputError(f"{name} of a line contact must be positive, found {value}")
        self.length_m, self.radius_m, self.reduced_modulus_pa = length_m, radius_m, reduced_modulus_pa
        self._rigidity = math.pi * reduced_modulus_pa * length_m  # N/m
        self._scale = math.pi * reduced_modulus_pa * length_m**3 / radius_m  # N; F / scale = (b / 2l)^2
        self.limit_force_n = self._scale / 64.0
        self._limit = float(self._inside(np.array([self.limit_force_n]))[0])
        self._limit_stiffness = self._rigidity / math.log(64.0)

    def half_width(self, force_n: float) -> float:
        """Half-width b of the strip of contact, m."""
        return 2.0 * math.sqrt(force_n * self.radius_m / self._rigidity)

    def _inside(self, force: Array) -> Array:
        return np.asarray(force / self._rigidity * (1.0 + math.log(self._scale) - np.log(force)))

    @property
    def valid_up_to_n(self) -> float:
        """Force at which the strip is half as wide as it is long, N."""
        return self.limit_force_n

    @property
    def validity(self) -> str:
        """What fails above that force."""
        return (
            f"above {self.limit_force_n:.4g} N the strip of contact is wider than half its length; "
            "the law is continued along its tangent"
        )

    def _penetration(self, force: Array) -> Array:
        inside = self._inside(np.minimum(force, self.limit_force_n))
        return np.asarray(inside + np.maximum(force - self.limit_force_n, 0.0) / self._limit_stiffness)

    def _force(self, penetration: Array) -> Array:
        from scipy.special import lambertw

        # t (1 - ln t) = y with t = F / scale: with w = 1 - ln t it reads w exp(-w) = y / e.
        y = np.minimum(penetration, self._limit) * self._rigidity / self._scale
        w = -lambertw(-y / math.e, -1).real
        # Deep in the denormals W_-1 overflows; the force is then zero to every digit.
        force = np.where(np.isfinite(w), y / w * self._scale, 0.0)
        return np.asarray(force + np.maximum(penetration - self._limit, 0.0) * self._limit_stiffness)

    def _stiffness(self, force: Array) -> Array:
        inside = np.minimum(np.maximum(force, np.finfo(float).tiny), self.limit_force_n)
        return np.asarray(self._rigidity / np.log(self._scale / inside))

    def _energy(self, force: Array) -> Array:
        inside = np.minimum(np.maximum(force, np.finfo(float).tiny), self.limit_force_n)
        energy = inside**2 / self._rigidity * (0.5 * np.log(self._scale / inside) + 0.25)
        over = np.maximum(force**2 - self.limit_force_n**2, 0.0)
        return np.asarray(energy + over / (2.0 * self._limit_stiffness))
