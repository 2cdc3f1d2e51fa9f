"""The teeth's potential as the sum over every tooth pair (imports numba: load lazily).

The formula, with its symbols, heads ``hdsim.drive._mesh``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hdsim._compile import compiled
from hdsim.drive._mesh_layout import (
    BORDER,
    CLEARANCE,
    CONSTANT_GAPS_AT,
    CONTACT_AT,
    CONTACT_CELLS,
    CONTACT_STEP,
    EXTRA_GAP,
    GAP_AT,
    GAP_CELLS,
    KIND,
    LARGEST_PITCH_ERROR,
    PITCH_ERROR_AT,
    PLATEAU,
    SMOOTHING,
    TEETH,
)
from hdsim.drive._quartic import hermite
from hdsim.drive._window import lobe_potential

_jit: Any = compiled
_inline: Any = compiled


@_inline
def window(angle, plateau, border):  # type: ignore[no-untyped-def]
    """Weight of a tooth, its slope and curvature over the angle: a quintic step (C2) at each end."""
    a = abs(angle)
    if a <= plateau:
        return 1.0, 0.0, 0.0
    if a >= border:
        return 0.0, 0.0, 0.0
    width = border - plateau
    s = (border - a) / width
    sign = -1.0 if angle > 0.0 else 1.0
    weight = s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
    slope = 30.0 * s * s * (1.0 - s) * (1.0 - s) * sign / width
    curvature = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (width * width)
    return weight, slope, curvature


@_inline
def ramp(u, width):  # type: ignore[no-untyped-def]
    """Ramp rounded over +- width, its slope and curvature; see ``hdsim.contact.smooth_dead_zone``."""
    if u >= width:
        return u, 1.0, 0.0
    if u <= -width:
        return 0.0, 0.0, 0.0
    t = (u + width) / (2.0 * width)
    return 2.0 * width * t * t * t * (1.0 - 0.5 * t), t * t * (3.0 - 2.0 * t), 3.0 * t * (1.0 - t) / width


@_inline
def smooth_depth(x, gap, width):  # type: ignore[no-untyped-def]
    """Smooth dead-zone at x >= 0 and its derivatives: f, f_x, f_gap, f_xx (= f_gap,gap), f_x,gap."""
    here, here_1, here_2 = ramp(x - gap, width)
    there, there_1, there_2 = ramp(-x - gap, width)
    return here - there, here_1 + there_1, there_1 - here_1, here_2 - there_2, -here_2 - there_2


@_inline
def contact_border(p, x):  # type: ignore[no-untyped-def]
    """Angle from the major axis beyond which no tooth can touch at displacement x."""
    if p[KIND] == 0.0:
        return p[BORDER]
    # Wear keeps teeth apart that a preload presses together.
    reach = (abs(x) + p[LARGEST_PITCH_ERROR] + p[SMOOTHING] - min(p[EXTRA_GAP], 0.0)) / p[CLEARANCE]
    if reach >= 1.0:
        return 0.5 * math.pi
    return math.asin(math.sqrt(reach))


@_jit
def window_potential(p, x, angle):  # type: ignore[no-untyped-def]
    """``teeth_potential`` for a window, constant gaps and sharp corners: the two arcs, each in one sweep."""
    teeth = int(p[TEETH])
    pitch = 2.0 * math.pi / teeth
    border = p[BORDER]
    v = v_x = v_xx = v_a = v_aa = v_xa = engaged = 0.0
    for lobe in range(2):
        origin = angle - lobe * math.pi
        first = math.ceil((-border - origin) / pitch)
        last = math.floor((border - origin) / pitch)
        tooth = first % teeth
        part = lobe_potential(
            p,
            x,
            int(p[CONSTANT_GAPS_AT]) + tooth,
            int(p[PITCH_ERROR_AT]) + tooth,
            min(last - first + 1, teeth),
            first * pitch + origin,
            pitch,
            p[PLATEAU],
            border,
            p[EXTRA_GAP],
            int(p[CONTACT_AT]),
            p[CONTACT_STEP],
            int(p[CONTACT_CELLS]),
        )
        v += part[0]
        v_x += part[1]
        v_xx += part[2]
        v_a += part[3]
        v_aa += part[4]
        v_xa += part[5]
        engaged += part[6]
    return v, v_x, v_xx, v_a, v_aa, v_xa, engaged


@_inline
def pair_potential(p, x, phi, c2, s2, tooth, shift, widened):  # type: ignore[no-untyped-def]
    """One tooth's part of ``teeth_potential``, and whether it carries load (0 or 1).

    Args:
        p: the mesh's numbers.
        x: common displacement, m.
        phi: the tooth's angle from the major axis, within a quarter of a turn, rad.
        c2: cos(2 phi); read where a clearance engages the teeth.
        s2: sin(2 phi); likewise.
        tooth: its number.
        shift: displacement on top of its pitch error, m.
        widened: half-gap on top of its own, m.
    """
    weight, slope, curvature = 1.0, 0.0, 0.0
    gap, gap_a, gap_aa = p[EXTRA_GAP] + widened, 0.0, 0.0
    pressed = gap < 0.0
    smoothing = p[SMOOTHING]
    if p[KIND] != 0.0:
        gap += 0.5 * p[CLEARANCE] * (1.0 - c2)
        gap_a += p[CLEARANCE] * s2
        gap_aa += 2.0 * p[CLEARANCE] * c2
    else:
        weight, slope, curvature = window(phi, p[PLATEAU], p[BORDER])
    cells = int(p[GAP_CELLS])
    gap_at = int(p[GAP_AT])
    if cells == 1:
        gap += p[gap_at + 4 * tooth]
    else:
        cell_width = math.pi / cells
        cell = int((phi + 0.5 * math.pi) / cell_width)
        cell = min(max(cell, 0), cells - 1)
        s = phi + 0.5 * math.pi - cell * cell_width
        at = gap_at + 4 * (tooth * cells + cell)
        gap += p[at] + s * (p[at + 1] + s * (p[at + 2] + s * p[at + 3]))
        gap_a += p[at + 1] + s * (2.0 * p[at + 2] + s * 3.0 * p[at + 3])
        gap_aa += 2.0 * p[at + 2] + s * 6.0 * p[at + 3]
    shifted = x + p[int(p[PITCH_ERROR_AT]) + tooth] + shift
    v = v_x = v_xx = v_a = v_aa = v_xa = engaged = 0.0
    if abs(shifted) - gap <= -smoothing:
        return v, v_x, v_xx, v_a, v_aa, v_xa, engaged
    side = 1.0 if shifted > 0.0 else -1.0
    # Without interference the far flank is out of touch wherever the near one is in touch.
    for flank in range(2 if pressed else 1):
        depth = abs(shifted) - gap
        by_x, by_gap, by_x2, by_x_gap = 1.0, -1.0, 0.0, 0.0
        if pressed:
            depth = (abs(shifted) if flank == 0 else -abs(shifted)) - gap
            if depth <= -smoothing:
                break
            if flank == 1:
                side = -side
            if smoothing > 0.0:
                depth, by_x, by_x2 = ramp(depth, smoothing)
                by_gap, by_x_gap = -by_x, -by_x2
        elif smoothing > 0.0:
            depth, by_x, by_gap, by_x2, by_x_gap = smooth_depth(abs(shifted), gap, smoothing)
        energy, force, stiffness = hermite(p, int(p[CONTACT_AT]), p[CONTACT_STEP], p[CONTACT_CELLS], depth)
        if weight >= 0.5 and depth > 0.0 and flank == 0:
            engaged = 1.0
        v += weight * energy
        # by_x2 is the second derivative over the gap, too.
        v_x += weight * force * by_x * side
        v_xx += weight * (stiffness * by_x * by_x + force * by_x2)
        v_a += slope * energy + weight * force * by_gap * gap_a
        curved = (stiffness * by_gap * by_gap + force * by_x2) * gap_a * gap_a
        v_aa += curvature * energy + 2.0 * slope * force * by_gap * gap_a
        v_aa += weight * (curved + force * by_gap * gap_aa)
        v_xa += side * (
            slope * force * by_x + weight * (stiffness * by_x * by_gap + force * by_x_gap) * gap_a
        )
    return v, v_x, v_xx, v_a, v_aa, v_xa, engaged


@_jit
def teeth_potential(p, x, angle):  # type: ignore[no-untyped-def]
    """Sum over the teeth at common displacement x and ring angle a from the major axis.

    With a preload (a negative extra gap) both flanks of a tooth may press at once: U(x - b) + U(-x - b).
    Returns V, V_x, V_xx, V_a, V_aa, V_xa and the number of teeth that carry load.
    """
    if p[CONSTANT_GAPS_AT] > 0.0 and p[EXTRA_GAP] >= 0.0:
        return window_potential(p, x, angle)
    teeth = int(p[TEETH])
    pitch = 2.0 * math.pi / teeth
    clearing = p[KIND] != 0.0
    border = contact_border(p, x)
    v = v_x = v_xx = v_a = v_aa = v_xa = engaged = 0.0
    turn_cos = math.cos(2.0 * pitch)
    turn_sin = math.sin(2.0 * pitch)
    for lobe in range(2):
        origin = angle - lobe * math.pi
        first = math.ceil((-border - origin) / pitch)
        last = math.floor((border - origin) / pitch)
        phi = first * pitch + origin
        c2 = math.cos(2.0 * phi)
        s2 = math.sin(2.0 * phi)
        tooth = first % teeth
        for j in range(first, last + 1):
            phi = j * pitch + origin
            own = pair_potential(p, x, phi, c2, s2, tooth, 0.0, 0.0)
            if clearing:
                c2, s2 = c2 * turn_cos - s2 * turn_sin, s2 * turn_cos + c2 * turn_sin
            tooth += 1
            if tooth == teeth:
                tooth = 0
            v += own[0]
            v_x += own[1]
            v_xx += own[2]
            v_a += own[3]
            v_aa += own[4]
            v_xa += own[5]
            engaged += own[6]
    return v, v_x, v_xx, v_a, v_aa, v_xa, engaged


@_jit
def tooth_forces(p, x, angle, forces, angles):  # type: ignore[no-untyped-def]
    """Every tooth's normal force (N, signed by flank) and angle from the major axis (rad, +- half a turn).

    Of a preloaded tooth it is the difference of its two flanks.
    """
    teeth = int(p[TEETH])
    pitch = 2.0 * math.pi / teeth
    for tooth in range(teeth):
        phi = tooth * pitch + angle
        angles[tooth] = phi - 2.0 * math.pi * math.floor(phi / (2.0 * math.pi) + 0.5)
        phi -= math.pi * math.floor(phi / math.pi + 0.5)
        c2, s2 = math.cos(2.0 * phi), math.sin(2.0 * phi)
        forces[tooth] = pair_potential(p, x, phi, c2, s2, tooth, 0.0, 0.0)[1]


@_jit
def potentials(p, x, angles):  # type: ignore[no-untyped-def]
    """``teeth_potential`` at several ring angles (m,), shape (m, 7)."""
    found = np.empty((len(angles), 7))
    for k in range(len(angles)):
        found[k, 0], found[k, 1], found[k, 2], found[k, 3], found[k, 4], found[k, 5], found[k, 6] = (
            teeth_potential(p, x, angles[k])
        )
    return found
