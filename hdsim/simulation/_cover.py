"""RODAS over all smooth spans of a run, samples included, in one compiled loop (imports numba)."""

from __future__ import annotations

from math import isfinite
from typing import Any

from hdsim._compile import compiled
from hdsim.simulation._beside import follow
from hdsim.simulation._rosenbrock import (
    DONE,
    FINISHED,
    LAST_ERROR,
    LAST_STEP,
    RUNNING,
    T_BOUND,
    T,
    advance,
    interpolate,
)

_jit: Any = compiled

# What ``cover`` returns beside the statuses of ``advance``.
NOT_FINITE_STATE, RUNAWAY = -3, -4

# What ``progress`` holds.
SPAN, SAMPLED = range(2)


@_jit
def cover(  # type: ignore[no-untyped-def]
    address,
    integers,
    reals,
    scratch,
    stops,
    y,
    atol,
    control,
    counts,
    work,
    times,
    states,
    pieces,
    cuts,
    inside_at,
    guarded,
    limit,
    t_eval,
    out,
    progress,
    blocks,
    others,
    lists,
    shared,
    near,
    slopes,
    sizes,
    beside,
):
    """Integrate through the spans between ``cuts``; sample at increasing ``t_eval`` (m,) into ``out`` (m, n).

    The arguments up to ``pieces`` are those of ``_rosenbrock.advance``; ``control`` starts at the first span.
    Each span starts with the step size, but not with the error, of the one before. A sample at a cut belongs
    to the span before. ``inside_at`` is the place in the reals of a time inside the current span, or -1. The
    state ``guarded`` (-1: none) may not grow beyond ``limit``. ``progress`` (2,) counts spans and samples and
    starts with zeros. After so many ``blocks`` of steps control goes back to Python, which hears of Ctrl-C.
    Of models beside this one ``others`` (k, reals) holds the reals; ``lists``, ``shared``, ``near`` (n, k),
    ``slopes``, ``sizes`` (n, k) and the samples ``beside`` (k, m, n) are those of ``_beside.follow``.

    Returns RUNNING: call again; else what ``advance`` returned, NOT_FINITE_STATE or RUNAWAY.
    """
    for _ in range(blocks):
        span = progress[SPAN]
        fresh = control[T] == cuts[span]
        if inside_at >= 0:
            reals[inside_at] = 0.5 * (cuts[span] + cuts[span + 1])
            for k in range(others.shape[0]):
                others[k, inside_at] = reals[inside_at]
        status = advance(
            address, integers, reals, scratch, stops, y, atol, control, counts, work, times, states, pieces
        )
        first = progress[SAMPLED]
        end = first
        while end < len(t_eval) and t_eval[end] <= control[T]:
            end += 1
        if end > first and counts[DONE] > 0:
            interpolate(times, states, pieces, counts[DONE], t_eval[first:end], out[first:end].T)
            progress[SAMPLED] = end
        if others.shape[0] > 0 and counts[DONE] > 0:
            follow(
                address, integers, reals, others, lists, shared, scratch, times, states, pieces, counts[DONE],
                fresh, near, slopes, sizes, t_eval[first:end], beside[:, first:end],
            )  # fmt: skip
        if status < 0:
            return status
        for i in range(len(y)):
            if not isfinite(y[i]):
                return NOT_FINITE_STATE
        if guarded >= 0 and abs(y[guarded]) > limit:
            return RUNAWAY
        if status == FINISHED:
            if span + 2 == len(cuts):
                return FINISHED
            progress[SPAN] = span + 1
            control[T_BOUND] = cuts[span + 2]
            control[LAST_STEP] = 0.0
            control[LAST_ERROR] = 0.0
    return RUNNING
