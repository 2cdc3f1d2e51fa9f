"""Explained shares of a residual: cross-validated over blocks of time, with the whole search's false alarms.

A *design* is a set of columns. Its share is the part of the residual's power that a linear fit of them
removes in blocks that it has not seen, after the base model's own sensitivities have been taken out of
columns and residual alike, so that nothing a wrong parameter explains counts. The chance level of the
best share of a whole search comes from the wild bootstrap with blocks as clusters (Cameron, Gelbach and
Miller 2008, Review of Economics and Statistics 90:414): the residual's blocks with random signs, searched
in the same way; the most remarkable share of each draw counts (Westfall and Young 1993,
Resampling-Based Multiple Testing).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.records import Array

#: Folds of the cross-validation, and blocks that stay together in a fold.
FOLDS, TOGETHER = 5, 2
#: Draws of the wild bootstrap, and the largest chance at which a search may name an effect.
DRAWS = 400
LEVEL = 0.02
#: Square of a direction's length beside the largest below which it is none: what a Gram matrix can tell.
NO_DIRECTION = 1e-13


@dataclass
class Share:
    """What a design explains.

    Attributes:
        share: of the residual's power, cross-validated; negative when it only adds freedom.
        losses: shape (blocks,), power of each block that is left when it is predicted unseen.
        coefficients: shape (columns,), of the fit to all blocks.
        chance: shape (draws,), shares of the same design on surrogates.
    """

    share: float
    losses: Array
    coefficients: Array
    chance: Array


class Residual:
    """A residual with the directions that the base model can explain taken out.

    Args:
        values: shape (n,), whitened.
        base: shape (n, b), the base model's sensitivities and offsets.
        blocks: shape (n,), block of every row.
        seed: of the surrogates' signs.
    """

    def __init__(self, values: Array, base: Array, blocks: NDArray[np.int64], seed: int = 0) -> None:
        #: What was taken out, as given.
        self.base = base
        scale = np.linalg.norm(base, axis=0)
        self._base = base[:, scale > 0] / scale[scale > 0]
        # Their Gram matrix tells the directions at a part of what decomposing the long columns costs.
        powers, vectors = np.linalg.eigh(self._base.T @ self._base)
        seen = powers > NO_DIRECTION * max(float(powers.max(initial=0.0)), 1e-300)
        self._turned = vectors[:, seen] / np.sqrt(powers[seen])
        self.values = self.project(values)
        used, self._blocks = np.unique(blocks, return_inverse=True)
        self.count = len(used)
        self._order = np.argsort(self._blocks, kind="stable")
        fold = (np.arange(self.count) // TOGETHER) % FOLDS
        self._folds = [np.flatnonzero(fold == k) for k in range(FOLDS) if (fold == k).any()]
        self.powers: Array = np.asarray(np.bincount(self._blocks, self.values**2, self.count), dtype=float)
        self.power = float(self.powers.sum())
        self._signs = np.random.default_rng([seed, 5]).choice([-1.0, 1.0], size=(DRAWS, self.count))

    def project(self, values: Array) -> Array:
        """Without what the base's directions explain; shape of ``values``."""
        for _ in range(2):  # once leaves what the Gram matrix has lost
            values = values - self._base @ (self._turned @ (self._turned.T @ (self._base.T @ values)))
        return values

    def share(self, columns: Array, rows: NDArray[np.bool_] | None = None) -> Share:
        """What a design of shape (n, k) explains.

        Args:
            columns: the design.
            rows: rows that count (one channel, say); all by default.
        """
        # Block after block, so that each has its moments by one product.
        order = self._order if rows is None else self._order[rows[self._order]]
        x, y, blocks = self.project(columns)[order], self.values[order], self._blocks[order]
        powers = np.asarray(np.bincount(blocks, y**2, self.count), dtype=float)
        total = float(powers.sum())
        norm = np.linalg.norm(x, axis=0)
        alive = norm > 1e-6 * max(float(np.linalg.norm(columns)), 1e-300)
        k = int(alive.sum())
        coefficients = np.zeros(columns.shape[1])
        if k == 0 or total <= 0:
            return Share(0.0, powers, coefficients, np.zeros(DRAWS))
        x = x[:, alive] / norm[alive]
        edges = np.searchsorted(blocks, np.arange(self.count + 1))
        moments = np.stack([x[a:b].T @ y[a:b] for a, b in pairwise(edges)])
        gram = np.stack([x[a:b].T @ x[a:b] for a, b in pairwise(edges)])
        # A trace of ridge keeps columns that the record does not tell apart from blowing up.
        ridge = 1e-6 * np.eye(k)
        whole, right = gram.sum(axis=0) + ridge, moments.sum(axis=0)
        coefficients[alive] = np.linalg.solve(whole, right) / norm[alive]
        losses = np.empty(self.count)
        draws = np.zeros(DRAWS)
        flipped = self._signs @ moments  # (draws, k)
        for fold in self._folds:
            inner = whole - gram[fold].sum(axis=0)
            beta = np.linalg.solve(inner, right - moments[fold].sum(axis=0))
            losses[fold] = (
                powers[fold] - 2 * moments[fold] @ beta + np.einsum("bij,i,j->b", gram[fold], beta, beta)
            )
            own = self._signs[:, fold] @ moments[fold]
            betas = np.linalg.solve(inner, (flipped - own).T).T
            square = gram[fold].sum(axis=0)
            draws += -2 * np.einsum("dk,dk->d", own, betas) + np.einsum("di,ij,dj->d", betas, square, betas)
        return Share(1.0 - float(losses.sum()) / total, losses, coefficients, -draws / total)


def chance_of(best: Share, everything: Sequence[Share]) -> float:
    """Probability that a search over all these designs finds one as remarkable as ``best`` by chance.

    A share is remarkable when it is large, or large beside its own spread over the surrogates: the first
    suits a design with few but strong moments, the second one that would drown beside a freer design. Both
    are asked, so the smaller probability is doubled (Bonferroni).

    Args:
        best: of the design that is asked for.
        everything: of all designs that were tried, ``best`` among them.
    """
    if not everything:
        return 1.0
    plain = _tail(best.share, [one.chance for one in everything])
    scaled = _tail(_standard(best.share, best), [_standard(one.chance, one) for one in everything])
    return min(1.0, 2.0 * min(plain, scaled))


def _tail(value: float, draws: Sequence[Array]) -> float:
    largest = np.max(np.stack(draws), axis=0)
    return float((1 + np.sum(largest >= value)) / (1 + len(largest)))


def _standard(share: Any, of: Share) -> Any:
    return (share - of.chance.mean()) / max(float(of.chance.std()), 1e-12)
