"""A harmonic drive in MuJoCo: motor with wave generator, output with load, a tendon or an equality between.

MuJoCo integrates (RK4) and has the inertias, gravity on the arm and on unbalanced masses, the first
stiffness with its damping and its play (a fixed tendon of length motor / ratio - output with a spring, a
cubic and a dead band), the rigid transmission (a joint equality), LuGre friction and cogging (``dcmotor``),
the lag of the current (a filter), dry friction at the output and an end stop (constraints), and drag. The
rest is in ``mujoco_laws``. Nothing here imports hdsim. Units are SI.
"""

from __future__ import annotations

import ctypes
import math
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco_laws import BOARD, SLIDERS, Numbers, board, error_of, passive, slipped
from numba import njit

STEP_HZ = 5000
STEP = 1.0 / STEP_HZ
#: Inertia that holds a prescribed motion whatever acts on it, kg m^2.
PRESCRIBED_INERTIA = 1e7
GRAVITY = 9.80665

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
    # What makes the unbalance is heavy and near the axis, so that it hardly has inertia of its own.
    mass = arm + 1.0 + 50.0 * p.unbalance**2 / p.load_inertia
    place = (across[0] / mass, -(arm * p.lever + across[1]) / mass)
    own = p.load_inertia - mass * (place[0] ** 2 + place[1] ** 2)
    weight = 0.5 + 50.0 * p.rotor_unbalance**2 / p.motor_inertia
    rotor = p.rotor_unbalance / weight
    leaning = rotor * math.sin(p.rotor_unbalance_phase), rotor * math.cos(p.rotor_unbalance_phase)
    rest = p.motor_inertia - weight * rotor**2
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
    device = '<dcmotor joint="motor" input="none" motorconst="0 0" resistance="1" {}/>'
    for size, order, phase in (
        (p.cogging, p.cogging_order, p.cogging_phase),
        (p.cogging_2, p.cogging_2_order, p.cogging_2_phase),
    ):
        if size:
            motors.append(device.format(f'cogging="{size!r} {order!r} {phase!r}"'))
    if p.bristle:
        bristles = (p.bristle, p.bristle_damping, p.bristle_coulomb, p.bristle_static, p.bristle_speed)
        motors.append(device.format('lugre="' + " ".join(repr(v) for v in bristles) + '"'))
    return f'''<mujoco><compiler angle="radian"/>
    <option timestep="{STEP!r}" integrator="RK4" gravity="0 0 {-GRAVITY}"><flag contact="disable"/></option>
    <worldbody>
      <body><joint name="motor" type="hinge" axis="0 1 0" damping="0 {p.drag!r}" {armature}/>
        <inertial pos="{leaning[0]!r} 0 {-leaning[1]!r}" mass="{weight!r}"
          diaginertia="{rest!r} {rest!r} {rest!r}"/></body>
      <body><joint name="output" type="hinge" axis="0 1 0" frictionloss="{p.output_dry!r}" {limit}/>
        <inertial pos="{place[0]!r} 0 {place[1]!r}" mass="{mass!r}"
          diaginertia="{own!r} {own!r} {own!r}"/></body>
    </worldbody>
    {coupling}<actuator>{"".join(motors)}</actuator></mujoco>'''


class Motion(NamedTuple):
    """What a plant is told: a reference over the controller's ticks, an external torque over the steps."""

    reference: np.ndarray  # (ticks, 2): angle and speed of the output
    load: np.ndarray  # (steps,): torque on the output, N m
    ticks_every: int  # steps
    rows_every: int  # steps between two rows of the log


def simulate(
    p: Numbers, motion: Motion, like: np.ndarray | None = None, *, free: float | None = None
) -> np.ndarray:
    """What is true of an experiment, before sensors.

    Args:
        p: the plant.
        motion: what it is told.
        like: a log whose motor motion is prescribed.
        free: no controller; the twist (rad) from which the drive is let go.

    Returns:
        Shape (rows, 8): motor angle and speed, output angle and speed, torque of the drive on the output,
        torque of the motor, temperature, external torque.
    """
    model = mujoco.MjModel.from_xml_string(document(p, prescribed=like is not None))
    data = mujoco.MjData(model)
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
    speed = float(motion.reference[0, 1])
    data.qvel[:] = (p.ratio * speed, speed) if like is None else like[0, [1, 3]]
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
    mujoco.set_mjcb_passive(passive.ctypes)
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
    if p.rigid:
        # MuJoCo's equality gives way by a few 1e-7 rad, which is no part of a rigid drive.
        log[:, 2:4] = log[:, :2] / p.ratio
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
    own = np.zeros(1, BOARD)
    for name, value in zip(Numbers._fields, p, strict=True):
        own[name] = value
    return float(_error(own, m, o))


@njit
def _error(board, m, o):
    return error_of(board[0], m, o)[0]
