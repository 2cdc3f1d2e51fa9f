"""Compiled meshes: potential, gradient and Hessian of the conservative core (imports numba: load lazily).

A mesh kernel reads the angles (motor m, ring f, output o) and the kinematic error e with its derivatives
and sets ``result`` (the indices below). The mesh twist and the structure's twist are

    Delta = g (theta_m / i - nu theta_o + e) - theta_f,        chi = theta_f - kappa theta_o

with, by the arrangement: circular spline fixed g = 1, nu = 0, kappa = 1; flexspline fixed
g = -z_c/z_f, nu = 1, kappa = 0 (the ring twists against the housing). One potential gives every torque:

    V = sum_j w(phi_j) U(dead_zone(R Delta + eps_j, b_j(phi_j) + c(phi_j))) + V_structure(chi)

with phi_j = 2 pi j / z_f + theta_f - theta_m the tooth's angle from the major axis, R = r cos(alpha), the
window w, the half-gap b_j, the clearance c and the stored energy U of one tooth pair.
"""

from __future__ import annotations

import math
from typing import Any

from hdsim._compile import compiled
from hdsim.drive._window import lobe_potential
from hdsim.kernel import mesh

# Result of a mesh kernel.
ENERGY = 0
GRADIENT = 1  # m, f, o
HESSIAN = 4  # mm, mf, mo, ff, fo, oo
MESH_TWIST = 10
TWIST = 11
ENGAGED = 12  # number of teeth that carry load
RESULT_SIZE = 16

# Parameters of a toothed mesh: a header, then the arrays at their offsets.
TEETH = 0
GAIN = 1  # g
OUTPUT_SHARE = 2  # nu
INVERSE_RATIO = 3
LEVER = 4  # R
KIND = 5  # 0 window, 1 clearance
PLATEAU = 6  # angle where the window starts to fall
BORDER = 7  # angle where it has reached zero
CLEARANCE = 8
KAPPA = 9
CONTACT_STEP = 10
CONTACT_CELLS = 11
CONTACT_AT = 12
SPRING_STEP = 13
SPRING_CELLS = 14
SPRING_AT = 15
GAP_CELLS = 16
GAP_AT = 17
PITCH_ERROR_AT = 18
EXTRA_GAP = 19
LARGEST_PITCH_ERROR = 20
TABLE_TWIST_STEP = 21
TABLE_TWIST_NODES = 22
TABLE_ANGLE_NODES = 23
TABLE_AT = 24
TABLE_TWIST_START = 25
SMOOTHING = 26  # half-width of the dead-zone's rounded corners, m
CONSTANT_GAPS_AT = 27  # constant half-gaps of the teeth, twice over as the pitch errors; 0: none
HEADER = 28

_jit: Any = compiled
_inline: Any = compiled


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
def spring(p, at, step, cells, twist, half_gap):  # type: ignore[no-untyped-def]
    """Energy, torque and stiffness of an odd spring over twist, behind a dead-zone."""
    if twist >= half_gap:
        return hermite(p, at, step, cells, twist - half_gap)
    if twist < -half_gap:
        energy, force, stiffness = hermite(p, at, step, cells, -twist - half_gap)
        return energy, -force, stiffness
    return 0.0, 0.0, 0.0


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
    reach = (abs(x) + p[LARGEST_PITCH_ERROR] + p[SMOOTHING]) / p[CLEARANCE]
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


@_jit
def teeth_potential(p, x, angle):  # type: ignore[no-untyped-def]
    """Sum over the teeth at common displacement x and ring angle a from the major axis.

    Returns V, V_x, V_xx, V_a, V_aa, V_xa and the number of teeth that carry load.
    """
    if p[CONSTANT_GAPS_AT] > 0.0:
        return window_potential(p, x, angle)
    teeth = int(p[TEETH])
    pitch = 2.0 * math.pi / teeth
    clearing = p[KIND] != 0.0
    border = contact_border(p, x)
    cells = int(p[GAP_CELLS])
    cell_width = math.pi / cells
    gap_at = int(p[GAP_AT])
    pitch_at = int(p[PITCH_ERROR_AT])
    contact_at = int(p[CONTACT_AT])
    contact_step = p[CONTACT_STEP]
    contact_cells = p[CONTACT_CELLS]
    smoothing = p[SMOOTHING]
    v = v_x = v_xx = v_a = v_aa = v_xa = 0.0
    engaged = 0
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
            weight, slope, curvature = 1.0, 0.0, 0.0
            gap, gap_a, gap_aa = p[EXTRA_GAP], 0.0, 0.0
            if clearing:
                gap += 0.5 * p[CLEARANCE] * (1.0 - c2)
                gap_a += p[CLEARANCE] * s2
                gap_aa += 2.0 * p[CLEARANCE] * c2
                c2, s2 = c2 * turn_cos - s2 * turn_sin, s2 * turn_cos + c2 * turn_sin
            else:
                weight, slope, curvature = window(phi, p[PLATEAU], p[BORDER])
            if cells == 1:
                gap += p[gap_at + 4 * tooth]
            else:
                cell = int((phi + 0.5 * math.pi) / cell_width)
                cell = min(max(cell, 0), cells - 1)
                s = phi + 0.5 * math.pi - cell * cell_width
                at = gap_at + 4 * (tooth * cells + cell)
                gap += p[at] + s * (p[at + 1] + s * (p[at + 2] + s * p[at + 3]))
                gap_a += p[at + 1] + s * (2.0 * p[at + 2] + s * 3.0 * p[at + 3])
                gap_aa += 2.0 * p[at + 2] + s * 6.0 * p[at + 3]
            shifted = x + p[pitch_at + tooth]
            tooth += 1
            if tooth == teeth:
                tooth = 0
            depth = abs(shifted) - gap
            if depth <= -smoothing:
                continue
            side = 1.0 if shifted > 0.0 else -1.0
            by_x, by_gap, by_x2, by_x_gap = 1.0, -1.0, 0.0, 0.0
            if smoothing > 0.0:
                depth, by_x, by_gap, by_x2, by_x_gap = smooth_depth(abs(shifted), gap, smoothing)
            energy, force, stiffness = hermite(p, contact_at, contact_step, contact_cells, depth)
            if weight >= 0.5 and depth > 0.0:
                engaged += 1
            v += weight * energy
            # by_x2 is the second derivative over the gap, too.
            v_x += weight * force * by_x * side
            v_xx += weight * (stiffness * by_x * by_x + force * by_x2)
            v_a += slope * energy + weight * force * by_gap * gap_a
            v_aa += (
                curvature * energy
                + 2.0 * slope * force * by_gap * gap_a
                + weight
                * ((stiffness * by_gap * by_gap + force * by_x2) * gap_a * gap_a + force * by_gap * gap_aa)
            )
            v_xa += side * (
                slope * force * by_x + weight * (stiffness * by_x * by_gap + force * by_x_gap) * gap_a
            )
    return v, v_x, v_xx, v_a, v_aa, v_xa, float(engaged)


@_jit
def tooth_forces(p, x, angle, forces, angles):  # type: ignore[no-untyped-def]
    """Every tooth's normal force (N, signed by flank) and angle from the major axis (rad, +- half a turn)."""
    teeth = int(p[TEETH])
    pitch = 2.0 * math.pi / teeth
    cells = int(p[GAP_CELLS])
    cell_width = math.pi / cells
    for tooth in range(teeth):
        phi = tooth * pitch + angle
        angles[tooth] = phi - 2.0 * math.pi * math.floor(phi / (2.0 * math.pi) + 0.5)
        phi -= math.pi * math.floor(phi / math.pi + 0.5)
        weight = 1.0
        gap = p[EXTRA_GAP]
        if p[KIND] != 0.0:
            gap += 0.5 * p[CLEARANCE] * (1.0 - math.cos(2.0 * phi))
        else:
            weight = window(phi, p[PLATEAU], p[BORDER])[0]
        cell = min(max(int((phi + 0.5 * math.pi) / cell_width), 0), cells - 1)
        s = phi + 0.5 * math.pi - cell * cell_width
        at = int(p[GAP_AT]) + 4 * (tooth * cells + cell)
        gap += p[at] + s * (p[at + 1] + s * (p[at + 2] + s * p[at + 3]))
        shifted = x + p[int(p[PITCH_ERROR_AT]) + tooth]
        depth, by_x = abs(shifted) - gap, 1.0
        if p[SMOOTHING] > 0.0:
            depth, by_x, _, _, _ = smooth_depth(abs(shifted), gap, p[SMOOTHING])
        forces[tooth] = 0.0
        if depth > 0.0:
            side = 1.0 if shifted > 0.0 else -1.0
            force = by_x * hermite(p, int(p[CONTACT_AT]), p[CONTACT_STEP], p[CONTACT_CELLS], depth)[1]
            forces[tooth] = weight * force * side


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


@_inline
def assemble(p, angles, error, local, result):  # type: ignore[no-untyped-def]
    """From the teeth's potential over (x, angle) and the structure's over chi to the three angles."""
    gain = p[GAIN]
    lever = p[LEVER]
    twist_m = gain * (p[INVERSE_RATIO] + error[1])
    twist_o = gain * (error[2] - p[OUTPUT_SHARE])
    kappa = p[KAPPA]
    structure = angles[1] - kappa * angles[2]
    energy, torque, stiffness = spring(p, int(p[SPRING_AT]), p[SPRING_STEP], p[SPRING_CELLS], structure, 0.0)
    v_x = local[1] * lever
    v_xx = local[2] * lever * lever
    v_a = local[3]
    v_aa = local[4]
    v_xa = local[5] * lever
    result[ENERGY] = local[0] + energy
    result[GRADIENT] = v_x * twist_m - v_a
    result[GRADIENT + 1] = -v_x + v_a + torque
    result[GRADIENT + 2] = v_x * twist_o - kappa * torque
    result[HESSIAN] = v_xx * twist_m * twist_m - 2.0 * v_xa * twist_m + v_aa + v_x * gain * error[3]
    result[HESSIAN + 1] = -v_xx * twist_m + v_xa * (twist_m + 1.0) - v_aa
    result[HESSIAN + 2] = v_xx * twist_m * twist_o - v_xa * twist_o + v_x * gain * error[4]
    result[HESSIAN + 3] = v_xx - 2.0 * v_xa + v_aa + stiffness
    result[HESSIAN + 4] = -v_xx * twist_o + v_xa * twist_o - kappa * stiffness
    result[HESSIAN + 5] = v_xx * twist_o * twist_o + v_x * gain * error[5] + kappa * kappa * stiffness
    result[TWIST] = structure
    result[ENGAGED] = local[6]


@_inline
def mesh_twist(p, angles, error):  # type: ignore[no-untyped-def]
    """Delta, see the head of this file."""
    return p[GAIN] * (angles[0] * p[INVERSE_RATIO] - p[OUTPUT_SHARE] * angles[2] + error[0]) - angles[1]


@mesh
def teeth_mesh(angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """Every tooth pair on its own."""
    p = parameters
    twist = mesh_twist(p, angles, error)
    local = teeth_potential(p, p[LEVER] * twist, angles[1] - angles[0])
    assemble(p, angles, error, local, result)
    result[MESH_TWIST] = twist


@mesh
def table_mesh(angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """All teeth from a table."""
    p = parameters
    twist = mesh_twist(p, angles, error)
    local = table_potential(p, p[LEVER] * twist, angles[1] - angles[0])
    assemble(p, angles, error, local, result)
    result[MESH_TWIST] = twist


@mesh
def lumped_mesh(angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """The catalogue's spring over phi = theta_m / i - theta_o + e, behind an optional gap."""
    p = parameters
    twist = angles[0] * p[INVERSE_RATIO] - angles[2] + error[0]
    twist_m = p[INVERSE_RATIO] + error[1]
    twist_o = error[2] - 1.0
    energy, torque, stiffness = spring(
        p, int(p[SPRING_AT]), p[SPRING_STEP], p[SPRING_CELLS], twist, p[EXTRA_GAP]
    )
    for k in range(RESULT_SIZE):
        result[k] = 0.0
    result[ENERGY] = energy
    result[GRADIENT] = torque * twist_m
    result[GRADIENT + 2] = torque * twist_o
    result[HESSIAN] = stiffness * twist_m * twist_m + torque * error[3]
    result[HESSIAN + 2] = stiffness * twist_m * twist_o + torque * error[4]
    result[HESSIAN + 3] = 1.0
    result[HESSIAN + 5] = stiffness * twist_o * twist_o + torque * error[5]
    result[MESH_TWIST] = twist
    result[TWIST] = twist
    result[ENGAGED] = math.nan
