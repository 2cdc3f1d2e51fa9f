"""The least-squares core: data weighed by the independent samples that they are worth, beside the priors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdsim.estimate.problem import Problem
from hdsim.estimate.records import Array
from hdsim.estimate.slopes import Slopes

#: Evaluations of the residual in one round of a fit, Jacobians aside.
EVALUATIONS = 8
#: Relative fall of the cost at which a round of a fit ends; rounds, and promised fall, in units of what one
#: independent sample adds to the cost, at which no further one begins.
ROUGHLY, ROUNDS, TIGHT = 3e-4, 2, 0.25


@dataclass(frozen=True)
class Minimum:
    """Where a fit ends.

    Attributes:
        x: shape (p,).
        rest: the residual there, shape (rows,).
        columns: sensitivities there, shape (rows, p).
        promised: fall of the cost that they promise there, in units of what one independent sample adds;
            not known of a rough fit.
    """

    x: Array
    rest: Array
    columns: Array
    promised: float = 0.0


def minimised(
    problem: Problem,
    x0: Array,
    centre: Array,
    power: float,
    *,
    known: Array | None = None,
    evaluations: int = EVALUATIONS,
    rounds: int = ROUNDS,
    tight: float = TIGHT,
    rough: bool = False,
) -> Minimum:
    """Least squares of the residual and of what the priors have against the numbers.

    Args:
        problem: what is fitted.
        x0: where to begin, within the bounds, shape (p,).
        centre: of the priors, shape (p,).
        power: what one independent sample of the residual counts.
        known: sensitivities at the start to the first numbers, shape (rows, up to p), where known.
        evaluations: residuals that the optimiser may ask for in a round.
        rounds: most rounds, each with an exact Jacobian at its end.
        tight: promised fall of the cost below which no further round begins.
        rough: one round, whose last Jacobian is good enough.

    Raises:
        ArithmeticError: the residual at the start cannot be computed.
    """
    from scipy.optimize import least_squares

    slopes = Slopes(problem, known, thrifty=rough)
    start = problem.residual(x0)
    slopes.rest[x0.tobytes()] = start
    worth, priors = 1.0 / math.sqrt(power), problem.priors

    def residual(x: Array) -> Array:
        rest = slopes.rest.get(x.tobytes())
        if rest is None:
            try:
                rest = slopes.rest[x.tobytes()] = problem.residual(x)
            except ArithmeticError:
                rest = 10.0 * start
        return rest

    def whole(x: Array, columns: Array) -> Array:
        """Derivatives and, last, values of all that is minimised, in p + 1 rows of the same products."""
        both = np.column_stack([-worth * columns, worth * residual(x)])
        beliefs = np.column_stack([np.diag(1.0 / priors), (x - centre) / priors])
        return np.asarray(np.linalg.qr(np.vstack([both, beliefs]), mode="r"))

    def length(x: Array) -> float:
        return math.hypot(
            worth * float(np.linalg.norm(residual(x))), float(np.linalg.norm((x - centre) / priors))
        )

    # The optimiser sees the long residual by its products alone: turned so that it is its length in the last
    # row, it is known before the derivatives are.
    def values(x: Array) -> Array:
        return np.append(np.zeros(len(x)), length(x))

    def jacobian(x: Array) -> Array:
        small = whole(x, slopes.at(x))
        return _turned(small[:, :-1], small[:, -1])

    promised = 0.0
    for _ in range(1 if rough else rounds):
        found = least_squares(
            values,
            x0,
            jac=jacobian,
            bounds=problem.bounds,
            method="trf",
            x_scale="jac",
            ftol=ROUGHLY,
            xtol=1e-4,
            gtol=1e-10,
            max_nfev=evaluations,
        )
        if rough:
            columns = slopes.at(found.x)
            break
        # The end is where the exact Jacobian promises less than an independent sample of the data is worth.
        columns = slopes.proved(found.x)
        small = whole(found.x, columns)
        free, rest = found.active_mask == 0, small[:, -1]
        step, *_ = np.linalg.lstsq(small[:, :-1][:, free], -rest, rcond=None)
        promised = float(np.sum(rest**2) - np.sum((rest + small[:, :-1][:, free] @ step) ** 2))
        if promised < tight:
            break
        x0 = found.x
    return Minimum(found.x, residual(found.x), columns, promised)


def _turned(columns: Array, values: Array) -> Array:
    """Columns, shape (n, p), turned so that the values, (n,), would be their length in the last row alone.

    A. S. Householder 1958, Journal of the ACM 5:339: the reflection that takes one vector to another.
    """
    mirror = values.copy()
    mirror[-1] -= float(np.linalg.norm(values))
    size = float(mirror @ mirror)
    return columns if size == 0.0 else columns - np.outer(mirror, 2.0 / size * (mirror @ columns))
