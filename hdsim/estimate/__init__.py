"""Parameters of a model from measured data: records, noise, prediction, fit, confidence intervals.

>>> from hdsim.estimate import estimate, solve
>>> found = estimate([record], scenario)  # a drive's parameters
>>> found = solve(problem)  # your own residual, see hdsim.estimate.problem
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.estimate.estimation import Estimation, estimate
    from hdsim.estimate.problem import Problem
    from hdsim.estimate.solution import Solution, solve

__all__ = ["Estimation", "Problem", "Solution", "estimate", "solve"]

_HOMES = {
    "Estimation": "estimation",
    "Problem": "problem",
    "Solution": "solution",
    "estimate": "estimation",
    "solve": "solution",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
