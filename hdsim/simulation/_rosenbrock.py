"""RODAS, compiled once for every model (imports numba: load lazily).

A six-stage, stiffly accurate, L-stable Rosenbrock method of order 4 with an embedded one of order 3 and a
continuous extension of order 3: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed.,
Springer 1996, section IV.7 (coefficients in ``_rodas.py``). Step-size control: the same book, section IV.8
(Gustafsson's predictive controller).

With u = sum gamma_ij k_j a step from (t, y) of size h solves, for i = 1..6,

    (1/(h gamma) - J) u_i = f(t + c_i h, y + sum_j a_ij u_j) + sum_j (c_ij / h) u_j + d_i h df/dt,

one matrix for all stages; y_new = y + sum_j a_6j u_j + u_6, and u_6 is the error estimate.

The model comes in as the address of its system kernel, so nothing here depends on it.
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any

import numpy as np

from hdsim._abi import call_system
from hdsim._compile import compiled
from hdsim.simulation import _rodas as c
from hdsim.simulation._first_step import first_not_finite, initial_step, suspect
from hdsim.simulation._lu import factorise, solve

_jit: Any = compiled

# Step-size control as in the book's code: safety factor, largest shrinking and growth (inverse) of a step.
# The book has 0.9 and a growth by 6; teeth that touch and part make the error jumpy, and with more caution a
# drive costs 12 % less at equal error.
_SAFETY = 0.8
_SHRINK = 5.0
_GROW = 1.0 / 2.5
#: After this many non-finite attempts in a row, each with a tenth of the step, there is no way on.
_HOPELESS = 25

#: Largest value of s^2 (1 - s), which multiplies the cubic term of the continuous extension. That term tells
#: h^3 y''' / 6; its size to the power 4/3, in units of the state, is that of h^4 y'''' / 384, the error of a
#: cubic through both ends (within 10 % for a sine). The embedded estimate alone is blind to it in the stiff
#: limit, where it dies out with 1 / (h * stiffness): right steps, wrong samples between them.
_CUBIC_PEAK = 4.0 / 27.0

# What ``control`` holds.
T, T_BOUND, STEP, MAX_STEP, RTOL, LAST_STEP, LAST_ERROR = range(7)
CONTROL_SIZE = 7

# What ``counts`` holds; the pivots of the LU decomposition follow.
SIZE, QUADRATURES, DONE, NFEV, NJEV, NLU, ACCEPTED, REJECTED, SUSPECT = range(9)
COUNTS_SIZE = 9

# What ``advance`` returns.
RUNNING, FINISHED, STEP_TOO_SMALL, NOT_FINITE = 0, 1, -1, -2


def work_size(size: int, quadratures: int) -> int:
    """Number of float64 of work that ``advance`` needs."""
    core = size - quadratures
    return 10 * size + size * size + core * core + core


@_jit
def _next_stop(stops, t, t_bound):  # type: ignore[no-untyped-def]
    """Index of the first of the increasing ``stops`` beyond t on the way to ``t_bound``; may be none's."""
    if t_bound >= t:
        return np.searchsorted(stops, t, side="right")
    return np.searchsorted(stops, t, side="left") - 1


@_jit
def advance(  # type: ignore[no-untyped-def]
    address, integers, reals, scratch, stops, y, atol, control, counts, work, times, states, pieces
):
    """Take up to ``len(pieces)`` accepted steps, stopping exactly at ``control[T_BOUND]``.

    Args:
        address: of the system kernel; ``integers``, ``reals`` and ``scratch`` are its own.
        integers: see ``hdsim.system.System``.
        reals: likewise.
        scratch: likewise.
        stops: increasing times at which a step has to end, shape (s,).
        y: state, shape (n,); updated.
        atol: absolute tolerance, shape (n,).
        control: shape (CONTROL_SIZE,); updated. ``control[STEP]`` is the size of the step to try (0: choose
            one), ``control[LAST_STEP]`` 0 before the first step.
        counts: shape (COUNTS_SIZE + n,), int64; updated. ``counts[DONE]`` is the number of steps taken here.
        work: shape (work_size(n, quadratures),).
        times: shape (k + 1,); gets the ends of the steps.
        states: shape (k + 1, n); gets the states there.
        pieces: shape (k, 2, n); gets the rest of the continuous extension.

    Returns:
        RUNNING, FINISHED, STEP_TOO_SMALL or NOT_FINITE; then ``counts[SUSPECT]`` is the state that failed,
        -1 if unknown.
    """
    n, core = counts[SIZE], counts[SIZE] - counts[QUADRATURES]
    pivots = counts[COUNTS_SIZE:]
    f, dfdt, dy, new = work[:n], work[n : 2 * n], work[2 * n : 3 * n], work[3 * n : 4 * n]
    u1, u2, u3 = work[4 * n : 5 * n], work[5 * n : 6 * n], work[6 * n : 7 * n]
    u4, u5, u6 = work[7 * n : 8 * n], work[8 * n : 9 * n], work[9 * n : 10 * n]
    start = 10 * n
    jacobian = work[start : start + n * n].reshape(n, n)
    start += n * n
    matrix = work[start : start + core * core].reshape(core, core)
    start += core * core
    inverse = work[start : start + core]

    t, t_bound, rtol = control[T], control[T_BOUND], control[RTOL]
    direction = 1.0 if t_bound >= t else -1.0
    times[0] = t
    for i in range(n):
        states[0, i] = y[i]
    counts[DONE] = 0
    at = _next_stop(stops, t, t_bound)

    while counts[DONE] < len(pieces):
        stop = t_bound
        if 0 <= at < len(stops) and (t_bound - stops[at]) * direction > 0.0:
            stop = stops[at]
        call_system(address, t, y, integers, reals, scratch, 1, f, jacobian, dfdt)
        counts[NFEV] += 1
        counts[NJEV] += 1
        if control[STEP] == 0.0:
            control[STEP] = initial_step(
                address, t, y, integers, reals, scratch, f, t_bound - t, rtol, atol, new, dy, jacobian, u1
            )
            counts[NFEV] += 1
        smallest = 10.0 * abs(np.nextafter(t, direction * np.inf) - t)
        size = min(max(control[STEP], smallest), control[MAX_STEP])
        rejected, hopeless, accepted = False, 0, False
        k = counts[DONE]

        while not accepted:
            proposed, truncated, arrives = size, False, False
            rest = abs(stop - t)
            if rest <= 1.0001 * size:
                size, truncated, arrives = rest, True, True
            elif rest < 2.0 * size:  # two equal steps rather than one and a crumb
                size, truncated = 0.5 * rest, True
            h = direction * size
            t_new = stop if arrives else t + h

            diagonal = 1.0 / (h * c.GAMMA)
            for i in range(core):
                for j in range(core):
                    matrix[i, j] = -jacobian[i, j]
                matrix[i, i] += diagonal
            factorise(matrix, inverse, pivots, core)
            counts[NLU] += 1
            step_gamma = h * c.GAMMA
            p = 1.0 / h

            s1 = h * c.D1
            for i in range(n):
                u1[i] = f[i] + s1 * dfdt[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u1)

            for i in range(n):
                new[i] = y[i] + c.A21 * u1[i]
            call_system(address, t + c.C2 * h, new, integers, reals, scratch, 0, dy, jacobian, dfdt)
            s1, s2 = p * c.C21, h * c.D2
            for i in range(n):
                u2[i] = dy[i] + s1 * u1[i] + s2 * dfdt[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u2)

            for i in range(n):
                new[i] = y[i] + c.A31 * u1[i] + c.A32 * u2[i]
            call_system(address, t + c.C3 * h, new, integers, reals, scratch, 0, dy, jacobian, dfdt)
            s1, s2, s3 = p * c.C31, p * c.C32, h * c.D3
            for i in range(n):
                u3[i] = dy[i] + s1 * u1[i] + s2 * u2[i] + s3 * dfdt[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u3)

            for i in range(n):
                new[i] = y[i] + c.A41 * u1[i] + c.A42 * u2[i] + c.A43 * u3[i]
            call_system(address, t + c.C4 * h, new, integers, reals, scratch, 0, dy, jacobian, dfdt)
            s1, s2, s3, s4 = p * c.C41, p * c.C42, p * c.C43, h * c.D4
            for i in range(n):
                u4[i] = dy[i] + s1 * u1[i] + s2 * u2[i] + s3 * u3[i] + s4 * dfdt[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u4)

            for i in range(n):
                new[i] = y[i] + c.A51 * u1[i] + c.A52 * u2[i] + c.A53 * u3[i] + c.A54 * u4[i]
            call_system(address, t_new, new, integers, reals, scratch, 0, dy, jacobian, dfdt)
            s1, s2, s3, s4 = p * c.C51, p * c.C52, p * c.C53, p * c.C54
            for i in range(n):
                u5[i] = dy[i] + s1 * u1[i] + s2 * u2[i] + s3 * u3[i] + s4 * u4[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u5)

            for i in range(n):
                new[i] += u5[i]
            call_system(address, t_new, new, integers, reals, scratch, 0, dy, jacobian, dfdt)
            s1, s2, s3, s4, s5 = p * c.C61, p * c.C62, p * c.C63, p * c.C64, p * c.C65
            for i in range(n):
                u6[i] = dy[i] + s1 * u1[i] + s2 * u2[i] + s3 * u3[i] + s4 * u4[i] + s5 * u5[i]
            solve(matrix, inverse, pivots, core, jacobian, n, step_gamma, u6)

            total, bend = 0.0, 0.0
            for i in range(n):
                new[i] += u6[i]
                # The floor is for a state that is exactly 0 and has no absolute tolerance.
                tolerance = 1.0 / max(atol[i] + rtol * max(abs(y[i]), abs(new[i])), 1e-150)
                ratio = u6[i] * tolerance
                total += ratio * ratio
                cubic = c.H31 * u1[i] + c.H32 * u2[i] + c.H33 * u3[i] + c.H34 * u4[i] + c.H35 * u5[i]
                pieces[k, 1, i] = cubic
                ratio = cubic * tolerance
                bend += ratio * ratio
            error = sqrt(total / n)
            if rtol > 0.0 and bend < np.inf:
                between = rtol * _CUBIC_PEAK * sqrt(bend / n)
                # Most often it is the smaller one, and no power need be computed.
                if between * between * between * between > (rtol * error) ** 3:
                    error = max(error, between ** (4.0 / 3.0) / rtol)
            counts[NFEV] += 5

            if not isfinite(error):
                counts[REJECTED] += 1
                hopeless += 1
                at_start = first_not_finite(f) >= 0 or first_not_finite(dfdt) >= 0
                for i in range(n):
                    at_start = at_start or first_not_finite(jacobian[i]) >= 0
                size *= 0.1
                if at_start or hopeless > _HOPELESS or size < smallest:
                    counts[SUSPECT] = suspect(
                        address, t, h, y, integers, reals, scratch, f, jacobian, dfdt, new, dy
                    )
                    return NOT_FINITE
                rejected = True
                continue

            factor = max(_GROW, min(_SHRINK, sqrt(sqrt(error)) / _SAFETY))
            if error >= 1.0:
                counts[REJECTED] += 1
                rejected = True
                size /= factor
                if size < smallest:
                    worst = -1.0
                    for i in range(n):
                        ratio = abs(u6[i]) / (atol[i] + rtol * max(abs(y[i]), abs(new[i])))
                        if ratio > worst:
                            worst = ratio
                            counts[SUSPECT] = i
                    return STEP_TOO_SMALL
                continue

            accepted = True
            # Rounding hides the error of a step cut to almost nothing: it says nothing against the uncut one.
            best = proposed if error < 1e-6 else min(proposed, size * _SAFETY / sqrt(sqrt(error)))
            if control[LAST_STEP] > 0.0:
                predicted = control[LAST_STEP] / size * sqrt(sqrt(error * error / control[LAST_ERROR]))
                factor = max(factor, max(_GROW, min(_SHRINK, predicted / _SAFETY)))
            following = size / factor
            if rejected:
                following = min(following, size)
            elif truncated:  # the stop, not the error, made this step short
                following = max(following, best)
            control[LAST_STEP] = size
            control[LAST_ERROR] = max(1e-2, error)
            control[STEP] = min(following, control[MAX_STEP])

        for i in range(n):
            y[i] = new[i]
            states[k + 1, i] = new[i]
            pieces[k, 0, i] = c.H21 * u1[i] + c.H22 * u2[i] + c.H23 * u3[i] + c.H24 * u4[i] + c.H25 * u5[i]
        t = t_new
        times[k + 1] = t
        control[T] = t
        counts[DONE] += 1
        counts[ACCEPTED] += 1
        if arrives and stop == t_bound:
            return FINISHED
        if arrives:
            at += 1 if direction > 0.0 else -1
    return RUNNING


@_jit
def interpolate(times, states, pieces, count, t, out):  # type: ignore[no-untyped-def]
    """Evaluate the continuous extension of ``count`` steps at ``t`` (m,) into ``out`` (n, m).

    Outside the steps the first or last piece is continued.
    """
    forward = times[count] >= times[0]
    for j in range(len(t)):
        low, high = 0, count - 1
        while low < high:
            middle = (low + high) // 2
            if (t[j] <= times[middle + 1]) if forward else (t[j] >= times[middle + 1]):
                high = middle
            else:
                low = middle + 1
        s = (t[j] - times[low]) / (times[low + 1] - times[low])
        r = 1.0 - s
        for i in range(states.shape[1]):
            out[i, j] = states[low, i] * r + s * (
                states[low + 1, i] + r * (pieces[low, 0, i] + s * pieces[low, 1, i])
            )
