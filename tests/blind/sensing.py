"""What the log of a plant reads: sensors, the log's rate, quantisation, a clock that jitters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from contract import Measured
from drives import LOCKED_SIGN_SPEED, SIGN_SPEED, Drive
from motions import CONTROL_RATE, reference
from plant_numbers import Numbers
from plants import known_loads, simulate
from scipy.interpolate import CubicSpline

#: Channels of each set of sensors. ``temperature`` may come on top.
SENSORS = {
    "motor": ("motor_angle", "motor_torque"),
    "both": ("motor_angle", "motor_torque", "output_angle"),
    "torque sensor": ("motor_angle", "motor_torque", "output_angle", "output_torque"),
    "known load": ("motor_angle", "motor_torque", "output_angle", "load_torque"),
}
#: Parts of a sampling period by which jittering samples are late or early, at most.
JITTER = 0.2


@dataclass(frozen=True)
class Setup:
    """Everything of one record but the plant's hidden effect.

    Attributes:
        drive: the nominal numbers, which are the base's.
        motion: kind of motion, see ``motions.KINDS``.
        gravity: whether the load is an arm.
        rate: of the log, Hz; the plant's clock is a whole multiple of it.
        seconds: length of the record.
        seed: of motion and noise.
        sensors: a key of ``SENSORS``.
        temperature: whether that of the housing is measured.
        noise: factor on the drive's angle noise; ``torque_noise`` on that of its torques.
        step: of both encoders, over the standard deviation of the white noise before it.
        torque_step: of the torques' converters, over that of theirs.
        jitter: error of the stamps of samples that come late or early, as a share of by how much; 0: the
            clock is even.
        speed: factor on the motion's speed (on the twist, where the output is locked).
        lacks: numbers of friction that neither base nor plant has.
        algebraic_sign: friction changes sign by another formula than the model's.
    """

    drive: Drive
    motion: str
    gravity: bool
    rate: float
    seconds: float
    seed: tuple[int, ...]
    sensors: str = "torque sensor"
    temperature: bool = False
    noise: float = 1.0
    torque_noise: float = 1.0
    step: float = 0.3
    torque_step: float = 0.3
    jitter: float = 0.0
    speed: float = 1.0
    lacks: tuple[str, ...] = ()
    algebraic_sign: bool = False

    @property
    def locked(self) -> bool:
        """Whether the output is locked."""
        return self.motion == "locked"

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the log."""
        return (*SENSORS[self.sensors], *(["temperature"] if self.temperature else []))

    def noises(self) -> dict[str, float]:
        """Standard deviation of each channel's noise, with quantisation; of ``transmission`` the error's."""
        d = self.drive
        motor, output = d.motor_noise * self.noise, d.output_noise * self.noise
        joint = d.output_torque_noise * self.torque_noise
        return {
            "motor_angle": motor,
            "motor_torque": d.motor_torque_noise * self.torque_noise,
            "output_angle": output,
            "output_torque": joint,
            "load_torque": 0.1 * joint,  # what a bench puts on is known better than what a joint carries
            "transmission": float(np.hypot(output, motor / d.ratio)),
            "temperature": 0.05,
        }

    def compared(self) -> list[str]:
        """Channels in which a model can be seen to be wrong."""
        found = [c for c in ("motor_torque", "output_torque") if c in self.channels]
        if {"motor_angle", "output_angle"} <= set(self.channels) and not self.locked:
            found.append("transmission")
        return found


def numbers(setup: Setup, changes: dict[str, float]) -> Numbers:
    """The plant of an experiment with changes of its nominal numbers."""
    d = setup.drive
    nominal = {
        "ratio": d.ratio, "motor_inertia": d.motor_inertia, "load_inertia": d.load_inertia,
        "k1": d.stiffness[0], "k2": d.stiffness[1], "k3": d.stiffness[2],
        "t1": d.torques[0], "t2": d.torques[1],
        "damping": d.damping, "coulomb": d.coulomb, "viscous": d.viscous, "load_loss": d.load_loss,
        "arm": d.arm if setup.gravity and not setup.locked else 0.0,
        "sign_speed": LOCKED_SIGN_SPEED if setup.locked else SIGN_SPEED,
        "algebraic_sign": float(setup.algebraic_sign), "locked": float(setup.locked),
        # Friction at top speed warms it by about three kelvins in ten seconds.
        "heat_capacity": 3.0 * (d.coulomb + d.viscous * d.top_speed) * d.top_speed,
    }  # fmt: skip
    if setup.sensors == "known load":
        rng = np.random.default_rng([*setup.seed, 13])
        size = d.torques[0] * rng.uniform(0.5, 1.5, 2)
        nominal |= {"known_a": size[0], "known_a_hz": rng.uniform(0.15, 0.5), "known_b": 0.5 * size[1],
                    "known_b_hz": rng.uniform(0.6, 2.0), "known_phase": rng.uniform(0, 6.283)}  # fmt: skip
    nominal |= dict.fromkeys(setup.lacks, 0.0)
    return Numbers(**{name: float(value) for name, value in (nominal | changes).items()})


@lru_cache(maxsize=8)
def _reference(setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    d = setup.drive
    # The log has to follow the motion: slow logs are taken of softer motions.
    softest = 8.0 / setup.rate
    if setup.locked:
        return reference(setup.motion, d, setup.seconds, [*setup.seed, 11], setup.speed, softest)
    fast = replace(d, top_speed=d.top_speed * setup.speed)
    return reference(setup.motion, fast, setup.seconds, [*setup.seed, 11], 1.0, softest)


def truth(
    setup: Setup, p: Numbers, like: np.ndarray | None = None, seconds: float | None = None
) -> np.ndarray:
    """What is true of an experiment (see ``simulate``).

    Args:
        setup: the experiment.
        p: the plant.
        like: takes the motor's motion from this log instead of from the controller.
        seconds: only the first of it.
    """
    angle, speed = _reference(setup)
    n = len(angle) if seconds is None else min(len(angle), round(seconds * CONTROL_RATE))
    n = n if like is None else min(n, len(like))
    return simulate(p, angle[:n], speed[:n], None if like is None else like[:n, [0, 5, 6]])


def readings(p: Numbers, log: np.ndarray) -> dict[str, np.ndarray]:
    """What ideal sensors with the plant's own sensor errors read, without noise, at the controller's rate."""
    motor, torque, output, joint, temperature = log[:, :5].T.copy()
    time = np.arange(len(motor)) / CONTROL_RATE
    if p.delay:
        output = np.interp(time - p.delay, time, output)
    output = output + p.encoder_once * np.sin(output + p.encoder_phase)
    wave = np.sin(p.sensor_order * motor + p.sensor_phase) * (1.0 + p.sensor_load * joint / p.t2)
    joint = joint + p.sensor_ripple * (wave + p.sensor_second * np.sin(2 * p.sensor_order * motor + 0.6))
    # Current times the nominal torque constant: a saturating motor needs more current for its torque.
    torque = p.gain * torque * (1.0 + p.saturation * np.abs(torque) * abs(p.ratio) / p.t2)
    load = known_loads(time, p) if p.known_a else np.zeros_like(time)
    return {
        "motor_angle": motor, "motor_torque": torque, "output_angle": output, "output_torque": joint,
        "load_torque": load, "temperature": temperature, "transmission": output - motor / p.ratio,
    }  # fmt: skip


def sampled(setup: Setup, log: np.ndarray) -> np.ndarray:
    """The motor's motion as the log's samples tell it, a cubic: shape (n, 7), see ``simulate``."""
    step = round(CONTROL_RATE / setup.rate)
    ticks = np.arange(len(log))
    spline = CubicSpline(ticks[::step] / CONTROL_RATE, log[::step, 0])
    found = np.zeros_like(log)
    for column, order in ((0, 0), (5, 1), (6, 2)):
        found[:, column] = spline(ticks / CONTROL_RATE, order)
    # Beyond the last sample nothing is known.
    return found[: step * ((len(log) - 1) // step)]


def measure(setup: Setup, p: Numbers, name: str) -> Measured:
    """Sample the readings of a plant, add noise, quantise."""
    rng = np.random.default_rng([*setup.seed, 7])
    step = round(CONTROL_RATE / setup.rate)
    whole = readings(p, truth(setup, p))
    ideal = {channel: whole[channel][::step] for channel in setup.channels}
    n, noises = len(ideal["motor_angle"]), setup.noises()
    time = np.arange(n) / setup.rate
    if setup.jitter:
        # The samples are taken late or early; the stamps tell when, but for a share.
        shift = rng.uniform(-JITTER, JITTER, n) / setup.rate
        clock = np.arange(len(whole["motor_angle"])) / CONTROL_RATE
        ideal = {channel: np.interp(time + shift, clock, whole[channel]) for channel in ideal}
        time = time + shift * (1.0 + setup.jitter * rng.uniform(-1.0, 1.0, n))
    channels = {}
    for channel, values in ideal.items():
        steps = setup.step if channel.endswith("angle") else setup.torque_step
        # White noise and rounding together are the channel's noise.
        white = noises[channel] / np.hypot(1.0, steps / np.sqrt(12))
        offset = 0.0 if channel.endswith("angle") else rng.uniform(-1.5, 1.5) * noises[channel]
        if channel == "temperature":
            white, offset, steps = 0.05, 0.0, 2.0
        if channel == "load_torque":
            offset = 0.0
        noisy = values + offset + white * rng.standard_normal(n)
        channels[channel] = np.round(noisy / (steps * white)) * (steps * white)
    return Measured(name, time - time[0], channels, {c: v.copy() for c, v in ideal.items()})
