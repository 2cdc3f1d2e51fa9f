"""What the families of blind plants draw alike: experiments, motions, sensors, and how visible a trace is."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from contract import Case, Kind, Measured

#: Part of a wanted strength that a drawn case reaches, and the case.
Try = tuple[float, Case]

GRAVITY = 9.80665
#: Rates of the log, Hz; the plants' clocks are multiples of all of them.
RATES = (100, 125, 200, 250, 500, 1000, 2500, 5000)
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
#: Frequency up to which a log's angle has to tell the acceleration, Hz: reversals of friction reach so far.
TOLD_HZ = 90.0
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
            "k1": k1, "k2": k2, "k3": k3, "t1": self.torques[0], "t2": self.torques[1],
            "damping": self.damping,
            "coulomb": self.coulomb, "viscous": self.viscous, "load_loss": self.load_loss, "arm": self.arm,
            "lever": self.lever, "rigid": float(self.rigid),
        }  # fmt: skip


#: Numbers that a base can have wrong: the field of ``Drive``, and the path in a scenario.
PARAMETERS = {
    "load inertia": ("load_inertia", "load.inertia_kg_m2"),
    "motor inertia": ("motor_inertia", "drive.inertia.motor_kg_m2"),
    "stiffness": ("stiffness", "drive.torsion.stiffness_k1_nm_per_rad"),
    "Coulomb friction": ("coulomb", "drive.friction.coulomb_nm"),
    "viscous friction": ("viscous", "drive.friction.viscous_nm_s_per_rad"),
    "load-dependent loss": ("load_loss", "drive.friction.load_coefficient"),
    "mass": ("arm", "load.gravity.mass_kg"),
    "torque constant": ("gain", "motor_torque_gain"),
}
#: Part of the motor's inertia that the base gives to the wave generator.
GENERATOR_SHARE = 0.25


def together(numbers: Mapping[str, float], more: Mapping[str, float]) -> dict[str, float]:
    """True numbers of two effects; a field that both have says not whose it is, and is asked of neither."""
    both = {**numbers, **more}
    return {path: both[path] for path in both if not (path in numbers and path in more)}


def draw_drive(rng: np.random.Generator, *, arm: bool, rigid: bool = False) -> Drive:
    """A drive of sizes 14 to 50 and ratios 50 to 160, both signs; numbers scale as the catalogues' do.

    Stiffness and torques grow with the cube of the size, inertias with its fourth power.
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


def off(
    drive: Drive, names: Sequence[str], rng: np.random.Generator
) -> tuple[Drive, float, dict[str, float]]:
    """A drive whose named numbers are off by 5 to 25 %, the torque reading's factor, true values by path."""
    gain, truth = 1.0, {}
    for name in names:
        factor = 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.25))
        own, path = PARAMETERS[name]
        if own == "gain":
            gain = truth[path] = factor
            continue
        value = getattr(drive, own)
        many = isinstance(value, tuple)
        drive = replace(drive, **{own: tuple(v * factor for v in value) if many else value * factor})
        number = factor * (value[0] if many else value)
        if own == "motor_inertia":
            number *= 1 - GENERATOR_SHARE
        truth[path] = number / (GRAVITY * drive.lever) if own == "arm" else number
    return drive, gain, truth


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

    @property
    def coarseness(self) -> float:
        """Step of the encoders over their noise."""
        return self.step["output_angle"] / self.noise["output_angle"]

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
    rng: np.random.Generator,
    drive: Drive,
    kinds: Sequence[str] = tuple(SENSORS),
    *,
    fast: bool = False,
    quietest_rad: float = 1e-6,
) -> Sensing:
    """Sensors for a drive: rates from 100 to 5000 Hz, steps of the encoders 0.05 to 10 times their noise.

    Args:
        rng: random numbers.
        drive: the drive, to which noise is scaled.
        kinds: of ``SENSORS``, among which is chosen.
        fast: 500 Hz at least.
        quietest_rad: least noise of the output's encoder.
    """
    often = np.array((0.1, 0.08, 0.12, 0.14, 0.23, 0.24, 0.06, 0.03)) * [
        rate >= 500 or not fast for rate in RATES
    ]
    rate = int(rng.choice(RATES, p=often / often.sum()))
    noise = {
        "motor_angle": log_uniform(rng, 5e-6, 6e-5),
        "output_angle": log_uniform(rng, quietest_rad, 1.2e-5),
        # Friction jumps by 2 T_c in a sample or two at a reversal, and no smoothed motion tells exactly when.
        "motor_torque": drive.coulomb * log_uniform(rng, max(0.12, 16.0 / rate), 0.4),
        "output_torque": drive.torques[0] * log_uniform(rng, 0.006, 0.03),
        "temperature": 0.05,
    }
    noise["load_torque"] = drive.torques[0] * log_uniform(rng, 0.003, 0.015)
    coarse = log_uniform(rng, 0.05, 10.0)
    # What the encoder leaves unknown of the inertia's torque up to TOLD_HZ is well below the noise.
    inertia = drive.motor_inertia + drive.load_inertia / drive.ratio**2
    bend = inertia * (2 * np.pi * TOLD_HZ) ** 2 * np.sqrt(min(2 * TOLD_HZ / rate, 1.0) / 5.0)
    known = min(
        noise["motor_torque"], noise["output_torque"] * abs(drive.ratio) * inertia / drive.load_inertia
    )
    finest = 0.15 * known / bend / np.hypot(1.0, coarse / np.sqrt(12))
    # And of the output's angle: its steps are no white noise in a slow motion, smoothing leaves them.
    noise["motor_angle"] = min(noise["motor_angle"], finest, 0.3 * abs(drive.ratio) * noise["output_angle"])
    # The load's noise winds the spring up: by less than a quarter of the output encoder's errors.
    finest = 0.25 * drive.stiffness[0] * noise["output_angle"] * np.hypot(1.0, coarse / np.sqrt(12))
    noise["load_torque"] = min(noise["load_torque"], finest)
    step = {c: 0.3 * value for c, value in noise.items()}
    step |= {"motor_angle": coarse * noise["motor_angle"], "output_angle": coarse * noise["output_angle"]}
    return Sensing(str(rng.choice(list(kinds))), rate, noise, step, bool(rng.random() < 0.35))


def slower(drive: Drive, rate: int) -> Drive:
    """The drive with a top speed whose fourth order has four samples a period in a log of that rate."""
    return replace(drive, top_speed=min(drive.top_speed, 2 * np.pi * rate / 16.0))


def started(d: Drive, sensing: Sensing) -> float:
    """Share of a start with the arm raised that a tool can know.

    Nobody knows how a drive was wound up before its log begins. hdsim lets its model ring for 0.5 s from no
    load at all; what is left of that then has to stay below a fifth of the output angle's noise.
    """
    if d.arm == 0.0 or d.rigid:
        return 1.0
    left = d.arm * np.sin(0.8) / d.stiffness[0] * np.exp(-0.25 * d.damping / d.load_inertia)
    return float(min(1.0, 0.2 * sensing.noise["output_angle"] / left))


def kind_of(number: int, seed: int, kinds: Sequence[Kind]) -> tuple[Kind, int]:
    """Kind of a case and its turn: the kinds go round by the number, and the seed shifts what is hidden."""
    return kinds[number % len(kinds)], number // len(kinds) + seed


def draw_parameters(rng: np.random.Generator) -> tuple[str, ...]:
    """One or two numbers of the base that are to be off."""
    return tuple(str(n) for n in rng.choice(list(PARAMETERS), int(rng.integers(1, 3)), replace=False))


def first_near(
    family: str, number: int, seed: int, tries: int, drawn: Callable[[np.random.Generator], Try | None]
) -> Case:
    """The first try that reaches half of the strength it wants, else the one that reaches the most of it.

    Args:
        family: its name; family, number, seed and try make the random numbers.
        number: of the case.
        seed: of the case.
        tries: how many.
        drawn: part of the strength that is reached, and the case; ``None`` where there is no such drive.
    """
    best: Try | None = None
    for attempt in range(tries):
        found = drawn(np.random.default_rng([seed, number, attempt, zlib.crc32(family.encode())]))
        if found is not None and found[0] > 0.5:
            return found[1]
        if found is not None and (best is None or found[0] > best[0]):
            best = found
    if best is None:
        raise ArithmeticError(f"{family} {number}/{seed}: no drive of {tries} could be built")
    return best[1]


def draw_lengths(
    rng: np.random.Generator, rate: int, *, least: float = 5.0
) -> tuple[list[float], list[float], str]:
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


def said(drive: Drive, sensing: Sensing, records: Sequence[Measured]) -> dict[str, object]:
    """What a case says of its drive and its sensors."""
    return {
        "rate_hz": sensing.rate, "encoder_step_over_noise": sensing.coarseness, "sensors": sensing.kind,
        "seconds": [float(r.time[-1]) for r in records], "records": len(records),
        "temperature": sensing.temperature, "load": "arm" if drive.arm else "inertia", "size": drive.size,
        "ratio": drive.ratio, "noise": {c: sensing.sigma(c) for c in sensing.channels},
    }  # fmt: skip


def visible(trace: np.ndarray, columns: Sequence[np.ndarray]) -> tuple[float, float]:
    """Root-mean-square of a trace where it is largest: as it is, and beyond what columns explain.

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
