"""The compiled right-hand side of a drive with a compliant mesh; see ``hdsim.drive._assembly``."""

from __future__ import annotations

from typing import Any

from hdsim._abi import call_mesh
from hdsim._compile import inlined
from hdsim.drive import _mesh_layout
from hdsim.drive._layout import (
    COLUMNS,
    ENERGIES,
    GAIN,
    GIVEN,
    HOUSING,
    HOUSING_INERTIA,
    INERTIA,
    INVERSE_RATIO,
    KAPPA,
    LAMBDA,
    MESH_ADDRESS,
    MESH_AT,
    ON_SPRING,
    ON_SPRING_AT,
    OUTPUT_SHARE,
    OWN_STATES,
    RING,
    RING_DYNAMIC,
    RING_STATIC,
    S_ACCELERATIONS,
    S_CONSTRAINT,
    S_ERROR,
    S_HELD,
    S_INPUTS,
    S_KINETIC,
    S_MESH,
    S_MESH_1,
    S_MESH_2,
    S_POTENTIAL,
    S_RELATIVE,
    S_RING_1,
    S_TWIST_1,
    S_TWIST_2,
    S_VELOCITIES,
    SIGNAL_OF,
    STATE_OF,
    STATES,
)
from hdsim.drive._ring import balance_ring, ring_curvature
from hdsim.drive._terms import fill_inputs, read_coordinates, read_error, run_elements, scatter
from hdsim.kernel import (
    DELIVERED,
    DISSIPATED,
    MESH_TORQUE,
    MESH_TWIST,
    MESH_TWIST_RATE,
    MOTOR_ANGLE,
    OUTPUT_ANGLE,
    OWN,
    RING_ANGLE,
    STORED,
    SUPPLIED,
    TIME,
    TRANSMITTED_TORQUE,
    TWIST,
    TWIST_RATE,
    TWIST_TORQUE,
)

_jit: Any = inlined


@_jit
def evaluate_elastic(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Right-hand side with a compliant mesh.

    Mesh, kinematic error and ports see the angles from the housing, theta_a - b. So the housing's row is
    minus the sum of the three bodies' rows, in torques and in derivatives alike.

    With ``integers[GIVEN]`` the scratch holds coordinates, kinematic error and mesh of a model that differs
    in none of them and was evaluated just before at the same time and state.
    """
    given = integers[GIVEN] != 0
    if not given:
        read_coordinates(t, y, integers, reals, scratch)
        read_error(integers, reals, scratch)
    angles = scratch[S_RELATIVE : S_RELATIVE + 3]
    seen = scratch[S_RELATIVE + 3 : S_RELATIVE + 6]
    velocities = scratch[S_VELOCITIES : S_VELOCITIES + 3]
    error = scratch[S_ERROR : S_ERROR + 6]
    result = scratch[S_MESH : S_MESH + _mesh_layout.RESULT_SIZE]
    ring = integers[RING]
    held = 0.0
    for k in range(integers[ON_SPRING]):
        held += scratch[S_INPUTS + integers[integers[ON_SPRING_AT] + k]]
    if ring == RING_STATIC:
        balance_ring(integers, reals, scratch)
    elif not given:
        result[_mesh_layout.HELD_TORQUE] = held
        call_mesh(integers[MESH_ADDRESS], angles, error, reals[integers[MESH_AT] :], result)
    h_mm = result[_mesh_layout.HESSIAN]
    h_mf = result[_mesh_layout.HESSIAN + 1]
    h_mo = result[_mesh_layout.HESSIAN + 2]
    # A ring in balance is no coordinate: the rest of the Hessian is its Schur complement.
    h_ff = 0.0 if ring == RING_STATIC else result[_mesh_layout.HESSIAN + 3]
    h_fo = result[_mesh_layout.HESSIAN + 4]
    h_oo = result[_mesh_layout.HESSIAN + 5]
    # The ports: their twists' first derivatives over the angles.
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
    elif ring == RING_STATIC:
        # Twist of the cup alone, as with a ring of its own: the gap is in the mesh, where nothing damps it.
        gain = reals[GAIN]
        torsion[0] = scratch[S_RING_1]
        torsion[1] = 0.0
        torsion[2] = scratch[S_RING_1 + 2] - reals[KAPPA]
        meshing[0] = gain * (inverse + error[1]) - scratch[S_RING_1]
        meshing[1] = 0.0
        meshing[2] = gain * (error[2] - reals[OUTPUT_SHARE]) - scratch[S_RING_1 + 2]
    else:
        # Of the spring alone as well: what has no teeth in contact does not wind up what lies behind them.
        gain = 1.0
        torsion[0] = result[_mesh_layout.TWIST_M]
        torsion[1] = 0.0
        torsion[2] = result[_mesh_layout.TWIST_O]
        meshing[0] = inverse + error[1]
        meshing[1] = 0.0
        meshing[2] = error[2] - 1.0
    twist = result[_mesh_layout.TWIST]
    mesh_twist = result[_mesh_layout.MESH_TWIST]
    twist_rate = 0.0
    mesh_rate = 0.0
    for a in range(3):
        twist_rate += torsion[a] * seen[a]
        mesh_rate += meshing[a] * seen[a]
    # Of what is parallel to the spring as well: the teeth carry both.
    scratch[S_HELD] = -held * torsion[2]
    transmitted = -result[_mesh_layout.GRADIENT + 2] + scratch[S_HELD]
    fill_inputs(t, integers, scratch, transmitted, twist, twist_rate, mesh_twist, mesh_rate)
    run_elements(integers, reals, scratch, want_jacobian)

    columns = integers[COLUMNS]
    rows = OWN + integers[OWN_STATES]
    outputs = scratch[S_INPUTS + columns : S_INPUTS + columns + rows]
    kinetic = 0.0
    supplied = outputs[SUPPLIED]
    delivered = outputs[DELIVERED]
    housing = integers[HOUSING]
    if housing > 0:
        reaction = 0.0
        for a in range(3):
            reaction -= outputs[TWIST_TORQUE] * torsion[a] + outputs[MESH_TORQUE] * meshing[a]
            reaction += result[_mesh_layout.GRADIENT + a]
        outputs[housing + 1] += reaction / reals[HOUSING_INERTIA]
    for a in range(3):
        if ring != RING_DYNAMIC and a == 1:
            continue
        torque = (
            outputs[a]
            + outputs[TWIST_TORQUE] * torsion[a]
            + outputs[MESH_TORQUE] * meshing[a]
            - result[_mesh_layout.GRADIENT + a]
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
    scratch[S_POTENTIAL] = result[_mesh_layout.ENERGY] + outputs[STORED]
    own = integers[OWN_STATES]
    energies = integers[STATES] - integers[ENERGIES]
    for k in range(own):
        dy[energies - own + k] = outputs[OWN + k]
    if integers[ENERGIES] > 0:
        dy[energies] = supplied
        dy[energies + 1] = delivered
        dy[energies + 2] = outputs[DISSIPATED]
    if want_jacobian == 0:
        return

    # Fold the dependent columns into those of the angles and velocities.
    at = S_INPUTS + columns + rows
    full = scratch[at : at + rows * columns]
    # Rows of energies that are no states, and those for the log, which have no derivatives.
    unread = STORED if integers[ENERGIES] > 0 else DISSIPATED
    vm = seen[0]
    vo = seen[2]
    bent = scratch[S_TWIST_2 : S_TWIST_2 + 3]
    bent_mesh = scratch[S_MESH_2 : S_MESH_2 + 3]
    bent[:] = 0.0
    if ring == RING_STATIC:
        ring_curvature(integers, reals, scratch)
    for k in range(3):
        bent_mesh[k] = gain * error[3 + k]
        if ring == RING_STATIC:
            bent_mesh[k] -= bent[k]
        elif ring != RING_DYNAMIC:
            bent[k] = result[_mesh_layout.TWIST_2 + k]
    for r in range(rows):
        if unread <= r < OWN:
            continue
        row = full[r * columns : (r + 1) * columns]
        d_tau = row[TRANSMITTED_TORQUE]
        d_twist = row[TWIST]
        d_rate = row[TWIST_RATE]
        d_mesh = row[MESH_TWIST]
        d_mesh_rate = row[MESH_TWIST_RATE]
        by_angles = row[MOTOR_ANGLE] + row[OUTPUT_ANGLE]
        if ring != RING_STATIC:
            by_angles += row[RING_ANGLE]
        by_velocities = row[MOTOR_ANGLE + 1] + row[RING_ANGLE + 1] + row[OUTPUT_ANGLE + 1]
        if ring == RING_STATIC:
            # The ring stands at the housing's angle plus what mesh and structure make of the others.
            row[MOTOR_ANGLE] += row[RING_ANGLE] * scratch[S_RING_1]
            row[OUTPUT_ANGLE] += row[RING_ANGLE] * scratch[S_RING_1 + 2]
        for a in range(3):
            row[2 * a] += d_twist * torsion[a] + d_mesh * meshing[a]
            row[2 * a + 1] += d_rate * torsion[a] + d_mesh_rate * meshing[a]
        for k in range(integers[ON_SPRING]):
            row[integers[integers[ON_SPRING_AT] + k]] -= d_tau * torsion[2]
        row[MOTOR_ANGLE] += d_rate * (bent[0] * vm + bent[1] * vo) - d_tau * (h_mo + held * bent[1])
        row[MOTOR_ANGLE] += d_mesh_rate * (bent_mesh[0] * vm + bent_mesh[1] * vo)
        row[OUTPUT_ANGLE] += d_rate * (bent[1] * vm + bent[2] * vo) - d_tau * (h_oo + held * bent[2])
        row[OUTPUT_ANGLE] += d_mesh_rate * (bent_mesh[1] * vm + bent_mesh[2] * vo)
        row[RING_ANGLE] -= d_tau * h_fo
        if housing > 0:
            # What came in through the mesh depends on the angles as seen from the housing.
            row[housing] += by_angles - row[MOTOR_ANGLE] - row[OUTPUT_ANGLE]
            row[housing] += row[RING_ANGLE] if ring == RING_STATIC else -row[RING_ANGLE]
            row[housing + 1] += by_velocities
            row[housing + 1] -= row[MOTOR_ANGLE + 1] + row[RING_ANGLE + 1] + row[OUTPUT_ANGLE + 1]
    # Torque rows: the ports' rows through their levers, then the potential.
    torque, mesh_torque = outputs[TWIST_TORQUE], outputs[MESH_TORQUE]
    slope_mo = torque * bent[1] + mesh_torque * bent_mesh[1] - h_mo
    slopes = (
        (torque * bent[0] + mesh_torque * bent_mesh[0] - h_mm, -h_mf, slope_mo),
        (-h_mf, -h_ff, -h_fo),
        (slope_mo, -h_fo, torque * bent[2] + mesh_torque * bent_mesh[2] - h_oo),
    )
    for a in range(3):
        if a == 1 and ring != RING_DYNAMIC:
            # No coordinate, no row: nor anything that the housing would feel.
            continue
        through = slopes[a][0] + slopes[a][1] + slopes[a][2]
        for c in range(columns):
            by_ports = (
                torsion[a] * full[TWIST_TORQUE * columns + c] + meshing[a] * full[MESH_TORQUE * columns + c]
            )
            full[a * columns + c] += by_ports
            if housing > 0:
                full[(housing + 1) * columns + c] -= by_ports / reals[HOUSING_INERTIA]
        for b in range(3):
            full[a * columns + 2 * b] += slopes[a][b]
            if housing > 0:
                full[(housing + 1) * columns + 2 * b] -= slopes[a][b] / reals[HOUSING_INERTIA]
        if housing > 0:
            full[a * columns + housing] -= through
            full[(housing + 1) * columns + housing] += through / reals[HOUSING_INERTIA]
    # Powers of the constraints, which only the energies read: T = J alpha - Q.
    for a in range(3):
        if integers[SIGNAL_OF + a] < 0 or integers[ENERGIES] == 0:
            continue
        sign = -velocities[a] if a == 0 else velocities[a]
        target = SUPPLIED if a == 0 else DELIVERED
        for c in range(columns):
            full[target * columns + c] += sign * full[a * columns + c]
        constraint = scratch[S_CONSTRAINT + a]
        full[target * columns + 2 * a + 1] += constraint if a == 0 else -constraint
        jerk = scratch[S_INPUTS + integers[SIGNAL_OF + a] + 3]
        full[target * columns + TIME] -= sign * reals[INERTIA + a] * jerk
    scatter(integers, reals, scratch, full, jacobian, dfdt)
