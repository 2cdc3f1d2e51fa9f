"""Shapley's shares: a whole that several causes make together, shared out so that nothing is left over.

The share of cause i is what it adds when the causes are switched on one after the other, mean of all orders,

    phi_i = sum over S without i of |S|! (n - |S| - 1)! / n! * (v(S with i) - v(S)),

with v(S) the value when the causes S are on. The shares sum to v(all) - v(none) whatever the interactions;
a cause that changes nothing has none, and two that act alike have the same (Shapley 1953, A value for
n-person games; for errors of models: Owen 2014, SIAM/ASA J. Uncertainty Quantification 2:245).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Coalition = frozenset[str]

#: Most causes for which all 2^n combinations are run.
MOST_EXACT = 6


@dataclass(frozen=True)
class Share:
    """What a cause contributes.

    Args:
        value: its share of the whole, in the whole's unit.
        standard_error: of the value where orders were drawn; 0 where all combinations were run.
    """

    value: float
    standard_error: float = 0.0


def drawn_orders(names: Sequence[str], count: int, seed: int = 0) -> list[tuple[str, ...]]:
    """Independent random orders of causes (Castro, Gomez and Tejada 2009, Comput. Oper. Res. 36:1726)."""
    rng = np.random.default_rng(seed)
    return [tuple(names[k] for k in rng.permutation(len(names))) for _ in range(count)]


def coalitions(names: Sequence[str], orders: Sequence[tuple[str, ...]] = ()) -> list[Coalition]:
    """The combinations that shares need: all of them, or with orders those that these go through."""
    if not orders:
        sizes = range(len(names) + 1)
        return [frozenset(one) for size in sizes for one in itertools.combinations(names, size)]
    steps = (frozenset(order[:k]) for order in orders for k in range(len(names) + 1))
    return list(dict.fromkeys(steps))


def shapley_shares(
    names: Sequence[str], values: Mapping[Coalition, float], orders: Sequence[tuple[str, ...]] = ()
) -> dict[str, Share]:
    """Shares of the causes.

    Args:
        names: the causes.
        values: v of every combination in ``coalitions(names, orders)``.
        orders: those that were drawn, two at least; none: exact, from all combinations.

    Returns:
        Shares by name; they sum to v(all) - v(none).
    """
    n = len(names)
    if not orders:
        shares = dict.fromkeys(names, 0.0)
        for on in coalitions(names):
            for name in (name for name in names if name not in on):
                weight = math.factorial(len(on)) * math.factorial(n - len(on) - 1) / math.factorial(n)
                shares[name] += weight * (values[on | {name}] - values[on])
        return {name: Share(value) for name, value in shares.items()}
    added: dict[str, list[float]] = {name: [] for name in names}
    for order in orders:
        for k, name in enumerate(order):
            added[name].append(values[frozenset(order[: k + 1])] - values[frozenset(order[:k])])
    return {
        name: Share(float(np.mean(a)), float(np.std(a, ddof=1) / math.sqrt(len(a))))
        for name, a in added.items()
    }
