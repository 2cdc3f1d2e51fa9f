"""Step 2a, predict: the model under the measured motion and the known load, channel by channel.

The motion is prescribed, so an unstable or unknown controller does not matter and nothing drifts away.
With both encoders the motor's motion is prescribed, output motion and torques are predicted. Without the
motor's encoder the output's motion times the ratio stands for it, and torques are predicted. Where the
reading of the output's torque sensor is the load, all of the scenario's load is in it, and the sensor is
compared with its slow part: its ripple is faster than a load that is carried. A measured temperature is given
to the parts that follow it, smoothed as the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive.parameters import RESOLVED_RAD_PER_S
from hdsim.errors import PhysicsError
from hdsim.estimate.known_load import MeasuredLoad, arm_course, beside_readings
from hdsim.estimate.lead_in import LeadInDamper
from hdsim.estimate.noise import (
    noise_of_means,
    quantisation_step,
    step_of,
    step_of_means,
    usual_size,
    without_orders,
)
from hdsim.estimate.plan import LoadSource, Locked, Plan, plan_for
from hdsim.estimate.records import Array, Mask, Record
from hdsim.estimate.spline import SlowPart, drawn_anew, pieces_of, signal, smoothed, spline_through
from hdsim.estimate.thin import Means
from hdsim.estimate.true_motion import Sines, errors_of, true_motion
from hdsim.estimate.unloaded import unloaded_angle
from hdsim.estimate.zeros import Zero, between_zeros

if TYPE_CHECKING:
    from hdsim.actuation.arm import Arm
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.parameters import Drive
    from hdsim.parts import Effect

#: Time for which the model runs before the record begins, so that its own oscillation has died away, s.
LEAD_IN_S = 0.5
#: Relative tolerance of predictions: tight against the steps of finite differences, for an integrator's
#: noise in a Jacobian looks like information; and the tolerance of a search, whose steps are larger.
RTOL, COARSE_RTOL = 1e-6, 3e-5
#: How much more closely the whole model of a drive with teeth follows its ring (``Model.seen_scale``).
CLOSER = 10.0


@dataclass(frozen=True)
class Candidate:
    """A model as the predictions need it."""

    drive: Drive
    effects: dict[str, Effect]
    load: Any
    seed: int = 0


class Predictor:
    """Predicts the channels of one record for any candidate model.

    Args:
        record: the measured run.
        plan: what is prescribed and predicted.
        ratio: the model's signed ratio.
        arm: what the drive's joint carries, where that is a robot arm; its numbers are each candidate's own.
        rtol: relative tolerance of the integration.
        apart_s: least time between the knots of a motion that no measured rate speaks for, s.
    """

    def __init__(
        self,
        record: Record,
        plan: Plan,
        ratio: float,
        arm: Arm | None = None,
        rtol: float = RTOL,
        apart_s: float = 0.0,
    ) -> None:
        self.record, self.plan, self.rtol = record, plan, rtol
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
        self.ratio = ratio
        self.steps: list[int] = []  # of the integration, of each prediction but of whole models
        #: Of drives with teeth (``hdsim.estimate.short_cut``): no short cut; whose teeth are in a table.
        self.whole = False
        self.table_for: frozenset[str] | None = None

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

    def disturbed(self, seed: int = 0) -> Predictor:
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

    def _moved(self, rng: np.random.Generator) -> Predictor:
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

    def measured(self, channel: str) -> tuple[Array, Mask, float, float]:
        """What a predicted channel is compared with.

        With both encoders the output's angle is read beside the motor's at the same moment: what a jittering
        clock, or the motor's encoder, puts on both falls out of their difference, the transmission error.
        Where that has less noise, the motor's reading less its smooth motion is taken out of the output's.

        Returns:
            Samples (n,), which of them count (n,), their noise, and that of a single reading.
        """
        record, raw = self.record, self.record.as_read
        values, trusted = record.filled(channel), record.trusted[channel]
        step = step_of(record, channel)
        angle = self._factor * raw.filled(self.plan.motion)

        def noises(read: Array, good: Mask, step: float, means: Array, whole: Mask) -> tuple[float, float]:
            read = without_orders(read, good, angle)
            means = read if means is read else without_orders(means, whole, self.motor_angle)
            single = noise_of_means(read, good, step, read, good, 1)
            return noise_of_means(read, good, step, means, whole, record.readings), single

        plain = noises(raw.channels[channel], raw.trusted[channel], step, values, trusted)
        if channel != "output_angle" or self.plan.motion != "motor_angle":
            return values, trusted, *plain
        motor, turned = record.filled("motor_angle"), raw.filled("motor_angle")
        whole = trusted & record.trusted["motor_angle"]
        good = raw.trusted[channel] & raw.trusted["motor_angle"]
        step = max(step, quantisation_step(turned[good]) / abs(self.ratio))
        read = raw.filled(channel) - turned / self.ratio
        beside = noises(read, good, step, values - motor / self.ratio, whole)
        if beside[0] >= plain[0]:
            return values, trusted, *plain
        own = self._means.of(self._reading - self.motor_angle)
        return values - own / self.ratio, whole, *beside

    def predict(self, candidate: Candidate, also: Sequence[str] = ()) -> dict[str, Array]:
        """Every predicted channel at the record's times, shape (n,) each; with sensors as they read.

        Args:
            candidate: the model.
            also: channels of the model that are returned as they are, by ``true_`` and their names.

        Raises:
            PredictionError: the model cannot be, or could not be integrated.
        """
        from hdsim.actuation.loads import SignalTorque
        from hdsim.actuation.shapes import Hold
        from hdsim.actuation.signal_data import SignalData
        from hdsim.drive.model import Model
        from hdsim.simulation.run import RunFailed
        from hdsim.simulation.sample import sample

        load = candidate.load
        weight, inertia = beside_readings(load, candidate.drive, sensed=self.slow is not None)
        parts: list[Any] = [*candidate.effects.values(), *weight]
        if self.load_torque is not None:
            parts.append(SignalTorque(self.load_torque))
        elif load.torque is not None:
            # The scenario's load begins with the record, after the lead-in.
            late = LEAD_IN_S - self.record.begins_s
            parts.append(SignalTorque(SignalData(load.torque.data.move.delayed(late))))
        if self.course is not None:
            arm = self.course.part(load.arm, LEAD_IN_S)
            parts.append(arm)
            inertia += arm.inertia_kg_m2
        if not self.plan.locked:
            parts.append(LeadInDamper(candidate.drive, inertia, LEAD_IN_S, self.ratio))
        if self._zero:
            parts.append(Zero(self._zero))
        motions: dict[str, Any] = {"motor": self._motion(candidate)}
        if self.plan.locked == "output":
            motions["output"] = SignalData(Hold().move())
        elif self.plan.locked == "motor":
            turned = -self._coefficients / self.ratio
            motions = {
                "motor": SignalData(Hold().move()),
                "output": signal(self._breaks, turned, LEAD_IN_S),
            }
        try:
            model = Model(
                candidate.drive.resolved(self.smoothing).settled(),
                parts,
                load_inertia_kg_m2=inertia,
                motions=motions,
                signals=self.signals,
                seed=candidate.seed,
                audited=False,
                table_for=None if self.whole else self.table_for,
            )
        except PhysicsError as error:
            raise PredictionError(str(error)) from None
        for side in {"ring", "output"} & set(model.place_of):
            model.system.y0[model.place_of[side]] = self._zero
        asked = tuple(dict.fromkeys((*self.plan.channels, *also)))
        try:
            rtol, scale = self.rtol, model.seen_scale(CLOSER if self.whole else 1.0)
            times, steps = self.record.time + LEAD_IN_S, [] if self.whole else self.steps
            got = sample(model, times, asked, rtol=rtol, atol=rtol * scale, steps=steps)
        except RunFailed as error:
            raise PredictionError(str(error)) from None
        found = {c: self._means.of(got.get(f"measured_{c}", got[c])) for c in self.plan.channels}
        if self.slow is not None and "output_torque" in found:
            # What the sensor adds, and of that what a slow load could not be.
            own = found["output_torque"] - self._means.of(got["output_torque"])
            own = own - self.slow.of(own) if np.any(own) else own
            found["output_torque"] = self.slow_torque + own
        return found | {f"true_{name}": got[name] for name in also}

    def _motion(self, candidate: Candidate) -> SignalData:
        """The motor's motion, without the error that the candidate knows of the encoder it was read from."""
        errors = errors_of(candidate.effects, self.plan.motion)
        if self.plan.locked or not errors:
            return self.motion
        kept = self._true.get(errors)
        if kept is None:
            try:
                breaks, angle = true_motion(self._breaks, self._coefficients / self._factor, errors)
            except ValueError as error:
                raise PredictionError(f"sensors.{self.plan.motion}: {error}") from None
            kept = signal(breaks, self._factor * angle, LEAD_IN_S)
            self._true = {errors: kept}  # a fit of something else asks for the same again
        return kept


class PredictionError(ArithmeticError):
    """A candidate model could not be integrated."""


def predictors(
    records: Sequence[Record],
    ratio: float,
    *,
    load: LoadSource | None = None,
    locked: Locked = "",
    arm: Arm | None = None,
    apart_s: float = 0.0,
) -> list[Predictor]:
    """One predictor for each record."""
    return [Predictor(r, plan_for(r, load=load, locked=locked), ratio, arm, apart_s=apart_s) for r in records]
