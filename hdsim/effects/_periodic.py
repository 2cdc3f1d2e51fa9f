"""The term of a fitting that reads from the data at which orders it acts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

from hdsim.effects._terms import Found, Harmonic, Limits, Ranged, Settings, Term, Values
from hdsim.nested import at, copied, put

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Distance below which two orders are one.
NEAR = 0.05


@dataclass(frozen=True)
class Periodic(Term):
    """Harmonics whose orders per wave-generator turn are read from the data; one list item each.

    Args:
        section: path of the list.
        amplitude: field of an item that is its amplitude.
        unit: its value at coefficient 1.
        settings: further fields of an item.
        channel: the channel whose order spectrum says which orders.
        besides: orders that the fitting's other terms have; given, the term may find no other ones.
    """

    section: str
    amplitude: str
    unit: float
    channel: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    besides: tuple[float, ...] = ()

    def paths(self) -> tuple[str, ...]:
        """Amplitude and phase of the first item."""
        return (f"{self.section}.0.{self.amplitude}", f"{self.section}.0.phase_deg")

    def count(self, orders: Values) -> int:
        """Two for each order."""
        return 2 * len(orders)

    def may_be_negative(self) -> bool:
        """As those of a harmonic."""
        return True

    def bounds(self, limits: Limits) -> tuple[float, float]:
        """As those of a harmonic."""
        return self.harmonic(0).bounds(limits)

    @property
    def list_path(self) -> str:  # type: ignore[override]
        """Its list."""
        return self.section

    def orders_among(self, lines: Iterable[tuple[str, float]], most: int) -> tuple[float, ...] | None:
        """Of its channel, one a turn or more, but for those that other terms have.

        Beyond the strongest only whole ones: what wobbles or rings has any number of others.
        """
        own = [order for channel, order in lines if channel == self.channel and order >= 1.0]
        own = list(self.orders_shared(own))
        own = [*own[:most], *(order for order in own[most:] if order == round(order))]
        return tuple(own) if own or self.besides else None

    def orders_shared(self, orders: Values) -> tuple[float, ...]:
        """Those that no other term has."""
        return tuple(o for o in orders if all(abs(o - other) >= NEAR for other in self.besides))

    def harmonic(self, item: int) -> Harmonic:
        """The harmonic that an item of the list is."""
        path = f"{self.section}.{item}"
        return Harmonic(f"{path}.{self.amplitude}", f"{path}.phase_deg", self.unit)

    def write(self, data: Settings, c: Values, orders: Values, before: dict[str, float]) -> None:
        """Append an item for each order."""
        try:
            items = copied(at(data, self.section))
        except KeyError:
            items = []
        put(data, self.section, items)
        for k, order in enumerate(orders):
            items.append(dict(self.settings) | {"order": order})
            self.harmonic(len(items) - 1).write(data, c[2 * k : 2 * k + 2], (), before)

    def read(self, data: Settings, orders: Values) -> list[float]:
        """Of the items with its orders; they stand anywhere in the list."""
        items, found = at(data, self.section), list[float]()
        for order in orders:
            own = dict(self.settings) | {"order": order}
            place = next((k for k, item in enumerate(items) if item | own == item), len(items))
            found += self.harmonic(place).read(data, ())
        return found

    def at_end(self, c: Values, plausible: Limits) -> bool:
        """Any amplitude at its upper end."""
        return any(self.harmonic(0).at_end(c[k : k + 2], plausible) for k in range(0, len(c), 2))

    def rescaled(self, factor: float) -> Self:
        """The unit times the factor."""
        return replace(self, unit=self.unit * factor)

    def strengths(self) -> Mapping[str, float]:
        """As those of a harmonic."""
        return self.harmonic(0).strengths()

    def report(self, found: Found, c: Values, covariance: Array, orders: Values, items: int) -> None:
        """Order, amplitude and phase of each item."""
        for k, order in enumerate(orders):
            part = slice(2 * k, 2 * k + 2)
            found[f"{self.section}.{items + k}.order"] = Ranged(order)
            self.harmonic(items + k).report(found, c[part], covariance[part, part], (), items)
