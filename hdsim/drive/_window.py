"""The sum over the teeth in its commonest case, written so that the compiler uses vector instructions.

``window`` engagement, a constant gap for each tooth, the dead-zone of the paper: no branch in the loop. Only
the order of the sums depends on the processor's vector width; non-finite numbers behave as everywhere else.
Imports numba: load lazily.
"""

from __future__ import annotations

import math
from typing import Any

from hdsim._compile import compiled

_reordered: Any = compiled(fastmath={"reassoc", "contract"})


@_reordered
def lobe_potential(  # type: ignore[no-untyped-def]
    p, x, gaps_at, errors_at, count, first_angle, pitch, plateau, border, extra_gap, contact_at, step, cells
):
    """Potential of ``count`` neighbouring teeth at displacement x, with derivatives as ``teeth_potential``.

    Args:
        p: the mesh's parameters.
        x: common displacement, m.
        gaps_at: place of the first tooth's half-gap in ``p``; the neighbours' follow.
        errors_at: place of its pitch error.
        count: number of teeth.
        first_angle: angle of the first tooth from the major axis, rad.
        pitch: angle between two teeth, rad.
        plateau: angle where the window starts to fall, rad.
        border: angle where it has reached zero, rad.
        extra_gap: half-gap that all teeth have on top, m.
        contact_at: place of the contact table, ``cells`` cells of width ``step``.
        step: m.
        cells: number of cells.
    """
    v = v_x = v_xx = v_a = v_aa = v_xa = engaged = 0.0
    per_width = 1.0 / (border - plateau)
    per_step = 1.0 / step
    last = cells - 1
    third = 1.0 / 3.0
    for k in range(count):
        angle = first_angle + k * pitch
        s = min(max((border - abs(angle)) * per_width, 0.0), 1.0)
        r = 1.0 - s
        weight = s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
        slope = math.copysign(30.0 * per_width * s * s * r * r, -angle)
        curvature = 60.0 * per_width * per_width * s * r * (1.0 - 2.0 * s)
        shifted = x + p[errors_at + k]
        depth = abs(shifted) - p[gaps_at + k] - extra_gap
        touching = 1.0 if depth > 0.0 else 0.0
        depth = max(depth, 0.0)
        # The lower bound catches what the conversion makes of a number that is not finite.
        cell = max(min(int(depth * per_step), last), 0)
        at = contact_at + 5 * cell
        d = depth - cell * step
        beyond = max(d - step, 0.0)
        d -= beyond
        c0 = p[at]
        c1 = p[at + 1]
        c2 = p[at + 2]
        c3 = p[at + 3]
        force = c0 + d * (c1 + d * (c2 + d * c3))
        stiffness = c1 + d * (2.0 * c2 + d * 3.0 * c3)
        energy = p[at + 4] + d * (c0 + d * (0.5 * c1 + d * (third * c2 + 0.25 * d * c3)))
        energy += beyond * (force + 0.5 * stiffness * beyond)
        force = math.copysign(touching * (force + stiffness * beyond), shifted)
        stiffness *= touching
        energy *= touching
        v += weight * energy
        v_x += weight * force
        v_xx += weight * stiffness
        v_a += slope * energy
        v_aa += curvature * energy
        v_xa += slope * force
        engaged += touching if weight >= 0.5 else 0.0
    return v, v_x, v_xx, v_a, v_aa, v_xa, engaged
