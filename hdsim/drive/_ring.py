"""The ring in static balance of mesh and structure: its angle, its slopes and curvatures (imports numba)."""

from __future__ import annotations

from typing import Any

from hdsim._abi import call_mesh
from hdsim._compile import compiled
from hdsim.drive import _mesh_layout
from hdsim.drive._layout import (
    GAIN,
    INVERSE_RATIO,
    KAPPA,
    MESH_ADDRESS,
    MESH_AT,
    OUTPUT_SHARE,
    S_ANGLES,
    S_ERROR,
    S_HOUSING,
    S_MESH,
    S_RELATIVE,
    S_RING_1,
    S_SPARE,
    S_TWIST_2,
    S_VELOCITIES,
)
from hdsim.drive._terms import read_error

_jit: Any = compiled


@_jit
def balance_ring(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Ring angle at which mesh and structure balance: safeguarded Newton on the convex potential."""
    angles = scratch[S_RELATIVE : S_RELATIVE + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    result = scratch[S_MESH : S_MESH + _mesh_layout.RESULT_SIZE]
    parameters = reals[integers[MESH_AT] :]
    free = reals[KAPPA] * angles[2]
    loaded = reals[GAIN] * (angles[0] * reals[INVERSE_RATIO] - reals[OUTPUT_SHARE] * angles[2] + error[0])
    # Wider than from free to loaded: pitch errors push without a twist, the window's slope pulls.
    margin = 1e-5 + parameters[_mesh_layout.LARGEST_PITCH_ERROR] / parameters[_mesh_layout.LEVER]
    low = min(free, loaded) - margin
    high = max(free, loaded) + margin
    angles[1] = free + 0.7 * (loaded - free)
    for _ in range(100):
        call_mesh(integers[MESH_ADDRESS], angles, error, parameters, result)
        slope = result[_mesh_layout.GRADIENT + 1]
        if slope > 0.0:
            high = angles[1]
        else:
            low = angles[1]
        step = -slope / result[_mesh_layout.HESSIAN + 3]
        following = angles[1] + step
        if not (low <= following <= high):
            following = 0.5 * (low + high)
            step = following - angles[1]
        if abs(step) <= 1e-14 * (1e-3 + abs(following - free)) or following == angles[1]:
            break
        angles[1] = following
    stiffness = result[_mesh_layout.HESSIAN + 3]
    scratch[S_RING_1] = -result[_mesh_layout.HESSIAN + 1] / stiffness
    scratch[S_RING_1 + 1] = 0.0
    scratch[S_RING_1 + 2] = -result[_mesh_layout.HESSIAN + 4] / stiffness
    # Schur complement: Hessian of the potential with the ring at its balance.
    mf = result[_mesh_layout.HESSIAN + 1]
    fo = result[_mesh_layout.HESSIAN + 4]
    result[_mesh_layout.HESSIAN] -= mf * mf / stiffness
    result[_mesh_layout.HESSIAN + 2] -= mf * fo / stiffness
    result[_mesh_layout.HESSIAN + 5] -= fo * fo / stiffness
    result[_mesh_layout.HESSIAN + 1] = 0.0
    result[_mesh_layout.HESSIAN + 4] = 0.0
    result[_mesh_layout.GRADIENT + 1] = 0.0
    scratch[S_RELATIVE + 4] = (
        scratch[S_RING_1] * scratch[S_RELATIVE + 3] + scratch[S_RING_1 + 2] * scratch[S_RELATIVE + 5]
    )
    scratch[S_ANGLES + 1] = scratch[S_RELATIVE + 1] + scratch[S_HOUSING]
    scratch[S_VELOCITIES + 1] = scratch[S_RELATIVE + 4] + scratch[S_HOUSING + 1]


@_jit
def ring_curvature(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Second derivatives (mm, mo, oo) of the ring angle f(m, o) in static balance: of the torsion twist.

    From V_f(m, f(m, o), o) = 0 twice: f_ab = -D_a (V_fb + V_ff f_b) / V_ff, D_a along (e_a + f_a e_f) and f_b
    held, by central differences of the Hessian: exact to about 1e-6 of what it is added to.
    """
    angles = scratch[S_RELATIVE : S_RELATIVE + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    result = scratch[S_SPARE : S_SPARE + _mesh_layout.RESULT_SIZE]
    stiffness = scratch[S_MESH + _mesh_layout.HESSIAN + 3]
    motor, ring, output = angles[0], angles[1], angles[2]
    by_m, by_o = scratch[S_RING_1], scratch[S_RING_1 + 2]
    mm = mo = oo = 0.0
    for a in range(2):
        nudge = 1e-6 if a == 0 else 1e-8
        for sign in (-1.0, 1.0):
            step = sign * nudge
            angles[0] = motor + (step if a == 0 else 0.0)
            angles[2] = output + (step if a == 1 else 0.0)
            angles[1] = ring + step * (by_m if a == 0 else by_o)
            read_error(integers, reals, scratch)
            call_mesh(integers[MESH_ADDRESS], angles, error, reals[integers[MESH_AT] :], result)
            h_ff = result[_mesh_layout.HESSIAN + 3]
            along_o = result[_mesh_layout.HESSIAN + 4] + h_ff * by_o
            share = -sign / (2.0 * nudge * stiffness)
            if a == 0:
                mm += share * (result[_mesh_layout.HESSIAN + 1] + h_ff * by_m)
                mo += share * along_o
            else:
                oo += share * along_o
    angles[0], angles[1], angles[2] = motor, ring, output
    read_error(integers, reals, scratch)
    scratch[S_TWIST_2], scratch[S_TWIST_2 + 1], scratch[S_TWIST_2 + 2] = mm, mo, oo
