"""From SI units to those that engineers read."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unit:
    """A unit for an axis: ``shown = factor * value in SI``."""

    name: str
    factor: float


ARCSEC = Unit("arcsec", math.degrees(1.0) * 3600.0)
ARCMIN = Unit("arcmin", math.degrees(1.0) * 60.0)
DEGREE = Unit("deg", math.degrees(1.0))
TURN = Unit("turns", 1.0 / (2.0 * math.pi))
RPM = Unit("rpm", 30.0 / math.pi)
NEWTON_METRE = Unit("N m", 1.0)
MILLINEWTON_METRE = Unit("mN m", 1000.0)
CELSIUS = Unit("degC", 1.0)
SECOND = Unit("s", 1.0)
MINUTE = Unit("min", 1.0 / 60.0)


def printed(unit: str) -> str:
    """A unit with the signs of print: ``kg m^2`` is kg m²."""
    unit = "µm" if unit == "um" else unit
    return unit.replace("^2", "²").replace("^3", "³").replace("degC", "°C")


def largest(*curves: Array) -> float:
    """Largest finite absolute value of all curves; 0 for none."""
    return max(
        (float(np.max(np.abs(c[np.isfinite(c)]), initial=0.0)) for c in curves),
        default=0.0,
    )


def for_angle(size_rad: float) -> Unit:
    """Unit for an angle of this size."""
    if size_rad > 5 * 2 * math.pi:
        return TURN
    if size_rad > math.radians(0.5):
        return DEGREE
    return for_error(size_rad)


def for_error(size_rad: float) -> Unit:
    """Unit for an error: arcsec as long as its numbers stay readable."""
    if size_rad > math.radians(1.5):
        return DEGREE
    return ARCSEC if size_rad <= math.radians(5000.0 / 3600.0) else ARCMIN


def for_torque(size_nm: float) -> Unit:
    """Unit for a torque."""
    return NEWTON_METRE if size_nm >= 1.0 else MILLINEWTON_METRE


def for_duration(size_s: float) -> Unit:
    """Unit for the time axis."""
    return MINUTE if size_s > 300.0 else SECOND
