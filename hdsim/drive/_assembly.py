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
after one turn and after a thousand. Then the elements' own states, and last the energies supplied, delivered
and dissipated.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import carray

from hdsim._abi import call_element, call_mesh, call_signal, call_twist
from hdsim._compile import compiled
from hdsim.drive import _mesh
from hdsim.kernel import (
    DELIVERED,
    DISSIPATED,
    MESH_TORQUE,
    MESH_TWIST,
    MESH_TWIST_RATE,
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    OUTPUT_ANGLE,
    OUTPUT_TORQUE,
    OWN,
    RING_ANGLE,
    STORED,
    SUPPLIED,
    TIME,
    TRANSMITTED_TORQUE,
    TWIST,
    TWIST_RATE,
    TWIST_TORQUE,
    system,
)

# Integers of the system.
STATES = 0
OWN_STATES = 1
SIGNALS = 2
ELEMENTS = 3
TWISTS = 4
MESH_ADDRESS = 5
MESH_AT = 6
RING = 7
COLUMNS = 8
REALS = 9
SCRATCH = 10
INTEGERS = 11
STATE_OF = 12  # three: index of a coordinate's angle in y, or -1
SIGNAL_OF = 15  # three: column of the signal that prescribes a coordinate, or -1
LISTS = 20  # elements (address, parameters, own), twists (address, parameters), signals (address, parameters)

RING_DYNAMIC = 0
RING_STATIC = 1
RING_ABSENT = 2
RIGID = 3

# Reals of the system; the kernels' parameters follow.
INSIDE = 0
INERTIA = 1  # three
INVERSE_RATIO = 4
GAIN = 5
OUTPUT_SHARE = 6
KAPPA = 7
LAMBDA = 8  # three
PARAMETERS = 16

# Scratch, from its end of fixed size: found at the same place for every model.
S_ANGLES = 0
S_VELOCITIES = 3
S_ACCELERATIONS = 6
S_ERROR = 9
S_MESH = 16
S_TWIST_1 = 32  # first derivatives of the torsion twist over the three angles
S_MESH_1 = 35  # of the mesh twist
S_RING_1 = 38  # of the eliminated ring angle
S_KINETIC = 41
S_POTENTIAL = 42
S_CONSTRAINT = 43  # three: torque that the prescription of a coordinate costs
S_INPUTS = 48

_jit: Any = compiled


@_jit
def read_coordinates(t, y, integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Signals, angles, velocities, prescribed accelerations and own states into the scratch."""
    own = integers[OWN_STATES]
    first_signal = S_INPUTS + OWN + own
    at = LISTS + 3 * integers[ELEMENTS] + 2 * integers[TWISTS]
    for k in range(integers[SIGNALS]):
        column = first_signal + 4 * k
        call_signal(
            integers[at + 2 * k],
            t,
            reals[INSIDE],
            reals[integers[at + 2 * k + 1] :],
            scratch[column : column + 4],
        )
    scratch[S_ANGLES] = 0.0
    scratch[S_VELOCITIES] = 0.0
    for a in range(3):
        index = integers[STATE_OF + a]
        column = integers[SIGNAL_OF + a]
        if index >= 0:
            scratch[S_ANGLES + a] = y[index] + reals[LAMBDA + a] * scratch[S_ANGLES]
            scratch[S_VELOCITIES + a] = y[index + 1] + reals[LAMBDA + a] * scratch[S_VELOCITIES]
            scratch[S_ACCELERATIONS + a] = 0.0
        elif column >= 0:
            for k in range(3):
                scratch[S_ANGLES + 3 * k + a] = scratch[S_INPUTS + column + k]
        else:
            for k in range(3):
                scratch[S_ANGLES + 3 * k + a] = 0.0
    last = integers[STATES] - 3
    for k in range(own):
        scratch[S_INPUTS + OWN + k] = y[last - own + k]


@_jit
def read_error(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Kinematic error and its derivatives at the current angles."""
    error = scratch[S_ERROR : S_ERROR + 6]
    error[:] = 0.0
    at = LISTS + 3 * integers[ELEMENTS]
    for k in range(integers[TWISTS]):
        call_twist(
            integers[at + 2 * k],
            scratch[S_ANGLES],
            scratch[S_ANGLES + 2],
            reals[integers[at + 2 * k + 1] :],
            error,
        )


@_jit
def balance_ring(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Ring angle at which mesh and structure balance: safeguarded Newton on the convex potential."""
    angles = scratch[S_ANGLES : S_ANGLES + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    result = scratch[S_MESH : S_MESH + _mesh.RESULT_SIZE]
    parameters = reals[integers[MESH_AT] :]
    free = reals[KAPPA] * angles[2]
    loaded = reals[GAIN] * (angles[0] * reals[INVERSE_RATIO] - reals[OUTPUT_SHARE] * angles[2] + error[0])
    # Wider than from free to loaded: pitch errors push without a twist, the window's slope pulls.
    margin = 1e-5 + parameters[_mesh.LARGEST_PITCH_ERROR] / parameters[_mesh.LEVER]
    low = min(free, loaded) - margin
    high = max(free, loaded) + margin
    angles[1] = free + 0.7 * (loaded - free)
    for _ in range(100):
        call_mesh(integers[MESH_ADDRESS], angles, error, parameters, result)
        slope = result[_mesh.GRADIENT + 1]
        if slope > 0.0:
            high = angles[1]
        else:
            low = angles[1]
        step = -slope / result[_mesh.HESSIAN + 3]
        following = angles[1] + step
        if not (low <= following <= high):
            following = 0.5 * (low + high)
            step = following - angles[1]
        if abs(step) <= 1e-14 * (1e-3 + abs(following - free)) or following == angles[1]:
            break
        angles[1] = following
    stiffness = result[_mesh.HESSIAN + 3]
    scratch[S_RING_1] = -result[_mesh.HESSIAN + 1] / stiffness
    scratch[S_RING_1 + 1] = 0.0
    scratch[S_RING_1 + 2] = -result[_mesh.HESSIAN + 4] / stiffness
    # Schur complement: Hessian of the potential with the ring at its balance.
    mf = result[_mesh.HESSIAN + 1]
    fo = result[_mesh.HESSIAN + 4]
    result[_mesh.HESSIAN] -= mf * mf / stiffness
    result[_mesh.HESSIAN + 2] -= mf * fo / stiffness
    result[_mesh.HESSIAN + 5] -= fo * fo / stiffness
    result[_mesh.HESSIAN + 1] = 0.0
    result[_mesh.HESSIAN + 4] = 0.0
    result[_mesh.GRADIENT + 1] = 0.0
    scratch[S_VELOCITIES + 1] = (
        scratch[S_RING_1] * scratch[S_VELOCITIES] + scratch[S_RING_1 + 2] * scratch[S_VELOCITIES + 2]
    )


@_jit
def fill_inputs(t, integers, scratch, transmitted, twist, twist_rate, mesh_twist, mesh_rate):  # type: ignore[no-untyped-def]
    """The elements' inputs from the coordinates and the ports."""
    inputs = scratch[S_INPUTS:]
    for a in range(3):
        inputs[2 * a] = scratch[S_ANGLES + a]
        inputs[2 * a + 1] = scratch[S_VELOCITIES + a]
    inputs[TRANSMITTED_TORQUE] = transmitted
    inputs[TWIST] = twist
    inputs[TWIST_RATE] = twist_rate
    inputs[MESH_TWIST] = mesh_twist
    inputs[MESH_TWIST_RATE] = mesh_rate
    inputs[TIME] = t


@_jit
def run_elements(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Clear outputs and Jacobian, then let every element add to them."""
    columns = integers[COLUMNS]
    rows = OWN + integers[OWN_STATES]
    at = S_INPUTS + columns
    inputs = scratch[S_INPUTS:at]
    outputs = scratch[at : at + rows]
    jacobian = scratch[at + rows : at + rows + rows * columns]
    outputs[:] = 0.0
    jacobian[:] = 0.0
    for k in range(integers[ELEMENTS]):
        entry = LISTS + 3 * k
        call_element(
            integers[entry],
            inputs,
            reals[integers[entry + 1] :],
            integers[entry + 2],
            columns,
            outputs,
            jacobian,
        )


@_jit
def evaluate_elastic(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Right-hand side with a compliant mesh."""
    read_coordinates(t, y, integers, reals, scratch)
    read_error(integers, reals, scratch)
    angles = scratch[S_ANGLES : S_ANGLES + 3]
    velocities = scratch[S_VELOCITIES : S_VELOCITIES + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    result = scratch[S_MESH : S_MESH + _mesh.RESULT_SIZE]
    ring = integers[RING]
    if ring == RING_STATIC:
        balance_ring(integers, reals, scratch)
    else:
        call_mesh(integers[MESH_ADDRESS], angles, error, reals[integers[MESH_AT] :], result)
    h_mm = result[_mesh.HESSIAN]
    h_mf = result[_mesh.HESSIAN + 1]
    h_mo = result[_mesh.HESSIAN + 2]
    h_ff = result[_mesh.HESSIAN + 3]
    h_fo = result[_mesh.HESSIAN + 4]
    h_oo = result[_mesh.HESSIAN + 5]
    # The ports: first derivatives over the angles; second ones exist only through the error.
    torsion = scratch[S_TWIST_1 : S_TWIST_1 + 3]
    meshing = scratch[S_MESH_1 : S_MESH_1 + 3]
    inverse = reals[INVERSE_RATIO]
    if ring == RING_DYNAMIC:
        gain = reals[GAIN]
        torsion[0] = 0.0
        torsion[1] = 1.0
        torsion[2] = -reals[KAPPA]
        meshing[0] = gain * (inverse + error[1])
        meshing[1] = -1.0
        meshing[2] = gain * (error[2] - reals[OUTPUT_SHARE])
        curved_torsion = 0.0
        curved_mesh = gain
        twist = result[_mesh.TWIST]
        mesh_twist = result[_mesh.MESH_TWIST]
    else:
        torsion[0] = inverse + error[1]
        torsion[1] = 0.0
        torsion[2] = error[2] - 1.0
        meshing[:] = torsion
        curved_torsion = 1.0
        curved_mesh = 1.0
        twist = angles[0] * inverse - angles[2] + error[0]
        mesh_twist = twist
    twist_rate = 0.0
    mesh_rate = 0.0
    for a in range(3):
        twist_rate += torsion[a] * velocities[a]
        mesh_rate += meshing[a] * velocities[a]
    fill_inputs(t, integers, scratch, -result[_mesh.GRADIENT + 2], twist, twist_rate, mesh_twist, mesh_rate)
    run_elements(integers, reals, scratch)

    columns = integers[COLUMNS]
    rows = OWN + integers[OWN_STATES]
    outputs = scratch[S_INPUTS + columns : S_INPUTS + columns + rows]
    kinetic = 0.0
    supplied = outputs[SUPPLIED]
    delivered = outputs[DELIVERED]
    for a in range(3):
        if ring != RING_DYNAMIC and a == 1:
            continue
        torque = (
            outputs[a]
            + outputs[TWIST_TORQUE] * torsion[a]
            + outputs[MESH_TORQUE] * meshing[a]
            - result[_mesh.GRADIENT + a]
        )
        inertia = reals[INERTIA + a]
        kinetic += 0.5 * inertia * velocities[a] * velocities[a]
        index = integers[STATE_OF + a]
        if index >= 0:
            scratch[S_ACCELERATIONS + a] = torque / inertia
            scratch[S_CONSTRAINT + a] = 0.0
            dy[index] = y[index + 1]
            dy[index + 1] = torque / inertia - reals[LAMBDA + a] * scratch[S_ACCELERATIONS]
        else:
            constraint = inertia * scratch[S_ACCELERATIONS + a] - torque
            scratch[S_CONSTRAINT + a] = constraint
            if a == 0:
                supplied += constraint * velocities[a]
            else:
                delivered -= constraint * velocities[a]
    scratch[S_KINETIC] = kinetic
    scratch[S_POTENTIAL] = result[_mesh.ENERGY] + outputs[STORED]
    own = integers[OWN_STATES]
    energies = integers[STATES] - 3
    for k in range(own):
        dy[energies - own + k] = outputs[OWN + k]
    dy[energies] = supplied
    dy[energies + 1] = delivered
    dy[energies + 2] = outputs[DISSIPATED]
    if want_jacobian == 0:
        return

    # Fold the dependent columns into those of the angles and velocities.
    at = S_INPUTS + columns + rows
    full = scratch[at : at + rows * columns].reshape((rows, columns))
    vm = velocities[0]
    vo = velocities[2]
    bent_m = error[3] * vm + error[4] * vo
    bent_o = error[4] * vm + error[5] * vo
    for r in range(rows):
        row = full[r]
        d_tau = row[TRANSMITTED_TORQUE]
        d_twist = row[TWIST]
        d_rate = row[TWIST_RATE]
        d_mesh = row[MESH_TWIST]
        d_mesh_rate = row[MESH_TWIST_RATE]
        if ring == RING_STATIC:
            row[MOTOR_ANGLE] += row[RING_ANGLE] * scratch[S_RING_1]
            row[OUTPUT_ANGLE] += row[RING_ANGLE] * scratch[S_RING_1 + 2]
        for a in range(3):
            row[2 * a] += d_twist * torsion[a] + d_mesh * meshing[a]
            row[2 * a + 1] += d_rate * torsion[a] + d_mesh_rate * meshing[a]
        bent = d_rate * curved_torsion + d_mesh_rate * curved_mesh
        row[MOTOR_ANGLE] += bent * bent_m - d_tau * h_mo
        row[OUTPUT_ANGLE] += bent * bent_o - d_tau * h_oo
        row[RING_ANGLE] -= d_tau * h_fo
    # Torque rows: the ports' rows through their levers, then the potential.
    for a in range(3):
        for c in range(columns):
            full[a, c] += torsion[a] * full[TWIST_TORQUE, c] + meshing[a] * full[MESH_TORQUE, c]
    bent = outputs[TWIST_TORQUE] * curved_torsion + outputs[MESH_TORQUE] * curved_mesh
    full[0, MOTOR_ANGLE] += bent * error[3] - h_mm
    full[0, RING_ANGLE] -= h_mf
    full[0, OUTPUT_ANGLE] += bent * error[4] - h_mo
    full[1, MOTOR_ANGLE] -= h_mf
    full[1, RING_ANGLE] -= h_ff
    full[1, OUTPUT_ANGLE] -= h_fo
    full[2, MOTOR_ANGLE] += bent * error[4] - h_mo
    full[2, RING_ANGLE] -= h_fo
    full[2, OUTPUT_ANGLE] += bent * error[5] - h_oo
    # Powers of the constraints: T = J alpha - Q.
    for a in range(3):
        if integers[SIGNAL_OF + a] < 0:
            continue
        sign = -velocities[a] if a == 0 else velocities[a]
        target = SUPPLIED if a == 0 else DELIVERED
        for c in range(columns):
            full[target, c] += sign * full[a, c]
        constraint = scratch[S_CONSTRAINT + a]
        full[target, 2 * a + 1] += constraint if a == 0 else -constraint
        jerk = scratch[S_INPUTS + integers[SIGNAL_OF + a] + 3]
        full[target, TIME] -= sign * reals[INERTIA + a] * jerk
    scatter(integers, reals, scratch, full, jacobian, dfdt)


@_jit
def scatter(integers, reals, scratch, full, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """From rows and columns of the elements to those of the states; what is prescribed goes into df/dt."""
    n = integers[STATES]
    own = integers[OWN_STATES]
    energies = n - 3
    first_own = energies - own
    columns = integers[COLUMNS]
    jacobian[: n * n] = 0.0
    dfdt[:n] = 0.0
    for kind in range(3 + own + 3):
        # Which row of ``full`` drives which state, and its factor.
        if kind < 3:
            index = integers[STATE_OF + kind]
            if index < 0:
                continue
            jacobian[index * n + index + 1] = 1.0
            state = index + 1
            r = kind
            factor = 1.0 / reals[INERTIA + kind]
            if kind > 0 and integers[STATE_OF] >= 0:
                # The deviation's acceleration: this row less lambda times the motor's.
                share = reals[LAMBDA + kind] * reals[INERTIA + kind] / reals[INERTIA]
                for c in range(columns):
                    full[kind, c] -= share * full[0, c]
        elif kind < 3 + own:
            state = first_own + kind - 3
            r = OWN + kind - 3
            factor = 1.0
        else:
            which = kind - 3 - own
            state = energies + which
            r = SUPPLIED if which == 0 else (DELIVERED if which == 1 else DISSIPATED)
            factor = 1.0
        row = full[r]
        slope = row[TIME]
        by_angle = row[0]
        by_velocity = row[1]
        for a in range(1, 3):
            index = integers[STATE_OF + a]
            if index >= 0:
                jacobian[state * n + index] = factor * row[2 * a]
                jacobian[state * n + index + 1] = factor * row[2 * a + 1]
                by_angle += reals[LAMBDA + a] * row[2 * a]
                by_velocity += reals[LAMBDA + a] * row[2 * a + 1]
            elif integers[SIGNAL_OF + a] >= 0:
                slope += row[2 * a] * scratch[S_VELOCITIES + a]
                slope += row[2 * a + 1] * scratch[S_ACCELERATIONS + a]
        if integers[STATE_OF] >= 0:
            jacobian[state * n + integers[STATE_OF]] = factor * by_angle
            jacobian[state * n + integers[STATE_OF] + 1] = factor * by_velocity
        else:
            slope += by_angle * scratch[S_VELOCITIES] + by_velocity * scratch[S_ACCELERATIONS]
            if 0 < kind < 3:
                jerk = scratch[S_INPUTS + integers[SIGNAL_OF] + 3]
                slope -= reals[LAMBDA + kind] * reals[INERTIA + kind] * jerk
        for k in range(own):
            jacobian[state * n + first_own + k] = factor * row[OWN + k]
        for c in range(OWN + own, columns):
            if (c - OWN - own) % 4 != 3:
                slope += row[c] * scratch[S_INPUTS + c + 1]
        dfdt[state] = factor * slope


@_jit
def rigid_output(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Put the output at the motor's angle over i plus e; returns c = dtheta_o/dtheta_m and dc/dtheta_m."""
    angles = scratch[S_ANGLES : S_ANGLES + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    inverse = reals[INVERSE_RATIO]
    angles[2] = angles[0] * inverse
    for _ in range(6):
        read_error(integers, reals, scratch)
        angles[2] = angles[0] * inverse + error[0]
    read_error(integers, reals, scratch)
    c = (inverse + error[1]) / (1.0 - error[2])
    return c, (error[3] + 2.0 * error[4] * c + error[5] * c * c) / (1.0 - error[2])


@_jit
def evaluate_rigid(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Right-hand side of a drive without compliance: the output follows theta_o = theta_m / i + e.

    With c = dtheta_o/dtheta_m: (J_m + c^2 J_o) theta_m'' = Q_m + c Q_o - J_o c c' theta_m'^2, and the torque
    on the output, which friction depends on, is found by Newton's method.
    """
    read_coordinates(t, y, integers, reals, scratch)
    velocities = scratch[S_VELOCITIES : S_VELOCITIES + 3]
    accelerations = scratch[S_ACCELERATIONS : S_ACCELERATIONS + 3]
    c, bend = rigid_output(integers, reals, scratch)
    vm = velocities[0]
    velocities[2] = c * vm
    j_m = reals[INERTIA]
    j_o = reals[INERTIA + 2]
    total = j_m + c * c * j_o
    columns = integers[COLUMNS]
    own = integers[OWN_STATES]
    rows = OWN + own
    outputs = scratch[S_INPUTS + columns : S_INPUTS + columns + rows]
    at = S_INPUTS + columns + rows
    full = scratch[at : at + rows * columns].reshape((rows, columns))
    free = integers[STATE_OF] >= 0
    tau = 0.0
    alpha = accelerations[0]
    gradient = 1.0
    for _ in range(20):
        fill_inputs(t, integers, scratch, tau, 0.0, 0.0, 0.0, 0.0)
        run_elements(integers, reals, scratch)
        gradient = 1.0 + full[OUTPUT_TORQUE, TRANSMITTED_TORQUE]
        if free:
            alpha = (outputs[MOTOR_TORQUE] + c * outputs[OUTPUT_TORQUE] - j_o * c * bend * vm * vm) / total
            pulled = full[MOTOR_TORQUE, TRANSMITTED_TORQUE] + c * full[OUTPUT_TORQUE, TRANSMITTED_TORQUE]
            gradient -= j_o * c * pulled / total
        residual = tau - (j_o * (c * alpha + bend * vm * vm) - outputs[OUTPUT_TORQUE])
        if abs(residual) <= 1e-13 * (1.0 + abs(tau)):
            break
        tau -= residual / gradient
    accelerations[0] = alpha
    accelerations[2] = c * alpha + bend * vm * vm
    scratch[S_KINETIC] = 0.5 * total * vm * vm
    scratch[S_POTENTIAL] = outputs[STORED]
    for k in range(_mesh.RESULT_SIZE):
        scratch[S_MESH + k] = 0.0
    scratch[S_MESH + _mesh.ENGAGED] = math.nan
    constraint = 0.0
    index = integers[STATE_OF]
    if free:
        dy[index] = vm
        dy[index + 1] = alpha
    else:
        constraint = j_m * alpha - outputs[MOTOR_TORQUE] + c * tau
    scratch[S_CONSTRAINT] = constraint
    scratch[S_CONSTRAINT + 1] = 0.0
    scratch[S_CONSTRAINT + 2] = 0.0
    energies = integers[STATES] - 3
    for k in range(own):
        dy[energies - own + k] = outputs[OWN + k]
    dy[energies] = outputs[SUPPLIED] + constraint * vm
    dy[energies + 1] = outputs[DELIVERED]
    dy[energies + 2] = outputs[DISSIPATED]
    if want_jacobian == 0:
        return
    # dc'/dtheta_m needs the error's third derivative: a central difference, exact to about 1e-9.
    motor, output, nudge = scratch[S_ANGLES], scratch[S_ANGLES + 2], 1e-4
    scratch[S_ANGLES] = motor + nudge
    above = rigid_output(integers, reals, scratch)[1]
    scratch[S_ANGLES] = motor - nudge
    below = rigid_output(integers, reals, scratch)[1]
    scratch[S_ANGLES] = motor
    rigid_output(integers, reals, scratch)
    scratch[S_ANGLES + 2] = output
    turning = j_o * vm * vm * (above - below) / (2.0 * nudge)
    # The output's columns through the kinematics.
    for r in range(rows):
        row = full[r]
        row[MOTOR_ANGLE] += c * row[OUTPUT_ANGLE] + bend * vm * row[OUTPUT_ANGLE + 1]
        row[MOTOR_ANGLE + 1] += c * row[OUTPUT_ANGLE + 1]
    # The transmitted torque's column through its own equation.
    for k in range(columns):
        if k in (TRANSMITTED_TORQUE, OUTPUT_ANGLE, OUTPUT_ANGLE + 1):
            continue
        d_alpha = 0.0
        if free:
            d_alpha = (full[MOTOR_TORQUE, k] + c * full[OUTPUT_TORQUE, k]) / total
            if k == MOTOR_ANGLE + 1:
                d_alpha -= 2.0 * j_o * c * bend * vm / total
            if k == MOTOR_ANGLE:
                d_alpha += (
                    bend * outputs[OUTPUT_TORQUE]
                    - j_o * bend * bend * vm * vm
                    - 2.0 * c * bend * j_o * alpha
                    - c * turning
                ) / total
        d_tau = j_o * c * d_alpha - full[OUTPUT_TORQUE, k]
        if k == MOTOR_ANGLE:
            d_tau += j_o * bend * alpha + turning
        if k == MOTOR_ANGLE + 1:
            d_tau += 2.0 * j_o * bend * vm
        d_tau /= gradient
        for r in range(rows):
            full[r, k] += full[r, TRANSMITTED_TORQUE] * d_tau
        # A spare row keeps d tau for the constraint's power.
        full[TWIST_TORQUE, k] = d_tau
    for k in range(columns):
        full[MESH_TORQUE, k] = full[MOTOR_TORQUE, k]
        if free:
            full[MOTOR_TORQUE, k] += c * full[OUTPUT_TORQUE, k]
    if free:
        full[MOTOR_TORQUE, MOTOR_ANGLE] += (
            bend * outputs[OUTPUT_TORQUE]
            - j_o * bend * bend * vm * vm
            - 2.0 * c * bend * j_o * alpha
            - c * turning
        )
        full[MOTOR_TORQUE, MOTOR_ANGLE + 1] -= 2.0 * j_o * c * bend * vm
        for k in range(columns):
            full[MOTOR_TORQUE, k] *= j_m / total
    else:
        for k in range(columns):
            if k != TRANSMITTED_TORQUE and k != OUTPUT_ANGLE and k != OUTPUT_ANGLE + 1:
                full[SUPPLIED, k] += vm * (c * full[TWIST_TORQUE, k] - full[MESH_TORQUE, k])
        full[SUPPLIED, MOTOR_ANGLE] += vm * bend * tau
        full[SUPPLIED, MOTOR_ANGLE + 1] += constraint
        jerk = scratch[S_INPUTS + integers[SIGNAL_OF] + 3]
        d_tau = j_o * c * jerk / gradient
        full[SUPPLIED, TIME] += vm * (j_m * jerk + (c - full[MESH_TORQUE, TRANSMITTED_TORQUE]) * d_tau)
        for r in range(rows):
            if r != SUPPLIED:
                full[r, TIME] += full[r, TRANSMITTED_TORQUE] * d_tau
    scatter(integers, reals, scratch, full, jacobian, dfdt)


@_jit
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
def observe(times, states, integers, reals, inside, place, held, scratch, kept, rows):  # type: ignore[no-untyped-def]
    """Evaluate at every sample and keep the first ``kept`` numbers of the scratch: shape (samples, kept).

    ``inside`` holds, for each sample, a time inside its smooth span; ``held`` what stood at ``place`` of the
    reals then (the held torque of a sampled controller; no place: -1).
    """
    n = integers[STATES]
    dy = np.empty(n)
    nothing = np.empty(0)
    for k in range(times.shape[0]):
        reals[INSIDE] = inside[k]
        if place >= 0:
            reals[place] = held[k]
        evaluate_arrays(times[k], states[k], integers, reals, scratch, 0, dy, nothing, nothing)
        for c in range(kept):
            rows[k, c] = scratch[c]
        rows[k, kept : kept + n] = dy
