"""Starting, running and back-driving torque, and efficiency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.metrics._spans import plateaus
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Speed beyond which a motor shaft counts as turning: 0.01 rad/s, and as a multiple of the smoothing speed of
#: its friction's sign.
_TURNING_RAD_PER_S, _TURNING = 0.01, 6.0
#: Growth within a sample, as a share, up to which a torque at the start of motion is that of friction.
_SLOW = 0.05

_MANUAL = "Harmonic Drive AG, engineering data: no-load starting, back-driving and running torque, efficiency"


def turning_speed(scenario: Scenario) -> float:
    """Motor speed beyond which the shaft counts as turning, rad/s."""
    return max(_TURNING_RAD_PER_S, _TURNING * scenario.drive.friction.smoothing_velocity_rad_per_s)


def _at_start(recording: Recording, scenario: Scenario, driving: str, idle: str) -> float:
    """Size of the torque ``driving`` at which the motor begins to turn, the torque ``idle`` being zero, N m.

    It grows slowly from zero: by what it grows within a sample it may be too large.

    Raises:
        InputError: the motor does not turn, turns from the beginning, or not by that torque alone.
    """
    first = _starts(recording, scenario)
    _without_gravity(scenario, "a torque at the start of motion needs")
    other = float(np.max(np.abs(recording[idle][: first + 1])))
    if other > 0.0:
        raise InputError(
            f"a torque at the start of motion needs {idle} to be zero until then; here it is up to "
            f"{other:.3g} N m"
        )
    size = np.abs(recording[driving][: first + 1])
    growth = float(np.max(np.abs(np.diff(size, prepend=0.0))))
    if not growth <= _SLOW * size[-1] or size[-1] == 0.0:
        raise InputError(
            f"a torque at the start of motion needs a {driving} that grows slowly from zero; here it changes "
            f"by up to {growth:.3g} N m within a sample, and is {size[-1]:.3g} N m then"
        )
    return float(size[-1])


def _without_gravity(scenario: Scenario, needs: str) -> None:
    """Refuse an output that gravity loads: the load torque does not hold it."""
    if scenario.load.gravity is not None or scenario.load.arm is not None:
        raise InputError(f"{needs} an output without gravity; here an arm hangs on it")


def _starts(recording: Recording, scenario: Scenario) -> int:
    """Sample at which the motor begins to turn.

    Raises:
        InputError: it does not turn, or it turns from the beginning.
    """
    threshold = turning_speed(scenario)
    turning = np.flatnonzero(np.abs(recording["motor_velocity"]) > threshold)
    if not len(turning):
        raise InputError(f"the drive does not start to turn: the motor stays below {threshold:.3g} rad/s")
    if turning[0] == 0:
        raise InputError("a starting torque needs a drive at rest; the motor turns from the beginning")
    return int(turning[0])


@metric("starting_torque", "N m", "motor torque at which the unloaded drive starts to turn", _MANUAL)
def starting_torque(recording: Recording, scenario: Scenario) -> float:
    """Motor torque at the start of motion, N m."""
    return _at_start(recording, scenario, "motor_torque", "load_torque")


@metric("back_driving_torque", "N m", "output torque at which the drive is turned from the output", _MANUAL)
def back_driving_torque(recording: Recording, scenario: Scenario) -> float:
    """Load torque at the start of motion, motor free, N m."""
    return _at_start(recording, scenario, "load_torque", "motor_torque")


@dataclass(frozen=True)
class OperatingPoints:
    """Averages over each plateau of speed and load.

    Args:
        speed: motor speed, rad/s, shape (n,), positive.
        load: load torque against the motion, N m, shape (n,); negative when the load drives.
        motor_torque: mean motor torque in the direction of motion, N m, shape (n,).
        efficiency: work out over work in, 1, shape (n,); NaN without load.
    """

    speed: Array
    load: Array
    motor_torque: Array
    efficiency: Array

    def grid(self, values: Array) -> tuple[Array, Array, Array]:
        """Values as a map: speeds (m,), loads (k,), values (k, m); NaN where there was no plateau."""
        speeds, loads = np.unique(np.round(self.speed, 3)), np.unique(np.round(self.load, 3))
        table = np.full((len(loads), len(speeds)), math.nan)
        rows, columns = (
            np.searchsorted(loads, np.round(self.load, 3)),
            np.searchsorted(speeds, np.round(self.speed, 3)),
        )
        table[rows, columns] = values
        return speeds, loads, table


def _points(recording: Recording, scenario: Scenario) -> OperatingPoints:
    """Plateaus whose load is the load torque alone.

    Raises:
        InputError: the run has none, or gravity loads the output.
    """
    _without_gravity(scenario, "running torque and efficiency need")
    return operating_points(recording)


def operating_points(recording: Recording) -> OperatingPoints:
    """Every plateau of a run, evaluated.

    Raises:
        InputError: the run has none.
    """
    found = plateaus(recording)
    if not found:
        raise InputError("running torque and efficiency need a stretch of constant speed and load")
    rows = []
    for plateau in found:
        part = plateau.samples
        ways = [
            math.copysign(1.0, float(np.mean(recording[name][part])))
            for name in ("motor_velocity", "output_velocity")
        ]
        load = -ways[1] * plateau.load
        supplied, delivered = (
            float(recording[name][part][-1] - recording[name][part][0])
            for name in ("work_supplied", "work_delivered")
        )
        efficiency = math.nan
        if load > 1e-9:
            efficiency = delivered / supplied
        elif load < -1e-9:
            # The load drives: what reaches the motor, which brakes, over what the load gives.
            efficiency = max(0.0, supplied / delivered)
        torque = ways[0] * float(np.mean(recording["motor_torque"][part]))
        rows.append((abs(plateau.speed), load, torque, efficiency))
    return OperatingPoints(*np.array(rows).T)


@metric("running_torque", "N m", "mean motor torque without load, at the fastest plateau of the run", _MANUAL)
def running_torque(recording: Recording, scenario: Scenario) -> float:
    """Mean motor torque at the fastest plateau without load, N m."""
    points = _points(recording, scenario)
    unloaded = np.flatnonzero(np.abs(points.load) < 1e-9)
    if not len(unloaded):
        raise InputError("a no-load running torque needs a plateau of constant speed without load torque")
    return float(points.motor_torque[unloaded[np.argmax(points.speed[unloaded])]])


@metric("efficiency", "1", "work out over work in, at the plateau with the largest load and speed", _MANUAL)
def efficiency(recording: Recording, scenario: Scenario) -> float:
    """Efficiency at the plateau of largest power delivered; driving counts before back-driving."""
    points = _points(recording, scenario)
    loaded = np.flatnonzero(np.isfinite(points.efficiency))
    if not len(loaded):
        raise InputError("efficiency needs a plateau of constant speed with a load torque")
    power = (points.load * points.speed)[loaded]
    return float(points.efficiency[loaded[np.argmax(power)]])
