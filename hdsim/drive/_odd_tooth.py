"""Teeth that differ from those that were drawn: out of place, worn or raised (imports numba: load lazily).

A tooth pair with the share a of an error has the potential (1 - a) w U(dz(x + eps, b)) + a w U(dz(x + eps +
s, b + d)), with the shift s along its normal and the half-gap d on top of its own: the symbols are those of
``hdsim.drive._mesh``. What is added to the sum over all teeth is the difference to that pair as drawn, so a
table of the teeth stays as it is.

A tooth k of the circular spline has another partner in each pass. With an ideal gear its angle from there,
2 pi k / z_c + theta_c (theta_c = nu theta_o), is that of the flexspline's tooth j, 2 pi j / z_f + theta_f,
each time that a lobe is on it: so j is the nearest, and changes where the pair is farthest from both lobes.
"""

from __future__ import annotations

import math
from typing import Any

from hdsim._compile import compiled
from hdsim.drive._mesh_layout import (
    ODD_AT,
    ODD_COUNT,
    ODD_MEMBER,
    ODD_SHARE,
    ODD_SHIFT,
    ODD_TOOTH,
    ODD_WIDENED,
    OUTPUT_SHARE,
    PER_ODD,
    TEETH,
)
from hdsim.drive._teeth import pair_potential

_jit: Any = compiled


@_jit
def partner(p, at, ring, output):  # type: ignore[no-untyped-def]
    """Number of the flexspline's tooth in the odd pair at a place of the mesh's numbers.

    Args:
        p: the mesh's numbers.
        at: where the odd tooth stands in them.
        ring: angle of the ring, rad.
        output: of the output, rad.
    """
    teeth = int(p[TEETH])
    tooth = p[at + ODD_TOOTH]
    if p[at + ODD_MEMBER] != 0.0:
        # The circular spline has two teeth more.
        from_ring = 2.0 * math.pi * tooth / (teeth + 2.0) + p[OUTPUT_SHARE] * output - ring
        tooth = math.floor(from_ring * teeth / (2.0 * math.pi) + 0.5)
    return int(tooth) % teeth


@_jit
def difference(p, at, x, angles):  # type: ignore[no-untyped-def]
    """Number of the odd pair's tooth and, with its share, what ``pair_potential`` returns beyond the drawn.

    Args:
        p: the mesh's numbers.
        at: where the odd tooth stands in them.
        x: common displacement, m.
        angles: of motor, ring and output, rad.
    """
    tooth = partner(p, at, angles[1], angles[2])
    phi = tooth * (2.0 * math.pi / p[TEETH]) + angles[1] - angles[0]
    phi -= math.pi * math.floor(phi / math.pi + 0.5)
    c2, s2 = math.cos(2.0 * phi), math.sin(2.0 * phi)
    drawn = pair_potential(p, x, phi, c2, s2, tooth, 0.0, 0.0)
    odd = pair_potential(p, x, phi, c2, s2, tooth, p[at + ODD_SHIFT], p[at + ODD_WIDENED])
    share = p[at + ODD_SHARE]
    return (
        tooth,
        share * (odd[0] - drawn[0]),
        share * (odd[1] - drawn[1]),
        share * (odd[2] - drawn[2]),
        share * (odd[3] - drawn[3]),
        share * (odd[4] - drawn[4]),
        share * (odd[5] - drawn[5]),
        share * (odd[6] - drawn[6]),
    )


@_jit
def odd_potential(p, x, angles, local):  # type: ignore[no-untyped-def]
    """The teeth's potential and its derivatives with those of the teeth that differ.

    Args:
        p: the mesh's numbers.
        x: common displacement, m.
        angles: of motor, ring and output, rad.
        local: what ``teeth_potential`` or a table of it returns there.
    """
    v, v_x, v_xx, v_a, v_aa, v_xa, engaged = local
    for k in range(int(p[ODD_COUNT])):
        more = difference(p, int(p[ODD_AT]) + PER_ODD * k, x, angles)
        v += more[1]
        v_x += more[2]
        v_xx += more[3]
        v_a += more[4]
        v_aa += more[5]
        v_xa += more[6]
        engaged += more[7]
    return v, v_x, v_xx, v_a, v_aa, v_xa, engaged


@_jit
def odd_forces(p, x, angles, forces):  # type: ignore[no-untyped-def]
    """Add to every tooth's normal force (N) what it differs by; arguments as ``odd_potential``."""
    for k in range(int(p[ODD_COUNT])):
        more = difference(p, int(p[ODD_AT]) + PER_ODD * k, x, angles)
        forces[more[0]] += more[2]
