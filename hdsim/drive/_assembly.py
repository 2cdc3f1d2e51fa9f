"""The compiled right-hand side of a drive: kernels in, ODE out (imports numba: load lazily).

Generalised coordinates are the motor (m), the ring (f) and the output (o). With the potential V of the mesh
kernel, the ports' torques P_k (twist of the torsion spring, twist of the mesh) and the elements' torques Q:

    J_a theta_a'' = Q_a + sum_k P_k d(twist_k)/d(theta_a) - dV/d(theta_a)

so that the kinematic error's reaction torque on the motor, (1 + i de/dtheta_m) instead of 1, comes out of
the derivative and is never written by hand. A coordinate can be free, prescribed by a signal (its constraint
torque is then computed and counted in the energy balance), or eliminated: the ring by static balance, the
output of a rigid drive by the kinematics.

The states are theta_m, and for ring and output the deviations theta_a - lambda_a theta_m from the ideal gear
(lambda = 1/i, or 0 for a ring that stands still): small numbers, so that a relative tolerance means the same
after one turn and after a thousand. Then the elements' own states, and last, where a model keeps them, the
energies supplied, delivered and dissipated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray

from hdsim._abi import call_system
from hdsim._compile import compiled, inlined
from hdsim.drive._elastic import evaluate_elastic
from hdsim.drive._layout import (
    INSIDE,
    INTEGERS,
    REALS,
    RIGID,
    RING,
    SCRATCH,
    STATES,
)
from hdsim.drive._rigid import evaluate_rigid
from hdsim.drive._terms import read_coordinates
from hdsim.kernel import (
    system,
)

_jit: Any = compiled
_inline: Any = inlined


@_inline
def evaluate_arrays(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Right-hand side of either kind."""
    if integers[RING] == RIGID:
        evaluate_rigid(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt)
    else:
        evaluate_elastic(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt)


@system
def drive_system(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """The drive as a system kernel."""
    n = integers[STATES]
    evaluate_arrays(
        t,
        carray(y, (n,)),
        carray(integers, (integers[INTEGERS],)),
        carray(reals, (integers[REALS],)),
        carray(scratch, (integers[SCRATCH],)),
        want_jacobian,
        carray(dy, (n,)),
        carray(jacobian, (n * n,)),
        carray(dfdt, (n,)),
    )


@_jit
def observe(address, times, states, integers, reals, inside, place, held, scratch, places, rows):  # type: ignore[no-untyped-def]
    """Evaluate at every sample and keep the numbers at ``places`` of the scratch: shape (samples, places).

    ``inside`` holds, for each sample, a time inside its smooth span; ``held`` what stood at ``place`` of the
    reals then (the held torque of a sampled controller; no place: -1).
    """
    dy = np.empty(integers[STATES])
    nothing = np.empty(0)
    for k in range(times.shape[0]):
        reals[INSIDE] = inside[k]
        if place >= 0:
            reals[place] = held[k]
        call_system(address, times[k], states[k], integers, reals, scratch, 0, dy, nothing, nothing)
        for c in range(len(places)):
            rows[k, c] = scratch[places[c]]


@_jit
def observe_coordinates(times, states, integers, reals, inside, scratch, places, rows):  # type: ignore[no-untyped-def]
    """What ``observe`` keeps of angles and velocities that are states or prescribed, without any torque."""
    for k in range(times.shape[0]):
        reals[INSIDE] = inside[k]
        read_coordinates(times[k], states[k], integers, reals, scratch)
        for c in range(len(places)):
            rows[k, c] = scratch[places[c]]
