"""The load of a prediction as parts: what is measured of it, and what the scenario says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.spline import drawn_anew, pieces_of, signal, spline_through

if TYPE_CHECKING:
    from hdsim.actuation.arm import Arm, Course
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.parameters import Drive
    from hdsim.estimate.records import Array, Record
    from hdsim.parts import Builder


class Gravity:
    """A load without its torque over time."""

    def __init__(self, load: Any) -> None:
        self.load = load

    def contribute(self, build: Builder) -> None:
        """Add the weight."""
        if self.load.gravity is not None:
            self.load.gravity.contribute(build)


def beside_readings(load: Any, drive: Drive, *, sensed: bool) -> tuple[list[Gravity], float]:
    """What a scenario's load is beside a torque that was measured: its weight, and its inertia, kg m^2.

    Args:
        load: of the scenario.
        drive: whose output it is on.
        sensed: the torque is that of a sensor at the output: all beyond it is in its reading, and a flange
            before it is no heavier than the ring.
    """
    if sensed:
        return [], min(load.inertia_kg_m2, drive.inertia.ring_kg_m2)
    return [Gravity(load)], load.inertia_kg_m2


class MeasuredLoad:
    """A load's torque as a sensor read it: a smoothing spline through its readings.

    Args:
        time: shape (n,), s.
        torque_nm: shape (n,), on the output.
        step_nm: of the sensor.
    """

    def __init__(self, time: Array, torque_nm: Array, step_nm: float) -> None:
        self._time, self._torque = time, torque_nm
        self._spline, _ = spline_through(time, torque_nm, step=step_nm)

    def signal(self, lead_in_s: float, rng: np.random.Generator | None = None) -> SignalData:
        """The torque over time, after a lead-in at its initial value; ``rng`` draws the readings anew."""
        breaks, coefficients = pieces_of(self._spline)
        if rng is not None:
            drawn = drawn_anew(self._time, self._torque, self._spline, rng)
            coefficients = coefficients if drawn is None else drawn
        return signal(breaks, coefficients, lead_in_s, steady=True)


def arm_course(record: Record, arm: Arm, rng: np.random.Generator | None = None) -> Course:
    """What the drive's joint carries of an arm along a record: the other joints move as they were measured.

    Where a joint was not measured it moves as the arm's ``joints`` says.

    Args:
        record: the measured run, with the angles of other joints.
        arm: the arm.
        rng: draws the other joints' readings anew, with their noise; None takes them as read.

    Raises:
        InputError: a measured joint is not the arm's, or the motion of one is neither measured nor given.
    """
    from scipy.interpolate import PPoly

    from hdsim.actuation.arm import STEP_S

    lost = [name for name in arm.others if name not in record.joints and name not in arm.joints]
    if lost:
        raise InputError(
            f"{record.name}: load.arm: {lost[0]} is neither measured (joints of the mapping) nor given a "
            "motion (joints of the arm)"
        )
    count = max(round(record.duration_s / max(record.period_s, STEP_S)), 2)
    times = np.linspace(record.time[0], record.time[-1], count)
    motions: dict[str, Array] = {
        name: motion.values(times + record.begins_s)[:3] for name, motion in arm.joints.items()
    }
    for name, values in record.joints.items():
        spline, _ = spline_through(record.time, values, motion=True)
        breaks, coefficients = pieces_of(spline)
        if rng is not None:
            drawn = drawn_anew(record.time, values, spline, rng)
            coefficients = coefficients if drawn is None else drawn
        angle = PPoly(coefficients[::-1], breaks)
        motions[name] = np.array([angle(times), angle(times, 1), angle(times, 2)])
    return arm.along(times, motions)
