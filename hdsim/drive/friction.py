"""Friction and damping that every drive has: on the input shaft, in the torsion spring and in the mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hdsim.kernel import (
    DISSIPATED,
    INPUT_FRICTION,
    MESH_TORQUE,
    MESH_TWIST_RATE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    TRANSMITTED_TORQUE,
    TWIST_RATE,
    TWIST_TORQUE,
    element,
)
from hdsim.parts import INPUT_FRICTION_HEAT, InputFriction

if TYPE_CHECKING:
    from hdsim.drive.parameters import Friction
    from hdsim.parts import Builder


@element
def input_friction(inputs, parameters, own, columns, outputs, jacobian):  # type: ignore[no-untyped-def]
    """T = (T_c + c_L |tau / i|) tanh(w / w_s) + b w on the motor shaft; parameters T_c, b, c_L / |i|, w_s."""
    speed = inputs[MOTOR_VELOCITY]
    tau = inputs[TRANSMITTED_TORQUE]
    sign = math.tanh(speed / parameters[3])
    size = parameters[0] + parameters[2] * abs(tau)
    torque = size * sign + parameters[1] * speed
    by_speed = size * (1.0 - sign * sign) / parameters[3] + parameters[1]
    by_tau = (parameters[2] if tau >= 0.0 else -parameters[2]) * sign
    outputs[MOTOR_TORQUE] -= torque
    outputs[INPUT_FRICTION] += torque
    outputs[DISSIPATED] += torque * speed
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= by_speed
    jacobian[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE] -= by_tau
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += by_speed * speed + torque
    jacobian[DISSIPATED * columns + TRANSMITTED_TORQUE] += by_tau * speed


@element
def torsion_damping(inputs, parameters, own, columns, outputs, jacobian):  # type: ignore[no-untyped-def]
    """Viscous damper parallel to the torsion spring; parameter: N m s/rad."""
    rate = inputs[TWIST_RATE]
    outputs[TWIST_TORQUE] -= parameters[0] * rate
    outputs[DISSIPATED] += parameters[0] * rate * rate
    jacobian[TWIST_TORQUE * columns + TWIST_RATE] -= parameters[0]
    jacobian[DISSIPATED * columns + TWIST_RATE] += 2.0 * parameters[0] * rate


@element
def contact_damping(inputs, parameters, own, columns, outputs, jacobian):  # type: ignore[no-untyped-def]
    """Viscous damper parallel to the torsion spring of a drive with play.

    P = -c chi' within +-|tau|: what is not in contact is not damped, and spring and damper together never
    pull what only touches (the limit of Modelica's ``ElastoBacklash``). Parameter: c, N m s/rad.
    """
    rate = inputs[TWIST_RATE]
    tau = inputs[TRANSMITTED_TORQUE]
    torque = parameters[0] * rate
    by_rate, by_tau = parameters[0], 0.0
    if abs(torque) > abs(tau):
        by_rate = 0.0
        by_tau = math.copysign(1.0, torque) * math.copysign(1.0, tau)
        torque = math.copysign(abs(tau), torque)
    outputs[TWIST_TORQUE] -= torque
    outputs[DISSIPATED] += torque * rate
    jacobian[TWIST_TORQUE * columns + TWIST_RATE] -= by_rate
    jacobian[TWIST_TORQUE * columns + TRANSMITTED_TORQUE] -= by_tau
    jacobian[DISSIPATED * columns + TWIST_RATE] += by_rate * rate + torque
    jacobian[DISSIPATED * columns + TRANSMITTED_TORQUE] += by_tau * rate


@element
def mesh_damping(inputs, parameters, own, columns, outputs, jacobian):  # type: ignore[no-untyped-def]
    """Viscous damper parallel to the mesh; parameter: N m s/rad."""
    rate = inputs[MESH_TWIST_RATE]
    outputs[MESH_TORQUE] -= parameters[0] * rate
    outputs[DISSIPATED] += parameters[0] * rate * rate
    jacobian[MESH_TORQUE * columns + MESH_TWIST_RATE] -= parameters[0]
    jacobian[DISSIPATED * columns + MESH_TWIST_RATE] += 2.0 * parameters[0] * rate


def contribute_friction(build: Builder, friction: Friction) -> None:
    """Add the input's friction: T_in = T_out / i (1 + c_L) + T_c + b w while driving."""
    coulomb, viscous = friction.coulomb_nm, friction.viscous_nm_s_per_rad
    smoothing = friction.smoothing_velocity_rad_per_s
    build.element(
        input_friction,
        [coulomb, viscous, friction.load_coefficient / abs(build.ratio), smoothing],
        heat=INPUT_FRICTION_HEAT,
    )
    build.declare_input_friction(InputFriction(coulomb, viscous, smoothing))
