"""Scenarios that are tried as the next experiment: motions and loads within what drive and data allow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.state import State

if TYPE_CHECKING:
    from hdsim.actuation.signal_data import SignalData

#: Longest experiment, s.
LONGEST_S = 20.0
#: Part of the rated torque up to which a locked or loaded output is wound.
WOUND = 0.6


@dataclass(frozen=True)
class Limits:
    """What an experiment may ask for; angles, speeds and accelerations at the output, SI.

    Attributes:
        low: lowest angle of the data.
        high: highest angle.
        speed: largest speed of the data but for half a percent.
        acceleration: largest acceleration, likewise.
        rated_torque: of the drive, N m.
        wind_up: twist at ``WOUND`` of the rated torque; 0 for a rigid drive.
        inertia: of the load, kg m^2.
        weighted: whether the load has weight.
        locked: whether the data are of a locked output.
    """

    low: float
    high: float
    speed: float
    acceleration: float
    rated_torque: float
    wind_up: float
    inertia: float
    weighted: bool
    locked: bool

    @property
    def middle(self) -> float:
        """Middle of the range, rad."""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> float:
        """Half of the range, rad."""
        return max(0.5 * (self.high - self.low), 1e-3)


@dataclass(frozen=True)
class Experiment:
    """A scenario's command, load and duration, with what an engineer would do.

    Attributes:
        title: what is done.
        motor: the section ``command.motor``; empty for the measured motion.
        duration_s: length.
        output: the section ``command.output``.
        load: changes of the section ``load``.
        encoder_turned_deg: angle by which the output's encoder is turned on its shaft beforehand.
        motion: the measured motion, for a repetition of the record.
        load_torque: the measured load.
        lead_in_s: time at the start that is not compared.
    """

    title: str
    motor: dict[str, Any]
    duration_s: float
    output: dict[str, Any] = field(default_factory=lambda: {"type": "free"})
    load: dict[str, Any] = field(default_factory=dict)
    encoder_turned_deg: float = 0.0
    motion: SignalData | None = None
    load_torque: SignalData | None = None
    lead_in_s: float = 0.5

    def shifted(self) -> tuple[Experiment, float] | None:
        """With the motor's zero elsewhere, and by how much (rad at the output); None where that is known.

        With the output locked nobody knows the angle at which the drive is unwound.
        """
        trajectory = self.motor.get("trajectory")
        if self.output["type"] != "locked" or trajectory is None:
            return None
        key = "offset_rad" if trajectory["type"] == "sine" else "initial_rad"
        reach = trajectory.get("amplitude_rad") or abs(trajectory["moves"][0]["distance_rad"])
        step = 0.03 * float(reach)
        moved = trajectory | {key: trajectory.get(key, 0.0) + step}
        return replace(self, motor=self.motor | {"trajectory": moved}), step


def limits_of(bench: Bench, state: State) -> Limits:
    """The limits that data and drive set."""
    from hdsim.drive.spring import catalogue_wind_up

    predictors = bench.predictors[: bench.training]
    ratio = predictors[0].ratio
    angle = np.concatenate([p.motor_angle for p in predictors]) / ratio
    speed = np.abs(np.concatenate([p.motor_velocity for p in predictors]) / ratio)
    acceleration = np.abs(np.concatenate([p.motor_acceleration for p in predictors]) / ratio)
    locked = all(p.plan.locked for p in predictors)
    drive = state.drive
    torque = WOUND * float(drive.rated_torque_nm)
    rigid = drive.mesh.model == "rigid"
    return Limits(
        low=float(angle.min()),
        high=float(angle.max()),
        speed=max(float(np.quantile(speed, 0.995)), 1e-3),
        acceleration=max(float(np.quantile(acceleration, 0.995)), 1e-2),
        rated_torque=float(drive.rated_torque_nm),
        wind_up=0.0 if rigid else float(catalogue_wind_up(drive.torsion, np.array([torque]))[0]),
        inertia=float(state.load.inertia_kg_m2),
        weighted=state.load.gravity is not None,
        locked=locked,
    )


def experiments(limits: Limits) -> list[Experiment]:
    """What is tried: slow, fast, creeping, far, swept, loaded, locked and with the encoder turned."""
    found = []
    if limits.wind_up > 0.0:
        found += _locked(limits)
    if limits.locked:
        return found
    medium = _swing(limits, limits.half, 0.5 * limits.speed)
    found += [
        Experiment("swing slowly over the measured range", *_swing(limits, limits.half, 0.15 * limits.speed)),
        Experiment(
            "swing at 1.5 times the measured speed", *_swing(limits, 0.7 * limits.half, 1.5 * limits.speed)
        ),
        Experiment("creep to and fro", *_swing(limits, min(0.02, limits.half), 0.03 * limits.speed)),
        _turn(limits),
        _sweep(limits),
        Experiment("swing with the output's encoder turned by 90 degrees", *medium, encoder_turned_deg=90.0),
    ]
    bias = {"torque": {"type": "hold", "torque_nm": _rounded(0.4 * limits.rated_torque)}}
    found.append(Experiment("swing under a constant torque on the output", *medium, load=bias))
    if limits.weighted:
        found.append(Experiment("swing without the load's weight", *medium, load={"gravity": None}))
    return found


def _swing(limits: Limits, amplitude: float, speed: float) -> tuple[dict[str, Any], float]:
    """A sine about the middle of the range and its duration, within twice the data's acceleration."""
    rate = min(speed / amplitude, math.sqrt(2.0 * limits.acceleration / amplitude))
    # At least one period and a half in the longest experiment.
    rate = max(rate, 1.5 * 2.0 * math.pi / LONGEST_S)
    amplitude = min(amplitude, speed / rate)
    cycles = max(1.5, min(4.0, LONGEST_S * rate / (2.0 * math.pi)))
    trajectory = {
        "type": "sine",
        "amplitude_rad": _rounded(amplitude),
        "frequency_hz": _rounded(rate / (2.0 * math.pi)),
        "phase_deg": -90.0,
        "offset_rad": _rounded(limits.middle),
    }
    return {"type": "motion", "at": "output", "trajectory": trajectory}, _rounded(
        min(cycles * 2.0 * math.pi / rate, LONGEST_S)
    )


def _move(limits: Limits, distance: float, speed: float) -> dict[str, Any]:
    return {
        "type": "s_curve",
        "distance_rad": _rounded(distance),
        "maximum_velocity_rad_per_s": _rounded(speed),
        "maximum_acceleration_rad_per_s2": _rounded(limits.acceleration),
        "maximum_jerk_rad_per_s3": _rounded(20.0 * limits.acceleration),
    }


def _turn(limits: Limits) -> Experiment:
    distance = min(2.0 * math.pi, 0.4 * LONGEST_S * limits.speed)
    moves = [_move(limits, distance, limits.speed), {"type": "hold", "duration_s": 0.3}]
    moves += [_move(limits, -distance, limits.speed)]
    trajectory = {"type": "sequence", "initial_rad": _rounded(limits.middle), "moves": moves}
    duration = 2.0 * (distance / limits.speed + 2.0 * limits.speed / limits.acceleration) + 1.0
    return Experiment(
        f"turn the output by {math.degrees(distance):.0f} degrees and back at constant speed",
        {"type": "motion", "at": "output", "trajectory": trajectory},
        _rounded(min(duration, LONGEST_S)),
    )


def _sweep(limits: Limits) -> Experiment:
    """A chirp up to 12 Hz whose torque of inertia stays below 0.3 of the rated one."""
    highest = 12.0
    largest = min(0.3 * limits.rated_torque / limits.inertia, 20.0 * limits.acceleration)
    trajectory = {
        "type": "chirp",
        "amplitude_rad": _rounded(largest / (2.0 * math.pi * highest) ** 2),
        "start_frequency_hz": 0.5,
        "end_frequency_hz": highest,
        "duration_s": 10.0,
        "offset_rad": _rounded(limits.middle),
    }
    motor = {"type": "motion", "at": "output", "trajectory": trajectory}
    return Experiment("sweep the frequency of a small swing from 0.5 to 12 Hz", motor, 10.0)


def _locked(limits: Limits) -> list[Experiment]:
    """The output held while the motor winds the drive, and the motor held while the output is loaded."""
    held = {"type": "locked"}
    torque = WOUND * limits.rated_torque
    slow = {"type": "sine", "amplitude_rad": _rounded(limits.wind_up), "frequency_hz": 0.2}
    # Loops within loops: every reversal a fifth nearer to zero than the one before.
    ends = [limits.wind_up * (-0.8) ** k for k in range(9)]
    distances = np.diff([0.0, *ends])
    moves = [
        {
            "type": "s_curve",
            "distance_rad": _rounded(float(distance)),
            "maximum_velocity_rad_per_s": _rounded(2.0 * limits.wind_up),
            "maximum_acceleration_rad_per_s2": _rounded(20.0 * limits.wind_up),
            "maximum_jerk_rad_per_s3": _rounded(400.0 * limits.wind_up),
        }
        for distance in distances
    ]
    nested = {"type": "sequence", "moves": moves}
    duration = float(np.sum(np.abs(distances) / (2.0 * limits.wind_up) + 0.15)) + 0.5
    triangle = {"type": "triangle", "amplitude_nm": _rounded(torque), "frequency_hz": 0.2}
    found = [
        Experiment(
            f"lock the output and wind the drive slowly to plus and minus {torque:.3g} N m",
            {"type": "motion", "at": "output", "trajectory": slow},
            10.0,
            held,
        ),
        Experiment(
            f"lock the output and wind the drive to and fro, each time less, from {torque:.3g} N m",
            {"type": "motion", "at": "output", "trajectory": nested},
            _rounded(duration),
            held,
        ),
    ]
    if not limits.locked:
        found.append(
            Experiment(
                f"lock the motor and load the output slowly to plus and minus {torque:.3g} N m",
                {"type": "locked"},
                10.0,
                load={"torque": triangle, "gravity": None},
            )
        )
    return found


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
