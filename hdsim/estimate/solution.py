"""Least squares of anybody's problem: what the data determine, with intervals and correlations.

The same core as a fit of a model (``hdsim.estimate.fit``): numbers with priors and bounds, trust-region
Gauss-Newton steps, covariance from leaving out one block after another, Student's intervals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.estimate.covariance import correlation, robust_covariance
from hdsim.estimate.determine import UNDETERMINED, determined
from hdsim.estimate.minimise import minimised
from hdsim.estimate.problem import Problem
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.slopes import made

#: Evaluations of the residual in a round, and most rounds: nothing is known of how dear a residual is.
EVALUATIONS, ROUNDS = 50, 5
#: Promised fall of the cost at which no further round begins: a hundredth of a standard deviation, squared.
TIGHT = 1e-4
#: A number without a prior counts as one whose prior spread is this many times its start, or this.
VAGUE = 1e3
#: Least share of a number in a direction for it to be named there.
NAMED = 0.3


@dataclass(frozen=True)
class Direction:
    """A combination of the parameters, in units of their prior spreads, and whether it is identifiable.

    Attributes:
        spread: ratio of its standard deviation after the data to that before.
        parts: share of each parameter that takes part, by name; their squares sum to at most 1.
    """

    spread: float
    parts: dict[str, float]

    @property
    def seen(self) -> bool:
        """Whether the data determine it."""
        return self.spread <= UNDETERMINED


@dataclass(frozen=True)
class Solution:
    """A solved problem.

    Attributes:
        names: of the parameters.
        x: their estimates, shape (p,); those that are not identifiable keep their start values.
        determined: which ones the data determine, shape (p,).
        covariance: shape (p, p), scaled so that two standard deviations are a 95 % interval (Student's t
            with the blocks that carry information on a parameter); NaN where it is not identifiable.
        ties: for each parameter that is not identifiable, those it is confounded with.
        directions: all combinations, identifiable or not, the best determined first.
        rest: the residual, shape (rows,).
    """

    names: tuple[str, ...]
    x: Array
    determined: Mask
    covariance: Array
    ties: dict[str, list[str]]
    directions: list[Direction]
    rest: Array

    @property
    def intervals(self) -> Array:
        """95 % intervals, shape (p, 2); NaN where a parameter is not identifiable."""
        half = 2.0 * np.sqrt(np.diag(self.covariance))
        return np.column_stack([self.x - half, self.x + half])

    @property
    def correlation(self) -> Array:
        """Of the estimates, shape (p, p)."""
        return correlations(self.covariance)


def correlations(covariance: Array) -> Array:
    """Correlation matrix of a covariance, both of shape (p, p)."""
    spread = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(spread, spread))


def directions(columns: Array, priors: Array, power: float, names: list[str]) -> list[Direction]:
    """How well the data determine each combination of parameters (singular vectors of the sensitivities).

    Args:
        columns: sensitivities of the residual, shape (rows, p).
        priors: prior standard deviations, shape (p,).
        power: what one independent sample of the residual counts.
        names: of the numbers.
    """
    if not names:
        return []
    scaled = columns * priors / math.sqrt(power)
    _, sizes, vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    return [
        Direction(
            1.0 / math.sqrt(1.0 + float(size) ** 2),
            {name: float(v) for name, v in zip(names, vector, strict=True) if abs(v) >= NAMED},
        )
        for size, vector in zip(sizes, vectors, strict=True)
    ]


class _Part:
    """Some numbers of a problem, the others held."""

    def __init__(self, problem: Problem, kept: list[int], at: Array, priors: Array) -> None:
        self._problem, self._kept, self._at = problem, kept, at
        self.names = [problem.names[k] for k in kept]
        self.start, self.priors = problem.start[kept], priors[kept]
        lower, upper = problem.bounds
        self.bounds = lower[kept], upper[kept]
        self.blocks: NDArray[np.int64] = problem.blocks

    def _whole(self, x: Array) -> Array:
        whole = self._at.copy()
        whole[self._kept] = x
        return whole

    def residual(self, x: Array) -> Array:
        return np.asarray(self._problem.residual(self._whole(x)), dtype=float)

    def jacobian(self, x: Array) -> Array:
        return -made(self._problem, self._whole(x))[:, self._kept]


def solve(problem: Problem, *, evaluations: int = EVALUATIONS) -> Solution:
    """Fit a problem's numbers to its data.

    Args:
        problem: numbers with priors and bounds, and a residual; see ``hdsim.estimate.problem``.
        evaluations: residuals that the optimiser may ask for in a round.

    Raises:
        InputError: the problem contradicts itself.
        ArithmeticError: the residual at the start cannot be computed.
    """
    start, (lower, upper) = np.asarray(problem.start, dtype=float), problem.bounds
    rest = np.asarray(problem.residual(start), dtype=float)
    _check(problem, start, rest)
    priors = np.where(np.isfinite(problem.priors), problem.priors, VAGUE * np.maximum(np.abs(start), 1.0))
    names, p = tuple(problem.names), len(start)
    inside = np.where(np.isfinite(upper - lower), 1e-9 * (upper - lower), 0.0)
    x = np.clip(start, lower + inside, upper - inside)
    blocks = np.unique(problem.blocks, return_inverse=True)[1]
    split = determined(made(problem, x), rest, priors, blocks, p)
    power = split.power
    for last in (False, True):
        if not split.kept:
            break
        x[split.dropped] = start[split.dropped]
        part = _Part(problem, split.kept, x, priors)
        found = minimised(
            part, x[split.kept], start[split.kept], split.power,
            evaluations=evaluations, rounds=ROUNDS, tight=TIGHT,
        )  # fmt: skip
        x[split.kept], rest = found.x, found.rest
        power = max(float(np.mean(rest**2)), 1e-300) * correlation(rest, blocks)
        # Far from the end, what the data see may look different from there.
        there = determined(made(problem, x), rest, priors, blocks, p)
        if last or len(there.kept) == len(split.kept):
            break
        split = there
    kept = split.kept
    columns = made(problem, x)
    covariance = np.full((p, p), np.nan)
    if kept:
        others = [k for k in range(p) if k not in kept]
        beside = (columns[:, others], priors[others]) if others else None
        covariance[np.ix_(kept, kept)] = robust_covariance(
            columns[:, kept], rest, blocks, priors[kept], beside
        )
    return Solution(
        names, x, np.isin(np.arange(p), kept), covariance,
        {names[k]: [names[j] for j in tied] for k, tied in split.ties.items()},
        directions(columns, priors, power, list(names)), rest,
    )  # fmt: skip


def _check(problem: Problem, start: Array, rest: Array) -> None:
    lower, upper = problem.bounds
    lengths = {len(problem.names), len(start), len(problem.priors), len(lower), len(upper)}
    if len(lengths) > 1 or start.ndim != 1 or not len(start):
        raise InputError(f"names, start, priors and bounds need one length, found {sorted(lengths)}")
    if rest.ndim != 1 or len(rest) != len(problem.blocks) or not np.all(np.isfinite(rest)):
        raise InputError("the residual at the start needs one finite number for each of the blocks' rows")
    if len(np.unique(problem.blocks)) < 2:
        raise InputError("the covariance needs at least two blocks")
    for name, value, low, high, prior in zip(problem.names, start, lower, upper, problem.priors, strict=True):
        if not low <= value <= high or not prior > 0:
            raise InputError(
                f"{name}: start {value:g} outside {low:g} to {high:g}, or prior {prior:g} not positive"
            )
