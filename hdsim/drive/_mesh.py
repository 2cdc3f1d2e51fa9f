"""Compiled meshes: potential, gradient and Hessian of the conservative core (imports numba: load lazily).

A mesh kernel reads the angles (motor m, ring f, output o) and the kinematic error e with its derivatives
and sets ``result`` (at the places of ``_mesh_layout``). The mesh twist and the structure's twist are

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

from hdsim._compile import inlined
from hdsim.drive._mesh_layout import (
    ENERGY,
    ENGAGED,
    EXTRA_GAP,
    GAIN,
    GRADIENT,
    HELD_TORQUE,
    HESSIAN,
    INVERSE_RATIO,
    KAPPA,
    LEVER,
    MESH_TWIST,
    ODD_COUNT,
    OUTPUT_SHARE,
    PER_WAVE,
    RESULT_SIZE,
    SPRING_AT,
    SPRING_CELLS,
    SPRING_STEP,
    TWIST,
    TWIST_2,
    TWIST_M,
    TWIST_O,
    WAVES,
    WAVES_AT,
)
from hdsim.drive._odd_tooth import odd_potential
from hdsim.drive._quartic import spring
from hdsim.drive._teeth import teeth_potential
from hdsim.drive._teeth_table import table_potential
from hdsim.kernel import mesh

_inline: Any = inlined


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
    if p[ODD_COUNT] > 0.0:
        local = odd_potential(p, p[LEVER] * twist, angles, local)
    assemble(p, angles, error, local, result)
    result[MESH_TWIST] = twist


@mesh
def table_mesh(angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """All teeth from a table."""
    p = parameters
    twist = mesh_twist(p, angles, error)
    local = table_potential(p, p[LEVER] * twist, angles[1] - angles[0])
    if p[ODD_COUNT] > 0.0:
        local = odd_potential(p, p[LEVER] * twist, angles, local)
    assemble(p, angles, error, local, result)
    result[MESH_TWIST] = twist


@_inline
def resting(p, at, step, cells, held, low, high):  # type: ignore[no-untyped-def]
    """Twist between two others at which a spring bears -held: Newton's method, safeguarded."""
    if held == 0.0:
        return 0.0
    twist = 0.5 * (low + high)
    for _ in range(60):
        _, torque, stiffness = spring(p, at, step, cells, twist, 0.0)
        if torque + held > 0.0:
            high = twist
        else:
            low = twist
        following = twist - (torque + held) / stiffness
        if not (low <= following <= high):
            following = 0.5 * (low + high)
        if abs(following - twist) <= 1e-15:
            break
        twist = following
    return twist


@mesh
def lumped_mesh(angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """The catalogue's spring over phi = theta_m / i - theta_o + e, behind an optional gap.

    The half-gap may go round with the angles, h = h_0 + sum A sin(a theta_m + b theta_o + p), nowhere below
    zero. The spring's own twist chi, which damper and hysteresis see, is what is left of phi,

        chi = phi - h while T(phi - h) + F > 0,    phi + h while T(phi + h) + F < 0,    else T(chi) = -F

    with the torque F of what is parallel to the spring, which ``result`` holds: teeth only push, and inside
    the gap nothing is transmitted and chi stands still, as behind a ring without inertia.
    """
    p = parameters
    twist = angles[0] * p[INVERSE_RATIO] - angles[2] + error[0]
    twist_m = p[INVERSE_RATIO] + error[1]
    twist_o = error[2] - 1.0
    twist_mm, twist_mo, twist_oo = error[3], error[4], error[5]
    gap, waves = p[EXTRA_GAP], int(p[WAVES])
    for k in range(waves):
        w = int(p[WAVES_AT]) + PER_WAVE * k
        gap += p[w] * math.sin(p[w + 1] * angles[0] + p[w + 2] * angles[2] + p[w + 3])
    half, held = max(gap, 0.0), result[HELD_TORQUE]
    at, step, cells = int(p[SPRING_AT]), p[SPRING_STEP], p[SPRING_CELLS]
    pressed = 0.0
    own = twist - half
    energy, torque, stiffness = spring(p, at, step, cells, own, 0.0)
    if half > 0.0:
        pressed = 1.0
        if torque + held <= 0.0:
            pressed = -1.0
            own = twist + half
            energy, torque, stiffness = spring(p, at, step, cells, own, 0.0)
            if torque + held >= 0.0:
                pressed = 0.0
                own = resting(p, at, step, cells, held, twist - half, own)
                energy, torque, stiffness = spring(p, at, step, cells, own, 0.0)[0], 0.0, 0.0
                twist_m = twist_o = twist_mm = twist_mo = twist_oo = 0.0
    if pressed != 0.0:
        for k in range(waves):
            w = int(p[WAVES_AT]) + PER_WAVE * k
            a, b = p[w + 1], p[w + 2]
            angle = a * angles[0] + b * angles[2] + p[w + 3]
            sine, cosine = pressed * p[w] * math.sin(angle), pressed * p[w] * math.cos(angle)
            twist_m -= a * cosine
            twist_o -= b * cosine
            twist_mm += a * a * sine
            twist_mo += a * b * sine
            twist_oo += b * b * sine
    for k in range(RESULT_SIZE):
        result[k] = 0.0
    result[ENERGY] = energy
    result[GRADIENT] = torque * twist_m
    result[GRADIENT + 2] = torque * twist_o
    result[HESSIAN] = stiffness * twist_m * twist_m + torque * twist_mm
    result[HESSIAN + 2] = stiffness * twist_m * twist_o + torque * twist_mo
    result[HESSIAN + 3] = 1.0
    result[HESSIAN + 5] = stiffness * twist_o * twist_o + torque * twist_oo
    result[MESH_TWIST] = twist
    result[TWIST] = own
    result[TWIST_M], result[TWIST_O] = twist_m, twist_o
    result[TWIST_2], result[TWIST_2 + 1], result[TWIST_2 + 2] = twist_mm, twist_mo, twist_oo
    result[ENGAGED] = math.nan
