"""What the families of blind plants draw alike: experiments, motions, sensors, and how visible a trace is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from contract import Measured

GRAVITY = 9.80665
#: Rates of the log, Hz; the plants' clocks are multiples of all of them.
RATES = (100, 125, 200, 250, 500, 1000, 2500, 5000)
MOTIONS = ("multisine", "moves", "sweep", "plateaus", "creep")
#: Channels of the sets of sensors.
SENSORS = {
    "motor": ("motor_angle", "motor_torque"),
    "both": ("motor_angle", "motor_torque", "output_angle"),
    "torque sensor": ("motor_angle", "motor_torque", "output_angle", "output_torque"),
    "known load": ("motor_angle", "motor_torque", "output_angle", "load_torque"),
}
COMPARED = ("motor_torque", "output_angle", "output_torque")
#: Samples of all records of a case together, for the sake of the time that a diagnosis takes.
MOST_SAMPLES = 90_000
#: Start of a record that doesn't count for a strength, s.
SKIP_S = 0.1


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


@dataclass(frozen=True)
class Drive:
    """Nominal numbers of a drive with its load; friction and motor inertia at the motor shaft, SI units."""

    size: int
    ratio: float
    stiffness: tuple[float, float, float]
    torques: tuple[float, float]
    motor_inertia: float
    load_inertia: float
    damping: float
    coulomb: float
    viscous: float
    load_loss: float
    arm: float  # N m, weight times lever; 0: none
    lever: float
    top_speed: float  # of the motor, rad/s
    rigid: bool = False

    @property
    def base(self) -> dict[str, float]:
        """The numbers that the base has, by the names that plants use."""
        k1, k2, k3 = self.stiffness
        return {
            "ratio": self.ratio, "motor_inertia": self.motor_inertia, "load_inertia": self.load_inertia,
            "k1": k1, "k2": k2, "k3": k3, "t1": self.torques[0], "t2": self.torques[1], "damping": self.damping,
            "coulomb": self.coulomb, "viscous": self.viscous, "load_loss": self.load_loss, "arm": self.arm,
            "lever": self.lever, "rigid": float(self.rigid),
        }  # fmt: skip


#: Paths in a scenario of the numbers that a base can have wrong, and the plant's names of each.
PARAMETERS = {
    "load inertia": (("load_inertia",), "load.inertia_kg_m2"),
    "motor inertia": (("motor_inertia",), "drive.inertia.motor_kg_m2"),
    "stiffness": (("k1", "k2", "k3"), "drive.torsion.stiffness_k1_nm_per_rad"),
    "Coulomb friction": (("coulomb",), "drive.friction.coulomb_nm"),
    "viscous friction": (("viscous",), "drive.friction.viscous_nm_s_per_rad"),
    "load-dependent loss": (("load_loss",), "drive.friction.load_coefficient"),
    "mass": (("arm",), "load.gravity.mass_kg"),
    "torque constant": (("gain",), "motor_torque_gain"),
}
#: Part of the motor's inertia that the base gives to the wave generator.
GENERATOR_SHARE = 0.25


def draw_drive(rng: np.random.Generator, *, arm: bool, rigid: bool = False) -> Drive:
    """A drive of sizes 14 to 50 and ratios 50 to 160, both signs; numbers scale as the catalogues' do.

    Stiffness and torques grow with the cube of the size, inertias with its fourth power, from size 20, ratio 100.
    """
    size = int(rng.choice([14, 17, 20, 25, 32, 40, 45, 50]))
    scale, ratio = size / 20.0, int(rng.choice([50, 60, 80, 100, 120, 130, 160]))
    stiffness = 1.6e4 * scale**3 * rng.uniform(0.8, 1.2) * (0.81 if ratio < 80 else 1.0)
    second, third = rng.uniform(1.2, 1.6), rng.uniform(1.65, 1.85)
    torques = 7.0 * scale**3, 25.0 * scale**3
    motor = 6.9e-5 * scale**4 * rng.uniform(0.7, 1.4)
    load = motor * ratio**2 * rng.uniform(0.4, 1.5)
    reduced = 1.0 / (1.0 / (motor * ratio**2) + 1.0 / load)
    weight = torques[1] * rng.uniform(0.25, 0.6) if arm else 0.0
    # Of the load's inertia at most half belongs to the mass on the lever.
    lever = min(0.3, 0.5 * load * GRAVITY / weight) if arm else 0.1
    return Drive(
        size, float(ratio * rng.choice([-1, 1])), (stiffness, second * stiffness, third * stiffness), torques,
        motor, load, 2 * rng.uniform(0.03, 0.08) * float(np.sqrt(stiffness * reduced)),
        0.03 * scale**2.3 * rng.uniform(0.6, 1.5), 3.5e-4 * scale**2.7 * rng.uniform(0.6, 1.5),
        rng.uniform(0.04, 0.1), weight, lever, rng.uniform(55.0, 110.0), rigid,
    )  # fmt: skip


def base_yaml(drive: Drive, *, mesh: str = "lumped", lacks: Sequence[str] = ()) -> str:
    """The model that the diagnosis is given.

    Args:
        drive: the nominal numbers.
        mesh: its model.
        lacks: numbers of the friction that the model hasn't, by the plant's names.
    """
    k1, k2, k3 = drive.stiffness
    forward = drive.ratio > 0
    teeth = round(2 * abs(drive.ratio)) - (2 if forward else 0)
    friction = {
        "coulomb_nm": 0.0 if "coulomb" in lacks else drive.coulomb,
        "viscous_nm_s_per_rad": 0.0 if "viscous" in lacks else drive.viscous,
        "load_coefficient": 0.0 if "load_loss" in lacks else drive.load_loss,
    }
    motor, generator = (1 - GENERATOR_SHARE) * drive.motor_inertia, GENERATOR_SHARE * drive.motor_inertia
    lines = [
        "name: blind bench",
        "description: The model that a blind plant is held against.",
        "drive:",
        f"  rated_torque_nm: {2 * drive.torques[1]:.10g}",
        f"  arrangement: {'flexspline_fixed' if forward else 'circular_spline_fixed'}",
        f"  geometry: {{flexspline_teeth: {teeth}, circular_spline_teeth: {teeth + 2}}}",
        f"  torsion: {{stiffness_k1_nm_per_rad: {k1:.10g}, stiffness_k2_nm_per_rad: {k2:.10g},",
        f"            stiffness_k3_nm_per_rad: {k3:.10g}, torque_t1_nm: {drive.torques[0]:.10g},",
        f"            torque_t2_nm: {drive.torques[1]:.10g}, damping_nm_s_per_rad: {drive.damping:.10g}}}",
        f"  inertia: {{motor_kg_m2: {motor:.10g}, wave_generator_kg_m2: {generator:.10g}}}",
        f"  friction: {{{', '.join(f'{name}: {value:.10g}' for name, value in friction.items())}}}",
        f"  mesh: {{model: {mesh}}}",
        "command: {motor: {type: free}}",
        "load:",
        f"  inertia_kg_m2: {drive.load_inertia:.10g}",
    ]
    if drive.arm:
        mass = drive.arm / (GRAVITY * drive.lever)
        lines.append(f"  gravity: {{mass_kg: {mass:.12g}, centre_of_mass_m: {drive.lever:.12g}}}")
    return "\n".join([*lines, "run: {duration_s: 1.0}", ""])


@dataclass(frozen=True)
class Sensing:
    """Sensors of a log: white noise and the step of each channel in its unit, the log's rate."""

    kind: str
    rate: int
    noise: dict[str, float]
    step: dict[str, float]
    temperature: bool

    @property
    def channels(self) -> tuple[str, ...]:
        """What the log has."""
        return (*SENSORS[self.kind], *(("temperature",) if self.temperature else ()))

    @property
    def compared(self) -> tuple[str, ...]:
        """Channels in which a model can be seen to be wrong."""
        return tuple(c for c in COMPARED if c in self.channels)

    def sigma(self, channel: str) -> float:
        """Standard deviation of a channel's error, quantisation included."""
        return float(np.hypot(self.noise[channel], self.step[channel] / np.sqrt(12)))

    def measure(self, name: str, ideal: Mapping[str, np.ndarray], rng: np.random.Generator) -> Measured:
        """A record of what ideal sensors would read at the log's rate."""
        n = len(ideal["motor_angle"])
        channels = {}
        for channel in self.channels:
            values = ideal[channel] + self.noise[channel] * rng.standard_normal(n)
            if channel.endswith("torque"):
                values = values + rng.uniform(-1.5, 1.5) * self.noise[channel]
            step = self.step[channel]
            channels[channel] = np.round(values / step) * step
        return Measured(name, np.arange(n) / self.rate, channels, {c: ideal[c] for c in self.channels})


def draw_sensing(
    rng: np.random.Generator, drive: Drive, kinds: Sequence[str] = tuple(SENSORS), *, fast: bool = False
) -> Sensing:
    """Sensors for a drive: rates from 100 to 5000 Hz, steps of the encoders 0.05 to 10 times their noise."""
    rate = int(rng.choice(RATES[4:] if fast else RATES, p=None if fast else (0.1, 0.08, 0.12, 0.14, 0.2, 0.2, 0.1, 0.06)))
    noise = {
        "motor_angle": log_uniform(rng, 5e-6, 6e-5),
        "output_angle": log_uniform(rng, 1e-6, 1.2e-5),
        "motor_torque": drive.coulomb * log_uniform(rng, 0.06, 0.3),
        "output_torque": drive.torques[0] * log_uniform(rng, 0.006, 0.03),
        "temperature": 0.05,
    }
    noise["load_torque"] = drive.torques[0] * log_uniform(rng, 0.003, 0.015)
    coarse = log_uniform(rng, 0.05, 10.0)
    step = {c: 0.3 * value for c, value in noise.items()}
    step |= {"motor_angle": coarse * noise["motor_angle"], "output_angle": coarse * noise["output_angle"]}
    return Sensing(str(rng.choice(list(kinds))), rate, noise, step, bool(rng.random() < 0.35))


def slower(drive: Drive, rate: int) -> Drive:
    """The drive with a top speed whose fourth order has four samples a period at least in a log of that rate."""
    return replace(drive, top_speed=min(drive.top_speed, 2 * np.pi * rate / 16.0))


def draw_lengths(rng: np.random.Generator, rate: int, *, least: float = 5.0) -> tuple[list[float], list[float], str]:
    """Lengths of the records and of those held out, s, and how data are held out."""
    most = MOST_SAMPLES / rate

    def one(high: float) -> float:
        seconds = log_uniform(rng, least, max(high, 1.2 * least))
        if seconds > 30.0 and rng.random() < 0.6:
            seconds = log_uniform(rng, least, max(min(high, 30.0), 1.2 * least))
        return round(seconds, 1)

    files = bool(rng.random() < 0.6)
    count = int(rng.choice([1, 2, 3, 4], p=[0.45, 0.3, 0.15, 0.1]))
    given = [one(min(60.0 if count == 1 else 20.0, most / count)) for _ in range(count)]
    held = [one(min(15.0, most / 3)) for _ in range(int(rng.integers(1, 3)))] if files else []
    return given, held, "files" if files else "stretches"


def motion(
    kind: str, seconds: float, top: float, rng: np.random.Generator, *, tick_hz: int, smooth_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed of the output at a controller's ticks, shape (n,) each; it starts at rest at angle 0.

    Args:
        kind: of ``MOTIONS``.
        seconds: length.
        top: speed that is not exceeded, rad/s at the output.
        rng: random numbers.
        tick_hz: rate of the ticks.
        smooth_s: three moving means of this width take the corners off.
    """
    t = np.arange(round(seconds * tick_hz)) / tick_hz
    pace = 0.1 / smooth_s  # slower where the smoothing is wide
    if kind == "multisine":
        lines = zip(np.exp(rng.uniform(np.log(0.06), np.log(1.0 * pace), 4)), rng.uniform(0, 2 * np.pi, 4),
                    rng.uniform(0.3, 1.0, 4), strict=True)  # fmt: skip
        speed = sum(size * np.sin(2 * np.pi * f * t + phase) for f, phase, size in lines)
    elif kind == "moves":
        speed, now, place = np.zeros_like(t), 0.1, 0.0
        while now < t[-1]:
            lasts, way = rng.uniform(0.5, 2.0) / pace, rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0)
            way = -np.sign(place) * abs(way) if abs(place) > 1.2 else way
            s = np.clip((t - now) / lasts, 0.0, 1.0)
            speed += way * 16 * (s * (1 - s)) ** 2  # the speed of a fifth-degree polynomial from rest to rest
            place += way * lasts * 0.53
            now += lasts + rng.uniform(0.0, 0.4)
    elif kind == "sweep":
        low, high = rng.uniform(0.1, 0.2), rng.uniform(1.2, 3.0) * pace
        share = np.abs(2 * t / max(t[-1], 1e-9) - 1)
        frequency = high * (low / high) ** share
        speed = (frequency / low) ** -0.4 * np.sin(2 * np.pi * np.cumsum(frequency) / tick_hz)
    elif kind == "plateaus":
        levels = np.repeat(rng.permutation([0.05, 0.2, 0.5, 0.75, 1.0]), 2) * np.tile([1.0, -1.0], 5)
        speed = levels[np.minimum((t * 10 / max(seconds, 1e-9)).astype(int), 9)]
    else:
        turns = np.sin(2 * np.pi * t / rng.uniform(2.0, 5.0) + rng.uniform(0, 6.3))
        speed = rng.uniform(0.06, 0.25) * np.sign(turns) * rng.uniform(0.7, 1.0)
    peak = float(np.max(np.abs(speed)))
    if kind not in ("plateaus", "creep"):
        speed = speed / max(peak, 1e-9) * rng.uniform(0.6, 1.0)
    speed = top * speed * np.clip(t / max(3 * smooth_s, 0.2), 0.0, 1.0)
    for _ in range(3):
        width = max(round(smooth_s * tick_hz), 1)
        padded = np.concatenate([np.zeros(width), speed, np.full(width, speed[-1])])
        speed = np.convolve(padded, np.ones(width) / width, mode="same")[width:-width]
    speed[0] = 0.0
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / tick_hz
    return angle, speed


def visible(trace: np.ndarray, columns: Sequence[np.ndarray]) -> tuple[float, float]:
    """Root-mean-square of a trace in the channel where it is largest: as it is, and beyond what columns explain.

    Args:
        trace: shape (channels, n), over the noise.
        columns: shape (channels, n) each, over the noise: sensitivities to the base's own numbers.

    Returns:
        Plain, and after least squares on an offset of each channel and the columns.
    """
    centred = trace - trace.mean(axis=1, keepdims=True)
    plain = float(np.sqrt(np.mean(centred**2, axis=1)).max())
    matrix = np.array([(c - c.mean(axis=1, keepdims=True)).ravel() for c in columns if np.any(c)]).T
    rest = centred
    if matrix.size:
        matrix = matrix / (np.linalg.norm(matrix, axis=0) + 1e-300)
        basis, values, _ = np.linalg.svd(matrix, full_matrices=False)
        basis = basis[:, values > 1e-8 * values[0]]
        rest = centred - (basis @ (basis.T @ centred.ravel())).reshape(centred.shape)
    return plain, float(np.sqrt(np.mean(rest**2, axis=1)).max())
