"""Forces tabulated in quartic cells of energy: a contact, and a spring behind a dead-zone.

Imports numba: load lazily.
"""

from __future__ import annotations

from typing import Any

from hdsim._compile import inlined

_inline: Any = inlined

#: Corners of a spring, each as its twist and by how much the spring is stiffer beyond it, before its table.
CORNERS = 3


@_inline
def hermite(p, at, step, cells, x):  # type: ignore[no-untyped-def]
    """Energy, force and stiffness at x >= 0 from a table of quartic cells; linear force beyond the end."""
    last = int(cells) - 1
    # The lower bound catches what the conversion makes of a number that is not finite.
    cell = max(int(x / step), 0)
    if cell > last:
        base = at + 5 * last
        s = step
        force = p[base] + s * (p[base + 1] + s * (p[base + 2] + s * p[base + 3]))
        stiffness = p[base + 1] + s * (2.0 * p[base + 2] + s * 3.0 * p[base + 3])
        energy = p[base + 4] + s * (
            p[base] + s * (p[base + 1] / 2.0 + s * (p[base + 2] / 3.0 + s * p[base + 3] / 4.0))
        )
        d = x - step * cells
        return energy + d * (force + 0.5 * stiffness * d), force + stiffness * d, stiffness
    base = at + 5 * cell
    s = x - cell * step
    force = p[base] + s * (p[base + 1] + s * (p[base + 2] + s * p[base + 3]))
    stiffness = p[base + 1] + s * (2.0 * p[base + 2] + s * 3.0 * p[base + 3])
    energy = p[base + 4] + s * (
        p[base] + s * (p[base + 1] / 2.0 + s * (p[base + 2] / 3.0 + s * p[base + 3] / 4.0))
    )
    return energy, force, stiffness


@_inline
def cornered(p, at, step, cells, x):  # type: ignore[no-untyped-def]
    """Energy, force and stiffness of a spring at x >= 0: its corners, then the rest of it as a table."""
    energy, force, stiffness = hermite(p, at + 2 * CORNERS, step, cells, x)
    for k in range(CORNERS):
        past = x - p[at + 2 * k]
        if past > 0.0:
            stiffer = p[at + 2 * k + 1]
            energy += 0.5 * stiffer * past * past
            force += stiffer * past
            stiffness += stiffer
    return energy, force, stiffness


@_inline
def spring(p, at, step, cells, twist, half_gap):  # type: ignore[no-untyped-def]
    """Energy, torque and stiffness of an odd spring over twist, behind a dead-zone."""
    if twist >= half_gap:
        return cornered(p, at, step, cells, twist - half_gap)
    if twist < -half_gap:
        energy, force, stiffness = cornered(p, at, step, cells, -twist - half_gap)
        return energy, -force, stiffness
    return 0.0, 0.0, 0.0
