"""How an effect is fitted to data: which of its numbers scale its trace, and which shape it.

An effect may declare ``fittings``, a tuple of ``Fitting``; without one it can be simulated but not named
by a diagnosis. The terms say in which numbers the trace is, nearly, proportional to a coefficient; a
diagnosis simulates each term once at its unit size and has the trace that the effect leaves in every channel.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

from hdsim.effects._periodic import Periodic
from hdsim.effects._plausible import Plausible, Range, range_of, scales_of
from hdsim.effects._terms import (
    INSIDE,
    LIMIT,
    Amplitude,
    Harmonic,
    Inverse,
    Limits,
    Ranged,
    Term,
)
from hdsim.nested import copied, in_places, put

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = [
    "WIDER",
    "Amplitude",
    "Fitting",
    "Harmonic",
    "Inverse",
    "Limits",
    "Periodic",
    "Plausible",
    "Range",
    "Ranged",
    "Shape",
    "range_of",
    "scales_of",
]

#: Ratio to the next start that a lone one would have, and of the widths of a play that are tried.
ALONE, WIDER = 6.0, 3.0
#: Largest logarithm of the factor to either end of an interval: e^20 says enough of what nobody knows.
WIDEST = 20.0


@dataclass(frozen=True)
class Shape:
    """A field in which the trace is not linear. A fit moves its logarithm, or itself where it is ``linear``.

    Args:
        path: of the field.
        starts: values where a fit may start, in rising order.
        over_range: the starts are divided by the largest value that the record has of this: ``torque_nm`` at
            the output, or ``motor_side_torque_nm``, if any.
        of_range: likewise, multiplied by it.
        linear: the field is an angle or the like, whose neighbours lie at differences, not at ratios.
        least: what lies below is another effect's; divided like the starts.
        most: the same for what lies above.
        apart: factor between values at which a fit may end, where its cost has several minima; 1: one only.
    """

    path: str
    starts: tuple[float, ...]
    over_range: str = ""
    of_range: str = ""
    linear: bool = False
    least: float = 0.0
    most: float = math.inf
    apart: float = 1.0

    def neighbours(self, value: float, times: int) -> tuple[float, float]:
        """Values on both sides at the half of the starts' distance, halved ``times`` times.

        Args:
            value: the best so far.
            times: how often it was halved before.
        """
        part = 0.5 ** (times + 1)
        if self.linear:
            return value - part * self.distance, value + part * self.distance
        ratio = self.starts[1] / self.starts[0] if len(self.starts) > 1 else ALONE
        return max(float(value / ratio**part), self.least), min(float(value * ratio**part), self.most)

    def next_minima(self, value: float) -> list[float]:
        """Values where the cost may have its next minima, within the fitting's own range."""
        if self.apart == 1.0:
            return []
        return [v for v in (value / self.apart, value * self.apart) if self.least <= v <= self.most]

    def beside(self, value: float, other: float) -> bool:
        """Whether two values are nearer to one another than minima of the cost may be."""
        return self.apart == 1.0 or abs(math.log(value / other)) < 0.5 * math.log(self.apart)

    @property
    def distance(self) -> float:
        """Of two starts of a linear shape: the unit in which a fit moves it."""
        return self.starts[1] - self.starts[0] if len(self.starts) > 1 else max(abs(self.starts[0]), 1.0)

    def number(self, value: float) -> float:
        """What a fit moves, at a value of the field."""
        return value / self.distance if self.linear else math.log(value)

    def value(self, number: float) -> float:
        """The field's value at what a fit moves."""
        return number * self.distance if self.linear else math.exp(number)

    def ends(self, limits: Limits) -> tuple[float, float]:
        """Least and largest value of the field: this fitting's, within the field's own."""
        low, high = limits(self.path)
        if self.linear:
            return low, high
        inside = 1.0 - INSIDE
        return max(self.least, low / inside if low > 0 else 0.0), min(self.most, inside * high)

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """The same of what a fit moves."""
        low, high = self.ends(limits)
        if self.linear:
            return low / self.distance, high / self.distance
        return math.log(low) if low > 0 else -math.inf, math.log(high)

    def at_end(self, value: float, plausible: Limits) -> bool:
        """Whether a value stands at an end of its range; what is linear has none that means anything else."""
        if self.linear:
            return False
        low, high = plausible(self.path)
        return value <= max(self.least, low) * (1.0 + LIMIT) or value >= min(self.most, high) / (1.0 + LIMIT)

    def within(self, ranges: Mapping[str, float]) -> Shape:
        """The shape with its values in its own unit, where they are parts of a range or of its inverse."""
        if not (self.over_range or self.of_range):
            return self
        unit = ranges[self.of_range] if self.of_range else 1.0 / ranges[self.over_range]
        return replace(
            self,
            starts=tuple(value * unit for value in self.starts),
            least=self.least * unit,
            most=self.most * unit,
            over_range="",
            of_range="",
        )

    def report(self, value: float, deviation: float) -> Ranged:
        """Value and 95 % interval.

        Args:
            value: as fitted.
            deviation: standard deviation of what the fit moves.
        """
        if self.linear:
            half = 2.0 * deviation * self.distance
            return Ranged(value, value - half, value + half)
        factor = math.exp(min(2.0 * deviation, WIDEST))
        return Ranged(value, value / factor, value * factor)


@dataclass(frozen=True)
class Fitting:
    """One way to fit an effect.

    Args:
        terms: what scales its trace.
        shapes: what shapes it.
        settings: fields that stay as given here, nested.
        label: tells this way from the effect's others.
        needs: channels without which it cannot be told.
        turns: least travel of the wave generator, in turns, without which its trace looks like anything.
        covered_by: numbers of a scenario that say the same: where all are above zero the re-fit has had it.
        beyond: numbers of a scenario that it is a departure from: not asked while one of them is none and no
            effect has a field of that name.
        cumulative: a term has a meaning only on top of those before it, and adds to their fields.
        follows: measured channels that it takes as they are (``Builder.external``): asked only of records
            that have them.
        unless: measured channels that tell more than this way can: not asked of records that have them.
        mesh: models that it is asked of, where not of all: those with teeth, or those without.
        lives_in: coordinates in which this way's residual is a function, the most telling first; those of the
            effect's signature where there are none.
        refines: labels of the ways that it is a finer formula of, where not of all (``Effect.finer``).
        asks: numbers of the base, by their paths in a scenario, that its trace depends on and that no fit
            moves by itself (``Number.asked``): a fit of it moves them too.
    """

    terms: tuple[Term, ...]
    shapes: tuple[Shape, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    needs: tuple[str, ...] = ()
    turns: float = 0.0
    covered_by: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    cumulative: bool = False
    follows: tuple[str, ...] = ()
    unless: tuple[str, ...] = ()
    mesh: Literal["", "toothed", "toothless"] = ""
    lives_in: tuple[str, ...] = ()
    refines: tuple[str, ...] = ()
    asks: tuple[str, ...] = ()

    @property
    def in_series(self) -> bool:
        """Whether it fits a compliance in series with the drive's spring."""
        return any(term.series_field for term in self.terms)

    @property
    def play(self) -> bool:
        """Whether it fits the width of a play."""
        return any(term.play for term in self.terms)

    def of_mesh(self, toothed: bool) -> bool:
        """Whether it is asked of a model with teeth, or of one without."""
        return self.mesh in ("", "toothed" if toothed else "toothless")

    def of_channels(self, measured: set[str], compared: Collection[str]) -> bool:
        """Whether it is asked of records that have measured these channels, some of them compared."""
        return (
            measured.issuperset(self.follows)
            and measured.isdisjoint(self.unless)
            and all(channel in compared for channel in self.needs)
        )

    def count(self, orders: Sequence[float]) -> int:
        """Number of coefficients."""
        return sum(term.count(orders) for term in self.terms)

    def signed(self, orders: Sequence[float]) -> list[bool]:
        """Whether each coefficient may be negative."""
        return [term.may_be_negative() for term in self.terms for _ in range(term.count(orders))]

    def bounds(self, limits: Limits, orders: Sequence[float]) -> list[tuple[float, float]]:
        """Least and largest value of each coefficient."""
        return [term.bounds(limits) for term in self.terms for _ in range(term.count(orders))]

    def parts(self, orders: Sequence[float]) -> list[tuple[Term, slice]]:
        """Each term with where its coefficients stand."""
        found, first = [], 0
        for term in self.terms:
            last = first + term.count(orders)
            found.append((term, slice(first, last)))
            first = last
        return found

    def rescaled(self, factor: float) -> Fitting:
        """The same way with units that are worth ``factor`` times as much."""
        return replace(self, terms=tuple(term.rescaled(factor) for term in self.terms))

    def within(self, ranges: Mapping[str, float]) -> Fitting | None:
        """The same way for a record that covers these ranges; None where it lacks one that a term needs."""
        if any(term.of_range and term.of_range not in ranges for term in self.terms):
            return None
        return replace(
            self,
            terms=tuple(term.sized(ranges) for term in self.terms),
            shapes=tuple(shape.within(ranges) for shape in self.shapes),
        )

    def written(
        self, coefficients: Sequence[float], shapes: Sequence[float], orders: Sequence[float]
    ) -> dict[str, Any]:
        """Values of the effect's fields, nested."""
        data: dict[str, Any] = copied(self.settings)
        for shape, value in zip(self.shapes, shapes, strict=True):
            put(data, shape.path, value)
        before: dict[str, float] = {}
        for term, part in self.parts(orders):
            term.write(data, coefficients[part], orders, before)
        return data

    def orders_of(self, orders: Sequence[float]) -> tuple[float, ...]:
        """Of the orders that another way has read from the data those that a term of this one has as well."""
        found = (term.orders_shared(orders) for term in self.terms)
        return next((shared for shared in found if shared), ())

    def read(self, settings: Mapping[str, Any], orders: Sequence[float]) -> tuple[float, ...]:
        """Coefficients of an effect that another of its ways wrote; 0 of what that does not have.

        Args:
            settings: what it wrote. Items of a list are known by what this way holds fixed of them.
            orders: orders of periodic terms.
        """
        data = in_places(self.settings, settings)
        return tuple(c for term, _ in self.parts(orders) for c in term.read(data, orders))

    def report(
        self,
        coefficients: Sequence[float],
        covariance: Array,
        shapes: Sequence[float],
        deviations: Sequence[float] | Array,
        orders: Sequence[float],
    ) -> dict[str, Ranged]:
        """The fitted fields with 95 % intervals.

        Args:
            coefficients: one for each column of the terms.
            covariance: of the coefficients, shape (k, k).
            shapes: values of the shapes.
            deviations: standard deviations of what the fit moves of them.
            orders: orders of periodic terms.
        """
        found: dict[str, Ranged] = {}
        for term, part in self.parts(orders):
            items = len(self.items(term.list_path)) if term.list_path else 0
            term.report(found, coefficients[part], covariance[part, part], orders, items)
        for path, units in self._sums(orders).items():
            # What is unsure of a term that others are on top of is unsure of them too.
            value = sum(unit * coefficients[k] for k, unit in units.items())
            variance = sum(a * b * covariance[i, j] for i, a in units.items() for j, b in units.items())
            half = 2.0 * math.sqrt(max(float(variance), 0.0))
            found[path] = Ranged(value, value - half, value + half)
        for shape, value, deviation in zip(self.shapes, shapes, deviations, strict=True):
            found[shape.path] = shape.report(value, float(deviation))
        return found

    def _sums(self, orders: Sequence[float]) -> dict[str, dict[int, float]]:
        """Fields that several terms add to, each with the units of its coefficients by their place."""
        units: dict[str, dict[int, float]] = {}
        for term, part in self.parts(orders):
            if isinstance(term, Amplitude):
                for path, unit in term.units.items():
                    units.setdefault(path, {})[part.start] = unit
        return {path: own for path, own in units.items() if len(own) > 1}

    @property
    def paths(self) -> tuple[str, ...]:
        """Every field that a fit of it moves, phases and other angles included."""
        found = [path for term in self.terms for path in term.paths()]
        return tuple(dict.fromkeys([*found, *(shape.path for shape in self.shapes)]))

    def items(self, section: str) -> list[Any]:
        """Items that a list of the effect has before periodic terms add theirs."""
        here: Any = self.settings
        for key in section.split("."):
            here = here.get(key, {})
        return list(here)
