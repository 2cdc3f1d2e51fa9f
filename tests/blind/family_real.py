"""The family of real machines: recordings of joints into which an effect is put.

What an effect would have changed along the measured motion follows from statics and kinematics, and, where
the drive yields, from one linear equation: J d'' = F - T for the output's deviation d under a kinematic error
e and a torque T on the output, where the drive carries F = k (e - d) + c (e' - d') more. No power is lost in
an error: of the motor's torque the drive's whole one takes the part 1/i + de/dq, by the motor's angle q. A
real joint has effects of its own that nobody knows all of. So an effect counts as found when it is named with
its order and about its size, and the same recording without it does not get that name: every case brings that
one along.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from contract import Case, Kind, Measured
from real_records import (
    KINOVA_FRICTION,
    SIGN_SPEED,
    Joint,
    absorbed,
    beyond,
    carried,
    kinova,
    lara,
    motor_angle,
    over_noise,
    rates,
    remains,
)
from scipy.signal import cont2discrete, dlsim

FAMILY = "real"
#: Log-uniform strengths that are asked for; what is reached ends at each effect's largest size.
STRENGTH, LEAST = (1.0, 60.0), 0.7
ARCMIN = np.pi / 10800
#: Damping of the output on the drive's spring, share of critical.
DAMPING = 0.05
#: Steps of the drive's equation in a sample.
FINER = 8

Changed = dict[str, np.ndarray]
Change = Callable[[Joint, Measured, float, np.random.Generator], Changed]


@dataclass(frozen=True)
class PutIn:
    """An effect that is put into a recording.

    Attributes:
        name: in the words of a key.
        truth: names of the catalogue that are right; none: nothing new is right.
        change: what it adds to channels of a record at a size.
        most: largest size, in ``unit``.
        unit: of the size.
        where: names of joints begin with it.
        order: of its component; 0: none.
        field: of the effect that holds the size of that component, and ``per_field`` that field's unit over
            ``unit``.
        but_not: joints that have it (SOURCE.md of the recordings).
    """

    name: str
    truth: frozenset[str]
    change: Change
    most: Callable[[Joint], float]
    unit: str
    where: str = ""
    order: float = 0.0
    field: str = ""
    per_field: float = 1.0
    but_not: tuple[str, ...] = ()


#: Of an angle of the motor: an error of the gear there, rad, and its derivative.
Error = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def without_error(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A gear without kinematic error."""
    return np.zeros_like(angle), np.zeros_like(angle)


def through(joint: Joint, record: Measured, error: Error, torque: np.ndarray) -> Changed:
    """What a kinematic error and a torque (N m) that the load adds change, the motor's motion given."""
    k, inertia = joint.stiffness, joint.inertia
    c = 2 * DAMPING * np.sqrt(k * inertia)
    # Finer than the samples, which are a few in a period of a high order.
    step = float(np.median(np.diff(record.time))) / FINER
    even = np.arange(0.0, record.time[-1] + step, step)
    angle, speed, added = (
        np.interp(even, record.time, values)
        for values in (
            motor_angle(joint, record), rates(record.time, motor_angle(joint, record))[0], torque
        )
    )  # fmt: skip
    e, slope = error(angle)
    drives = k * e + c * slope * speed
    system = cont2discrete(
        (np.array([[0.0, 1.0], [-k / inertia, -c / inertia]]), np.array([[0.0], [1.0 / inertia]]),
         np.eye(2), np.zeros((2, 1))), step, method="foh",
    )  # fmt: skip
    push = drives - added
    # It begins where the drive would be at rest.
    _, _, state = dlsim(system, push[:, None], x0=np.array([push[0] / k, 0.0]))
    moved, more = (
        np.interp(record.time, even, values)
        for values in (state[:, 0], drives - k * state[:, 0] - c * state[:, 1])
    )
    slopes = error(motor_angle(joint, record))[1]
    return {
        "output_angle": moved,
        "motor_torque": more / joint.ratio + (carried(joint, record) + more) * slopes,
    }


def ripple(order: float) -> Change:
    """Torque of the motor that its angle makes; the current has to make up for it."""

    def change(joint: Joint, record: Measured, size: float, rng: np.random.Generator) -> Changed:
        phase = rng.uniform(0, 2 * np.pi)
        return {"motor_torque": size * np.sin(order * motor_angle(joint, record) + phase)}

    return change


def stribeck(joint: Joint, record: Measured, size: float, rng: np.random.Generator) -> Changed:
    """More friction at low speed: Stribeck's curve, Gaussian."""
    speed, _ = rates(record.time, motor_angle(joint, record), 0.05)
    over = rng.uniform(3.0, 8.0)
    return {"motor_torque": size * np.tanh(speed / SIGN_SPEED) * np.exp(-((speed / over) ** 2))}


def weight(joint: Joint, record: Measured, size: float, rng: np.random.Generator) -> Changed:
    """A weight on the output at an angle of its own."""
    torque = size * np.cos(record.channels["output_angle"] + rng.uniform(0, 2 * np.pi))
    if joint.stiffness:
        return through(joint, record, without_error, torque)
    # A sensor on the output carries it, and so does the motor, behind the gear: the load is what it reads.
    return {"output_torque": torque, "motor_torque": torque / joint.ratio}


def kinematic(order: float) -> Change:
    """Kinematic error of the gear, by the motor's angle."""

    def change(joint: Joint, record: Measured, size: float, rng: np.random.Generator) -> Changed:
        phase = rng.uniform(0, 2 * np.pi)

        def error(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            turned = order * angle + phase
            return size * np.sin(turned), size * order * np.cos(turned)

        return through(joint, record, error, np.zeros_like(record.time))

    return change


def encoder(joint: Joint, record: Measured, size: float, rng: np.random.Generator) -> Changed:
    """Eccentric disc of the load's encoder: an error once a turn."""
    del joint
    return {"output_angle": size * np.sin(record.channels["output_angle"] + rng.uniform(0, 2 * np.pi))}


def _coulomb(times: float) -> Callable[[Joint], float]:
    return lambda joint: times * joint.coulomb


ROTOR = frozenset({"unbalance", "motor_torque_ripple"})
EFFECTS = (
    *(PutIn(f"motor torque ripple order {order:g}", frozenset({"motor_torque_ripple"}), ripple(order),
            _coulomb(3.0), "N m", order=order, field="cogging_nm", but_not=("kinova 6", "kinova 7"))
      for order in (5.0, 6.0, 10.0)),
    # A rotor's weight and a ripple of order 1 are one torque over the angle.
    PutIn("unbalance of the rotor", ROTOR, ripple(1.0), _coulomb(3.0), "N m", order=1.0, field="cogging_nm"),
    PutIn("stribeck friction", frozenset({"stribeck_friction"}), stribeck, _coulomb(3.0), "N m"),
    PutIn("weight that the sensor carries", frozenset(), weight, lambda _: 5.0, "N m", "kinova"),
    *(PutIn(f"kinematic error order {order:g}", frozenset({"kinematic_error"}), kinematic(order),
            lambda _: 2.0 * ARCMIN, "rad", "lara", order, "amplitude_arcmin", 1.0 / ARCMIN)
      for order in (2.0, 4.0)),
    PutIn("wave generator once a turn", frozenset({"wave_generator_eccentricity", "kinematic_error"}),
          kinematic(1.0), lambda _: 2.0 * ARCMIN, "rad", "lara", 1.0, "amplitude_arcmin", 1.0 / ARCMIN),
    PutIn("weight on the output", frozenset({"unbalance"}), weight, lambda _: 60.0, "N m", "lara"),
)  # fmt: skip


def joints() -> list[Joint]:
    """All joints.

    Raises:
        AbsentError: the recordings are not here.
    """
    # The one with both encoders is as often drawn as two others.
    return [*(kinova(k) for k in KINOVA_FRICTION), lara(), lara()]


def fitting(joint: Joint) -> list[PutIn]:
    """What can be put into a joint's recordings."""
    return [e for e in EFFECTS if joint.name.startswith(e.where) and joint.name not in e.but_not]


def draw(number: int, seed: int) -> Case:
    """The case of a number and a seed.

    Raises:
        AbsentError: the recordings are not here.
    """
    rng = np.random.default_rng([zlib.crc32(FAMILY.encode()), seed, number])
    known = joints()
    joint = known[rng.integers(len(known))]
    choice = fitting(joint)
    effect, phase, one, size = choice[0], 0, 0.0, 0.0
    while size * one < LEAST:
        # What cannot be seen at a physical size is drawn again.
        effect, phase = choice[rng.integers(len(choice))], int(rng.integers(2**31))
        # An error of the gear is not quite in proportion: it is looked at where it is physical.
        one = visible(joint, effect, effect.most(joint), phase) / effect.most(joint)
        size = min(float(np.exp(rng.uniform(*np.log(STRENGTH)))) / one, effect.most(joint))
        if not effect.truth:
            size = effect.most(joint)
            break
    files = len(joint.records) > 1 and bool(rng.random() < 0.6)
    learnt = joint.records[:1] if files else joint.records
    held = joint.records[1:] if files else ()
    kind: Kind = "effect" if effect.truth else "null"
    setup = {
        "rate_hz": 1.0 / float(np.median(np.diff(joint.records[0].time))),
        "encoder_step_over_noise": None, "sensors": joint.sensors, "records": len(learnt),
        "seconds": [float(r.time[-1]) for r in learnt], "held": "files" if files else "stretches",
        "motion": ["recorded"] * len(learnt), "temperature": "temperature" in joint.records[0].channels,
        "formula": "catalogue", "hidden": effect.name, "joint": joint.name, "size": size, "unit": effect.unit,
        "at": {"order": effect.order, "field": effect.field, "size": size * effect.per_field}
        if effect.order else None, "own": list(joint.own),
    }  # fmt: skip
    plain = Case(
        f"{FAMILY}/plain/{joint.name.replace(' ', '-')}-{setup['held']}/{number}/{seed}", FAMILY, "null", (),
        learnt, held, joint.base, joint.load, (), {}, setup,
    )  # fmt: skip
    return replace(
        plain,
        key=f"{FAMILY}/{kind}/{effect.name.replace(' ', '-')}@{joint.name.replace(' ', '-')}/{number}/{seed}",
        kind=kind,
        truth=(effect.truth,) if effect.truth else (),
        records=tuple(with_it(joint, effect, r, size, phase) for r in learnt),
        holdout=tuple(with_it(joint, effect, r, size, phase) for r in held),
        strength=(visible(joint, effect, size, phase),) if effect.truth else (),
        without=plain,
    )


def with_it(joint: Joint, effect: PutIn, record: Measured, size: float, phase: int) -> Measured:
    """A record with an effect; the same phase in all records."""
    added = effect.change(joint, record, size, np.random.default_rng(phase))
    return replace(record, channels=record.channels | {c: record.channels[c] + v for c, v in added.items()})


def visible(joint: Joint, effect: PutIn, size: float, phase: int) -> float:
    """Strength: the trace beyond the base's numbers over what is known to be left of the recording.

    That is the noise of the other families, where the true model leaves nothing else.
    """
    record = joint.records[0]
    added = effect.change(joint, record, size, np.random.default_rng(phase))
    # The load is what a sensor of the torque reads.
    return max(
        over_noise(record.time, beyond(trace, absorbed(joint, record)), remains(joint, record, channel))
        for channel, trace in added.items()
        if channel != "output_torque"
    )
