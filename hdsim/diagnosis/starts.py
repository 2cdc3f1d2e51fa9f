"""Where the search for an effect's shapes begins, and the sizes beside one that were tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

from hdsim.effects._fitting import WIDER, Fitting
from hdsim.estimate.orders import Line
from hdsim.estimate.state import Added

#: Orders of a periodic term that are taken from the spectra, beside further whole ones.
MOST_ORDERS = 3


def starts(name: str, fitting: Fitting, lines: Sequence[Line], ranges: Mapping[str, float]) -> list[Added]:
    """The effect at unit size with every combination of its shapes' starts.

    Args:
        name: of the effect.
        fitting: how it is fitted.
        lines: peaks of the order spectra, for its periodic terms.
        ranges: what the records cover, for units that are parts of it.

    Returns:
        Nothing when the record does not give what the fitting asks for.
    """
    own = fitting.within(ranges)
    if own is None:
        return []
    orders: tuple[float, ...] = ()
    peaks = [(line.channel, line.order) for line in lines]
    for term in own.terms:
        read = term.orders_among(peaks, MOST_ORDERS)
        if read is None:
            return []
        orders = read or orders
    return [
        Added(name, own, (1.0,) * own.count(orders), tuple(values), orders)
        for values in product(*(shape.starts for shape in own.shapes))
    ]


def neighbours(added: Added, times: int) -> list[Added]:
    """The effect at unit size with each shape, or the width of its play, a little off on either side."""
    found = []
    if added.fitting.play:
        for factor in (WIDER ** (-(0.5 ** (times + 1))), WIDER ** (0.5 ** (times + 1))):
            units = (1.0,) * len(added.coefficients)
            found.append(replace(added, fitting=added.fitting.rescaled(factor), coefficients=units))
    for k, shape in enumerate(added.fitting.shapes):
        for value in shape.neighbours(added.shapes[k], times):
            shapes = (*added.shapes[:k], value, *added.shapes[k + 1 :])
            found.append(replace(added, coefficients=(1.0,) * len(added.coefficients), shapes=shapes))
    return found
