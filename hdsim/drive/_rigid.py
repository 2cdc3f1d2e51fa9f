"""The compiled right-hand side of a drive without compliance; see ``hdsim.drive._assembly``."""

from __future__ import annotations

import math
from typing import Any

from hdsim._compile import inlined
from hdsim.drive import _mesh_layout
from hdsim.drive._layout import (
    COLUMNS,
    ENERGIES,
    INERTIA,
    INVERSE_RATIO,
    OWN_STATES,
    S_ACCELERATIONS,
    S_ANGLES,
    S_CONSTRAINT,
    S_ERROR,
    S_INPUTS,
    S_KINETIC,
    S_MESH,
    S_POTENTIAL,
    S_RELATIVE,
    S_VELOCITIES,
    SIGNAL_OF,
    STATE_OF,
    STATES,
)
from hdsim.drive._terms import fill_inputs, read_coordinates, read_error, run_elements, scatter
from hdsim.kernel import (
    DELIVERED,
    DISSIPATED,
    MESH_TORQUE,
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    OUTPUT_ANGLE,
    OUTPUT_TORQUE,
    OWN,
    STORED,
    SUPPLIED,
    TIME,
    TRANSMITTED_TORQUE,
    TWIST_TORQUE,
)

_jit: Any = inlined


@_jit
def rigid_output(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Put the output at the motor's angle over i plus e; returns c = dtheta_o/dtheta_m and dc/dtheta_m."""
    angles = scratch[S_ANGLES : S_ANGLES + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    inverse = reals[INVERSE_RATIO]
    # Without compliance the housing stands still.
    seen = scratch[S_RELATIVE : S_RELATIVE + 3]
    angles[2] = angles[0] * inverse
    seen[0], seen[2] = angles[0], angles[2]
    for _ in range(6):
        read_error(integers, reals, scratch)
        angles[2] = angles[0] * inverse + error[0]
        seen[2] = angles[2]
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
    full = scratch[at : at + rows * columns]
    free = integers[STATE_OF] >= 0
    tau = 0.0
    alpha = accelerations[0]
    gradient = 1.0
    for _ in range(20):
        fill_inputs(t, integers, scratch, tau, 0.0, 0.0, 0.0, 0.0)
        run_elements(integers, reals, scratch, 1)
        gradient = 1.0 + full[OUTPUT_TORQUE * columns + TRANSMITTED_TORQUE]
        if free:
            alpha = (outputs[MOTOR_TORQUE] + c * outputs[OUTPUT_TORQUE] - j_o * c * bend * vm * vm) / total
            pulled = (
                full[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE]
                + c * full[OUTPUT_TORQUE * columns + TRANSMITTED_TORQUE]
            )
            gradient -= j_o * c * pulled / total
        residual = tau - (j_o * (c * alpha + bend * vm * vm) - outputs[OUTPUT_TORQUE])
        if abs(residual) <= 1e-13 * (1.0 + abs(tau)):
            break
        tau -= residual / gradient
    accelerations[0] = alpha
    accelerations[2] = c * alpha + bend * vm * vm
    scratch[S_KINETIC] = 0.5 * total * vm * vm
    scratch[S_POTENTIAL] = outputs[STORED]
    for k in range(_mesh_layout.RESULT_SIZE):
        scratch[S_MESH + k] = 0.0
    scratch[S_MESH + _mesh_layout.ENGAGED] = math.nan
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
    energies = integers[STATES] - integers[ENERGIES]
    for k in range(own):
        dy[energies - own + k] = outputs[OWN + k]
    if integers[ENERGIES] > 0:
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
        row = full[r * columns : (r + 1) * columns]
        row[MOTOR_ANGLE] += c * row[OUTPUT_ANGLE] + bend * vm * row[OUTPUT_ANGLE + 1]
        row[MOTOR_ANGLE + 1] += c * row[OUTPUT_ANGLE + 1]
    # The transmitted torque's column through its own equation.
    for k in range(columns):
        if k in (TRANSMITTED_TORQUE, OUTPUT_ANGLE, OUTPUT_ANGLE + 1):
            continue
        d_alpha = 0.0
        if free:
            d_alpha = (full[MOTOR_TORQUE * columns + k] + c * full[OUTPUT_TORQUE * columns + k]) / total
            if k == MOTOR_ANGLE + 1:
                d_alpha -= 2.0 * j_o * c * bend * vm / total
            if k == MOTOR_ANGLE:
                d_alpha += (
                    bend * outputs[OUTPUT_TORQUE]
                    - j_o * bend * bend * vm * vm
                    - 2.0 * c * bend * j_o * alpha
                    - c * turning
                ) / total
        d_tau = j_o * c * d_alpha - full[OUTPUT_TORQUE * columns + k]
        if k == MOTOR_ANGLE:
            d_tau += j_o * bend * alpha + turning
        if k == MOTOR_ANGLE + 1:
            d_tau += 2.0 * j_o * bend * vm
        d_tau /= gradient
        for r in range(rows):
            full[r * columns + k] += full[r * columns + TRANSMITTED_TORQUE] * d_tau
        # A spare row keeps d tau for the constraint's power.
        full[TWIST_TORQUE * columns + k] = d_tau
    for k in range(columns):
        full[MESH_TORQUE * columns + k] = full[MOTOR_TORQUE * columns + k]
        if free:
            full[MOTOR_TORQUE * columns + k] += c * full[OUTPUT_TORQUE * columns + k]
    if free:
        full[MOTOR_TORQUE * columns + MOTOR_ANGLE] += (
            bend * outputs[OUTPUT_TORQUE]
            - j_o * bend * bend * vm * vm
            - 2.0 * c * bend * j_o * alpha
            - c * turning
        )
        full[MOTOR_TORQUE * columns + MOTOR_ANGLE + 1] -= 2.0 * j_o * c * bend * vm
        for k in range(columns):
            full[MOTOR_TORQUE * columns + k] *= j_m / total
    else:
        for k in range(columns):
            if k != TRANSMITTED_TORQUE and k != OUTPUT_ANGLE and k != OUTPUT_ANGLE + 1:
                full[SUPPLIED * columns + k] += vm * (
                    c * full[TWIST_TORQUE * columns + k] - full[MESH_TORQUE * columns + k]
                )
        full[SUPPLIED * columns + MOTOR_ANGLE] += vm * bend * tau
        full[SUPPLIED * columns + MOTOR_ANGLE + 1] += constraint
        jerk = scratch[S_INPUTS + integers[SIGNAL_OF] + 3]
        d_tau = j_o * c * jerk / gradient
        full[SUPPLIED * columns + TIME] += vm * (
            j_m * jerk + (c - full[MESH_TORQUE * columns + TRANSMITTED_TORQUE]) * d_tau
        )
        for r in range(rows):
            if r != SUPPLIED:
                full[r * columns + TIME] += full[r * columns + TRANSMITTED_TORQUE] * d_tau
    scatter(integers, reals, scratch, full, jacobian, dfdt)
