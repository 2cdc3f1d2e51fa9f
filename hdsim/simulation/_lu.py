"""Linear systems of a Rosenbrock method: LU decomposition, substitution (imports numba: load lazily)."""

from __future__ import annotations

from typing import Any

from hdsim._compile import compiled

_jit: Any = compiled


@_jit
def factorise(matrix, inverse, pivots, size):  # type: ignore[no-untyped-def]
    """LU decomposition in place, partial pivoting; ``inverse`` gets the inverse pivots."""
    for k in range(size):
        best, row = abs(matrix[k, k]), k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > best:
                best, row = abs(matrix[i, k]), i
        pivots[k] = row
        if row != k:
            for j in range(size):
                matrix[k, j], matrix[row, j] = matrix[row, j], matrix[k, j]
        inverse[k] = 1.0 / matrix[k, k]
        for i in range(k + 1, size):
            factor = matrix[i, k] * inverse[k]
            matrix[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]


@_jit
def solve(matrix, inverse, pivots, core, jacobian, size, step_gamma, b):  # type: ignore[no-untyped-def]
    """Solve (1/(h gamma) - J) x = b in place: LU for the core, back-substitution for the quadratures."""
    for k in range(core):
        row = pivots[k]
        value = b[row]
        if row != k:
            b[row] = b[k]
            b[k] = value
    # By columns: the updates of one column don't wait for each other.
    for k in range(core - 1):
        value = b[k]
        for i in range(k + 1, core):
            b[i] -= matrix[i, k] * value
    for k in range(core - 1, -1, -1):
        value = b[k] * inverse[k]
        b[k] = value
        for i in range(k):
            b[i] -= matrix[i, k] * value
    for i in range(core, size):
        value = b[i]
        for j in range(core):
            value += jacobian[i, j] * b[j]
        b[i] = value * step_gamma


@_jit
def solve_all(matrix, inverse, pivots, size, b):  # type: ignore[no-untyped-def]
    """Solve A x = b in place for every column of ``b`` (size, k), A as ``factorise`` left it."""
    columns = b.shape[1]
    for k in range(size):
        row = pivots[k]
        if row != k:
            for c in range(columns):
                b[k, c], b[row, c] = b[row, c], b[k, c]
    for k in range(size - 1):
        for i in range(k + 1, size):
            factor = matrix[i, k]
            if factor != 0.0:
                for c in range(columns):
                    b[i, c] -= factor * b[k, c]
    for k in range(size - 1, -1, -1):
        for c in range(columns):
            b[k, c] *= inverse[k]
        for i in range(k):
            factor = matrix[i, k]
            if factor != 0.0:
                for c in range(columns):
                    b[i, c] -= factor * b[k, c]
