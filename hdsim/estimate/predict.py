"""Step 2a, predict: the model under the measured motion and the known load, channel by channel.

With both encoders the motor's motion is prescribed (``hdsim.estimate.prescribed``), output motion and torques
are predicted; without the motor's encoder torques are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import PhysicsError
from hdsim.estimate.known_load import beside_readings
from hdsim.estimate.lead_in import LeadInDamper
from hdsim.estimate.noise import noise_of_means, quantisation_step, step_of, without_orders
from hdsim.estimate.plan import LoadSource, Locked, Plan, plan_for
from hdsim.estimate.prescribed import LEAD_IN_S, Prescribed
from hdsim.estimate.records import Array, Mask, Record
from hdsim.estimate.spline import signal
from hdsim.estimate.true_motion import errors_of, true_motion
from hdsim.estimate.zeros import Zero

if TYPE_CHECKING:
    from hdsim.actuation.arm import Arm
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.model import Model
    from hdsim.drive.parameters import Drive
    from hdsim.parts import Effect

#: Relative tolerance of predictions: tight against the steps of finite differences, for an integrator's
#: noise in a Jacobian looks like information; and the tolerance of a search, whose steps are larger.
RTOL, COARSE_RTOL = 1e-6, 3e-5
#: How much more closely the whole model of a drive with teeth follows its ring (``Model.seen_scale``).
CLOSER = 10.0
#: Predicted channels of a model and of one beside it, shape (n,) each.
Change = tuple[dict[str, Array], dict[str, Array]]


@dataclass(frozen=True)
class Candidate:
    """A model as the predictions need it; see ``State``."""

    drive: Drive
    effects: dict[str, Effect]
    load: Any
    seed: int = 0
    swings: Mapping[int, tuple[float, float]] = field(default_factory=dict)


class Predictor(Prescribed):
    """Predicts the channels of one record for any candidate model.

    Args:
        record: the measured run.
        plan: what is prescribed and predicted.
        ratio: the model's signed ratio.
        arm: see ``Prescribed``.
        rtol: relative tolerance of the integration.
        apart_s: see ``Prescribed``.
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
        super().__init__(record, plan, ratio, arm, apart_s)
        self.rtol = rtol
        self.steps: list[int] = []  # of the integration, of each prediction but of whole models
        #: Of drives with teeth (``hdsim.estimate.short_cut``): no short cut; whose teeth are in a table.
        self.whole = False
        self.table_for: frozenset[str] | None = None
        #: Number of the record among those that are held against a model together.
        self.number = 0

    @contextlib.contextmanager
    def within(self, rtol: float) -> Iterator[None]:
        """Predict with another tolerance."""
        kept, self.rtol = self.rtol, rtol
        try:
            yield
        finally:
            self.rtol = kept

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
        asked = tuple(dict.fromkeys((*self.plan.channels, *also)))
        (got,) = self._sampled([self._model(candidate)], asked, self._swing(candidate))
        return self._as_read(got) | {f"true_{name}": got[name] for name in also}

    def beside(self, candidate: Candidate, others: Sequence[Candidate]) -> list[Change | None]:
        """What a model predicts, and others that differ so little that they may be linearised beside it.

        Args:
            candidate: the model.
            others: see ``hdsim.simulation.sample.samples_beside``; of other parts, they are none of these.

        Returns:
            Predicted channels of the model and of each other one; None where that is none.

        Raises:
            PredictionError: the model cannot be, or could not be integrated.
        """
        from hdsim.simulation.sample import alike

        model = self._model(candidate)
        end = float(self.record.time[-1]) + LEAD_IN_S
        near: list[Model | None] = []
        if not alike(model, model, end):
            return [None] * len(others)  # nor to any other, whose tables would be made in vain
        for other in others:
            try:
                one = self._model(other)
            except PredictionError:
                near.append(None)
            else:
                near.append(one if alike(model, one, end) else None)
        if all(one is None for one in near):
            return [None] * len(near)
        models = [model, *(one for one in near if one is not None)]
        got, *there = self._sampled(models, self.plan.channels, self._swing(candidate))
        here, changed = self._as_read(got), iter(there)
        return [None if one is None else (here, self._as_read(next(changed))) for one in near]

    def set_free(
        self, candidate: Candidate, changes: Array, until_s: float = np.inf
    ) -> tuple[list[dict[str, Array]], Array]:
        """What a model predicts, and what it would with other swings at the record's beginning.

        Args:
            candidate: the model.
            changes: of angle and speed of the output there, shape (k, 2): so small that they are linear.
            until_s: the last time that is predicted, s; from there on all stays as it was.

        Returns:
            Predicted channels with the swing that is, and with each change of it: none of a model whose
            output does not swing. What angle and speed are when wound up by the rated torque, (2,).

        Raises:
            PredictionError: the model cannot be, or could not be integrated.
        """
        from hdsim.simulation.sample import alike

        model, size = self._model(candidate), len(self.record.time)
        at = model.place_of.get("output")
        if self.plan.locked or at is None or not alike(model, model, until_s):
            return [], np.ones(2)
        # Means of readings reach to the next one.
        count = min(int(np.searchsorted(self.record.time, until_s, "right")) + 2, size)
        swings = self._swing(candidate) + np.vstack([np.zeros(2), changes])
        found = self._sampled([model] * len(swings), self.plan.channels, swings, count)
        found = [{c: np.pad(v, (0, size - count), mode="edge") for c, v in got.items()} for got in found]
        return [self._as_read(got) for got in found], model.system.scale[at : at + 2]

    def _swing(self, candidate: Candidate) -> Array:
        """Angle and speed of the output's swing where the record begins, shape (2,), rad and rad/s."""
        return np.array(candidate.swings.get(self.number, (0.0, 0.0)))

    def _sampled(
        self, models: Sequence[Model], channels: Sequence[str], swings: Array, count: int | None = None
    ) -> list[dict[str, Array]]:
        """Channels of a model, and of those that are linearised beside it, at the record's times.

        Args:
            models: these.
            channels: which.
            swings: where the record begins, of all of them, shape (2,), or of each, (models, 2).
            count: how many of these times; all of them when None.
        """
        from hdsim.simulation.run import RunFailed
        from hdsim.simulation.sample import SetFree, samples_beside

        model, *others = models
        free, at = None, model.place_of.get("output")
        if at is not None and swings.any():
            jumps = np.zeros((len(models), model.system.size))
            jumps[:, at : at + 2] = swings
            free = SetFree(LEAD_IN_S, jumps)
        scale, steps = model.seen_scale(CLOSER if self.whole else 1.0), [] if self.whole else self.steps
        times, rtol = self.record.time[:count] + LEAD_IN_S, self.rtol
        try:
            return samples_beside(
                model, others, times, channels, rtol=rtol, atol=rtol * scale, steps=steps, set_free=free
            )
        except RunFailed as error:
            raise PredictionError(str(error)) from None

    def _as_read(self, got: Mapping[str, Array]) -> dict[str, Array]:
        """The predicted channels of what was sampled, as the sensors read them."""
        found = {c: self._means.of(got.get(f"measured_{c}", got[c])) for c in self.plan.channels}
        if self.slow is not None and "output_torque" in found:
            # What the sensor adds, and of that what a slow load could not be.
            own = found["output_torque"] - self._means.of(got["output_torque"])
            own = own - self.slow.of(own) if np.any(own) else own
            found["output_torque"] = self.slow_torque + own
        return found

    def _model(self, candidate: Candidate) -> Model:
        """A candidate under the record's motion and load.

        Raises:
            PredictionError: it cannot be.
        """
        from hdsim.actuation.loads import SignalTorque
        from hdsim.actuation.shapes import Hold
        from hdsim.actuation.signal_data import SignalData
        from hdsim.drive.model import Model

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
        return model

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
