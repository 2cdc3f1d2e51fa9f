"""What every compiled right-hand side does: read states and signals, run the elements, place the Jacobian."""

from __future__ import annotations

from typing import Any

from hdsim._abi import call_element, call_signal, call_twist
from hdsim._compile import inlined
from hdsim.drive._layout import (
    ACCOUNTS,
    COLUMNS,
    ELEMENTS,
    ENERGIES,
    HOUSING,
    INERTIA,
    INSIDE,
    LAMBDA,
    LISTS,
    OWN_STATES,
    PER_ELEMENT,
    PER_SIGNAL,
    PER_TWIST,
    S_ACCELERATIONS,
    S_ANGLES,
    S_ERROR,
    S_HOUSING,
    S_INPUTS,
    S_LEAST_ACCOUNT,
    S_LEAST_HEAT,
    S_RELATIVE,
    S_VELOCITIES,
    SIGNAL_OF,
    SIGNALS,
    STATE_OF,
    STATES,
    TWISTS,
)
from hdsim.kernel import (
    DELIVERED,
    DISSIPATED,
    MESH_TWIST,
    MESH_TWIST_RATE,
    OWN,
    SUPPLIED,
    TIME,
    TRANSMITTED_TORQUE,
    TWIST,
    TWIST_RATE,
)

_jit: Any = inlined


@_jit
def read_coordinates(t, y, integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Signals, angles, velocities, prescribed accelerations and own states into the scratch."""
    own = integers[OWN_STATES]
    first_signal = S_INPUTS + OWN + own
    at = LISTS + PER_ELEMENT * integers[ELEMENTS] + PER_TWIST * integers[TWISTS]
    for k in range(integers[SIGNALS]):
        column = first_signal + 4 * k
        call_signal(
            integers[at + PER_SIGNAL * k],
            t,
            reals[INSIDE],
            reals[integers[at + PER_SIGNAL * k + 1] :],
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
    last = integers[STATES] - integers[ENERGIES]
    for k in range(own):
        scratch[S_INPUTS + OWN + k] = y[last - own + k]
    see_from_housing(integers, scratch)


@_jit
def see_from_housing(integers, scratch):  # type: ignore[no-untyped-def]
    """The housing's motion, and angles and velocities as seen from it: what mesh and kinematic error see."""
    housing = integers[HOUSING]
    for k in range(2):
        turned = scratch[S_INPUTS + housing + k] if housing > 0 else 0.0
        scratch[S_HOUSING + k] = turned
        for a in range(3):
            scratch[S_RELATIVE + 3 * k + a] = scratch[S_ANGLES + 3 * k + a] - turned


@_jit
def read_error(integers, reals, scratch):  # type: ignore[no-untyped-def]
    """Kinematic error and its derivatives at the current angles, seen from the housing."""
    error = scratch[S_ERROR : S_ERROR + 6]
    error[:] = 0.0
    at = LISTS + PER_ELEMENT * integers[ELEMENTS]
    for k in range(integers[TWISTS]):
        call_twist(
            integers[at + PER_TWIST * k],
            scratch[S_RELATIVE],
            scratch[S_RELATIVE + 2],
            reals[integers[at + PER_TWIST * k + 1] :],
            error,
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
def run_elements(integers, reals, scratch, want_jacobian):  # type: ignore[no-untyped-def]
    """Clear outputs and Jacobian, then let each element add to them; keeps the least heat of an account.

    Without the Jacobian wanted, what the elements add to it is left to pile up: nobody reads it.
    """
    columns = integers[COLUMNS]
    rows = OWN + integers[OWN_STATES]
    at = S_INPUTS + columns
    inputs = scratch[S_INPUTS:at]
    outputs = scratch[at : at + rows]
    jacobian = scratch[at + rows : at + rows + rows * columns]
    heats = scratch[at + rows + rows * columns :]
    outputs[:] = 0.0
    if want_jacobian != 0:
        jacobian[:] = 0.0
    accounts = integers[ACCOUNTS]
    for k in range(accounts):
        heats[k] = 0.0
    for k in range(integers[ELEMENTS]):
        entry = LISTS + PER_ELEMENT * k
        before = outputs[DISSIPATED]
        call_element(
            integers[entry],
            inputs,
            reals[integers[entry + 1] :],
            integers[entry + 2],
            columns,
            outputs,
            jacobian,
        )
        if accounts > 0:
            heats[integers[entry + 3]] += outputs[DISSIPATED] - before
    scratch[S_LEAST_HEAT] = 0.0
    for k in range(accounts):
        if heats[k] < scratch[S_LEAST_HEAT]:
            scratch[S_LEAST_HEAT] = heats[k]
            scratch[S_LEAST_ACCOUNT] = k


@_jit
def scatter(integers, reals, scratch, full, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """From rows and columns of the elements to those of the states; what is prescribed goes into df/dt."""
    n = integers[STATES]
    own = integers[OWN_STATES]
    energies = n - integers[ENERGIES]
    first_own = energies - own
    columns = integers[COLUMNS]
    jacobian[: n * n] = 0.0
    dfdt[:n] = 0.0
    for kind in range(3 + own + integers[ENERGIES]):
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
                    full[kind * columns + c] -= share * full[0 * columns + c]
        elif kind < 3 + own:
            state = first_own + kind - 3
            r = OWN + kind - 3
            factor = 1.0
        else:
            which = kind - 3 - own
            state = energies + which
            r = SUPPLIED if which == 0 else (DELIVERED if which == 1 else DISSIPATED)
            factor = 1.0
        row = full[r * columns : (r + 1) * columns]
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
