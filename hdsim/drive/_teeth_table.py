"""The teeth's potential from a table over displacement and angle (imports numba: load lazily)."""

from __future__ import annotations

import math
from typing import Any

from hdsim._compile import compiled
from hdsim.drive._mesh_layout import (
    TABLE_ANGLE_NODES,
    TABLE_AT,
    TABLE_TWIST_NODES,
    TABLE_TWIST_START,
    TABLE_TWIST_STEP,
)

_jit: Any = compiled


@_jit
def table_potential(p, x, angle):  # type: ignore[no-untyped-def]
    """``teeth_potential`` from a bicubic spline of V over displacement and angle; linear beyond."""
    step = p[TABLE_TWIST_STEP]
    rows = int(p[TABLE_TWIST_NODES])
    columns = int(p[TABLE_ANGLE_NODES])
    at = int(p[TABLE_AT])
    limit = step * (rows - 3)
    place = x - p[TABLE_TWIST_START]
    beyond = 0.0
    if place < 0.0:
        beyond = place
        place = 0.0
    elif place > limit:
        beyond = place - limit
        place = limit
    cell = min(int(place / step), rows - 4)
    u = place / step - cell
    turn = angle / math.pi
    turn = (turn - math.floor(turn)) * columns
    column = min(int(turn), columns - 1)
    w = turn - column
    angle_step = math.pi / columns
    # Cubic B-spline weights of the four nodes around the point, with slopes and curvatures.
    u1 = 1.0 - u
    w1 = 1.0 - w
    a = (
        u1 * u1 * u1 / 6.0,
        (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
        (4.0 - 6.0 * u1 * u1 + 3.0 * u1 * u1 * u1) / 6.0,
        u * u * u / 6.0,
    )
    da = (-0.5 * u1 * u1, -2.0 * u + 1.5 * u * u, 2.0 * u1 - 1.5 * u1 * u1, 0.5 * u * u)
    dda = (u1, -2.0 + 3.0 * u, -2.0 + 3.0 * u1, u)
    b = (
        w1 * w1 * w1 / 6.0,
        (4.0 - 6.0 * w * w + 3.0 * w * w * w) / 6.0,
        (4.0 - 6.0 * w1 * w1 + 3.0 * w1 * w1 * w1) / 6.0,
        w * w * w / 6.0,
    )
    db = (-0.5 * w1 * w1, -2.0 * w + 1.5 * w * w, 2.0 * w1 - 1.5 * w1 * w1, 0.5 * w * w)
    ddb = (w1, -2.0 + 3.0 * w, -2.0 + 3.0 * w1, w)
    v = v_x = v_xx = v_a = v_aa = v_xa = v_xaa = v_xxa = v_xxaa = 0.0
    for k in range(4):
        line = at + (cell + k) * columns
        s = s_a = s_aa = 0.0
        for m in range(4):
            node = column + m - 1
            if node < 0:
                node += columns
            elif node >= columns:
                node -= columns
            c = p[line + node]
            s += c * b[m]
            s_a += c * db[m]
            s_aa += c * ddb[m]
        v += a[k] * s
        v_x += da[k] * s
        v_xx += dda[k] * s
        v_a += a[k] * s_a
        v_aa += a[k] * s_aa
        v_xa += da[k] * s_a
        v_xaa += da[k] * s_aa
        v_xxa += dda[k] * s_a
        v_xxaa += dda[k] * s_aa
    v_x /= step
    v_xx /= step * step
    v_a /= angle_step
    v_aa /= angle_step * angle_step
    v_xa /= step * angle_step
    v_xaa /= step * angle_step * angle_step
    v_xxa /= step * step * angle_step
    v_xxaa /= step * step * angle_step * angle_step
    if beyond != 0.0:
        v += beyond * (v_x + 0.5 * beyond * v_xx)
        v_x += beyond * v_xx
        v_a += beyond * (v_xa + 0.5 * beyond * v_xxa)
        v_aa += beyond * (v_xaa + 0.5 * beyond * v_xxaa)
        v_xa += beyond * v_xxa
    return v, v_x, v_xx, v_a, v_aa, v_xa, math.nan
