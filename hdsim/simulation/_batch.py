"""Many joints of one build advanced and observed one after another in one compiled loop (imports numba)."""

from __future__ import annotations

from typing import Any

import numpy as np

from hdsim._compile import compiled
from hdsim.drive._assembly import observe
from hdsim.simulation._cover import cover
from hdsim.simulation._rosenbrock import T_BOUND, T

_jit: Any = compiled


@_jit
def step_each(  # type: ignore[no-untyped-def]
    drives, address, integers, reals, scratch, y, atol, control, counts, work, times, states, pieces,
    inside_at, guarded, limit, statuses,
):  # fmt: skip
    """Integrate each of ``drives`` to its ``control[T_BOUND]``; the arguments are those of ``cover``.

    ``reals`` (N, reals), ``y`` (N, n), ``atol`` (N, n), ``control`` (N, CONTROL_SIZE) and ``statuses`` (N,)
    have a row for every drive; what else there is serves all of them in turn.
    """
    stops, cuts, progress = np.zeros(0), np.zeros(2), np.zeros(2, dtype=np.int64)
    t_eval, out = np.zeros(0), np.zeros((0, y.shape[1]))
    others, near = np.zeros((0, reals.shape[1])), np.zeros((y.shape[1], 0))
    lists, shared = np.zeros((0, len(integers)), dtype=np.int64), np.zeros(0, dtype=np.bool_)
    slopes, sizes = np.zeros((y.shape[1], 0)), np.zeros((y.shape[1], 0))
    beside = np.zeros((0, 0, y.shape[1]))
    for k in drives:
        cuts[0], cuts[1] = control[k, T], control[k, T_BOUND]
        progress[:] = 0
        statuses[k] = cover(
            address, integers, reals[k], scratch, stops, y[k], atol[k], control[k], counts, work, times,
            states, pieces, cuts, inside_at, guarded, limit, t_eval, out, progress, 1 << 40, others, lists,
            shared, near, slopes, sizes, beside,
        )  # fmt: skip


@_jit
def observe_each(address, times, y, integers, reals, inside, scratch, places, rows):  # type: ignore[no-untyped-def]
    """The numbers of every drive's scratch at ``places``, into ``rows`` (N, places); see ``observe``."""
    held = np.zeros(1)
    for k in range(y.shape[0]):
        observe(
            address, times[k : k + 1], y[k : k + 1], integers, reals[k], inside[k : k + 1], -1, held, scratch,
            places, rows[k : k + 1],
        )  # fmt: skip
