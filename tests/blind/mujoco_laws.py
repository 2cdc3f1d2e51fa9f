"""What a MuJoCo plant is made of, and the laws that MuJoCo lacks, in its callback for passive forces.

Friction that follows the sign's tanh, the stiffer segments of the spring, kinematic error with its reaction
on the motor, hysteresis. Nothing here imports hdsim. Units are SI.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import carray, cfunc, extending, njit, types

#: Speed over which the sign of the base's friction is smoothed, rad/s of the motor.
SIGN_SPEED = 0.5
SLIDERS = 10


class Numbers(NamedTuple):
    """What a plant is made of; angles of errors at the output, friction at the motor shaft."""

    ratio: float = -100.0
    motor_inertia: float = 6.93e-5
    load_inertia: float = 0.5
    k1: float = 1.6e4
    k2: float = 2.5e4
    k3: float = 2.9e4
    t1: float = 7.0
    t2: float = 25.0
    damping: float = 8.0
    coulomb: float = 0.03
    viscous: float = 3.5e-4
    load_loss: float = 0.06
    arm: float = 0.0  # weight times lever, N m
    lever: float = 0.1
    rigid: float = 0.0
    lag: float = 4e-4  # of the current loop, s
    heat_capacity: float = 30.0
    heat_resistance: float = 1.5
    # kinematic error: orders 1, 2, 4 of the motor, 2 of the motor against the output, 1 of the output
    ke_1: float = 0.0
    ke_1_phase: float = 0.0
    ke_2: float = 0.0
    ke_2_phase: float = 0.0
    ke_4: float = 0.0
    ke_4_phase: float = 0.0
    ke_rel: float = 0.0
    ke_rel_phase: float = 0.0
    ke_out: float = 0.0
    ke_out_phase: float = 0.0
    dent: float = 0.0
    dent_at: float = 0.0
    dent_width: float = 0.3
    # friction at the motor
    stribeck: float = 0.0
    stribeck_speed: float = 5.0
    stribeck_power: float = 2.0
    extra_coulomb: float = 0.0
    extra_viscous: float = 0.0
    extra_power: float = 1.0
    driving_loss: float = 0.0
    backdriving_loss: float = 0.0
    thermal: float = 0.0  # 1/K
    thermal_offset: float = 0.0  # degC below zero at which Vogel's law has its pole; 0: an exponential
    bristle: float = 0.0
    bristle_damping: float = 0.0
    bristle_coulomb: float = 0.0
    bristle_static: float = 0.0
    bristle_speed: float = 5.0
    cogging: float = 0.0
    cogging_order: float = 12.0
    cogging_phase: float = 0.0
    cogging_2: float = 0.0
    cogging_2_order: float = 24.0
    cogging_2_phase: float = 0.0
    drag: float = 0.0  # N m s^2/rad^2
    sticky: float = 0.0
    sticky_at: float = 0.0
    sticky_width: float = 0.1
    drift: float = 0.0
    drift_rate: float = 0.2
    rotor_unbalance: float = 0.0  # kg m
    rotor_unbalance_phase: float = 0.0
    # spring
    gap: float = 0.0
    cubic: float = 0.0
    slip: float = 0.0
    slip_twist: float = 5e-4
    slip_spread: float = 0.0  # of the sliders' slip twists; 0: all slip at the same one, by and by (Duhem)
    # output
    output_coulomb: float = 0.0
    output_viscous: float = 0.0
    output_dry: float = 0.0  # dry friction as a constraint
    unbalance: float = 0.0  # kg m
    unbalance_phase: float = 0.0
    cable: float = 0.0
    cable_at: float = 0.0
    cable_width: float = 0.3
    detent: float = 0.0
    detent_at: float = 0.0
    detent_width: float = 0.1
    stop_at: float = 0.0
    stop: float = 0.0  # stiffness of the end stop, N m/rad


#: The numbers, and what the compiled code keeps beside them, as one record that the callback can find.
BOARD = np.dtype(
    [(name, "f8") for name in Numbers._fields]
    + [("angles", "i8"), ("speeds", "i8"), ("forces", "i8"), ("carried", "f8"), ("friction", "f8")]
    + [("twist", "f8"), ("temperature", "f8"), ("sliders", "f8", (SLIDERS,))]
)  # fmt: skip
board = np.zeros(1, BOARD)
_ADDRESS = board.ctypes.data


@extending.intrinsic
def _pointer(_context, _address):
    def generate(context, builder, signature, values):
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return types.voidptr(types.int64), generate


@njit
def error_of(p, m, o):
    """Kinematic error and its derivatives over motor and output angle."""
    turn = 2.0 * (m - o) + p.ke_rel_phase
    e = p.ke_rel * math.sin(turn) + p.ke_out * math.sin(o + p.ke_out_phase)
    by_m = 2.0 * p.ke_rel * math.cos(turn)
    by_o = -by_m + p.ke_out * math.cos(o + p.ke_out_phase)
    e += p.ke_1 * math.sin(m + p.ke_1_phase) + p.ke_2 * math.sin(2 * m + p.ke_2_phase)
    e += p.ke_4 * math.sin(4 * m + p.ke_4_phase)
    by_m += p.ke_1 * math.cos(m + p.ke_1_phase) + 2 * p.ke_2 * math.cos(2 * m + p.ke_2_phase)
    by_m += 4 * p.ke_4 * math.cos(4 * m + p.ke_4_phase)
    if p.dent != 0.0:
        # Both lobes pass a dent of the spline that turns with the output: twice a turn.
        u = (m - o - p.dent_at) % math.pi
        u = u - math.pi if u > 0.5 * math.pi else u
        value = p.dent * math.exp(-0.5 * (u / p.dent_width) ** 2)
        e += value
        by_m -= value * u / p.dent_width**2
        by_o += value * u / p.dent_width**2
    return e, by_m, by_o


@njit
def chain(p, twist):
    """Torque of the three segments, their play taken up first."""
    free = math.copysign(max(abs(twist) - 0.5 * p.gap, 0.0), twist)
    first = p.t1 / p.k1
    second = first + (p.t2 - p.t1) / p.k2
    size = abs(free)
    torque = p.k1 * min(size, first) + p.k2 * max(min(size, second) - first, 0.0)
    return math.copysign(torque + p.k3 * max(size - second, 0.0), free), p.k1 * free


@njit
def slipped(p, k, change):
    """Torque of a slider after a change of the twist."""
    force = p.sliders[k]
    if p.slip_spread == 0.0:
        # z' = (s - z |x'|/x') x'/x_s has this solution between reversals (Dhaouadi's form of Duhem's model).
        if k > 0:
            return 0.0
        end = math.copysign(p.slip, change)
        return end + (force - end) * math.exp(-abs(change) / p.slip_twist)
    most = p.slip / SLIDERS
    at = p.slip_twist * (1.0 + p.slip_spread * (2.0 * (k + 0.5) / SLIDERS - 1.0))
    return min(most, max(-most, force + most / at * change))


@njit
def motor_friction(p, speed, carried, temperature, output):
    """Friction on the motor shaft, positive against positive speed."""
    sign = math.tanh(speed / SIGN_SPEED)
    load = abs(carried / p.ratio)
    viscous = p.viscous
    if p.thermal > 0.0:
        if p.thermal_offset > 0.0:
            # Vogel: ln(eta) = B/(T + theta) + const, with the given slope at 20 degC.
            theta = p.thermal_offset
            slope = p.thermal * (20.0 + theta) ** 2
            viscous *= math.exp(slope * (1.0 / (temperature + theta) - 1.0 / (20.0 + theta)))
        else:
            viscous *= math.exp(-p.thermal * (temperature - 20.0))
    torque = (p.coulomb + p.load_loss * load) * sign + viscous * speed
    if p.stribeck > 0.0:
        torque += p.stribeck * sign * math.exp(-(abs(speed / p.stribeck_speed) ** p.stribeck_power))
    if p.extra_coulomb > 0.0 or p.extra_viscous > 0.0:
        torque += p.extra_coulomb * sign
        torque += p.extra_viscous * math.copysign(abs(speed) ** p.extra_power, speed)
    # The motor drives where its share of the carried torque has the sign of its speed.
    driving = carried / p.ratio * speed >= 0.0
    torque += (p.driving_loss if driving else p.backdriving_loss) * load * sign
    if p.sticky > 0.0:
        torque += p.sticky * sign / (1.0 + ((output - p.sticky_at) / p.sticky_width) ** 4)
    return torque


@cfunc(types.void(types.voidptr, types.voidptr))
def passive(_model, _data):
    p = carray(_pointer(_ADDRESS), 1, BOARD)[0]
    angles = carray(_pointer(p.angles), 2, np.float64)
    speeds = carray(_pointer(p.speeds), 2, np.float64)
    forces = carray(_pointer(p.forces), 2, np.float64)
    m, o, wm, wo = angles[0], angles[1], speeds[0], speeds[1]
    if p.rigid == 0.0:
        error, by_m, by_o = error_of(p, m, o)
        plain = m / p.ratio - o
        rate = wm / p.ratio - wo
        whole, _ = chain(p, plain + error)
        _, given = chain(p, plain)  # by the tendon
        extra = whole - given + p.damping * (by_m * wm + by_o * wo)
        cubic = p.cubic * math.copysign(max(abs(plain) - 0.5 * p.gap, 0.0), plain) ** 3
        if p.slip > 0.0:
            change = plain + error - p.twist
            for k in range(SLIDERS):
                extra += slipped(p, k, change)
        tendon = given + cubic + p.damping * rate
        p.carried = (tendon + extra) * (1.0 - by_o)
        forces[0] -= extra / p.ratio + (tendon + extra) * by_m
        forces[1] += extra - (tendon + extra) * by_o
    p.friction = motor_friction(p, wm, p.carried, p.temperature, o)
    forces[0] -= p.friction
    forces[1] -= p.output_coulomb * math.tanh(wo / 0.005) + p.output_viscous * wo
    forces[1] -= p.cable * math.tanh((o - p.cable_at) / p.cable_width)
    away = (o - p.detent_at) / p.detent_width
    forces[1] -= p.detent * away * math.exp(0.5 - 0.5 * away * away)
