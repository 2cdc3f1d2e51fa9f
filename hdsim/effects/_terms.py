"""The terms of a fitting: fields of an effect in which its trace is, nearly, proportional to a coefficient.

A term knows how many coefficients it has, within which bounds, how they are written into the effect's
settings, and what a fit's result says of its fields.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from hdsim.nested import at, put

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Coefficient below which a compliance in series counts as none.
STIFF = 1e-6
#: A fit stays this part of a limit inside, so that what it finds is a legal setting; and the part of a limit
#: within which a number stands there: less than what one step of a finite difference moves it.
INSIDE, LIMIT = 1e-3, 0.02

#: Least and largest value of a field, by its path in the effect.
Limits = Callable[[str], tuple[float, float]]
Values = Sequence[float]
Settings = dict[str, Any]


class Ranged(NamedTuple):
    """A fitted field with its 95 % interval; none where it is exact."""

    value: float
    low: float = math.nan
    high: float = math.nan


Found = dict[str, Ranged]


class Term:
    """What the terms of a fitting have in common; the coefficients are the term's own."""

    #: Field of the stiffness, where it is a compliance in series with the drive's spring.
    series_field = ""
    #: Whether it is the width of a play in series with it.
    play = False
    #: Name of the range that its units are parts of, if any.
    of_range = ""
    #: Path of the list that it adds items to, if any.
    list_path = ""

    def count(self, orders: Values) -> int:
        """Number of coefficients.

        Args:
            orders: orders per wave-generator turn that were read from the data.
        """
        return 1

    def may_be_negative(self) -> bool:
        """Whether its coefficients have a sign."""
        return False

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """Least and largest value of each coefficient."""
        return (-math.inf, math.inf) if self.may_be_negative() else (0.0, math.inf)

    def paths(self) -> tuple[str, ...]:
        """Fields that it moves, phases included; those of a list's items as of its first."""
        raise NotImplementedError

    def write(self, data: Settings, c: Values, orders: Values, before: dict[str, float]) -> None:
        """Write its fields into an effect's settings.

        Args:
            data: the settings.
            c: its coefficients.
            orders: orders of periodic terms.
            before: what terms before it gave to each field; added to.
        """
        raise NotImplementedError

    def read(self, data: Settings, orders: Values) -> list[float]:
        """Coefficients at which its fields are as an effect's settings have them; 0 where they have none.

        Args:
            data: the settings.
            orders: orders of periodic terms.
        """
        return [0.0] * self.count(orders)

    def at_end(self, c: Values, plausible: Limits) -> bool:
        """Whether a field is as strong as its range allows: what is fitted would rather be something else."""
        raise NotImplementedError

    def rescaled(self, factor: float) -> Self:
        """The same term with a unit that is worth ``factor`` times as much."""
        raise NotImplementedError

    def strengths(self) -> Mapping[str, float]:
        """Fields that say how strong it is, with their values at coefficient 1; a compliance has none."""
        return {}

    def orders_among(self, lines: Iterable[tuple[str, float]], most: int) -> tuple[float, ...] | None:
        """Orders that it reads from order spectra; None where it finds none and needs some.

        Args:
            lines: channel and order of each peak, the largest first.
            most: number of orders; beyond them whole ones only, if any.
        """
        return ()

    def orders_shared(self, orders: Values) -> tuple[float, ...]:
        """Of the orders that another fitting has read from the data those that this term reads, too."""
        return ()

    def sized(self, ranges: Mapping[str, float]) -> Self:
        """The term in units of its own, where they are parts of a range that the record covers."""
        return self

    def report(self, found: Found, c: Values, covariance: Array, orders: Values, items: int) -> None:
        """Say what a fit found of its fields.

        Args:
            found: by path; added to.
            c: its coefficients.
            covariance: of them, scaled so that two standard deviations are a 95 % interval.
            orders: orders of periodic terms.
            items: number of items that its list has before.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class Amplitude(Term):
    """Fields that grow in proportion to one coefficient.

    Args:
        units: field to its value at coefficient 1; negative where the effect is not odd in it, and its two
            signs are two ways of fitting.
        signed: the coefficient may be negative.
        of_range: the units are parts of a range that the record covers: ``twist_arcmin``, if any.
        play: the units are the width of a play in series with the drive's spring. Its trace beside the
            spring's is the spring beyond the play: its size says how stiff that is, not how wide the play.
    """

    units: Mapping[str, float]
    signed: bool = False
    of_range: str = ""
    play: bool = False

    def paths(self) -> tuple[str, ...]:
        """All that have a unit."""
        return tuple(self.units)

    def may_be_negative(self) -> bool:
        """As declared."""
        return self.signed

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """From the fields' own limits; where they bound both signs, a negative coefficient has one too."""
        least, most = super().bounds(limits)
        for path, unit in self.units.items():
            low, high = sorted(limit / unit for limit in limits(path))
            most = min(most, (1.0 - INSIDE) * high)
            if self.signed:
                least = max(least, (1.0 - INSIDE) * low)
        return least, most

    def write(self, data: Settings, c: Values, orders: Values, before: dict[str, float]) -> None:
        """Each field is its unit times the coefficient, on top of what the terms before gave it."""
        for path, unit in self.units.items():
            before[path] = before.get(path, 0.0) + c[0] * unit
            put(data, path, before[path])

    def read(self, data: Settings, orders: Values) -> list[float]:
        """By the first field."""
        path, unit = next(iter(self.units.items()))
        return [_number(data, path) / unit]

    def at_end(self, c: Values, plausible: Limits) -> bool:
        """At the upper end, or, of a signed one, at the lower."""
        return any(_strongest(c[0] * unit, *plausible(path)) for path, unit in self.units.items())

    def rescaled(self, factor: float) -> Self:
        """Every unit times the factor."""
        return replace(self, units={path: unit * factor for path, unit in self.units.items()})

    def strengths(self) -> Mapping[str, float]:
        """All that have a unit."""
        return self.units

    def sized(self, ranges: Mapping[str, float]) -> Self:
        """The parts times the range."""
        return replace(self.rescaled(ranges[self.of_range]), of_range="") if self.of_range else self

    def report(self, found: Found, c: Values, covariance: Array, orders: Values, items: int) -> None:
        """Each field; what several terms add to one is the fitting's (``Fitting.report``)."""
        half = 2.0 * math.sqrt(max(float(covariance[0, 0]), 0.0))
        low = c[0] - half if self.signed else max(c[0] - half, 0.0)
        for path, unit in self.units.items():
            ends = sorted((unit * low, unit * (c[0] + half)))
            found[path] = Ranged(unit * c[0], *ends)


@dataclass(frozen=True)
class Inverse(Term):
    """A stiffness in series: the field is ``unit`` over the coefficient."""

    path: str
    unit: float

    @property
    def series_field(self) -> str:  # type: ignore[override]
        """The stiffness."""
        return self.path

    def paths(self) -> tuple[str, ...]:
        """The stiffness."""
        return (self.path,)

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """A stiffness at its lower limit is the largest compliance."""
        low, high = limits(self.path)
        most = (1.0 - INSIDE) * self.unit / low if low > 0 else math.inf
        return self.unit / high if math.isfinite(high) else 0.0, most

    def write(self, data: Settings, c: Values, orders: Values, before: dict[str, float]) -> None:
        """A compliance of none is a very large stiffness."""
        put(data, self.path, self.unit / max(c[0], STIFF))

    def at_end(self, c: Values, plausible: Limits) -> bool:
        """As soft as its range allows."""
        low, _ = plausible(self.path)
        return low > 0 and self.unit / max(c[0], STIFF) <= low * (1.0 + LIMIT)

    def rescaled(self, factor: float) -> Self:
        """A unit that is worth more is a softer spring."""
        return replace(self, unit=self.unit / factor)

    def report(self, found: Found, c: Values, covariance: Array, orders: Values, items: int) -> None:
        """The stiffness; its interval is that of the compliance, inverted."""
        half = 2.0 * math.sqrt(max(float(covariance[0, 0]), 0.0))
        ends = c[0], c[0] + half, c[0] - half
        found[self.path] = Ranged(*(self.unit / max(end, 1e-9) for end in ends))


@dataclass(frozen=True)
class Harmonic(Term):
    """Amplitude and phase of sin(angle + phase): two coefficients, of the sine and of the cosine."""

    amplitude: str
    phase: str
    unit: float

    @classmethod
    def components(cls, amplitude: str, unit: float, count: int) -> tuple[Self, ...]:
        """One for each of the first items of an effect's ``components``, by their field of the amplitude."""
        items = (f"components.{k}" for k in range(count))
        return tuple(cls(f"{item}.{amplitude}", f"{item}.phase_deg", unit) for item in items)

    def paths(self) -> tuple[str, ...]:
        """Amplitude and phase."""
        return (self.amplitude, self.phase)

    def count(self, orders: Values) -> int:
        """Of the sine and of the cosine."""
        return 2

    def may_be_negative(self) -> bool:
        """Both have a sign."""
        return True

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """The square within the circle of the largest amplitude: whatever the phase, it is legal."""
        _, high = limits(self.amplitude)
        most = (1.0 - INSIDE) * high / (math.sqrt(2.0) * self.unit)
        return -most, most

    def write(self, data: Settings, c: Values, orders: Values, before: dict[str, float]) -> None:
        """Amplitude and phase from the two coefficients."""
        put(data, self.amplitude, self.unit * math.hypot(*c))
        put(data, self.phase, math.degrees(math.atan2(c[1], c[0])))

    def read(self, data: Settings, orders: Values) -> list[float]:
        """From amplitude and phase."""
        size, angle = _number(data, self.amplitude) / self.unit, math.radians(_number(data, self.phase))
        return [size * math.cos(angle), size * math.sin(angle)]

    def at_end(self, c: Values, plausible: Limits) -> bool:
        """A side of the square that ``bounds`` allows, or the amplitude's upper end; a phase has none."""
        widest = max(math.hypot(*c), math.sqrt(2.0) * max(abs(x) for x in c))
        return _strongest(self.unit * widest, *plausible(self.amplitude))

    def rescaled(self, factor: float) -> Self:
        """The unit times the factor."""
        return replace(self, unit=self.unit * factor)

    def strengths(self) -> Mapping[str, float]:
        """The amplitude."""
        return {self.amplitude: self.unit}

    def report(self, found: Found, c: Values, covariance: Array, orders: Values, items: int) -> None:
        """Amplitude along the vector of the coefficients, phase as wide as their ellipse is seen."""
        import numpy as np

        centre = np.array(c)
        size = math.hypot(*c)
        along = centre / max(size, 1e-12)
        half = 2.0 * math.sqrt(max(float(along @ covariance @ along), 0.0))
        ends = size, max(size - half, 0.0), size + half
        found[self.amplitude] = Ranged(*(self.unit * end for end in ends))
        angle, wide = math.degrees(math.atan2(c[1], c[0])), _seen_under(centre, covariance)
        found[self.phase] = Ranged(angle, angle - wide, angle + wide)


def _number(data: Settings, path: str) -> float:
    """A field of an effect's settings; 0 where they have none."""
    try:
        return float(at(data, path))
    except LookupError:
        return 0.0


def _strongest(value: float, low: float, high: float) -> bool:
    """Whether a value stands at an end of its range away from zero."""
    return value >= high / (1.0 + LIMIT) or (low < 0.0 and value <= low / (1.0 + LIMIT))


def _seen_under(centre: Array, covariance: Array) -> float:
    """Largest angle from a vector to its 95 % ellipse, degrees; 180 where that holds the origin."""
    import numpy as np

    values, vectors = np.linalg.eigh(covariance)
    axes = 2.0 * np.sqrt(np.maximum(values, 0.0))
    if np.sum((vectors.T @ centre / np.maximum(axes, 1e-300)) ** 2) <= 1.0:
        return 180.0
    turn = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    edge = centre[:, None] + vectors @ (axes[:, None] * np.array([np.cos(turn), np.sin(turn)]))
    away = np.arctan2(centre[0] * edge[1] - centre[1] * edge[0], centre @ edge)
    return float(np.degrees(np.max(np.abs(away))))
