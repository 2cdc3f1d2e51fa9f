"""Rows about measured machines; their records are public, and docs/validation.md says where."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.validate.rows import Row, check

if TYPE_CHECKING:
    from hdsim.estimate.estimation import Estimation
    from hdsim.estimate.records import Record
    from hdsim.log.mapping import Mapping

#: Where the records lie in the folder of the data.
LARA8 = "lara8-joint3-dual-encoder/joint3.csv"
KINOVA = "kinova-gen3-7dof/validation_data/opti_traj_testing1.csv"
CYCLOIDAL = "cycloidal-backlash-hysteresis"
EROB = "erob80-friction-parameters/erob80_100/m1.json"


def _there(data: Path | None, name: str) -> Path | None:
    path = None if data is None else data / name
    return path if path is not None and path.exists() else None


def _scenario(drive: dict[str, Any], **sections: Any) -> Any:
    from hdsim.scenario import Scenario

    base: dict[str, Any] = {
        "drive": drive,
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 1e-4},
        "run": {"duration_s": 1.0},
    }
    return Scenario.model_validate(base | sections)


def _value(found: Estimation, name: str) -> tuple[float, float, float]:
    """A fitted number with its interval of 95 %; NaN for an interval where the data do not determine it."""
    one = next(number for number in found.intervals if number.name == name)
    return (one.value, one.low, one.high) if one.determined else (one.value, math.nan, math.nan)


#: Of LARA8's joint 3: speed of the record at the output in rad/s, ratio, and where its arm hangs, degrees.
_SPEED = 0.87
_RATIO = 101.0
_HANGING_DEG = -158.0


@cache
def _lara8(path: Path) -> tuple[Estimation, Record]:
    """A fit of friction, weight and wind-up from the catalogue's CSG-25-100, and the record."""
    from hdsim.drive.presets import preset
    from hdsim.estimate import estimate
    from hdsim.estimate.records import Record

    data = np.genfromtxt(path, delimiter=",", names=True)
    step = 2.0 * math.pi / 2**24
    record = Record(
        "joint 3",
        data["Timestamp"] - data["Timestamp"][0],
        {
            "motor_angle": data["encoder_motorinc_3"] * step,
            "output_angle": data["encoder_loadinc_3"] * step,
            "motor_torque": data["joint_torque_current_3"] / _RATIO,
        },
    )
    gear = preset("csg-25-100")
    friction = gear["friction"] | {"load_coefficient": 0.0}  # the author's law knows no load
    drive = gear | {"arrangement": "flexspline_fixed", "mesh": {"model": "lumped"}, "friction": friction}
    arm = {"mass_kg": 10.0, "centre_of_mass_m": 0.6, "hanging_angle_deg": _HANGING_DEG}
    scenario = _scenario(drive, load={"inertia_kg_m2": 1.5, "gravity": arm})
    return estimate([record], scenario), record


@check("lara8-friction", "lara8-weight")
def lara8(data: Path | None) -> Iterator[Row]:
    """Friction and weight of a robot's joint with both encoders."""
    source = "A. Lucious, MasterThesis, friction_parameters_lara8.json (law of joint 3)"
    path = _there(data, LARA8)
    friction = weight = regressed = math.nan
    law = 6.52696 + 1.14945 * (12.0 * _SPEED + math.tanh(54.5 * _SPEED))
    if path is not None:
        found, record = _lara8(path)
        fitted = found.fit.state.drive.friction
        at_motor = fitted.coulomb_nm + fitted.viscous_nm_s_per_rad * _RATIO * _SPEED
        at_motor *= found.fit.state.gains.get("motor_torque", 1.0)
        friction = _RATIO * (at_motor + found.readings[0].offsets["motor_torque"])
        weight = _value(found, "load.gravity.mass_kg")[0] * 0.6 * 9.80665
        regressed = _weight_by_regression(record)
    yield Row(
        "lara8-friction", "LARA8 joint 3: friction at 0.87 rad/s (with the torque's zero, one way)",
        "N m", source, law, friction, 0.10, "usual tolerance of a motor's torque constant (estimate)",
    )  # fmt: skip
    yield Row(
        "lara8-weight", "LARA8 joint 3: torque of the arm's weight", "N m",
        "NumPy: least squares of the torque over sine and cosine of the angle at constant speed",
        regressed, weight, 0.05, "the regression neglects inertia and wind-up (estimate)",
    )  # fmt: skip


def _weight_by_regression(record: Record) -> float:
    """Amplitude over the output's angle of the torque in the stretch of constant speed, N m."""
    angle, torque = record.channels["output_angle"], _RATIO * record.channels["motor_torque"]
    speed = np.gradient(angle, record.time)
    middle = slice(len(speed) // 3, 2 * len(speed) // 3)
    steady = np.abs(speed - np.median(speed[middle])) < 0.05 * abs(np.median(speed[middle]))
    columns = np.column_stack([np.sin(angle[steady]), np.cos(angle[steady]), np.ones(int(np.sum(steady)))])
    found = np.linalg.lstsq(columns, torque[steady], rcond=None)[0]
    return float(np.hypot(found[0], found[1]))


@check("erob80-coulomb", "erob80-viscous")
def erob80(data: Path | None) -> Iterator[Row]:
    """Friction of a joint module against that of a catalogue drive, both at the output without load."""
    from hdsim.drive.presets import preset

    source = "Rhoban BAM, eRob80:100, model M1 (arXiv 2410.08650)"
    path = _there(data, EROB)
    stated = {"friction_base": 5.610965892410754, "friction_viscous": 8.392324354671375}
    if path is not None:
        stated = json.loads(path.read_text(encoding="utf-8"))
    friction = preset("csg-20-100")["friction"]
    for what, unit, law, ours in (
        ("Coulomb", "N m", "friction_base", 100.0 * friction["coulomb_nm"]),
        ("viscous", "N m s/rad", "friction_viscous", 100.0**2 * friction["viscous_nm_s_per_rad"]),
    ):
        yield Row(
            f"erob80-{what.lower()}", f"eRob80 ratio 100: {what} friction, against CSG-20-100 at 20 °C",
            unit, source,
            stated[law], ours, 0.20, "two makers' products of one kind (estimate)",
            remark="the module's law holds motor, seals and its own grease besides the gear, whose size is "
            "not stated",
        )  # fmt: skip


#: Torque over current, N m/A at the output, of the joints that turn both ways, joint 6 hardly.
_CONSTANT = {1: 9.130, 3: 9.130, 4: 9.130, 6: 5.852}
_JOINTS = tuple(_CONSTANT)


@check(*(f"kinova-{joint}-friction" for joint in _JOINTS))
def kinova(data: Path | None) -> Iterator[Row]:
    """Friction of a robot's joints: ``hdsim fit`` against a straight line through the same record."""
    path = _there(data, KINOVA)
    for joint in _JOINTS:
        stated, ours, speed = _kinova(path, joint) if path is not None else (math.nan, math.nan, math.nan)
        at = "" if math.isnan(speed) else f" at {speed:.2f} rad/s"
        yield Row(
            f"kinova-{joint}-friction", f"Kinova Gen3 joint {joint}: friction{at}", "N m",
            "NumPy: motor torque less sensor torque over speed, its sign and acceleration",
            stated, ours, 0.15, "masks, smoothing and free parameters differ (estimate)",
        )  # fmt: skip


def _kinova(path: Path, joint: int) -> tuple[float, float, float]:
    """Friction at the output by regression and by the fit, N m, at half of the largest speed, rad/s."""
    from hdsim.estimate import estimate
    from hdsim.estimate.records import record_from
    from hdsim.log.importing import import_recording

    scenario = _scenario(
        {
            "rated_torque_nm": 30.0, "arrangement": "flexspline_fixed",
            "geometry": {"flexspline_teeth": 198, "circular_spline_teeth": 200},
            "torsion": {
                "stiffness_k1_nm_per_rad": 1.6e4, "stiffness_k2_nm_per_rad": 2.5e4,
                "stiffness_k3_nm_per_rad": 2.9e4, "torque_t1_nm": 7.0, "torque_t2_nm": 25.0,
            },
            "inertia": {"motor_kg_m2": 3e-5, "wave_generator_kg_m2": 1e-5},
            "friction": {"coulomb_nm": 0.02, "viscous_nm_s_per_rad": 2e-4, "load_coefficient": 0.0},
            "mesh": {"model": "rigid"},
        }
    )  # fmt: skip
    measured = import_recording(path, _mapping(joint))
    found = estimate([record_from(measured, f"joint {joint}")], scenario, load="output_torque")
    speed, motor = measured["output_velocity"], 100.0 * measured["motor_torque"]
    faster = float(np.nanpercentile(np.abs(speed), 99)) / 2.0
    friction = found.fit.state.drive.friction
    # As the motor's current reads it: the fit leaves the reading's gain free, the regression does not.
    read = 100.0 * found.fit.state.gains.get("motor_torque", 1.0)
    ours = read * (friction.coulomb_nm + friction.viscous_nm_s_per_rad * 100.0 * faster)
    moving = np.abs(speed) > 0.02
    columns = np.column_stack([np.sign(speed), speed, np.gradient(speed, measured.time), np.ones(len(speed))])
    rest = motor - measured["output_torque"]
    good = moving & np.isfinite(rest) & np.all(np.isfinite(columns), axis=1)
    law = np.linalg.lstsq(columns[good], rest[good], rcond=None)[0]
    return float(law[0] + law[1] * faster), ours, faster


def _mapping(joint: int) -> Mapping:
    """The channels of one joint; the control loop hiccups every 0.16 to 0.2 s, which is masked."""
    from hdsim.log.mapping import Mapping

    current = {"column": f"Cur{joint}", "unit": "A", "torque_constant_nm_per_a": _CONSTANT[joint]}
    return Mapping.model_validate(
        {
            "ratio": 100,
            "time": {"column": "Time", "unit": "ms"},
            "channels": {
                "output_angle": {"column": f"Position{joint}", "unit": "rad"},
                "output_velocity": {"column": f"Velocity{joint}", "unit": "rad/s"},
                "motor_torque": current | {"side": "output"},
                "output_torque": {"column": f"TorqueSm{joint}", "unit": "N m"},
            },
            "longest_gap_s": 0.005,
            "masks": [
                {"type": "outliers", "channels": ["motor_torque", "output_velocity"], "width_samples": 5}
            ],
        }
    )


_PLAYS = {
    "base, run in": ("2024-07-11__15-56-27__torqueramp__base_runin6.csv", 3.2),
    "base": ("2024-07-11__15-47-12__torqueramp__base_runin1.csv", 2.0),
    "split, preloaded": ("2024-07-11__13-26-36__torqueramp__split_4pre1.csv", 0.97),
    "conic, preloaded": ("2024-07-12__17-09-01__torqueramp__conic_5pre1.csv", 0.54),
}


@check(*(f"cycloidal-play-{k}" for k in range(1, len(_PLAYS) + 1)))
def cycloidal(data: Path | None) -> Iterator[Row]:
    """Play of a cycloidal actuator (no harmonic drive) by ``hdsim fit``, against what its loops show."""
    for k, (variant, (name, lost_deg)) in enumerate(_PLAYS.items(), 1):
        path = _there(data, f"{CYCLOIDAL}/{name}")
        play, low, high = _play(path) if path is not None else (math.nan, math.nan, math.nan)
        interval = "" if math.isnan(low) else f"interval of the fit {low:.0f} to {high:.0f} arcmin"
        yield Row(
            f"cycloidal-play-{k}", f"cycloidal actuator, {variant}: play", "arcmin",
            "lost motion at zero torque, read off the loops of JelmerV/Anti-Backlash-Cycloidal-Actuator",
            60.0 * lost_deg, play, 0.15, "lost motion holds friction besides the play (estimate)",
            remark=interval,
        )  # fmt: skip


def _play(path: Path) -> tuple[float, float, float]:
    """Play in arcmin with its interval of 95 %, the output locked."""
    from hdsim.estimate import estimate
    from hdsim.estimate.records import record_from
    from hdsim.log.importing import import_recording
    from hdsim.log.mapping import Mapping

    mapping = Mapping.model_validate(
        {
            "ratio": 14,
            "time": {"column": "TIME", "unit": "s", "quantised": True},
            "channels": {
                "motor_angle": {"column": "POSITION", "unit": "rev", "side": "output"},
                "motor_torque": {"column": "TORQUE", "unit": "N m", "side": "output"},
            },
        }
    )
    stiffness = {f"stiffness_k{k}_nm_per_rad": 1000.0 for k in (1, 2, 3)}
    scenario = _scenario(
        {
            "rated_torque_nm": 40.0, "arrangement": "flexspline_fixed",
            "geometry": {"flexspline_teeth": 26, "circular_spline_teeth": 28},
            "torsion": {**stiffness, "torque_t1_nm": 7.0, "torque_t2_nm": 25.0, "damping_nm_s_per_rad": 1.0},
            "inertia": {"motor_kg_m2": 1e-5, "wave_generator_kg_m2": 1e-6},
            "friction": {"coulomb_nm": 0.03, "viscous_nm_s_per_rad": 1e-4, "load_coefficient": 0.1},
            "mesh": {"model": "lumped"},
        },
        effects={"output_backlash": {"backlash_arcmin": 60.0}},
        command={"motor": {"type": "free"}, "output": {"type": "locked"}},
        load={"inertia_kg_m2": 0.01},
    )  # fmt: skip
    found = estimate([record_from(import_recording(path, mapping), "ramps")], scenario)
    return _value(found, "effects.output_backlash.backlash_arcmin")
