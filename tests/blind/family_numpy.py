"""The NumPy family: plants with own equations and integrator (``plants``), drawn at random and wide.

``draw(number, seed)`` decides by the number alone what kind of case it is, so that every twenty numbers hold
the same mix; everything else is drawn. Where an effect cannot reach the drawn strength at a physical size in
the drawn experiment, or the log's rate cannot carry the motion, the experiment is drawn again, later with
better sensors.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np
from contract import Case, Kind
from drawing import log_uniform, together
from drives import DRIVES, GRAVITY, LEVER, around, base_yaml
from hidden import ANY, EARLIER, EFFECTS, KINDS_OF, LATER, Changes, Expected, Hidden
from outside import OUTSIDE
from sensing import SENSORS, Setup, measure, numbers
from strength import Strength, plain_strength, strength, unresolved

FAMILY = "numpy"

#: Kinds of twenty numbers in a row: 25 % null, 10 % parameter, 45 % one effect, 10 % pair, 10 % outside.
KINDS: tuple[Kind, ...] = (
    "effect", "null", "effect", "parameter", "effect", "outside", "effect", "null", "pair", "effect",
    "null", "effect", "effect", "null", "effect", "parameter", "effect", "outside", "null", "pair",
)  # fmt: skip
assert len(KINDS) == 20

#: Ranges that are drawn from, log-uniform.
STRENGTH, OUTSIDE_STRENGTH, PAIR_STRENGTH = (0.5, 100.0), (1.5, 100.0), (1.0, 50.0)
RATE_HZ, SECONDS, LONG_SECONDS = (100.0, 5000.0), (5.0, 30.0), (30.0, 60.0)
STEP, TORQUE_STEP, NOISE, SPEED = (0.05, 10.0), (0.05, 3.0), (0.4, 2.5), (0.4, 1.3)
LONG_SHARE, FILES_SHARE, JITTER_SHARE, OFF_SHARE = 0.12, 0.6, 0.15, 0.25
#: The least factor on noise that better sensors reach.
LEAST_NOISE = 0.1
#: Drawn experiments that are tried; how near a strength is near enough (logarithm), and how near sizing goes.
TRIES, NEAR, TOLERANCE = 14, 0.3, 0.1
#: Part of the noise, or of the strength, that a log may lose between its samples.
LOST, LOST_OF_STRENGTH = 0.3, 0.1
#: Friction of another formula than the base's needs this much noise to hide in; where nothing is hidden, and
#: where no name is right, it would be something to find.
HIDES_SIGN = 0.6

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


@dataclass(frozen=True)
class Wanted:
    """What a case is to be, before an experiment is drawn.

    Attributes:
        kind: what it counts towards.
        hidden: the effects.
        strengths: of each.
        same: whether by the catalogue's formula.
        off: names of the base's numbers that are off, ``off_by`` their factors.
    """

    kind: Kind
    hidden: tuple[Hidden, ...]
    strengths: tuple[float, ...]
    same: bool
    off: tuple[str, ...]
    off_by: tuple[float, ...]

    @property
    def truth(self) -> str:
        """In the words of a key."""
        names = [h.name for h in self.hidden] or (list(self.off) if self.kind == "parameter" else ["nothing"])
        return "+".join(names).replace(" ", "-")


@dataclass(frozen=True)
class Sized:
    """A plant in an experiment."""

    setups: tuple[Setup, ...]
    held: tuple[Setup, ...]
    changes: Changes
    strengths: tuple[Strength, ...]
    expected: Expected
    miss: float


def draw(number: int, seed: int) -> Case:
    """The case of a number and a seed."""
    rng = np.random.default_rng([zlib.crc32(FAMILY.encode()), seed, number])
    wanted = wanted_of(number, seed, rng)
    best: Sized | None = None
    for attempt in range(TRIES):
        found = _sized(wanted, np.random.default_rng([seed, number, attempt]), attempt)
        if found is not None and (best is None or found.miss < best.miss):
            best = found
        if best is not None and best.miss <= NEAR:
            break
    if best is None:
        raise ValueError(f"{FAMILY} {number} of seed {seed}: no experiment shows {wanted.truth}")
    return _case(wanted, best, number, seed)


def wanted_of(number: int, seed: int, rng: np.random.Generator) -> Wanted:
    """Kind by the number; effects in turn in an order that the seed shuffles."""
    kind = KINDS[number % len(KINDS)]
    turn = number // len(KINDS) * KINDS.count(kind) + KINDS[: number % len(KINDS)].count(kind)
    order = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    hidden: tuple[Hidden, ...] = ()
    strengths: tuple[float, ...] = ()
    if kind == "effect":
        shuffled = [group[k] for group in (EARLIER, LATER) for k in order.permutation(len(group))]
        hidden = (shuffled[turn % len(EFFECTS)],)
        strengths = (log_uniform(rng, *STRENGTH),)
    elif kind == "outside":
        hidden = (OUTSIDE[order.permutation(len(OUTSIDE))[turn % len(OUTSIDE)]],)
        strengths = (log_uniform(rng, *OUTSIDE_STRENGTH),)
    elif kind == "pair":
        hidden = _pair(rng)
        first = log_uniform(rng, *PAIR_STRENGTH)
        strengths = (first, float(np.clip(first * log_uniform(rng, 0.2, 5.0), *PAIR_STRENGTH)))
    count, most = 0, 0.2
    if kind == "parameter":
        count, most = (1 if rng.random() < 0.6 else 2), 0.3
    elif hidden and rng.random() < OFF_SHARE:
        count = 1 if rng.random() < 0.6 else 2
    lacking = {name for h in hidden for name in h.lacks}
    names = [name for name, (plant, _) in PARAMETERS.items() if not set(plant) & lacking]
    off = tuple(str(name) for name in rng.choice(names, count, replace=False))
    by = tuple(float(1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.05, most)) for _ in off)
    return Wanted(kind, hidden, strengths, bool(rng.random() < 0.5), off, by)


def _pair(rng: np.random.Generator) -> tuple[Hidden, ...]:
    while True:
        one, other = (EARLIER[k] for k in rng.choice(len(EARLIER), 2, replace=False))
        together = set(one.motions) & set(other.motions) & set(ANY)
        if together and not any({one.name, other.name} <= kind for kind in KINDS_OF):
            return one, other


def _sized(wanted: Wanted, rng: np.random.Generator, attempt: int) -> Sized | None:
    """One experiment with its plant at the wanted strengths; ``None`` where it cannot be."""
    setups, held = _setups(wanted, rng, attempt)
    first = setups[0]
    if {"mass", "load-dependent loss"} & set(wanted.off) and not first.gravity:
        return None
    if first.locked and {"mass", "load inertia", "motor inertia"} & set(wanted.off):
        return None
    off, expected = _off(wanted, first)
    if wanted.kind == "parameter":
        strengths = tuple(plain_strength(first, _plant(wanted, first, [k])) for k in range(len(wanted.off)))
        weakest = min(s.plain for s in strengths)
        return Sized(setups, held, off, strengths, expected, max(0.0, float(np.log(1.0 / weakest))))
    changes: Changes = {}
    found, misses = [], [0.0]
    for hidden, size in zip(wanted.hidden, wanted.strengths, strict=True):
        sized = _size(hidden, first, rng.uniform(size=6), size, wanted.same, patient=attempt > TRIES // 2)
        if sized is None:
            return None
        own, one = sized
        changes |= own
        found.append(one)
        misses.append(abs(float(np.log(one.beyond_base / size))))
        if wanted.same and hidden.expected is not None:
            expected = together(expected, hidden.expected(first.drive, own))
    changes = off | changes
    lost = max(unresolved(setup, changes) for setup in (*setups, *held))
    if lost > max(LOST, LOST_OF_STRENGTH * max((s.beyond_base for s in found), default=0.0)):
        return None
    return Sized(setups, held, changes, tuple(found), expected, max(misses))


def measured_share(hidden: tuple[Hidden, ...]) -> float:
    """Share of the records that hold the temperature."""
    if any(h.temperature for h in hidden):
        return 1.0
    return 0.5 if any(h.name == "thermal_friction" for h in hidden) else 0.25


def _setups(
    wanted: Wanted, rng: np.random.Generator, attempt: int
) -> tuple[tuple[Setup, ...], tuple[Setup, ...]]:
    """Records that are learnt from, and those that are held out (none: stretches)."""
    hidden = wanted.hidden
    motions = [m for m in ANY if all(m in h.motions for h in hidden)]
    arm = any(h.arm for h in hidden) or bool({"mass", "load-dependent loss"} & set(wanted.off))
    drive = around(DRIVES[rng.integers(len(DRIVES))], tuple(rng.uniform(size=8)))
    better = 0.75 ** max(0, attempt - 3)
    noise = max(LEAST_NOISE, log_uniform(rng, *NOISE) * better)
    torque_noise = max(LEAST_NOISE, log_uniform(rng, *NOISE) * better)
    motion = str(rng.choice(motions))
    sensors = str(rng.choice(list(SENSORS), p=(0.2, 0.3, 0.3, 0.2)))
    if motion == "locked":
        sensors = str(rng.choice(["motor", "torque sensor"]))
    # The clock of the plant is a whole multiple of the log's.
    rate = 10000.0 / round(10000.0 / log_uniform(rng, *RATE_HZ))
    count = int(rng.choice([1, 2, 3, 4], p=(0.7, 0.15, 0.1, 0.05)))
    span = LONG_SECONDS if rng.random() < LONG_SHARE else SECONDS
    seconds = max(log_uniform(rng, *span), max((h.seconds for h in hidden), default=0.0))
    first = Setup(
        drive=drive,
        motion=motion,
        gravity=motion != "locked" and (arm or bool(rng.random() < 0.65)),
        rate=rate,
        seconds=max(5.0, seconds / count),
        seed=(int(rng.integers(2**31)), 0),
        sensors=sensors,
        temperature=bool(rng.random() < measured_share(hidden)),
        noise=noise,
        torque_noise=torque_noise,
        step=log_uniform(rng, *STEP),
        torque_step=log_uniform(rng, *TORQUE_STEP),
        jitter=log_uniform(rng, 0.002, 0.02) if rng.random() < JITTER_SHARE else 0.0,
        speed=_speed(wanted, motion, rng),
        lacks=tuple(name for h in hidden for name in h.lacks),
        algebraic_sign=bool(
            wanted.kind in ("effect", "pair")
            and not wanted.same
            and motion != "locked"
            and torque_noise >= HIDES_SIGN
            and rng.random() < 0.5
        ),
    )

    def another(k: int, kinds: list[str]) -> Setup:
        kind = str(rng.choice(kinds))
        return replace(first, motion=kind, seed=(first.seed[0], k), speed=_speed(wanted, kind, rng))

    free = [m for m in motions if (m == "locked") == first.locked]
    setups = (first, *(another(k, free) for k in range(1, count)))
    if rng.random() >= FILES_SHARE:
        return setups, ()
    others = [m for m in free if m not in {s.motion for s in setups}] or free
    held = [another(10 + k, others) for k in range(1 + int(rng.random() < 0.4))]
    seconds = max(5.0, first.seconds * rng.uniform(0.5, 1.0))
    return setups, tuple(replace(setup, seconds=seconds) for setup in held)


def _speed(wanted: Wanted, motion: str, rng: np.random.Generator) -> float:
    if motion == "locked":
        return float(rng.uniform(0.6, 1.0))
    return log_uniform(rng, *SPEED) * max((h.speed for h in wanted.hidden), default=1.0)


def _plant(wanted: Wanted, setup: Setup, which: list[int]) -> Changes:
    """The plant's own numbers where the base's are off."""
    nominal = numbers(setup, {})._asdict()
    names = [(name, wanted.off_by[k]) for k, name in enumerate(wanted.off) if k in which]
    return {key: nominal[key] * by for name, by in names for key in PARAMETERS[name][0]}


def _off(wanted: Wanted, setup: Setup) -> tuple[Changes, Expected]:
    """All of them, with what a re-fit should find."""
    changes = _plant(wanted, setup, list(range(len(wanted.off))))
    expected: Expected = {}
    for name in wanted.off if not setup.algebraic_sign else ():
        plant, path = PARAMETERS[name]
        value = changes[plant[0]]
        if name == "motor inertia":
            # The scenario's number is the rotor's alone, the wave generator's stays.
            value -= 0.25 * setup.drive.motor_inertia
        elif name == "mass":
            value /= GRAVITY * LEVER
        expected[path] = value
    return changes, expected


def _size(
    hidden: Hidden, setup: Setup, draws: np.ndarray, wanted: float, same: bool, *, patient: bool
) -> tuple[Changes, Strength] | None:
    """Iterate the size until the strength beyond the base's numbers is the wanted one.

    ``None`` where the largest physical size stays below it; with patience what that gives is good enough,
    as long as it can be seen at all.
    """
    least = STRENGTH[0] if patient else wanted * (1.0 - NEAR)
    # Without the base's sensitivities a quick look, which says enough where it is too little.
    if plain_strength(setup, hidden.build(setup.drive, draws, hidden.most, same)).plain < least:
        return None
    size, power, last = hidden.start, 1.0, None
    for _ in range(8):
        changes = hidden.build(setup.drive, draws, size, same)
        found = strength(setup, changes)
        if abs(np.log(found.beyond_base / wanted)) < TOLERANCE:
            break
        if size >= hidden.most and found.beyond_base < wanted:
            break
        if last is not None and last[0] != size and found.beyond_base != last[1]:
            slope = np.log(found.beyond_base / last[1]) / np.log(size / last[0])
            power = float(np.clip(slope, 0.3, 3.0))
        last = (size, found.beyond_base)
        step = float(np.clip((wanted / max(found.beyond_base, 1e-12)) ** (1 / power), 0.02, 30.0))
        size = min(size * step, hidden.most)
    return (changes, found) if found.beyond_base >= least else None


def _case(wanted: Wanted, sized: Sized, number: int, seed: int) -> Case:
    first = sized.setups[0]
    draws = np.full(6, 0.37)
    formulas = [h.build(first.drive, draws, 1.0, same) for h in wanted.hidden for same in (False, True)]
    exact = (wanted.same or formulas[0::2] == formulas[1::2]) and not first.algebraic_sign
    base = base_yaml(first.drive, gravity=first.gravity, locked=first.locked, lacks=first.lacks)
    records = [
        [measure(s, numbers(s, sized.changes), f"{name} {k + 1}") for k, s in enumerate(many)]
        for name, many in (("record", sized.setups), ("held out", sized.held))
    ]
    parameter = wanted.kind == "parameter"
    kind = wanted.kind
    if kind == "outside" and wanted.hidden[0].accepted:
        kind = "effect"  # it has a name since
    return Case(
        key=f"{FAMILY}/{kind}/{wanted.truth}/{number}/{seed}",
        family=FAMILY,
        kind=kind,
        truth=() if kind == "outside" else tuple(frozenset(h.accepted or (h.name,)) for h in wanted.hidden),
        records=tuple(records[0]),
        holdout=tuple(records[1]),
        base=base,
        strength=tuple(float(s.plain if parameter else s.beyond_base) for s in sized.strengths),
        numbers={path: float(value) for path, value in sized.expected.items()},
        setup={
            "rate_hz": first.rate,
            "encoder_step_over_noise": first.step,
            "sensors": first.sensors,
            "seconds": [s.seconds for s in sized.setups],
            "records": len(sized.setups),
            "held": "files" if sized.held else "stretches",
            "held_motion": [s.motion for s in sized.held],
            "motion": [s.motion for s in sized.setups],
            "temperature": first.temperature,
            "formula": "catalogue" if exact else "other",
            "hidden": wanted.truth,
            "drive": first.drive.name,
            "load": "locked" if first.locked else "arm" if first.gravity else "inertia",
            "jitter": first.jitter,
            "noise": [first.noise, first.torque_noise],
            "speed": [s.speed for s in (*sized.setups, *sized.held)],
            "off": dict(zip(wanted.off, wanted.off_by, strict=True)),
            "changes": sized.changes,
            "plain_strength": [s.plain for s in sized.strengths],
            "channel": [s.channel for s in sized.strengths],
        },
    )
