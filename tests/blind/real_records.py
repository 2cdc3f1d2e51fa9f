"""Recordings of real joints, with the plain model of each; nothing here imports hdsim.

Kinova Gen3 (strain wave, 100:1): angle and torque sensor of the output and the motor's current at 1 kHz.
NEURA LARA8 joint 3 (101:1): encoders of motor and load and the motor's current at 250 Hz. Sources and
licences are in the SOURCE.md beside the files; where those are not, there is no such family.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from contract import AbsentError, Measured
from scipy.optimize import least_squares
from scipy.signal import savgol_filter, welch

DATA = Path(__file__).parents[3] / "shared" / "data"
KINOVA = "kinova-gen3-7dof/validation_data/opti_traj_testing{}.csv"
LARA = "lara8-joint3-dual-encoder/joint3.csv"

#: Output Coulomb (N m) and viscous (N m s/rad) friction of the Kinova joints, as read off in SOURCE.md.
KINOVA_FRICTION = {1: (2.66, 3.02), 3: (2.17, 2.40), 4: (2.44, 2.54), 6: (1.18, 0.90), 7: (1.14, 0.85)}
#: Orders of the motor's turn that SOURCE.md names: of the current, and of the torque sensor that is the load.
KINOVA_ORDERS, LARA_ORDERS = (2.0, 7.0, 12.0, 14.0), (1.98, 2.0)
#: N m at the output per ampere (SOURCE.md).
KINOVA_CONSTANT = {1: 9.130, 3: 9.130, 4: 9.130, 6: 5.852, 7: 5.852}

#: From here on the motor of the LARA8's joint comes to rest, and the arm rings on the drive, s.
LARA_STOPS_S = 7.0

#: Speed over which friction's sign is smoothed, rad/s of the motor (as the base's).
SIGN_SPEED = 0.5


@dataclass(frozen=True)
class Joint:
    """A joint with its plain model, SI units.

    Attributes:
        name: of the joint.
        ratio: motor over output.
        sensors: in the words of a case's setup.
        base: the plain model as YAML: ratio, friction, stiffness and load, no effect.
        coulomb: friction at the motor, N m.
        stiffness: with which the drive yields to what is put in, at the output, N m/rad; 0: rigid.
        inertia: of the load, kg m^2; ``hanging`` the angle at which its arm hangs, ``weight`` that times its
            lever, N m.
        load: where the load's torque comes from.
        records: recordings.
        own: effects of the catalogue that SOURCE.md of the recordings says it has; ``orders`` of the motor's
            turn that it names.
    """

    name: str
    ratio: float
    sensors: str
    base: str
    coulomb: float
    stiffness: float
    inertia: float
    load: str | None
    records: tuple[Measured, ...]
    hanging: float = 0.0
    weight: float = 0.0
    own: tuple[str, ...] = ()
    orders: tuple[float, ...] = ()


def _table(name: str) -> np.ndarray:
    path = DATA / name
    if not path.exists():
        raise AbsentError(f"family real: the recordings are not here ({name} beside the project)")
    return np.genfromtxt(path, delimiter=",", names=True)


BASE = """name: {name}
description: Plain model of a real joint; its friction, nothing else.
drive:
  rated_torque_nm: {rated}
  arrangement: flexspline_fixed
  geometry: {{flexspline_teeth: {flexspline}, circular_spline_teeth: {circular}}}
  torsion:
    stiffness_k1_nm_per_rad: {stiffness:.6g}
    stiffness_k2_nm_per_rad: {stiffness:.6g}
    stiffness_k3_nm_per_rad: {stiffness:.6g}
    torque_t1_nm: {t1}
    torque_t2_nm: {t2}
    damping_nm_s_per_rad: {damping:.6g}
  inertia: {{motor_kg_m2: {motor:.6g}, wave_generator_kg_m2: {generator:.6g}}}
  friction: {{coulomb_nm: {coulomb:.6g}, viscous_nm_s_per_rad: {viscous:.6g}}}
  mesh: {{model: {mesh}}}
command:
  motor: {{type: free}}
load:
  inertia_kg_m2: {inertia:.6g}
{gravity}run: {{duration_s: 1.0}}
"""


@lru_cache(maxsize=8)
def kinova(joint: int) -> Joint:
    """A joint of the Kinova Gen3; its second recording is another motion.

    Raises:
        AbsentError: the recordings are not here.
    """
    ratio, records = 100.0, []
    for k in (1, 2):
        table = _table(KINOVA.format(k))
        channels = {
            "output_angle": table[f"Position{joint}"],
            "motor_torque": table[f"Cur{joint}"] * KINOVA_CONSTANT[joint] / ratio,
            "output_torque": table[f"TorqueSm{joint}"],
            "temperature": table[f"Temp{joint}"],
        }
        time = 1e-3 * (table["Time"] - table["Time"][0])
        records.append(Measured(f"joint {joint}, record {k}", time, channels))
    coulomb, viscous = KINOVA_FRICTION[joint]
    # The stiffness of a rigid mesh has no meaning; inertias are estimates.
    text = BASE.format(
        name=f"Kinova Gen3 joint {joint}", rated=30, flexspline=198, circular=200, stiffness=1.6e4, t1=7,
        t2=25, damping=8.0, motor=3e-5, generator=1e-5, coulomb=coulomb / ratio, viscous=viscous / ratio**2,
        mesh="rigid", inertia=1e-4, gravity="",
    )  # fmt: skip
    return Joint(
        f"kinova {joint}", ratio, "torque sensor", text, coulomb / ratio, 0.0, 0.0, "output_torque",
        tuple(records), own=("sensors", *(["motor_torque_ripple"] if joint > 5 else [])),
        orders=KINOVA_ORDERS,
    )  # fmt: skip


@lru_cache(maxsize=1)
def lara() -> Joint:
    """Joint 3 of the LARA8.

    Raises:
        AbsentError: the recording is not here.
    """
    ratio, turn = 101.0, 2 * np.pi / 2**24
    table = _table(LARA)
    time = table["Timestamp"] - table["Timestamp"][0]
    motor = table["encoder_motorinc_3"] * turn
    output = np.unwrap(table["encoder_loadinc_3"] * turn)
    # The motor's encoder has a zero of its own.
    motor = motor + ratio * np.mean(output - motor / ratio)
    torque = table["joint_torque_current_3"] / ratio
    record = Measured("joint 3", time, {"motor_angle": motor, "output_angle": output, "motor_torque": torque})
    # Of the base the stiffness is as in SOURCE.md, which takes all of an error once a turn for wind-up under
    # the weight; friction by its author's law there. The drive yields as its ringing at the end shows.
    rotor, generator, stated = 2e-4, 5e-5, 2.2e4
    weight, hanging, driven = _arm(record, ratio)
    inertia = driven - ratio**2 * (rotor + generator)
    ringing = record.time >= LARA_STOPS_S
    frequency = rings_at(record.time[ringing], (output - motor / ratio)[ringing])
    stiffness = inertia * (2 * np.pi * frequency) ** 2
    coulomb, viscous = (6.53 + 1.149) / ratio, 12 * 1.149 / ratio**2
    gravity = (
        f"  gravity: {{mass_kg: {weight / 9.80665 / 0.4:.6g}, centre_of_mass_m: 0.4, "
        f"hanging_angle_deg: {np.degrees(hanging):.6g}}}\n"
    )
    text = BASE.format(
        name="LARA8 joint 3", rated=100, flexspline=200, circular=202, stiffness=stated, t1=20, t2=60,
        damping=20.0, motor=rotor, generator=generator, coulomb=coulomb, viscous=viscous, mesh="lumped",
        inertia=inertia, gravity=gravity,
    )  # fmt: skip
    return Joint("lara 3", ratio, "both", text, coulomb, stiffness, inertia, None, (record,), hanging,
                 weight, ("kinematic_error",), LARA_ORDERS)  # fmt: skip


def _arm(record: Measured, ratio: float) -> tuple[float, float, float]:
    """Weight times lever (N m), angle at which the arm hangs (rad), inertia that the motor drives (kg m^2).

    By the motor's torque; the inertia is at the output, with the motor's own.

    Not from the twist: that holds the encoders' own errors once a turn, too.
    """
    output = record.channels["output_angle"]
    velocity, acceleration = rates(record.time, output)
    friction = [np.ones_like(output), np.tanh(ratio * velocity / SIGN_SPEED), velocity]
    columns = np.column_stack([np.cos(output), np.sin(output), acceleration, *friction])
    c, s, a = np.linalg.lstsq(columns, ratio * record.channels["motor_torque"], rcond=None)[0][:3]
    # The torque is w sin(q - h) + J q'' = w cos(h) sin(q) - w sin(h) cos(q) + J q'' and friction.
    return float(np.hypot(c, s)), float(np.arctan2(-c, s)), float(max(a, 0.5))


def rings_at(time: np.ndarray, values: np.ndarray) -> float:
    """Frequency of the damped oscillation about a parabola that leaves least of values, Hz."""
    since = time - time[0]
    parabola = np.vander(since, 3)

    def left(asked: np.ndarray) -> np.ndarray:
        turned = 2 * np.pi * asked[0] * since
        swing = np.exp(-asked[1] * since)[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
        return beyond(values, np.column_stack([parabola, swing]))

    least, most = 2.0 / since[-1], 0.25 / float(np.median(np.diff(time)))
    begins = np.arange(least, most, 0.5 / since[-1])
    nearest = min(begins, key=lambda f: float(np.sum(left(np.array([f, 0.0])) ** 2)))
    found = least_squares(left, [nearest, 0.0], bounds=([least, 0.0], [most, np.inf]))
    return float(found.x[0])


def rates(time: np.ndarray, angle: np.ndarray, over_s: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    """Speed and acceleration of a measured angle, cubic over a moving window; shape (n,) each."""
    step = float(np.median(np.diff(time)))
    even = np.arange(0.0, time[-1] - time[0] + step, step)
    width = max(5, 2 * round(over_s / step / 2) + 1)
    values = np.interp(even, time - time[0], angle)
    return tuple(  # type: ignore[return-value]
        np.interp(time - time[0], even, savgol_filter(values, width, 3, deriv=k, delta=step)) for k in (1, 2)
    )


def motor_angle(joint: Joint, record: Measured) -> np.ndarray:
    """As measured, or that of the output behind the gear."""
    measured = record.channels.get("motor_angle")
    return measured if measured is not None else joint.ratio * record.channels["output_angle"]


def carried(joint: Joint, record: Measured) -> np.ndarray:
    """Torque that the drive carries as recorded, N m: what the load's weight and inertia ask for."""
    output = record.channels["output_angle"]
    return joint.weight * np.sin(output - joint.hanging) + joint.inertia * rates(record.time, output)[1]


def reading(joint: Joint, record: Measured, channel: str) -> np.ndarray:
    """A channel; of the output's angle the transmission error: what jitters with the clock is in both."""
    values = record.channels[channel]
    return values - record.channels["motor_angle"] / joint.ratio if channel == "output_angle" else values


def absorbed(joint: Joint, record: Measured) -> np.ndarray:
    """Columns (n, k) of what the base's numbers can say: zero, inertia, load, friction."""
    output = record.channels["output_angle"]
    speed, acceleration = rates(record.time, output)
    # The load's torque is what a sensor reads, or that of the arm.
    load = record.channels.get("output_torque", np.sin(output - joint.hanging))
    friction = np.tanh(joint.ratio * speed / SIGN_SPEED)
    return np.column_stack([np.ones_like(output), acceleration, load, friction, speed])


def remains(joint: Joint, record: Measured, channel: str) -> np.ndarray:
    """What the best known description leaves of a channel: the sensor's noise and what is the machine's own.

    Beside the base's numbers it has a weight at any angle, an error of the output's turn at orders 1 and 2,
    and the orders of the motor's turn that are known of the joint.
    """
    output, motor = record.channels["output_angle"], motor_angle(joint, record)
    turning = [output, 2 * output, *(order * motor for order in joint.orders)]
    known = np.column_stack([absorbed(joint, record), *(f(a) for a in turning for f in (np.sin, np.cos))])
    return beyond(reading(joint, record, channel), known)


def beyond(values: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """What least squares leave of values."""
    # Columns of any unit: a speed beside a sine.
    columns = columns / np.linalg.norm(columns, axis=0)
    return values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]


def over_noise(time: np.ndarray, trace: np.ndarray, noise: np.ndarray) -> float:
    """Root mean square of a trace over noise of any colour: of both behind the filter that whitens the noise.

    With white noise it is the ratio of their root mean squares, with any other that of white noise in which a
    known trace is as visible (matched filter).
    """
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + step / 2, step)
    trace, noise = (np.interp(even, time, values) for values in (trace, noise))
    # Welch's estimate of both, in eleven windows: a narrow line leaks as much of either.
    of_trace, of_noise = (
        welch(values, nperseg=len(even) // 6, detrend=False)[1] for values in (trace, noise)
    )
    return float(np.sqrt(np.mean(of_trace / of_noise)))
