"""Size of an integration's first step, and which state fails when there is none (imports numba: load lazily).

Initial step: Hairer, Norsett, Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., section II.4.
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any

from hdsim._abi import call_system
from hdsim._compile import compiled

_jit: Any = compiled


@_jit
def _scaled_norm(values, y, rtol, atol):  # type: ignore[no-untyped-def]
    """Root mean square of values / (atol + rtol |y|), SciPy's norm."""
    total = 0.0
    for i in range(len(y)):
        ratio = values[i] / (atol[i] + rtol * abs(y[i]))
        total += ratio * ratio
    return sqrt(total / len(y))


@_jit
def initial_step(address, t, y, integers, reals, scratch, f, span, rtol, atol, trial, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Size of the first step: one explicit Euler step tells the second derivative. ``span`` is signed."""
    d0, d1 = _scaled_norm(y, y, rtol, atol), _scaled_norm(f, y, rtol, atol)
    guess = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    guess = min(guess, abs(span))
    h = guess if span > 0.0 else -guess
    for i in range(len(y)):
        trial[i] = y[i] + h * f[i]
    call_system(address, t + h, trial, integers, reals, scratch, 0, dy, jacobian, dfdt)
    for i in range(len(y)):
        trial[i] = dy[i] - f[i]
    d2 = _scaled_norm(trial, y, rtol, atol) / guess
    largest = max(d1, d2)
    chosen = max(1e-6, guess * 1e-3) if largest <= 1e-15 else (0.01 / largest) ** 0.25
    chosen = min(100.0 * guess, chosen)
    return chosen if isfinite(chosen) else guess


@_jit
def first_not_finite(values):  # type: ignore[no-untyped-def]
    """Index of the first non-finite value, -1 if there is none."""
    for i in range(len(values)):
        if not isfinite(values[i]):
            return i
    return -1


@_jit
def suspect(address, t, h, y, integers, reals, scratch, f, jacobian, dfdt, trial, dy):  # type: ignore[no-untyped-def]
    """Index of the state whose equation gives the first bad number, at (t, y) or one Euler step on."""
    bad = first_not_finite(f)
    for i in range(len(y)):
        if bad < 0 and not (isfinite(dfdt[i]) and first_not_finite(jacobian[i]) < 0):
            bad = i
    if bad < 0:
        for i in range(len(y)):
            trial[i] = y[i] + h * f[i]
        call_system(address, t + h, trial, integers, reals, scratch, 0, dy, jacobian, dfdt)
        bad = first_not_finite(dy)
    return bad
