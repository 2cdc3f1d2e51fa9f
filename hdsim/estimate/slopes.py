"""The Jacobian of a fit: made anew only where the last one no longer foretells the residuals.

It is made of the problem's own derivatives, of tangents or of finite differences; between two of them it
follows the residuals that the fit sees anyway (Broyden 1965, Mathematics of Computation 19:577), for as long
as it foretells them.
"""

from __future__ import annotations

import math

import numpy as np

from hdsim.estimate.problem import Differentiable, Problem, Simulated
from hdsim.estimate.records import Array

#: Size of a direction, all columns of length 1, below which what they say of it may be their own error, and
#: change of the residual along it, root mean square, below which it is the solver's.
WEAK, HEARD = 0.3, 0.006
#: Part of a step's change that a Jacobian may get wrong and still be corrected instead of made anew, and of
#: the residual that it may get wrong and stay as it is.
FORETOLD, NEGLIGIBLE = 0.3, 0.01
#: Relative step of a central difference at which rounding and curvature err alike.
THIRD = float(np.cbrt(np.finfo(float).eps))


class Slopes:
    """Sensitivities of what is predicted: the residual's derivatives, their sign turned, shape (rows, p).

    Args:
        problem: what is fitted.
        known: the sensitivities near the start to the first numbers, shape (rows, up to p), where known.
        thrifty: make them anew only where the last step has led away, and then by secants: a fit that has so
            far to go is led better by what is seen from afar.
    """

    def __init__(self, problem: Problem, known: Array | None = None, *, thrifty: bool = False) -> None:
        self._problem, self._thrifty = problem, thrifty
        self._columns = known
        self._at: Array | None = None if known is None else np.zeros(0)
        #: Residuals by the bytes of where they were seen.
        self.rest: dict[bytes, Array] = {}

    def exact(self, x: Array) -> Array:
        """Made at ``x``, shape (rows, p)."""
        self._columns = made(self._problem, x, like=self._columns, tangents=not self._thrifty)
        self._at = x.copy()
        return self._columns

    def proved(self, x: Array) -> Array:
        """Made at ``x``, with each direction in which its columns cancel tried as a whole.

        What is left of columns that cancel is mostly their own error, which would be taken for knowledge.
        """
        columns, problem = made(self._problem, x, like=self._columns), self._problem
        self._columns, self._at = columns, x.copy()
        if not isinstance(problem, Simulated):
            return columns
        lengths = np.linalg.norm(columns, axis=0)
        seen = lengths > 0  # the others say nothing that could be wrong
        _, sizes, directions = np.linalg.svd(np.linalg.qr(columns[:, seen] / lengths[seen], mode="r"))
        weak = np.zeros((int(np.sum(sizes < WEAK)), len(x)))
        weak[:, seen] = directions[sizes < WEAK] / lengths[seen]
        most = np.abs(problem.steps(x))
        steps = [d * float(np.min(most / np.maximum(np.abs(d), 1e-300))) for d in weak]
        changes = problem.changes([(x - d, x + d) for d in steps])
        # What a column may be wrong by: a part of itself, and a change that is just heard over its step.
        wrong = (WEAK * lengths) ** 2 + len(columns) * (HEARD / most) ** 2
        for d, change in zip(steps, changes, strict=True):
            if change is None:
                continue
            change = 0.5 * change
            if math.sqrt(np.mean(change**2)) < HEARD:
                change = np.zeros_like(change)
            along = d * wrong
            columns = columns + np.outer(change - columns @ d, along / (d @ along))
        self._columns = columns
        return columns

    def at(self, x: Array) -> Array:
        """Corrected or made anew, shape (rows, p)."""
        if self._columns is None or self._at is None:
            return self.exact(x)
        if not len(self._at):
            # What was known counts where the fit begins.
            rest = made(self._problem, x, self._columns.shape[1], tangents=not self._thrifty)
            self._columns, self._at = np.hstack([self._columns, rest]), x.copy()
        step = x - self._at
        if not np.any(step):
            return self._columns
        before, now = self.rest.get(self._at.tobytes()), self.rest.get(x.tobytes())
        if before is None or now is None:
            return self.exact(x)
        change = before - now  # of the predictions
        missed = change - self._columns @ step
        size = float(np.linalg.norm(missed))
        if size <= NEGLIGIBLE * np.linalg.norm(now):
            return self._columns  # of the order of the solver's noise, from which nothing is learned
        led_away = np.linalg.norm(now) >= np.linalg.norm(before)
        if size > FORETOLD * np.linalg.norm(change) and (led_away or not self._thrifty):
            return self.exact(x)
        scaled = np.einsum("ij,ij->j", self._columns, self._columns) * step
        self._columns = self._columns + np.outer(missed, scaled / max(float(step @ scaled), 1e-300))
        self._at = x.copy()
        return self._columns


def made(
    problem: Problem, x: Array, first: int = 0, like: Array | None = None, *, tangents: bool = False
) -> Array:
    """Sensitivities at ``x`` to the numbers from ``first`` on, shape (rows, p - first).

    Args:
        problem: what is fitted.
        x: where.
        first: index of the first number that is asked for.
        like: sensitivities near ``x``, which tell a simulated problem how large its steps have to be.
        tangents: see ``Simulated``.
    """
    if isinstance(problem, Simulated):
        return problem.sensitivities(x, first, like, tangents=tangents)
    if isinstance(problem, Differentiable):
        return -np.asarray(problem.jacobian(x), dtype=float)[:, first:]
    lower, upper = problem.bounds
    columns = []
    sizes = np.where(np.isfinite(problem.priors), problem.priors, 1.0)
    for k in range(first, len(x)):
        step = THIRD * max(abs(float(x[k])), float(sizes[k]))
        back, ahead = x.copy(), x.copy()
        back[k], ahead[k] = max(x[k] - step, lower[k]), min(x[k] + step, upper[k])
        columns.append((problem.residual(back) - problem.residual(ahead)) / (ahead[k] - back[k]))
    return np.column_stack(columns) if columns else np.zeros((len(problem.blocks), 0))
