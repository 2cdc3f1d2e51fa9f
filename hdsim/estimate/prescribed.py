"""One record's motion and load, as they are prescribed to a model.

The motion is prescribed, so an unstable or unknown controller does not matter and nothing drifts away.
With both encoders the motor's motion is prescribed. Without the motor's encoder the output's motion times the
ratio stands for it. Where the reading of the output's torque sensor is the load, all of the scenario's load
is in it, and the sensor is compared with its slow part: its ripple is faster than a load that is carried. A
measured temperature is given to the parts that follow it, smoothed as the load.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from hdsim.drive.parameters import RESOLVED_RAD_PER_S
from hdsim.estimate.known_load import MeasuredLoad, arm_course
from hdsim.estimate.noise import step_of, step_of_means, usual_size
from hdsim.estimate.plan import Plan
from hdsim.estimate.records import Array, Record
from hdsim.estimate.spline import SlowPart, drawn_anew, pieces_of, signal, smoothed, spline_through
from hdsim.estimate.thin import Means
from hdsim.estimate.true_motion import Sines
from hdsim.estimate.unloaded import unloaded_angle
from hdsim.estimate.zeros import between_zeros

if TYPE_CHECKING:
    from hdsim.actuation.arm import Arm
    from hdsim.actuation.signal_data import SignalData

#: Time for which the model runs before the record begins, so that its own oscillation has died away, s.
LEAD_IN_S = 0.5


class Prescribed:
    """The motion and load of one record.

    Args:
        record: the measured run.
        plan: what is prescribed and predicted.
        ratio: the model's signed ratio.
        arm: what the drive's joint carries, where that is a robot arm; its numbers are each candidate's own.
        apart_s: least time between the knots of a motion that no measured rate speaks for, s.
    """

    def __init__(
        self, record: Record, plan: Plan, ratio: float, arm: Arm | None = None, apart_s: float = 0.0
    ) -> None:
        self.record, self.plan, self.ratio = record, plan, ratio
        turns, self._zero = 0, 0.0
        if plan.motion == "motor_angle" and "output_angle" in record.readable and not plan.locked:
            turns, self._zero = between_zeros(record, ratio)
        self._means = Means(record)
        #: The prescribed reading, shape (n,), counted from the motor's zero that is next to the output's.
        values = self._reading = self._means.behind(record.filled(plan.motion)) + 2.0 * np.pi * turns
        # Ramps against a locked output creep: they reverse without a jump that could be seen.
        moves, step, rate = not plan.locked, self._step(plan.motion), record.rate(plan.motion)
        #: Samples (n,) that hold a reading of the motion, and the record's ends: the spline's.
        self._read = record.trusted[plan.motion].copy()
        self._read[[0, -1]] = True
        time, read = record.time[self._read], values[self._read]
        rate = None if rate is None else (self._means.behind(rate[0])[self._read], rate[1][self._read])
        through = spline_through(time, read, motion=moves, step=step, rate=rate, apart_s=apart_s)
        self._spline, self.likeliest = through
        values[~self._read] = self._spline(record.time[~self._read])
        breaks, coefficients = pieces_of(self._spline)
        #: Motor angle for the measured motion: with the motor locked, as it turns beside the output.
        self._factor = 1.0 if plan.motion == "motor_angle" else -ratio if plan.locked else ratio
        coefficients = coefficients * self._factor
        if plan.locked:
            # The encoder's zero means nothing there: the drive is unwound where it carries no torque.
            coefficients[0] -= unloaded_angle(record, self._factor * values)
        self._breaks, self._coefficients = breaks, coefficients
        self.turn(0.0)
        #: Motor speed over which a sticking drive's sign of friction is smoothed, rad/s.
        self.smoothing = RESOLVED_RAD_PER_S
        self._load: MeasuredLoad | None = None
        if plan.load != "scenario":
            carried = self._means.behind(record.filled(plan.load))
            sign = -1.0 if plan.load == "output_torque" else 1.0
            self._load = MeasuredLoad(record.time, sign * carried, self._step(plan.load))
        self.load_torque = None if self._load is None else self._load.signal(LEAD_IN_S)
        #: What a part may ask for beside the motion (``Builder.external``).
        self.signals: dict[str, SignalData] = {}
        if "temperature" in record.readable:
            found = smoothed(record.time, record.filled("temperature"))
            self.signals["temperature"] = signal(*found, LEAD_IN_S, steady=True)
        #: The part of a channel that a slow load could be, where the torque sensor's reading is the load.
        self.slow: SlowPart | None = None
        if plan.load == "output_torque":
            factor = ratio if plan.motion == "output_angle" else 1.0
            self.slow = SlowPart(record.time, factor * values / (2 * np.pi))
            #: What the sensor that is the load is compared with, shape (n,).
            self.slow_torque = self.slow.of(record.filled("output_torque"))
        #: Of an arm; a torque sensor that is the load has it in its reading.
        self._arm = arm if plan.load != "output_torque" else None
        self.course = None if self._arm is None else arm_course(record, self._arm)

    def turn(self, angle: float) -> None:
        """Turn the prescribed motion: only where a side is locked does its zero mean anything.

        Args:
            angle: added to the motor's angle, rad.
        """
        self._coefficients = self._coefficients.copy()
        self._coefficients[0] += angle
        self.motion = signal(self._breaks, self._coefficients, LEAD_IN_S)
        #: The last motion without an encoder's errors, by these.
        self._true: dict[Sines, SignalData] = {}
        motion = self.motion.values(self.record.time + LEAD_IN_S)
        #: Motor angle, velocity and acceleration as prescribed, shape (n,) each.
        self.motor_angle, self.motor_velocity, self.motor_acceleration = motion[0], motion[1], motion[2]

    def disturbed(self, seed: int = 0) -> Self:
        """The same record as another reading would have given motion and load (parametric bootstrap).

        What a prediction changes by is what the noise of the motion, of an arm's other joints and of the load
        does to it.

        Args:
            seed: of the draw.
        """
        rng = np.random.default_rng([seed, 11])
        found = self._moved(rng)
        if self._arm is not None:
            found.course = arm_course(self.record, self._arm, rng)
        if self._load is not None:
            found.load_torque = self._load.signal(LEAD_IN_S, rng)
        return found

    @cached_property
    def speed_noise(self) -> float:
        """Standard deviation of what the motion's noise does to the motor's speed as a rule, rad/s."""
        again = self._moved(np.random.default_rng([0, 11])).motor_velocity
        # The median: a loop's hiccup is no noise of the sensor.
        return usual_size(again - self.motor_velocity)

    @property
    def samples_a_knot(self) -> float:
        """Samples between knots of the prescribed motion, on average."""
        return np.count_nonzero(self._read) / len(self._spline.c)

    @property
    def angle_noise(self) -> float:
        """What readings of the prescribed motion differ by from it, root mean square, rad of the motor."""
        apart = self._factor * self._reading - self.motor_angle
        return float(np.std(apart[self._read]))

    def _moved(self, rng: np.random.Generator) -> Self:
        """The same record with the prescribed motion alone drawn anew."""
        found = copy(self)
        if self.likeliest is not None:
            coefficients: Array | None = pieces_of(self.likeliest.disturbed(rng))[1]
        else:
            read = self._read
            coefficients = drawn_anew(self.record.time[read], self._reading[read], self._spline, rng)
        if coefficients is not None:
            found._coefficients = self._factor * coefficients
            found.turn(float(self.motor_angle[0] - self._factor * self._spline(self.record.time[0])))
        return found

    def _step(self, channel: str) -> float:
        """Step of a channel's sensor, as it is felt in the record."""
        raw, values = self.record.as_read, self.record.filled(channel)
        good = raw.trusted[channel]
        step = step_of(self.record, channel)
        return step_of_means(raw.channels[channel], good, step, values, self.record.readings)
