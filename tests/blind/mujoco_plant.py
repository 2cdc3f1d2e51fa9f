"""A harmonic drive in MuJoCo: motor and wave generator, output with its load, a tendon or an equality between them.

MuJoCo integrates (RK4) and has the inertias, gravity on the arm and on unbalanced masses, the first stiffness with
its damping and its play (a fixed tendon of length motor / ratio - output with a spring, a cubic and a dead band), the
rigid transmission (a joint equality), LuGre friction and cogging (``dcmotor``), the lag of the current (a filter), dry
friction at the output and an end stop (constraints), and drag. What MuJoCo lacks is added in its callback for
passive forces: friction that follows the sign's tanh, the stiffer segments, kinematic error with its reaction on the
motor, hysteresis, heat. Nothing here imports hdsim. Units are SI.
"""

from __future__ import annotations

import ctypes
import math
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numba import carray, cfunc, extending, njit, types

STEP_HZ = 5000
STEP = 1.0 / STEP_HZ
#: Inertia that holds a prescribed motion whatever acts on it, kg m^2.
PRESCRIBED_INERTIA = 1e7
GRAVITY = 9.80665
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
    + [("angles", "i8"), ("speeds", "i8"), ("forces", "i8"), ("carried", "f8"), ("friction", "f8"), ("twist", "f8")]
    + [("temperature", "f8"), ("sliders", "f8", (SLIDERS,))]
)  # fmt: skip
_board = np.zeros(1, BOARD)
_ADDRESS = _board.ctypes.data


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
def _passive(_model, _data):
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


_library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco*"))))
_step, _forward = _library.mj_step, _library.mj_forward
for _function in (_step, _forward):
    _function.argtypes, _function.restype = [ctypes.c_void_p, ctypes.c_void_p], None


@njit
def _roll(addresses, board, data, reference, load, motion, gains, every, per, log):
    """Steps of the simulation with the controller; a row of ``log`` every ``every`` steps."""
    p = board[0]
    q, v, control, applied, passive, actuator, constraint, bias, current = data
    integral, torque = gains[4], gains[4]
    for k in range(len(log) * every):
        t = k * STEP
        if len(motion) and k % every == 0:
            q[0], v[0] = motion[k // every, 0], motion[k // every, 1]
        if len(motion) == 0 and k % per == 0:
            place, speed = reference[k // per, 0], reference[k // per, 1]
            slip = speed + gains[2] * (place - q[0]) - v[0]
            integral = min(gains[3], max(-gains[3], integral + gains[1] * slip * per * STEP))
            torque = min(2 * gains[3], max(-2 * gains[3], gains[0] * slip + integral))
            control[0] = torque
        applied[0] = p.drift * math.sin(p.drift_rate * t) * math.cos(0.37 * p.drift_rate * t + 0.5)
        applied[1] = load[min(k, len(load) - 1)]
        if k % every == 0:
            row = log[k // every]
            _forward(addresses[0], addresses[1])
            if p.rigid > 0.0:
                p.carried = -constraint[0] * p.ratio
                _forward(addresses[0], addresses[1])
                p.carried = -constraint[0] * p.ratio
            row[0], row[1], row[2], row[3], row[4] = q[0], v[0], q[1], v[1], p.carried
            # What the current's torque has to balance on a prescribed motion, without the inertia's part.
            row[5] = bias[0] - passive[0] - (actuator[0] - current[0]) - constraint[0] - applied[0]
            row[6], row[7], row[8] = current[0], p.temperature, applied[1]
        if len(motion):
            # The curve's mean acceleration over this step: cubic Hermite between the rows of the log.
            a = k // every
            b = min(a + 1, len(motion) - 1)
            h, s = every * STEP, (k % every + 0.5) / every
            jump = motion[b, 0] - motion[a, 0]
            if b == a:
                jump, bend = 0.0, 0.0
            else:
                bend = (6 - 12 * s) * jump / h**2
                bend += ((6 * s - 4) * motion[a, 1] + (6 * s - 2) * motion[b, 1]) / h
            applied[0] = PRESCRIBED_INERTIA * bend
        applied[1] = 0.5 * (load[min(k, len(load) - 1)] + load[min(k + 1, len(load) - 1)])
        _step(addresses[0], addresses[1])
        if p.slip > 0.0:
            error, _, _ = error_of(p, q[0], q[1])
            twist = q[0] / p.ratio - q[1] + error
            for j in range(SLIDERS):
                p.sliders[j] = slipped(p, j, twist - p.twist)
            p.twist = twist
        if p.rigid > 0.0:
            p.carried = -constraint[0] * p.ratio
        heat = p.friction * v[0] - (p.temperature - 20.0) / p.heat_resistance
        p.temperature += STEP * heat / p.heat_capacity


def document(p: Numbers, *, prescribed: bool = False) -> str:
    """The plant as MJCF."""
    arm = p.arm / GRAVITY / p.lever
    across = p.unbalance * math.sin(p.unbalance_phase), p.unbalance * math.cos(p.unbalance_phase)
    mass = arm + 1.0
    place = (across[0] / mass, -(arm * p.lever + across[1]) / mass)
    own = p.load_inertia - mass * (place[0] ** 2 + place[1] ** 2)
    rotor = p.rotor_unbalance / 0.5
    leaning = rotor * math.sin(p.rotor_unbalance_phase), rotor * math.cos(p.rotor_unbalance_phase)
    rest = p.motor_inertia - 0.5 * rotor**2
    if min(own, rest) <= 0:
        raise FloatingPointError("the masses have more inertia than their bodies")
    armature = f'armature="{PRESCRIBED_INERTIA!r}"' if prescribed else ""
    limit = ""
    if p.stop > 0:
        rate = math.sqrt(p.stop / p.load_inertia)
        limit = f'limited="true" range="-1000 {p.stop_at!r}" solreflimit="{-(rate**2)!r} {-rate!r}"'
        limit += ' solimplimit="0.5 0.5 0.1"'
    if p.rigid:
        coupling = (
            f'<equality><joint joint1="output" joint2="motor" polycoef="0 {1 / p.ratio!r} 0 0 0" '
            f'solref="{3 * STEP!r} 1" solimp="0.9999 0.9999 0.001"/></equality>'
        )
    else:
        half = 0.5 * p.gap
        coupling = (
            f'<tendon><fixed stiffness="{p.k1!r} 0 {p.cubic!r}" damping="{p.damping!r}" '
            f'springlength="{-half!r} {half!r}"><joint joint="motor" coef="{1 / p.ratio!r}"/>'
            '<joint joint="output" coef="-1"/></fixed></tendon>'
        )
    motors = [f'<general joint="motor" dyntype="filterexact" dynprm="{p.lag!r}" gainprm="1"/>']
    passive = '<dcmotor joint="motor" input="none" motorconst="0 0" resistance="1" {}/>'
    for size, order, phase in (
        (p.cogging, p.cogging_order, p.cogging_phase),
        (p.cogging_2, p.cogging_2_order, p.cogging_2_phase),
    ):
        if size:
            motors.append(passive.format(f'cogging="{size!r} {order!r} {phase!r}"'))
    if p.bristle:
        bristles = (p.bristle, p.bristle_damping, p.bristle_coulomb, p.bristle_static, p.bristle_speed)
        motors.append(passive.format('lugre="' + " ".join(repr(v) for v in bristles) + '"'))
    return f'''<mujoco><compiler angle="radian"/>
    <option timestep="{STEP!r}" integrator="RK4" gravity="0 0 {-GRAVITY}"><flag contact="disable"/></option>
    <worldbody>
      <body><joint name="motor" type="hinge" axis="0 1 0" damping="0 {p.drag!r}" {armature}/>
        <inertial pos="{leaning[0]!r} 0 {-leaning[1]!r}" mass="0.5" diaginertia="{rest!r} {rest!r} {rest!r}"/></body>
      <body><joint name="output" type="hinge" axis="0 1 0" frictionloss="{p.output_dry!r}" {limit}/>
        <inertial pos="{place[0]!r} 0 {place[1]!r}" mass="{mass!r}" diaginertia="{own!r} {own!r} {own!r}"/></body>
    </worldbody>
    {coupling}<actuator>{"".join(motors)}</actuator></mujoco>'''


class Motion(NamedTuple):
    """What a plant is told: the motor's reference over the controller's ticks, the external torque over the steps."""

    reference: np.ndarray  # (ticks, 2): angle and speed of the output
    load: np.ndarray  # (steps,): torque on the output, N m
    ticks_every: int  # steps
    rows_every: int  # steps between two rows of the log


def simulate(p: Numbers, motion: Motion, like: np.ndarray | None = None, *, free: float | None = None) -> np.ndarray:
    """What is true of an experiment, before sensors.

    Args:
        p: the plant.
        motion: what it is told.
        like: a log whose motor motion is prescribed.
        free: no controller; the twist (rad) from which the drive is let go.

    Returns:
        Shape (rows, 8): motor angle and speed, output angle and speed, torque of the drive on the output, of the
        motor, temperature, external torque.
    """
    model = mujoco.MjModel.from_xml_string(document(p, prescribed=like is not None))
    data = mujoco.MjData(model)
    board = _board
    board[0] = np.zeros((), BOARD)
    for name, value in zip(Numbers._fields, p, strict=True):
        board[name] = value
    board["angles"], board["speeds"] = data.qpos.ctypes.data, data.qvel.ctypes.data
    board["forces"], board["temperature"] = data.qfrc_passive.ctypes.data, 20.0
    rows = len(motion.load) // motion.rows_every
    log = np.zeros((rows, 9))
    reference = motion.reference * p.ratio
    start = float(motion.reference[0, 0])
    data.qpos[:] = (p.ratio * start, start) if like is None else like[0, [0, 2]]
    data.qvel[:] = (0.0, 0.0) if like is None else like[0, [1, 3]]
    # At rest where the log begins: the drive is wound up by what hangs on it.
    hanging = p.arm * math.sin(start) - float(motion.load[0])
    if not p.rigid and like is None:
        data.qpos[1] -= math.copysign(wind_up(p, abs(hanging)), hanging) - error_at(p, p.ratio * start, start)
    if free is not None:
        data.qpos[1] -= free
    board["carried"] = hanging
    board["twist"] = data.qpos[0] / p.ratio - data.qpos[1] + error_at(p, data.qpos[0], data.qpos[1])
    inertia = p.motor_inertia + p.load_inertia / p.ratio**2
    rate = 0.0 if free is not None else 0.8 * math.sqrt(p.k1 / p.load_inertia)
    rate = min(rate, 0.15 / (motion.ticks_every * STEP))
    gains = np.array([rate * inertia, 0.2 * rate**2 * inertia, 0.15 * rate, 2 * p.t2 / abs(p.ratio), 0.0])
    gains[4] = hanging / p.ratio if free is None else 0.0
    data.act[0] = gains[4] if like is None else 0.0
    arrays = (
        data.qpos, data.qvel, data.ctrl, data.qfrc_applied, data.qfrc_passive, data.qfrc_actuator,
        data.qfrc_constraint, data.qfrc_bias, data.actuator_force,
    )  # fmt: skip
    prescribed = np.zeros((0, 2)) if like is None else np.ascontiguousarray(like[:, :2])
    mujoco.set_mjcb_passive(_passive.ctypes)
    try:
        where = np.array([model._address, data._address])
        _roll(where, board, arrays, reference, motion.load, prescribed, gains, motion.rows_every,
              motion.ticks_every, log)  # fmt: skip
    finally:
        mujoco.set_mjcb_passive(None)
    if not np.all(np.isfinite(log)):
        raise FloatingPointError("the plant has run away")
    torque = log[:, 6]
    if like is not None:
        torque = log[:, 5] + p.motor_inertia * acceleration(like, motion.rows_every * STEP)
    return np.column_stack([log[:, :5], torque, log[:, 7:9]])


def acceleration(log: np.ndarray, period: float) -> np.ndarray:
    """Motor acceleration of a log, shape (rows,): mean of the cubic pieces on both sides of a row."""
    m, w = log[:, 0], log[:, 1]
    jump = np.diff(m)
    left = 6 * jump / period**2 - (4 * w[:-1] + 2 * w[1:]) / period
    right = -6 * jump / period**2 + (2 * w[:-1] + 4 * w[1:]) / period
    return 0.5 * (np.append(left, right[-1]) + np.append(left[0], right))


def wind_up(p: Numbers, torque: float) -> float:
    """Twist of the chain at a torque that is not negative, rad at the output."""
    low = min(torque, p.t1) / p.k1 + max(min(torque, p.t2) - p.t1, 0.0) / p.k2
    return low + max(torque - p.t2, 0.0) / p.k3 + 0.5 * p.gap * (torque > 0)


def error_at(p: Numbers, m: float, o: float) -> float:
    """Kinematic error of a plant, rad."""
    board = np.zeros(1, BOARD)
    for name, value in zip(Numbers._fields, p, strict=True):
        board[name] = value
    return float(_error(board, m, o))


@njit
def _error(board, m, o):
    return error_of(board[0], m, o)[0]
