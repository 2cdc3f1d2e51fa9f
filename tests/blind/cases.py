"""The blind matrix: which plants, how visible, and which answers are right."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from drives import DRIVES
from hidden import ANY, EFFECTS, KNOWN, MOVING, OUTSIDE, Expected, Hidden
from sensing import CHANNELS, DIRT, Setup, numbers
from strength import Strength, plain_strength, strength

#: Visible strength (see ``strength``) by group.
STRENGTHS = {
    "clear": 5.0, "matching": 5.0, "fair": 2.0, "faint": 0.7, "pair": 4.0, "outside": 5.0, "missing": 5.0,
    "dirty": 5.0,
}  # fmt: skip
#: Tries at a drive and a motion in which the effect can reach its strength, and its tolerance.
TRIES, TOLERANCE = 8, 0.08

PAIRS = (
    ("kinematic_error", "stribeck_friction"),
    ("motor_torque_ripple", "load_side_friction"),
    ("output_backlash", "load_side_friction"),
    ("torsional_hysteresis_maxwell", "kinematic_error"),
    ("lugre_friction", "wave_generator_eccentricity"),
    ("torque-sensor ripple", "stribeck_friction"),
    ("load_dependent_loss", "kinematic_error"),
    ("output encoder delay", "motor_torque_ripple"),
    ("unbalance", "input_coulomb_viscous"),
)
#: The base's numbers: names in the plant, path in the scenario.
PARAMETERS = {
    "load inertia": (("load_inertia",), "load.inertia_kg_m2"),
    "motor inertia": (("motor_inertia",), "drive.inertia.motor_kg_m2"),
    "stiffness": (("k1", "k2", "k3"), "drive.torsion.stiffness_k1_nm_per_rad"),
    "Coulomb friction": (("coulomb",), "drive.friction.coulomb_nm"),
    "viscous friction": (("viscous",), "drive.friction.viscous_nm_s_per_rad"),
    "torque constant": (("gain",), "motor_torque_gain"),
    "mass": (("arm",), "load.gravity.mass_kg"),
    "load-dependent loss": (("load_loss",), "drive.friction.load_coefficient"),
}
TWO_PARAMETERS = (
    ("load inertia", "Coulomb friction"), ("motor inertia", "viscous friction"), ("stiffness", "mass"),
    ("Coulomb friction", "viscous friction"), ("torque constant", "stiffness"), ("load inertia", "mass"),
    ("Coulomb friction", "load-dependent loss"), ("torque constant", "viscous friction"),
)  # fmt: skip
WITHOUT = {
    "no output torque": tuple(c for c in CHANNELS if c != "output_torque"),
    "no output angle": tuple(c for c in CHANNELS if c != "output_angle"),
    "no motor angle": tuple(c for c in CHANNELS if c != "motor_angle"),
}
MISSING = (
    ("no output torque", "kinematic_error"), ("no output torque", "stribeck_friction"),
    ("no output torque", "output_backlash"), ("no output torque", "load_side_friction"),
    ("no output torque", "nothing"),
    ("no output angle", "motor_torque_ripple"), ("no output angle", "stribeck_friction"),
    ("no output angle", "load_dependent_loss"), ("no output angle", "torque-sensor ripple"),
    ("no output angle", "nothing"),
    ("no motor angle", "stribeck_friction"), ("no motor angle", "load_side_friction"),
    ("no motor angle", "input_coulomb_viscous"), ("no motor angle", "nothing"),
)  # fmt: skip
DIRTY = ("nothing", "kinematic_error", "stribeck_friction", "motor_torque_ripple", "nothing",
         "torsional_hysteresis_maxwell", "load_side_friction")  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """One case of the matrix, before its plant is made.

    Attributes:
        group: what it counts towards.
        truth: what is hidden; after a ``#`` a number that only tells cases apart.
        seed: seed.
        effects: names of what is hidden, of ``hidden``.
        parameters: names of the base's numbers that are off.
        channels: channels that the log has.
        dirt: what is wrong with the log.
    """

    group: str
    truth: str
    seed: int
    effects: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    channels: tuple[str, ...] = CHANNELS
    dirt: str = ""

    @property
    def key(self) -> str:
        """What ``--only`` takes."""
        return f"{self.group}/{self.truth}/{self.seed}"

    @property
    def row(self) -> str:
        """Row of the confusion matrix."""
        return self.truth.partition("#")[0]

    @property
    def accepted(self) -> list[frozenset[str]]:
        """For each hidden effect, the names that are right."""
        return [frozenset(KNOWN[name].accepted or (name,)) for name in self.effects]


@dataclass(frozen=True)
class Case:
    """A trial with its experiment and its plant."""

    trial: Trial
    setup: Setup
    changes: dict[str, float]
    strengths: tuple[Strength, ...] = ()
    expected: Expected = field(default_factory=dict)
    reached: bool = True

    @property
    def weakest(self) -> float:
        """Strength that counts, of what is hidden least visibly."""
        return min(s.plain if self.trial.parameters else s.beyond_base for s in self.strengths)


def trials(seeds: Iterable[int]) -> Iterator[Trial]:
    """The matrix over seeds; each seed has every kind of case, and a rotating choice where there are many."""
    for seed in seeds:
        for k in range(15):
            yield Trial("null", f"nothing#{k}", seed)
        yield Trial("null", "nothing, spikes", seed, dirt="spikes")
        yield Trial("null", "nothing, jitter", seed, dirt="jitter")
        for name in PARAMETERS:
            yield Trial("parameter", name, seed, parameters=(name,))
        for pair in TWO_PARAMETERS:
            yield Trial("parameter", " + ".join(pair), seed, parameters=pair)
        for k, effect in enumerate(EFFECTS):
            names = (effect.name,)
            yield Trial("clear", effect.name, seed, names)
            if (k + seed) % 2:
                yield Trial("matching", effect.name, seed, names)
            if (k + seed) % 4:
                yield Trial("fair", effect.name, seed, names)
            if (k + seed) % 5 < 3:
                yield Trial("faint", effect.name, seed, names)
        for k, both in enumerate(PAIRS):
            if (k + seed) % 5:
                yield Trial("pair", " + ".join(both), seed, both)
        for effect in OUTSIDE:
            yield Trial("outside", effect.name, seed, (effect.name,))
        for k, (what, name) in enumerate(MISSING):
            if (k + seed) % 2:
                names = () if name == "nothing" else (name,)
                yield Trial("missing", f"{name}, {what}", seed, names, channels=WITHOUT[what])
        for k, dirt in enumerate(DIRT):
            name = DIRTY[(k + seed) % len(DIRTY)]
            names = () if name == "nothing" else (name,)
            yield Trial("dirty", f"{name}, {dirt}", seed, names, dirt=dirt)


def case_of(trial: Trial) -> Case:
    """Choose the experiment, size the plant. The choice follows from the trial's key alone."""
    best: Case | None = None
    for attempt in range(TRIES):
        rng = np.random.default_rng(
            [trial.seed, zlib.crc32(f"{trial.group}/{trial.truth}".encode()), attempt]
        )
        setup = _setup(trial, rng)
        # Where an effect cannot be seen at a physical size, better sensors are tried.
        setup = replace(setup, noise=setup.noise * 0.75**attempt)
        if trial.parameters:
            case = _off(trial, setup, rng)
        elif trial.effects:
            case = _sized(trial, setup, rng)
        else:
            return Case(trial, setup, {})
        if case.reached:
            return case
        if best is None or case.weakest > best.weakest:
            best = case
    assert best is not None
    return best


def _setup(trial: Trial, rng: np.random.Generator) -> Setup:
    hidden = [KNOWN[name] for name in trial.effects]
    motions = [m for m in (ANY if not hidden else (*MOVING, "locked")) if all(m in h.motions for h in hidden)]
    if (
        "motor_angle" not in trial.channels
        or "mass" in trial.parameters
        or "load inertia" in trial.parameters
    ):
        motions = [m for m in motions if m != "locked"]
    if trial.dirt or len(hidden) > 1:
        motions = [m for m in motions if m != "locked"]
    rates = (
        set.intersection(*({500, 1000, 2000} & set(h.rates) for h in hidden)) if hidden else {500, 1000, 2000}
    )
    weights = {500: 0.3, 1000: 0.55, 2000: 0.15}
    drawn = sorted(rates)
    chances = np.array([weights[r] for r in drawn])
    arm = any(h.arm for h in hidden) or bool({"mass", "load-dependent loss"} & set(trial.parameters))
    motion = str(rng.choice(motions))
    longest = max((h.seconds for h in hidden), default=0.0)
    drive = DRIVES[rng.integers(len(DRIVES))]
    if trial.group == "matching":
        # Every formula of the plant is the model's, that of the base's friction too.
        drive = replace(drive, algebraic_sign=False)
    setup = Setup(
        drive=drive,
        motion=motion,
        gravity=motion != "locked" and (arm or bool(rng.random() < 0.65)),
        rate=int(rng.choice(drawn, p=chances / chances.sum())),
        seconds=longest or float(rng.choice([8.0, 10.0, 10.0, 12.0, 12.0, 14.0])),
        seed=(trial.seed, int(rng.integers(2**31))),
        noise=float(np.exp(rng.uniform(np.log(0.6), np.log(1.6)))),
        channels=trial.channels,
        dirt=trial.dirt,
        speed=max((h.speed for h in hidden), default=1.0),
        lacks=tuple(name for h in hidden for name in h.lacks),
    )
    if "thermal_friction" in trial.effects and rng.random() < 0.5:
        setup = replace(setup, channels=(*setup.channels, "temperature"))
    return setup


def _off(trial: Trial, setup: Setup, rng: np.random.Generator) -> Case:
    """Numbers of the base off by 10 to 30 %, in an experiment in which each of them matters."""
    nominal = numbers(setup, {})._asdict()
    changes: dict[str, float] = {}
    expected: Expected = {}
    strengths = []
    for name in trial.parameters:
        factor = 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.3))
        plant, path = PARAMETERS[name]
        own = {key: nominal[key] * factor for key in plant}
        changes |= own
        strengths.append(plain_strength(setup, own))
        value = own[plant[0]]
        if name == "motor inertia":
            # The scenario's number is the rotor's alone, the wave generator's stays.
            value -= 0.25 * setup.drive.motor_inertia
        elif name == "mass":
            value /= 9.80665 * 0.3
        expected[path] = value
    return Case(trial, setup, changes, tuple(strengths), expected, min(s.plain for s in strengths) > 0.5)


def _sized(trial: Trial, setup: Setup, rng: np.random.Generator) -> Case:
    """Every hidden effect at the group's strength."""
    wanted = STRENGTHS[trial.group]
    changes: dict[str, float] = {}
    expected: Expected = {}
    strengths, reached = [], True
    for name in trial.effects:
        hidden = KNOWN[name]
        same = trial.group == "matching"
        own, found = _size(hidden, setup, rng.uniform(size=6), wanted, same)
        changes |= own
        strengths.append(found)
        reached = reached and bool(abs(np.log(found.beyond_base / wanted)) < 2 * TOLERANCE)
        if same and hidden.expected is not None:
            expected = hidden.expected(setup.drive, own)
    return Case(trial, setup, changes, tuple(strengths), expected, reached)


def _size(
    hidden: Hidden, setup: Setup, draws: np.ndarray, wanted: float, same: bool
) -> tuple[dict[str, float], Strength]:
    """Iterate the size until the strength beyond the base's numbers is the wanted one."""
    size, power, last = hidden.start, 1.0, None
    for _ in range(8):
        changes = hidden.build(setup.drive, draws, size, same)
        found = strength(setup, changes)
        if abs(np.log(found.beyond_base / wanted)) < TOLERANCE:
            break
        at_end = size >= hidden.most and found.beyond_base < wanted
        if at_end:
            break
        if last is not None and last[0] != size and found.beyond_base != last[1]:
            slope = np.log(found.beyond_base / last[1]) / np.log(size / last[0])
            power = float(np.clip(slope, 0.3, 3.0))
        last = (size, found.beyond_base)
        step = float(np.clip((wanted / max(found.beyond_base, 1e-12)) ** (1 / power), 0.02, 30.0))
        size = min(size * step, hidden.most)
    return changes, found
