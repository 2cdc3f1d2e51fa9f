"""Plants with a hidden effect, written apart from hdsim: own equations, own integrator, own sensors.

Coordinates are motor angle and output angle; a cascaded PI controller follows a reference. The effects use
formulas that differ from the catalogue's wherever the literature has another one. Nothing here imports
hdsim. Units are SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

RATIO = -100.0
STEP = 5e-5  # s, of the integrator
RATE = 1000  # Hz, of the log

# Indices of the plant's numbers.
NAMES = [
    "motor_inertia",
    "load_inertia",
    "k1",
    "k2",
    "k3",
    "t1",
    "t2",
    "damping",
    "coulomb",
    "viscous",
    "load_loss",
    "arm",
    "gain",
    "ke_order",
    "ke_amplitude",
    "ke_phase",
    "ke_order2",
    "ke_amplitude2",
    "stribeck_extra",
    "stribeck_speed",
    "lugre_static",
    "lugre_stiffness",
    "lugre_speed",
    "maxwell_torque",
    "maxwell_scale",
    "ripple_order",
    "ripple_torque",
    "ripple_phase",
    "load_coulomb",
    "load_viscous",
    "gap",
    "cubic",
    "wg_once",
    "unbalance",
    "unbalance_phase",
    "encoder_once",
    "encoder_phase",
    "delay",
    "sensor_order",
    "sensor_ripple",
    "cable",
    "spring_kick",
    "thermal_rate",
    "drift",
    "output_locked",
]
AT = {name: k for k, name in enumerate(NAMES)}
(
    MOTOR_INERTIA, LOAD_INERTIA, K1, K2, K3, T1, T2, DAMPING, COULOMB, VISCOUS, LOAD_LOSS, ARM, GAIN,
    KE_ORDER, KE_AMPLITUDE, KE_PHASE, KE_ORDER2, KE_AMPLITUDE2, STRIBECK_EXTRA, STRIBECK_SPEED, LUGRE_STATIC,
    LUGRE_STIFFNESS, LUGRE_SPEED, MAXWELL_TORQUE, MAXWELL_SCALE, RIPPLE_ORDER, RIPPLE_TORQUE, RIPPLE_PHASE,
    LOAD_COULOMB, LOAD_VISCOUS, GAP, CUBIC, WG_ONCE, UNBALANCE, UNBALANCE_PHASE, ENCODER_ONCE, ENCODER_PHASE,
    DELAY, SENSOR_ORDER, SENSOR_RIPPLE, CABLE, SPRING_KICK, THERMAL_RATE, DRIFT, OUTPUT_LOCKED,
) = range(len(NAMES))  # fmt: skip

NOMINAL = {
    "motor_inertia": 6.93e-5, "load_inertia": 0.5, "k1": 1.6e4, "k2": 2.5e4, "k3": 2.9e4, "t1": 7.0,
    "t2": 25.0, "damping": 8.0, "coulomb": 0.03, "viscous": 3.5e-4, "load_loss": 0.06, "arm": 12.0,
    "gain": 1.0,
}  # fmt: skip

SLIDERS = 12


@njit(cache=True)
def spring_torque(d, p):
    """Three straight pieces over torque, secant stiffnesses; a gap takes its width first; a cubic adds."""
    size = abs(d)
    sign = 1.0 if d >= 0 else -1.0
    size = max(0.0, size - 0.5 * p[GAP])
    d1 = p[T1] / p[K1]
    d2 = d1 + (p[T2] - p[T1]) / p[K2]
    if size < d1:
        t = p[K1] * size
    elif size < d2:
        t = p[T1] + p[K2] * (size - d1)
    else:
        t = p[T2] + p[K3] * (size - d2)
    return sign * (t + p[CUBIC] * size**3)


@njit(cache=True)
def rates(t, y, torque, load, p, dy, out):
    """y: motor angle, speed, output angle, speed, bristle, slider forces."""
    m, wm, o, wo, z = y[0], y[1], y[2], y[3], y[4]
    e = p[KE_AMPLITUDE] * math.sin(p[KE_ORDER] * m + p[KE_PHASE])
    de = p[KE_AMPLITUDE] * p[KE_ORDER] * math.cos(p[KE_ORDER] * m + p[KE_PHASE])
    e += p[KE_AMPLITUDE2] * math.sin(p[KE_ORDER2] * (m - o) + 0.7)
    de += p[KE_AMPLITUDE2] * p[KE_ORDER2] * math.cos(p[KE_ORDER2] * (m - o) + 0.7)
    e += p[WG_ONCE] * math.sin(m + 0.4)
    de += p[WG_ONCE] * math.cos(m + 0.4)
    twist = m / RATIO + e - o
    rate = wm * (1.0 / RATIO + de) - wo
    tau = spring_torque(twist, p) + p[DAMPING] * rate
    if p[MAXWELL_TORQUE] > 0:
        for k in range(SLIDERS):
            # Slip limits and slip twists that grow linearly over the elements.
            share = p[MAXWELL_TORQUE] * 2.0 * (k + 1) / (SLIDERS * (SLIDERS + 1))
            reach = p[MAXWELL_SCALE] * (k + 1) / SLIDERS
            force = y[5 + k]
            tau += force
            stiffness = share / reach
            if (force >= share and rate > 0) or (force <= -share and rate < 0):
                dy[5 + k] = 200.0 * (share * (1.0 if force > 0 else -1.0) - force)
            else:
                dy[5 + k] = stiffness * rate
    # Friction at the motor: sign(w) as w / sqrt(w^2 + w0^2).
    sign = wm / math.sqrt(wm * wm + 0.09)
    friction = (p[COULOMB] + p[LOAD_LOSS] * abs(tau / RATIO)) * sign + p[VISCOUS] * wm * (
        1.0 + p[THERMAL_RATE] * math.exp(-t / 4.0)
    )
    if p[STRIBECK_EXTRA] > 0:
        # Hess and Soom's form instead of the Gaussian.
        friction += p[STRIBECK_EXTRA] * sign / (1.0 + (wm / p[STRIBECK_SPEED]) ** 2)
    if p[LUGRE_STATIC] > 0:
        # In place of the Coulomb friction: Canudas de Wit's bristle with exp(-|w/v|).
        friction -= p[COULOMB] * sign
        level = p[COULOMB] + (p[LUGRE_STATIC] - p[COULOMB]) * math.exp(-abs(wm / p[LUGRE_SPEED]))
        dz = wm - p[LUGRE_STIFFNESS] * abs(wm) / level * z
        dy[4] = dz
        friction += p[LUGRE_STIFFNESS] * z
    ripple = p[RIPPLE_TORQUE] * math.sin(p[RIPPLE_ORDER] * m + p[RIPPLE_PHASE])
    # Outside the catalogue: a cable loop that winds up, and a kick from a spring catch.
    cable = p[CABLE] * math.tanh(3.0 * (o - 0.15)) ** 3
    kick = p[SPRING_KICK] * math.exp(-(((o - 0.25) / 0.05) ** 2))
    drift = p[DRIFT] * math.sin(2 * math.pi * t / 5.3) * math.exp(-t / 9.0)
    out_sign = wo / math.sqrt(wo * wo + 1e-5)
    out_friction = p[LOAD_COULOMB] * out_sign + p[LOAD_VISCOUS] * wo
    weight = p[ARM] * math.sin(o) + p[UNBALANCE] * math.cos(o + p[UNBALANCE_PHASE])
    reaction = tau * (1.0 / RATIO + de)
    dy[0] = wm
    dy[1] = (torque + ripple + drift - friction - reaction) / p[MOTOR_INERTIA]
    dy[2] = wo
    dy[3] = (tau - weight - out_friction - cable - kick + load) / p[LOAD_INERTIA]
    if p[OUTPUT_LOCKED] > 0:
        dy[2] = dy[3] = 0.0
    out[0] = tau


@njit(cache=True)
def integrate(reference, speed, p, log):
    """Fourth-order Runge-Kutta; the controller runs at the log's rate and holds its torque."""
    n = len(reference)
    y = np.zeros(5 + SLIDERS)
    a, b, c, d = np.zeros_like(y), np.zeros_like(y), np.zeros_like(y), np.zeros_like(y)
    out = np.zeros(1)
    y[0] = RATIO * reference[0]
    y[1] = RATIO * speed[0]
    y[3] = speed[0]
    y[2] = reference[0]
    integral = 0.0
    steps = round(1.0 / (RATE * STEP))
    for k in range(n):
        wanted = RATIO * speed[k] + 25.0 * (RATIO * reference[k] - y[0])
        error = wanted - y[1]
        integral = min(0.5, max(-0.5, integral + 0.8 * error / RATE))
        torque = min(2.0, max(-2.0, 0.02 * error + integral))
        rates(k / RATE, y, torque, 0.0, p, a, out)
        log[k, 0], log[k, 1], log[k, 2], log[k, 3] = y[0], torque, y[2], out[0]
        for j in range(steps):
            t = k / RATE + j * STEP
            rates(t, y, torque, 0.0, p, a, out)
            rates(t + STEP / 2, y + STEP / 2 * a, torque, 0.0, p, b, out)
            rates(t + STEP / 2, y + STEP / 2 * b, torque, 0.0, p, c, out)
            rates(t + STEP, y + STEP * c, torque, 0.0, p, d, out)
            y = y + STEP / 6 * (a + 2 * b + 2 * c + d)


@dataclass(frozen=True)
class Sensors:
    """What the log reads: counts per turn, noise, clock jitter, spikes."""

    motor_counts: float = 65536.0
    output_counts: float = 2.0**22
    motor_noise: float = 2e-5  # rad
    output_noise: float = 4e-6  # rad
    motor_torque_noise: float = 6e-3  # N m
    output_torque_noise: float = 0.15  # N m
    jitter: float = 0.0  # s
    spikes: int = 0


@dataclass(frozen=True)
class Case:
    """A plant, its sensors and what is true of it."""

    truth: str
    changes: dict[str, float] = field(default_factory=dict)
    sensors: Sensors = field(default_factory=Sensors)
    seconds: float = 12.0
    seed: int = 0
    channels: tuple[str, ...] = ("motor_angle", "motor_torque", "output_angle", "output_torque")


def reference(seconds: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed at the output: a slow and a fast swing, both directions, all speeds."""
    rng = np.random.default_rng([seed, 11])
    t = np.arange(round(seconds * RATE)) / RATE
    f1, f2 = 0.11 * rng.uniform(0.9, 1.1), 0.53 * rng.uniform(0.9, 1.1)
    a1, a2 = 0.9, 0.12
    angle = a1 * np.sin(2 * np.pi * f1 * t) + a2 * (1 - np.cos(2 * np.pi * f2 * t))
    speed = a1 * 2 * np.pi * f1 * np.cos(2 * np.pi * f1 * t) + a2 * 2 * np.pi * f2 * np.sin(
        2 * np.pi * f2 * t
    )
    return angle, speed


def truth(case: Case) -> np.ndarray:
    """Motor angle, motor torque, output angle, output torque without sensors, shape (n, 4)."""
    p = np.zeros(len(NAMES))
    for name, value in (NOMINAL | case.changes).items():
        p[AT[name]] = value
    angle, speed = reference(case.seconds, case.seed)
    log = np.zeros((len(angle), 4))
    integrate(angle, speed, p, log)
    return log


def run(case: Case) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time and the measured channels of a case."""
    log = truth(case)
    changes, s = NOMINAL | case.changes, case.sensors
    rng = np.random.default_rng([case.seed, 7])
    n = len(log)
    time = np.arange(n) / RATE
    motor, torque, output, out_torque = log.T.copy()
    if delay := changes.get("delay", 0.0):
        output = np.interp(time - delay, time, output)
    output = output + changes.get("encoder_once", 0.0) * np.sin(output + changes.get("encoder_phase", 0.0))
    if changes.get("sensor_ripple"):
        out_torque = out_torque + changes["sensor_ripple"] * np.sin(changes["sensor_order"] * motor + 1.1)
    motor = _counted(motor + s.motor_noise * rng.standard_normal(n), s.motor_counts)
    output = _counted(output + s.output_noise * rng.standard_normal(n), s.output_counts)
    torque = changes["gain"] * torque + s.motor_torque_noise * rng.standard_normal(n)
    out_torque = out_torque + s.output_torque_noise * rng.standard_normal(n) + 0.2
    if s.spikes:
        where = rng.choice(n, s.spikes, replace=False)
        torque[where] += rng.choice([-1.0, 1.0], s.spikes) * 1.5
    if s.jitter:
        time = time + s.jitter * rng.uniform(-1, 1, n)
        time[0] = 0.0
    channels = {
        "motor_angle": motor, "motor_torque": torque, "output_angle": output, "output_torque": out_torque,
    }  # fmt: skip
    return time, {name: channels[name] for name in case.channels}


def _counted(angle: np.ndarray, counts: float) -> np.ndarray:
    step = 2 * np.pi / counts
    return np.round(angle / step) * step
