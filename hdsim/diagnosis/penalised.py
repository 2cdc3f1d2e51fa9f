"""Penalised least squares: smooth curves whose roughness is chosen by what predicts left-out blocks of time.

The penalty is on second differences (Eilers and Marx 1996, Statistical Science 11:89).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hdsim.diagnosis.screen import FOLDS, TOGETHER
from hdsim.estimate.records import Array

#: Weights of the penalty that are tried, as a multiple of the mean information on a value.
WEIGHTS = tuple(10.0**k for k in range(-5, 4))
#: Information below this part of the mean counts as none: the model's own numbers explain that direction.
UNSEEN = 1e-4


def roughness(count: int, *, closed: bool = False) -> Array:
    """Penalty matrix: sum of squared second differences of the values, around the turn for a closed curve."""
    if not closed:
        d = np.diff(np.eye(count), 2, axis=0)
    else:
        d = np.roll(np.eye(count), 1, axis=1) - 2.0 * np.eye(count) + np.roll(np.eye(count), -1, axis=1)
    return np.asarray(d.T @ d)


@dataclass
class Penalised:
    """A penalised fit: values, cross-validated share, the inverse it was solved with and the penalty."""

    values: Array
    share: float
    inverse: Array
    penalty: Array


def penalised(x: Array, y: Array, blocks: NDArray[np.int64], rough: Array) -> Penalised:
    """Least squares with the penalty weight that predicts left-out blocks of time best.

    Args:
        x: shape (n, k).
        y: shape (n,).
        blocks: shape (n,).
        rough: penalty matrix, shape (k, k), see ``roughness``.
    """
    used, number = np.unique(blocks, return_inverse=True)
    order = np.argsort(number, kind="stable")
    edges = np.searchsorted(number[order], np.arange(len(used) + 1))
    x, y = x[order], y[order]
    grams = np.stack([x[a:b].T @ x[a:b] for a, b in pairwise(edges)])
    moments = np.stack([x[a:b].T @ y[a:b] for a, b in pairwise(edges)])
    total = float(y @ y)
    fold = (np.arange(len(used)) // TOGETHER) % FOLDS
    whole, right = grams.sum(axis=0), moments.sum(axis=0)
    scale = float(np.trace(whole)) / len(whole)
    least = UNSEEN * scale
    best: tuple[float, float] | None = None
    for weight in WEIGHTS:
        gained = 0.0
        for k in range(FOLDS):
            inner, moment = grams[fold == k].sum(axis=0), moments[fold == k].sum(axis=0)
            beta = inverse_of(whole - inner + weight * scale * rough, least) @ (right - moment)
            gained += float(2.0 * moment @ beta - beta @ inner @ beta)
        if best is None or gained > best[0]:
            best = (gained, weight)
    assert best is not None
    penalty = best[1] * scale * rough
    inverse = inverse_of(whole + penalty, least)
    return Penalised(inverse @ right, best[0] / total if total > 0 else 0.0, inverse, penalty)


def inverse_of(matrix: Array, least: float) -> Array:
    """Inverse of a symmetric matrix without directions whose eigenvalue is below ``least``: they stay 0."""
    values, vectors = np.linalg.eigh(matrix)
    seen = values > least
    return np.asarray((vectors[:, seen] / values[seen]) @ vectors[:, seen].T)
