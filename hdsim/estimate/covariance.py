"""How sure a fit is: covariance of its numbers by leaving out blocks of time, and what a sample is worth."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.records import Array

#: Least degrees of freedom of an interval: with fewer nobody can say what a spread is.
FEWEST_DEGREES = 3.0


def correlation(rest: Array, blocks: NDArray[np.int64]) -> float:
    """Samples for which one independent sample counts: variance of block sums over that of white noise."""
    sums = np.bincount(blocks, rest)
    counts = np.bincount(blocks)
    used = counts > 0
    power = float(np.mean(rest**2))
    if power <= 0:
        return 1.0
    ratio = float(np.mean(sums[used] ** 2 / counts[used])) / power
    return float(np.clip(ratio, 1.0, counts[used].mean()))


def sample_power(rest: Array, blocks: NDArray[np.int64]) -> float:
    """What one independent sample of a residual counts: its power, times the samples that it stands for."""
    return max(float(np.mean(rest**2)), 1e-30) * correlation(rest, blocks)


def worth_of_a_number(rest: Array, blocks: NDArray[np.int64]) -> float:
    """Power that one more free number must explain by the Bayesian information criterion (Schwarz 1978).

    It is that of an independent sample, times the logarithm of how many there are.
    """
    count = max(len(rest) / correlation(rest, blocks), 2.0)
    return sample_power(rest, blocks) * math.log(count)


def robust_covariance(
    columns: Array,
    rest: Array,
    blocks: NDArray[np.int64],
    priors: Array,
    beside: tuple[Array, Array] | None = None,
) -> Array:
    """Covariance of the free numbers, shape (p, p): how they move when one block of time is left out.

    It is scaled so that two standard deviations are a 95 % interval: for each number Student's t with one
    degree of freedom less than the blocks that tell of it (their effective number, Carter, Schnepel and
    Steigerwald 2017, Review of Economics and Statistics 99:698), over 2.

    Args:
        columns: sensitivities to the free numbers, shape (rows, p).
        rest: what the fit leaves, shape (rows,).
        blocks: shape (rows,).
        priors: shape (p,).
        beside: sensitivities to and prior spreads of numbers that stay where they are.
    """
    if beside is not None:
        whole = robust_covariance(
            np.hstack([columns, beside[0]]), rest, blocks, np.concatenate([priors, beside[1]])
        )
        return whole[: len(priors), : len(priors)]
    from scipy.special import stdtrit

    power, sample = max(float(np.mean(rest**2)), 1e-30), sample_power(rest, blocks)
    # As in the fit (``minimise``): where what is left is correlated, a prior counts as many samples more, or
    # numbers that the data cannot tell apart would seem to be moved farther than anybody believed.
    information = columns.T @ columns + np.diag(sample / priors**2)
    sizes = np.sqrt(np.diag(information))
    sizes[sizes == 0.0] = 1.0
    bread = _inverse(information, sizes)
    order = np.argsort(blocks, kind="stable")
    ends = np.flatnonzero(np.diff(blocks[order])) + 1
    moves, parts = [], []
    for rows in np.split(order, ends):
        own = columns[rows]
        square = own.T @ own
        without = _inverse(information - square, sizes)
        moves.append(without @ (own.T @ rest[rows]))
        parts.append(np.einsum("ij,jk,ik->i", without, square, without))
    away, variances = np.array(moves), np.array(parts)
    clustered = away.T @ away * (len(away) - 1) / len(away)
    clustered += bread @ np.diag(sample**2 / priors**2) @ bread
    # Few blocks can make the clustered spread too small by chance: white noise is its least.
    white = power * np.diag(bread)
    dead = np.flatnonzero(np.diag(clustered) == 0.0)
    clustered[dead, dead] = white[dead]
    low = np.maximum(1.0, np.sqrt(white / np.diag(clustered)))
    telling = variances.sum(axis=0) ** 2 / np.maximum((variances**2).sum(axis=0), 1e-300)
    scale = low * stdtrit(np.maximum(telling - 1.0, FEWEST_DEGREES), 0.975) / 2.0
    return np.asarray(clustered * np.outer(scale, scale))


def _inverse(information: Array, sizes: Array) -> Array:
    """Inverse of what is known of some numbers, shape (p, p).

    One block may be all that tells of a number: what rounding leaves of the others counts as rounding, and
    the number is as good as unknown without that block.

    Args:
        information: shape (p, p), positive but for rounding.
        sizes: in whose units the numbers are alike, shape (p,).
    """
    values, vectors = np.linalg.eigh(information / np.outer(sizes, sizes))
    values = np.maximum(values, len(sizes) * np.finfo(float).eps)
    return np.asarray((vectors / values) @ vectors.T / np.outer(sizes, sizes))
