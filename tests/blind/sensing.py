"""What the log of a plant reads: sensors, the log's rate, and what goes wrong with logs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from drives import LOCKED_SIGN_SPEED, SIGN_SPEED, Drive
from motions import CONTROL_RATE, reference
from plant_numbers import Numbers
from plants import simulate

CHANNELS = ("motor_angle", "motor_torque", "output_angle", "output_torque")
DIRT = ("spikes", "gaps", "jitter", "missing stretches", "coarse clock", "saturated")


@dataclass(frozen=True)
class Setup:
    """Everything of an experiment but the plant's hidden effect."""

    drive: Drive
    motion: str
    gravity: bool
    rate: int
    seconds: float
    seed: tuple[int, ...]
    noise: float = 1.0
    channels: tuple[str, ...] = CHANNELS
    dirt: str = ""
    speed: float = 1.0
    lacks: tuple[str, ...] = ()

    @property
    def locked(self) -> bool:
        """Whether the output is locked."""
        return self.motion == "locked"

    @property
    def algebraic_sign(self) -> bool:
        """Whether friction changes sign by another formula than the model's; only where noise hides that."""
        return self.drive.algebraic_sign and not self.locked and self.noise >= 0.6

    @property
    def text(self) -> str:
        """In words."""
        load = "locked" if self.locked else "arm" if self.gravity else "inertia"
        return f"{self.drive.name}, {self.motion}, {load}, {self.rate} Hz, {self.seconds:.0f} s"

    def noises(self) -> dict[str, float]:
        """Standard deviation of each channel's noise, with quantisation; of ``transmission`` the error's."""
        d = self.drive
        motor = np.hypot(2e-5 * self.noise, 2 * np.pi / d.motor_counts / np.sqrt(12))
        output = np.hypot(d.output_noise * self.noise, 2 * np.pi / d.output_counts / np.sqrt(12))
        return {
            "motor_angle": float(motor),
            "motor_torque": d.motor_torque_noise * self.noise,
            "output_angle": float(output),
            "output_torque": d.output_torque_noise * self.noise,
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
    }  # fmt: skip
    nominal |= dict.fromkeys(setup.lacks, 0.0)
    return Numbers(**{name: float(value) for name, value in (nominal | changes).items()})


@lru_cache(maxsize=8)
def _reference(setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    d = setup.drive
    return reference(
        setup.motion, replace(d, top_speed=d.top_speed * setup.speed), setup.seconds, [*setup.seed, 11]
    )


def truth(setup: Setup, p: Numbers, like: np.ndarray | None = None) -> np.ndarray:
    """What is true of an experiment (see ``simulate``); with the motor's motion ``like`` that of another."""
    return simulate(p, *_reference(setup), None if like is None else like[:, [0, 5, 6]])


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
    return {
        "motor_angle": motor, "motor_torque": torque, "output_angle": output, "output_torque": joint,
        "temperature": temperature, "transmission": output - motor / p.ratio,
    }  # fmt: skip


@dataclass
class Log:
    """A measured log and what it would read without noise; both by channel."""

    time: np.ndarray
    channels: dict[str, np.ndarray]
    ideal: dict[str, np.ndarray]
    spoilt: np.ndarray  # samples that dirt has touched


def measure(setup: Setup, p: Numbers) -> Log:
    """Sample, add noise, quantise, and soil the readings of a plant."""
    rng = np.random.default_rng([*setup.seed, 7])
    step = CONTROL_RATE // setup.rate
    ideal = {name: values[::step] for name, values in readings(p, truth(setup, p)).items()}
    n, d, noises = len(ideal["motor_angle"]), setup.drive, setup.noises()
    time = np.arange(n) / setup.rate
    if setup.dirt == "jitter":
        # The samples are taken late or early, the stamps tell when, to a tenth.
        shift = rng.uniform(-0.2, 0.2, n) / setup.rate
        ideal = {name: np.interp(time + shift, time, values) for name, values in ideal.items()}
        time = time + shift * rng.uniform(0.9, 1.1, n)
    clean = {}
    for name in (*setup.channels,):
        clean[name] = ideal[name] + 0.0
    channels = {}
    for name, values in clean.items():
        white = rng.standard_normal(n)
        if name in ("motor_angle", "output_angle"):
            spread = 2e-5 if name == "motor_angle" else d.output_noise
            counts = d.motor_counts if name == "motor_angle" else d.output_counts
            channels[name] = _stepped(values + spread * setup.noise * white, 2 * np.pi / counts)
        else:
            offset = rng.uniform(-1.5, 1.5) * noises[name]
            channels[name] = _stepped(values + offset + noises[name] * white, 0.3 * noises[name])
    time, channels, spoilt, keep = _soiled(setup, rng, time, channels)
    return Log(time - time[0], channels, {c: v[keep] for c, v in clean.items()}, spoilt)


def _soiled(
    setup: Setup, rng: np.random.Generator, time: np.ndarray, channels: dict[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray, np.ndarray]:
    n = len(time)
    spoilt, keep = np.zeros(n, bool), np.ones(n, bool)
    torques = [c for c in ("motor_torque", "output_torque") if c in channels]
    if setup.dirt == "spikes":
        for name in channels:
            where = rng.choice(n, 12, replace=False)
            size = np.ptp(channels[name]) * (1.0 if name in torques else 0.05)
            channels[name][where] += rng.choice([-1.0, 1.0], 12) * rng.uniform(0.7, 1.5, 12) * size
            spoilt[where] = True
    elif setup.dirt == "gaps":
        for _ in range(3):
            start = rng.integers(n // 10, n - n // 10)
            keep[start : start + round(rng.uniform(0.03, 0.25) * setup.rate)] = False
    elif setup.dirt == "missing stretches":
        for name in channels:
            start = rng.integers(n // 10, n - n // 10)
            length = round(rng.uniform(0.02, 0.06 if name.endswith("angle") else 0.3) * setup.rate)
            channels[name][start : start + length] = np.nan
            spoilt[start : start + length] = True
    elif setup.dirt == "coarse clock":
        # The clock ticks every 2.5 samples, so stamps come twice or three times.
        tick = 2.5 / setup.rate
        time = np.floor(time / tick + 1e-9) * tick
    elif setup.dirt == "saturated":
        values = channels["motor_torque"]
        top = np.quantile(np.abs(values), 0.985)
        spoilt |= np.abs(values) >= top
        channels["motor_torque"] = np.clip(values, -top, top)
    return time[keep], {c: v[keep] for c, v in channels.items()}, spoilt[keep], keep


def _stepped(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(values / step) * step
