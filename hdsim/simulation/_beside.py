"""How models move that differ a little from one that is simulated, along its steps (imports numba).

With f the right-hand side, J its Jacobian, r the numbers of the model and r_k those of one beside it, the
difference d_k of their states follows, to first order in it,

    d_k' = J(t, y) d_k + f(t, y; r_k) - f(t, y; r),    d_k(0) = y_k(0) - y(0):

the variational equation, with the right-hand side's own difference instead of its derivative (E. Hairer,
S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., Springer 1993, section I.14).
Over each step of the model it is solved by Radau IIA of two stages, order 3 and L-stable (Hairer and Wanner
1996, IV.5), with one linear system for all the models beside it; between the ends of a step d_k is the cubic
that has values and slopes there.

Where the right-hand side has a corner (a spring's stiffness jumps, a tooth touches) f itself is continuous.
With the corner passed at the time t*, the difference behind it is the one before it plus (f_before -
f_behind) dt* (the saltation matrix: M. di Bernardo et al., *Piecewise-smooth Dynamical Systems*, Springer
2008, section 2.5), and so it does not jump, wherever the numbers of the model move the corner: only J and the
push f(r_k) - f(r) do. What is lost within the step that passes a corner is its size times the jump of J: such
a step is halved until little is lost.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hdsim._abi import call_system
from hdsim._compile import compiled
from hdsim.simulation._lu import factorise, solve_all

_jit: Any = compiled

#: Radau IIA: first node; the other is the end of the step. Coefficients of its two stages.
_NODE = 1.0 / 3.0
_A11, _A12, _A21, _A22 = 5.0 / 12.0, -1.0 / 12.0, 0.75, 0.25
#: A step with a corner of J is halved, down to so small a part, where the corner changes a difference by more
#: than this share of its size so far.
_SMALLEST_PART, _COUNTS = 1.0 / 16.0, 1e-2
#: J counts as smooth over a step where it bends by less than this part of its change: a corner by a third.
_SMOOTH = 0.2


@_jit
def _pushes(address, t, y, own, lists, others, shared, scratch, other, spare, dfdt, push):  # type: ignore[no-untyped-def]
    """Differences of the others' right-hand sides from the model's ``own``, computed just before."""
    # First those that take something from the scratch: the rest fill it with their own.
    for takes in (True, False):
        for b in range(others.shape[0]):
            if shared[b] != takes:
                continue
            call_system(address, t, y, lists[b], others[b], scratch, 0, other, spare, dfdt)
            for i in range(len(y)):
                push[i, b] = other[i] - own[i]


@_jit
def _inside(states, pieces, step, s, y):  # type: ignore[no-untyped-def]
    """The model's state at the part ``s`` of a step, shape (n,), into ``y``."""
    r = 1.0 - s
    for i in range(len(y)):
        y[i] = states[step, i] * r + s * (
            states[step + 1, i] + r * (pieces[step, 0, i] + s * pieces[step, 1, i])
        )


@_jit
def _cornered(h, start, mid, end, near, sizes, bend):  # type: ignore[no-untyped-def]
    """Whether J has a corner within the step, and what that does to a difference d counts.

    With a jump of J, J at the first node is off the straight line between the ends by at least a third of the
    jump; where J is smooth, by a small part of its change. Work: ``bend`` (n, n) or larger.
    """
    n, found = near.shape[0], False
    for i in range(n):
        bent = False
        for j in range(n):
            change = end[i, j] - start[i, j]
            bend[i, j] = h * (mid[i, j] - start[i, j] - _NODE * change)
            if abs(bend[i, j]) <= _SMOOTH * h * abs(change):
                bend[i, j] = 0.0
            bent = bent or bend[i, j] != 0.0
        if bent and not found:
            for b in range(near.shape[1]):
                off = 0.0
                for j in range(n):
                    off += bend[i, j] * near[j, b]
                found = found or abs(off) > _COUNTS * sizes[i, b]
    return found


@_jit
def _add_product(matrix, columns, to):  # type: ignore[no-untyped-def]
    """Add matrix (n, n) times columns (n, k) to ``to`` (n, k)."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            factor = matrix[i, j]
            if factor != 0.0:
                for b in range(columns.shape[1]):
                    to[i, b] += factor * columns[j, b]


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
    sizes,
    t_eval,
    out,
):
    """Carry the models beside one along ``count`` of its steps.

    Args:
        address: of the system kernel; ``integers``, ``reals`` and ``scratch`` are its own.
        integers: see ``hdsim.system.System``.
        reals: of the model.
        others: of those beside it, shape (k, reals).
        lists: integers of those beside it, shape (k, integers).
        shared: whether each takes from the scratch what the model has computed there, shape (k,).
        scratch: likewise.
        times: ends of the steps, shape (count + 1,) or longer.
        states: of the model there, shape (count + 1, n).
        pieces: the rest of its continuous extension, shape (count, 2, n).
        count: of the steps.
        fresh: whether something jumped where the first step begins, so that the slopes are to be made anew.
        near: differences of the states, shape (n, k); updated.
        slopes: their time derivatives, shape (n, k); updated.
        sizes: the largest differences so far, shape (n, k); updated.
        t_eval: increasing times up to the end of the last step, shape (m,).
        out: gets the differences there, shape (k, m, n).
    """
    n, k = states.shape[1], others.shape[0]
    f, other, dfdt = np.empty(n), np.empty(n), np.empty(n)
    y_mid, y_end, mid, end = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    mid_scratch = np.zeros_like(scratch)
    at_start, at_mid, at_end = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    push_mid, push_end = np.empty((n, k)), np.empty((n, k))
    matrix, inverse = np.empty((2 * n, 2 * n)), np.empty(2 * n)
    # Both stages of a state together, the last state first: parts' own states, which few others see, so that
    # elimination fills in least.
    pivots, both, after = np.empty(2 * n, dtype=np.int64), np.empty((2 * n, k)), np.empty((n, k))
    call_system(address, times[0], states[0], integers, reals, scratch, 1, f, at_start, dfdt)
    if fresh:
        _pushes(address, times[0], states[0], f, lists, others, shared, scratch, other, at_mid, dfdt, slopes)
        _add_product(at_start, near, slopes)
    sample = 0
    for step in range(count):
        length = times[step + 1] - times[step]
        done, part = 0.0, 1.0
        while done < 1.0:
            arrives = done + part == 1.0
            t0 = times[step] + done * length
            t1 = times[step + 1] if arrives else times[step] + (done + part) * length
            h = part * length
            t_mid = t0 + _NODE * h
            _inside(states, pieces, step, done + _NODE * part, y_mid)
            call_system(address, t_mid, y_mid, integers, reals, mid_scratch, 1, mid, at_mid, dfdt)
            _inside(states, pieces, step, done + part, y_end)
            call_system(address, t1, y_end, integers, reals, scratch, 1, end, at_end, dfdt)
            if part > _SMALLEST_PART and _cornered(h, at_start, at_mid, at_end, near, sizes, matrix):
                part *= 0.5
                continue
            _pushes(
                address, t_mid, y_mid, mid, lists, others, shared, mid_scratch, other, matrix, dfdt, push_mid
            )
            _pushes(address, t1, y_end, end, lists, others, shared, scratch, other, matrix, dfdt, push_end)
            for i in range(n):
                at = 2 * (n - 1 - i)
                for j in range(n):
                    of = 2 * (n - 1 - j)
                    same = 1.0 if i == j else 0.0
                    matrix[at, of] = same - h * _A11 * at_mid[i, j]
                    matrix[at, of + 1] = -h * _A12 * at_end[i, j]
                    matrix[at + 1, of] = -h * _A21 * at_mid[i, j]
                    matrix[at + 1, of + 1] = same - h * _A22 * at_end[i, j]
            factorise(matrix, inverse, pivots, 2 * n)
            last = sample
            while last < len(t_eval) and t_eval[last] <= t1:
                last += 1
            for i in range(n):
                at = 2 * (n - 1 - i)
                for b in range(k):
                    both[at, b] = near[i, b] + h * (_A11 * push_mid[i, b] + _A12 * push_end[i, b])
                    both[at + 1, b] = near[i, b] + h * (_A21 * push_mid[i, b] + _A22 * push_end[i, b])
            solve_all(matrix, inverse, pivots, 2 * n, both)
            for i in range(n):
                after[i] = both[2 * (n - 1 - i) + 1]
            _add_product(at_end, after, push_end)
            for m in range(sample, last):
                s = (t_eval[m] - t0) / h
                r = 1.0 - s
                for b in range(k):
                    for i in range(n):
                        out[b, m, i] = (
                            near[i, b] * r * r * (1.0 + 2.0 * s)
                            + after[i, b] * s * s * (1.0 + 2.0 * r)
                            + r * s * h * (r * slopes[i, b] - s * push_end[i, b])
                        )
            for i in range(n):
                for b in range(k):
                    near[i, b], slopes[i, b] = after[i, b], push_end[i, b]
                    sizes[i, b] = max(sizes[i, b], abs(after[i, b]))
            sample = last
            at_start, at_end = at_end, at_start
            done += part
            # Longer again where that ends at one of the halves of halves.
            if done < 1.0 and done % (2.0 * part) == 0.0:
                part *= 2.0
