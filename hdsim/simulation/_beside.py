"""How models move that differ a little from one that is simulated, along its steps (imports numba).

With f the right-hand side, J its Jacobian, r the numbers of the model and r_k those of one beside it, the
difference d_k of their states follows, to first order in it,

    d_k' = J(t, y) d_k + f(t, y; r_k) - f(t, y; r),    d_k(0) = y_k(0) - y(0):

the variational equation, with the right-hand side's own difference instead of its derivative (E. Hairer,
S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., Springer 1993, section I.14).
Over each step of the model it is solved by Radau IIA of two stages, order 3 and L-stable (Hairer and Wanner
1996, IV.5), with one linear system for all the models beside it; between the ends of a step d_k is the cubic
that has values and slopes there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hdsim._abi import call_system
from hdsim._compile import compiled
from hdsim.simulation._lu import factorise, solve

_jit: Any = compiled

#: Radau IIA: first node; the other is the end of the step. Coefficients of its two stages.
_NODE = 1.0 / 3.0
_A11, _A12, _A21, _A22 = 5.0 / 12.0, -1.0 / 12.0, 0.75, 0.25


@_jit
def _pushes(address, t, y, own, lists, others, shared, scratch, kept, other, spare, dfdt, push):  # type: ignore[no-untyped-def]
    """Differences of the others' right-hand sides from the model's ``own``, computed just before."""
    first = shared[0, 0]
    for i in range(len(kept)):
        kept[i] = scratch[first + i]
    for b in range(others.shape[0]):
        to = shared[b, 1]
        if to >= 0:
            others[b, to : to + len(kept)] = kept
        call_system(address, t, y, lists[b], others[b], scratch, 0, other, spare, dfdt)
        for i in range(len(y)):
            push[b, i] = other[i] - own[i]


@_jit
def follow(  # type: ignore[no-untyped-def]
    address,
    integers,
    reals,
    others,
    lists,
    shared,
    scratch,
    times,
    states,
    pieces,
    count,
    fresh,
    near,
    slopes,
    t_eval,
    out,
):
    """Carry the models beside one along ``count`` of its steps.

    Args:
        address: of the system kernel; ``integers``, ``reals`` and ``scratch`` are its own.
        integers: see ``hdsim.system.System``.
        reals: of the model.
        others: of those beside it, shape (k, reals); changed where they share.
        lists: integers of those beside it, shape (k, integers).
        shared: first place in the scratch, and in each other's reals (-1: in none), and number of what a
            model beside this one takes from it instead of computing it, shape (k, 3).
        scratch: likewise.
        times: ends of the steps, shape (count + 1,) or longer.
        states: of the model there, shape (count + 1, n).
        pieces: the rest of its continuous extension, shape (count, 2, n).
        count: of the steps.
        fresh: whether something jumped where the first step begins, so that the slopes are to be made anew.
        near: differences of the states, shape (k, n); updated.
        slopes: their time derivatives, shape (k, n); updated.
        t_eval: increasing times up to the end of the last step, shape (m,).
        out: gets the differences there, shape (k, m, n).
    """
    n, k = states.shape[1], others.shape[0]
    f, other, dfdt = np.empty(n), np.empty(n), np.empty(n)
    between, mid, end = np.empty(n), np.empty(n), np.empty(n)
    at_mid, at_end = np.empty((n, n)), np.empty((n, n))
    push_mid, push_end = np.empty((k, n)), np.empty((k, n))
    matrix, inverse = np.empty((2 * n, 2 * n)), np.empty(2 * n)
    pivots, both = np.empty(2 * n, dtype=np.int64), np.empty(2 * n)
    kept = np.empty(max(0, np.max(shared[:, 2])))
    if fresh:
        call_system(address, times[0], states[0], integers, reals, scratch, 1, f, at_end, dfdt)
        _pushes(
            address, times[0], states[0], f, lists, others, shared, scratch, kept, other, at_mid, dfdt, slopes
        )
        for b in range(k):
            for i in range(n):
                for j in range(n):
                    slopes[b, i] += at_end[i, j] * near[b, j]
    sample = 0
    for step in range(count):
        t0, t1 = times[step], times[step + 1]
        h = t1 - t0
        t_mid = t0 + _NODE * h
        rest = 1.0 - _NODE
        for i in range(n):
            between[i] = states[step, i] * rest + _NODE * (
                states[step + 1, i] + rest * (pieces[step, 0, i] + _NODE * pieces[step, 1, i])
            )
        call_system(address, t_mid, between, integers, reals, scratch, 1, mid, at_mid, dfdt)
        _pushes(
            address, t_mid, between, mid, lists, others, shared, scratch, kept, other, matrix, dfdt, push_mid
        )
        at = states[step + 1]
        call_system(address, t1, at, integers, reals, scratch, 1, end, at_end, dfdt)
        _pushes(address, t1, at, end, lists, others, shared, scratch, kept, other, matrix, dfdt, push_end)
        for i in range(n):
            for j in range(n):
                same = 1.0 if i == j else 0.0
                matrix[i, j] = same - h * _A11 * at_mid[i, j]
                matrix[i, n + j] = -h * _A12 * at_end[i, j]
                matrix[n + i, j] = -h * _A21 * at_mid[i, j]
                matrix[n + i, n + j] = same - h * _A22 * at_end[i, j]
        factorise(matrix, inverse, pivots, 2 * n)
        last = sample
        while last < len(t_eval) and t_eval[last] <= t1:
            last += 1
        for b in range(k):
            for i in range(n):
                both[i] = near[b, i] + h * (_A11 * push_mid[b, i] + _A12 * push_end[b, i])
                both[n + i] = near[b, i] + h * (_A21 * push_mid[b, i] + _A22 * push_end[b, i])
            solve(matrix, inverse, pivots, 2 * n, at_mid, 2 * n, 0.0, both)
            for i in range(n):
                slope = push_end[b, i]
                for j in range(n):
                    slope += at_end[i, j] * both[n + j]
                before, after = near[b, i], both[n + i]
                first, second = h * slopes[b, i], h * slope
                for m in range(sample, last):
                    s = (t_eval[m] - t0) / h
                    r = 1.0 - s
                    out[b, m, i] = (
                        before * r * r * (1.0 + 2.0 * s)
                        + after * s * s * (1.0 + 2.0 * r)
                        + r * s * (r * first - s * second)
                    )
                near[b, i], slopes[b, i] = after, slope
        sample = last
