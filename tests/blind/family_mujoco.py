"""Blind plants in MuJoCo: ``draw(number, seed)`` hides an effect in a drive and measures it.

Strength: the trace of what is hidden along one motor motion, that of the plant without it under its
controller. With and without the effect the output (and the torque that the motion takes) is simulated again
with the motor's motion prescribed; the difference over the noise, after least squares on offsets and on the
plant's sensitivities to the base's own numbers, is what counts. Of several records the first counts, 12 s
of it at most. What is only a number of the base counts as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from contract import Case, Kind, Measured
from drawing import (
    SENSORS,
    SKIP_S,
    Drive,
    Sensing,
    Try,
    base_yaml,
    draw_drive,
    draw_lengths,
    draw_parameters,
    draw_sensing,
    first_near,
    kind_of,
    log_uniform,
    off,
    said,
    slower,
    started,
    together,
    visible,
)
from moving import MOTIONS, motion
from mujoco_effects import EFFECTS, PAIRS, Changes, Hidden
from mujoco_outside import OUTSIDE
from mujoco_plant import STEP_HZ, Motion, Numbers, acceleration, simulate

FAMILY = "mujoco"
KINDS: tuple[Kind, ...] = ("null", "effect", "effect", "parameter", "effect", "pair", "effect", "outside")
#: Time for which the drive stands before its log begins, and most of a record that a strength is taken of, s.
STANDING_S, STRENGTH_S = 0.5, 12.0
STRENGTHS = (0.5, 100.0)
TRIES, STEPS, TOLERANCE = 3, 6, 0.1
#: Change of a number for its sensitivity.
CHANGE = 0.02


@dataclass(frozen=True)
class Experiment:
    """Everything of a case but what is hidden."""

    drive: Drive
    sensing: Sensing
    motions: tuple[Motion, ...]
    held: tuple[Motion, ...]
    kinds: tuple[str, ...]
    own: Changes = field(
        default_factory=dict
    )  # what the plant has without the effect and differs from the base

    @property
    def rows_hz(self) -> float:
        """Rate of the plant's log."""
        return STEP_HZ / self.motions[0].rows_every


def told(
    kind: str, seconds: float, e: Drive, sensing: Sensing, tick_steps: int, rng: np.random.Generator
) -> Motion:
    """A motion with its load, the time before the log included."""
    tick_hz = STEP_HZ // tick_steps
    rate = sensing.rate
    angle, speed = motion(
        kind, seconds, e.top_speed / abs(e.ratio), rng, tick_hz=tick_hz, smooth_s=max(0.06, 20.0 / rate)
    )
    standing = round(STANDING_S * tick_hz)
    start = rng.uniform(-0.8, 0.8) * started(e, sensing)
    reference = np.column_stack([start + np.pad(angle, (standing, 0)), np.pad(speed, (standing, 0))])
    steps = len(reference) * tick_steps
    load = np.zeros(steps)
    if sensing.kind == "known load":
        t = np.arange(steps) / STEP_HZ - STANDING_S
        lines = [
            (np.exp(rng.uniform(np.log(0.08), np.log(min(1.5, rate / 80)))), rng.uniform(0, 6.3))
            for _ in range(3)
        ]
        load = sum(np.sin(2 * np.pi * f * t + phase) for f, phase in lines)
        load = load * np.clip(t / 0.5, 0.0, 1.0) ** 2 * (3 - 2 * np.clip(t / 0.5, 0.0, 1.0))
        load *= e.torques[1] * rng.uniform(0.3, 0.8) / np.max(np.abs(load))
    return Motion(reference, load, tick_steps, 5 if rate <= 1000 else STEP_HZ // rate)


def readings(log: np.ndarray, x: Experiment, errors: Changes) -> dict[str, np.ndarray]:
    """What ideal sensors with the plant's own sensor errors read, at the rate of the plant's log."""
    m, _, o, _, joint, torque, temperature, load = log.T
    time = np.arange(len(m)) / x.rows_hz
    if delay := errors.get("delay", 0.0):
        o = np.interp(time - delay, time, o)
    o = o + errors.get("encoder_once", 0.0) * np.sin(o - errors.get("encoder_phase", 0.0))
    order, phase = errors.get("sensor_order", 2.0), errors.get("sensor_phase", 0.0)
    wave = np.sin(order * m + phase) + errors.get("sensor_second", 0.0) * np.sin(2 * order * m + 1.0)
    joint = joint + errors.get("sensor_ripple", 0.0) * wave
    return {"motor_angle": m, "motor_torque": torque * errors.get("gain", 1.0), "output_angle": o,
            "output_torque": joint, "temperature": temperature, "load_torque": load}  # fmt: skip


def numbers_of(x: Experiment, changes: Changes) -> Numbers:
    """The plant of an experiment with changes of its nominal numbers; sensors' errors are left out."""
    given = x.drive.base | x.own | changes
    return Numbers(**{name: float(value) for name, value in given.items() if name in Numbers._fields})


class Visibility:
    """Strengths of changes in an experiment: see the module."""

    def __init__(self, x: Experiment) -> None:
        self.x = x
        first = x.motions[0]
        ticks = round((STANDING_S + STRENGTH_S) * STEP_HZ / first.ticks_every)
        self.motion = first._replace(
            reference=first.reference[:ticks],
            load=first.load[: len(first.reference[:ticks]) * first.ticks_every],
        )
        self.base = numbers_of(x, {})
        self.like = simulate(self.base, self.motion)
        self.plain = self._weighed({})
        self.columns = self._sensitivities()

    def _weighed(self, changes: Changes) -> np.ndarray:
        """Compared channels over their noise at the log's rate, shape (channels, n)."""
        sensing, p = self.x.sensing, numbers_of(self.x, changes)
        log = simulate(p, self.motion, self.like)
        found = readings(log, self.x, changes)
        return np.array([self._cut(found[c]) / sensing.sigma(c) for c in sensing.compared])

    def _cut(self, values: np.ndarray) -> np.ndarray:
        every = round(self.x.rows_hz / self.x.sensing.rate)
        return values[round((STANDING_S + SKIP_S) * self.x.rows_hz) :: every]

    def _sensitivities(self) -> list[np.ndarray]:
        x, p, like = self.x, self.base, self.like
        varied = [
            {name: value * (1 + CHANGE)}
            for name in ("load_inertia", "damping", "arm")
            if (value := getattr(p, name)) and not p.rigid
        ]
        if not p.rigid:
            varied.append({k: getattr(p, k) * (1 + CHANGE) for k in ("k1", "k2", "k3")})
        columns = [self._weighed(changes) - self.plain for changes in varied]
        # What the rest does along a prescribed motion is known without a simulation. What the base has as
        # zero is none of its numbers.
        speed, joint = like[:, 1], like[:, 4]
        sign, accelerated = np.tanh(speed / 0.5), acceleration(like, 1.0 / x.rows_hz)
        torques = [accelerated, like[:, 5]]
        friction = {"coulomb": sign, "viscous": speed, "load_loss": np.abs(joint) * sign}
        torques += [torque for name, torque in friction.items() if getattr(p, name)]
        columns += [self._column(motor_torque=torque) for torque in torques]
        if p.rigid:
            loads = (accelerated / p.ratio, *((np.sin(like[:, 2]),) if p.arm else ()))
            columns += [self._column(motor_torque=load / p.ratio, output_torque=load) for load in loads]
        return columns

    def _column(self, **found: np.ndarray) -> np.ndarray:
        """Channels over their noise, shape (channels, n): those that are not given are zero."""
        sensing, none = self.x.sensing, np.zeros(len(self.like))
        return np.array([self._cut(found.get(c, none)) / sensing.sigma(c) for c in sensing.compared])

    def of(self, changes: Changes) -> tuple[float, float]:
        """Plain strength, and beyond what the base's own numbers explain."""
        return visible(self._weighed(changes) - self.plain, self.columns)

    def sized(self, hidden: Hidden, uniform: list[float], same: bool, wanted: float) -> tuple[Changes, float]:
        """Changes with the wanted strength, by a secant iteration; the nearest that is physical."""
        size, tried = min(1.0, hidden.most), []
        best: tuple[float, Changes, float] | None = None
        for _ in range(STEPS):
            try:
                changes = hidden.build(self.x.drive, uniform, size, same)
                reached = self.of(changes)[1]
            except FloatingPointError:
                size *= 0.5
                continue
            off = abs(np.log(max(reached, 1e-9) / wanted))
            if best is None or off < best[0]:
                best = (off, changes, reached)
            tried.append((np.log(size), np.log(max(reached, 1e-9))))
            if off < TOLERANCE or (size >= hidden.most and reached < wanted):
                break
            slope = 1.0
            if len(tried) > 1 and abs(tried[-1][0] - tried[-2][0]) > 1e-6:
                slope = float(
                    np.clip((tried[-1][1] - tried[-2][1]) / (tried[-1][0] - tried[-2][0]), 0.4, 3.0)
                )
            way = float(np.clip((np.log(wanted) - tried[-1][1]) / slope, -6.0, 6.0))
            size = min(size * float(np.exp(way)), hidden.most)
        if best is None:
            raise FloatingPointError(f"{hidden.name}: no size can be simulated")
        return best[1], best[2]


def draw_experiment(
    rng: np.random.Generator, hidden: tuple[Hidden, ...], parameters: tuple[str, ...]
) -> Experiment:
    """Drive, sensors, motions: such that what is hidden can be seen there at all."""
    kinds = [k for k in SENSORS if all(set(h.channels) <= set(SENSORS[k]) for h in hidden)]
    weighed = any(h.loaded for h in hidden)
    if weighed:
        kinds = [k for k in kinds if k != "motor"]
    rigid = all(h.rigid for h in hidden) and not {"stiffness"} & set(parameters) and bool(rng.random() < 0.25)
    needs_arm = bool({"mass", "load-dependent loss"} & set(parameters))
    arm = needs_arm or bool(rng.random() < (0.8 if weighed else 0.5))
    drive = draw_drive(rng, arm=arm, rigid=rigid)
    sensing = draw_sensing(rng, drive, kinds, fast=any(h.fast for h in hidden))
    if weighed and not arm and sensing.kind != "known load":
        drive = draw_drive(rng, arm=True, rigid=rigid)
        sensing = draw_sensing(rng, drive, kinds, fast=any(h.fast for h in hidden))
    faster = max((h.speed for h in hidden), default=1.0)
    drive = slower(replace(drive, top_speed=faster * drive.top_speed), sensing.rate)
    tick = int(rng.choice([5, 2]))
    least = max([5.0, *(h.seconds for h in hidden)])
    given, held, _ = draw_lengths(rng, sensing.rate, least=least)
    allowed = [k for k in MOTIONS if all(k in h.motions for h in hidden)]
    if sensing.rate < 200:
        # A fast reversal lies between two samples, and what it excites with it.
        allowed = [k for k in allowed if k != "plateaus"]
    chosen = [str(k) for k in rng.choice(allowed, len(given))]
    others = [k for k in allowed if k not in chosen] or allowed
    later = [str(k) for k in rng.choice(others, len(held))]
    return Experiment(
        drive,
        sensing,
        tuple(told(k, s, drive, sensing, tick, rng) for k, s in zip(chosen, given, strict=True)),
        tuple(told(k, s, drive, sensing, tick, rng) for k, s in zip(later, held, strict=True)),
        (*chosen, *later),
        {name: 0.0 for h in hidden for name in h.lacks},
    )


def measured(
    x: Experiment, changes: Changes, rng: np.random.Generator
) -> tuple[list[Measured], list[Measured]]:
    """The records of a plant, and those that are held out."""
    found: tuple[list[Measured], list[Measured]] = ([], [])
    p = numbers_of(x, changes)
    every = round(x.rows_hz / x.sensing.rate)
    for group, motions in enumerate((x.motions, x.held)):
        for k, one in enumerate(motions):
            read = readings(simulate(p, one), x, changes)
            cut = {c: v[round(STANDING_S * x.rows_hz) :: every] for c, v in read.items()}
            found[group].append(x.sensing.measure(f"{('run', 'held')[group]} {k + 1}", cut, rng))
    return found


def draw(number: int, seed: int) -> Case:
    """A case; everything follows from the two numbers."""
    return first_near(FAMILY, number, seed, TRIES, lambda rng: _drawn(number, seed, rng))


def _drawn(number: int, seed: int, rng: np.random.Generator) -> Try:
    """The least part of a wanted strength that is reached, and the case."""
    kind, turn = kind_of(number, seed, KINDS)
    hidden: tuple[Hidden, ...] = ()
    names: tuple[str, ...] = ()
    if kind == "effect":
        place = 4 * turn + (1, 2, 4, 6).index(number % len(KINDS))
        hidden = (EFFECTS[place % len(EFFECTS)],)
    elif kind == "pair":
        known = {h.name: h for h in EFFECTS}
        hidden = tuple(known[name] for name in PAIRS[turn % len(PAIRS)])
    elif kind == "outside":
        hidden = (OUTSIDE[turn % len(OUTSIDE)],)
    elif kind == "parameter":
        names = draw_parameters(rng)
    x = draw_experiment(rng, hidden, names)
    if x.drive.rigid:
        names = tuple(n for n in names if n != "stiffness")
    changes: Changes = {}
    strengths: list[float] = []
    asked: list[float] = []
    truth, near = {}, 1.0
    same = bool(rng.random() < 0.4)
    if kind == "outside" and hidden[0].accepted:
        kind, same = "effect", True  # it has a name since, and its law
    if hidden or names:
        seen = Visibility(x)
    for h in hidden:
        wanted = log_uniform(rng, *(STRENGTHS if kind != "pair" else (1.0, 50.0)))
        own, reached = seen.sized(h, rng.random(6).tolist(), same, wanted)
        changes |= own
        strengths.append(round(reached, 3))
        asked.append(round(wanted, 3))
        near = min(near, reached / wanted)
        if same and h.numbers is not None:
            truth = together(truth, h.numbers(x.drive, own))
    if names:
        wrong, gain, truth = off(x.drive, names, rng)
        changes = {k: v for k, v in wrong.base.items() if v != x.drive.base[k]}
        changes |= {"gain": gain} if gain != 1.0 else {}
        strengths = [round(seen.of(changes)[0], 3)]
    records, held = measured(x, changes, rng)
    what = "+".join(h.name for h in hidden) or "+".join(names) or "nothing"
    setup = said(x.drive, x.sensing, records) | {
        "held": "files" if held else "stretches", "motion": x.kinds,
        "formula": "other" if hidden and (kind == "outside" or not same) else "catalogue",
        "mesh": "rigid" if x.drive.rigid else "lumped", "changes": changes, "asked": tuple(asked),
    }  # fmt: skip
    lacks = [name for h in hidden for name in h.lacks]
    return near, Case(
        f"{FAMILY}/{kind}/{what}/{number}/{seed}", FAMILY, kind,
        tuple(frozenset(h.accepted or (h.name,)) for h in hidden if kind != "outside"),
        tuple(records), tuple(held), base_yaml(x.drive, mesh=setup["mesh"], lacks=lacks), None,
        tuple(strengths), truth, setup,
    )  # fmt: skip
