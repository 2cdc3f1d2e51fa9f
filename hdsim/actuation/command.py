"""The ``command`` section of a scenario: what drives the motor and, if anything does, moves the output."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from hdsim.actuation._kernels import controller as controller_kernel
from hdsim.actuation._kernels import held_torque, motor_torque
from hdsim.actuation.canonical import CanonicalController, Loop, Side, canonical_controller
from hdsim.actuation.choice import PositionController, VelocityController
from hdsim.actuation.controllers import Controller
from hdsim.actuation.shapes import Hold
from hdsim.actuation.signal_data import SignalData
from hdsim.actuation.signals import AngleTrajectory, SignalModel, TorqueSignal, VelocityTrajectory
from hdsim.parts import Builder, Parameters, Part, State

if TYPE_CHECKING:
    from hdsim.actuation.sampled import SampledController


@dataclass(frozen=True)
class Motion:
    """A prescribed motion: the angle of ``axis`` follows ``signal`` (rad), whatever torque that takes."""

    axis: Side
    signal: SignalData


class TorqueCommand(Part):
    """Motor torque over time, without feedback."""

    type: Literal["torque"]
    torque: TorqueSignal
    """Motor torque, positive in the direction of positive motor angle."""

    def contribute(self, build: Builder) -> None:
        """Add the torque and the power that it supplies."""
        build.element(motor_torque, [build.signal(self.torque.data)])

    @property
    def end_time(self) -> float:
        """Time in s after which nothing is commanded any more."""
        return self.torque.end_time


class _Servo(Part):
    """A closed loop on a trajectory."""

    at: Side = "output"
    """Side on which the trajectory is given; at the other one it is seen through the signed ratio."""
    feedback: Side = "motor"
    """Side whose angle and velocity are fed back: ``motor`` (collocated) or ``output``."""
    torque_limit_nm: float | None = Field(None, gt=0.0)
    """Largest motor torque in either direction; none when left out. Unit N m."""
    sample_period_s: float | None = Field(None, gt=0.0)
    """Sample period; the torque is held in between. The controller is continuous when left out. Unit s."""
    discretisation: Literal["zoh", "tustin"] = "tustin"
    """How a sampled controller is made from the continuous one: zero-order hold or Tustin's rule."""

    @property
    def signal(self) -> SignalModel:
        """The trajectory."""
        return self.trajectory  # type: ignore[attr-defined,no-any-return]

    @property
    def law(self) -> Controller:
        """The controller."""
        return self.controller  # type: ignore[attr-defined,no-any-return]

    @property
    def order(self) -> int:
        """0 when the trajectory is an angle, 1 when it is a velocity."""
        raise NotImplementedError

    @property
    def end_time(self) -> float:
        """Time in s after which the trajectory is constant."""
        return self.signal.end_time

    @property
    def limit(self) -> float:
        """Torque limit in N m, infinite for none."""
        return math.inf if self.torque_limit_nm is None else self.torque_limit_nm

    @model_validator(mode="after")
    def _inputs_exist(self) -> _Servo:
        if self.order and "reference_position" in getattr(self.law, "inputs", ()):
            raise ValueError("a velocity command has no reference_position; use reference_velocity")
        return self

    def canonical(self, ratio: float) -> CanonicalController:
        """The continuous controller in canonical form, for a drive of signed ``ratio``."""
        return canonical_controller(self.law, Loop(ratio, self.at, self.feedback, self.order))

    def reference(self, ratio: float, side: Side = "output") -> SignalData:
        """The trajectory as seen at ``side``, in rad or rad/s."""
        return self.signal.data.scaled(Loop(ratio, self.at, self.feedback).scale(self.at, side))

    def sampled(self, ratio: float) -> SampledController | None:
        """The sampled controller, or None when the controller is continuous."""
        if self.sample_period_s is None:
            return None
        from hdsim.actuation.sampled import SampledController

        return SampledController(
            self.canonical(ratio),
            self.signal.data,
            order=self.order,
            period=self.sample_period_s,
            method=self.discretisation,
            limit=self.limit,
            clamps=self.law.clamps,
        )

    def contribute(self, build: Builder) -> None:
        """Add the controller, or the torque that its sampled version holds."""
        if self.sample_period_s is not None:
            build.element(held_torque, [0.0])
            return
        self.follow(build, self.signal.data)

    def follow(self, build: Builder, reference: SignalData) -> None:
        """Add the continuous controller on a reference at the side ``at``, of derivative order ``order``."""
        canonical = self.canonical(build.ratio)
        torque = min(self.limit, build.rated_torque_nm / abs(build.ratio))
        states = [
            State(
                f"controller_state_{k + 1}", "1", 0.0, torque / abs(gain) if gain else 1.0, "controller state"
            )
            for k, gain in enumerate(canonical.C)
        ]
        column = build.signal(reference)
        build.element(controller_kernel, canonical.pack(column, self.order, self.limit), states=states)


class PositionCommand(_Servo):
    """A position loop on an angle trajectory."""

    type: Literal["position"]
    trajectory: AngleTrajectory
    """Reference angle."""
    controller: PositionController
    """The controller."""

    @property
    def order(self) -> int:
        """The trajectory is an angle."""
        return 0


class VelocityCommand(_Servo):
    """A velocity loop on a velocity trajectory."""

    type: Literal["velocity"]
    trajectory: VelocityTrajectory
    """Reference velocity."""
    controller: VelocityController
    """The controller."""

    @property
    def order(self) -> int:
        """The trajectory is a velocity."""
        return 1


class MotionCommand(Parameters):
    """A prescribed motion: the axis follows the trajectory exactly; the torque for it is computed."""

    type: Literal["motion"]
    trajectory: AngleTrajectory
    """Angle of the axis."""
    at: Side | None = None
    """Side on which the trajectory is given; the axis itself when left out, else through the signed ratio."""

    @property
    def end_time(self) -> float:
        """Time in s after which the axis rests."""
        return self.trajectory.end_time

    def motion(self, axis: Side, ratio: float) -> Motion:
        """The motion of ``axis`` in rad."""
        at = self.at or axis
        return Motion(axis, self.trajectory.data.scaled(Loop(ratio, at, axis).scale(at, axis)))


class LockedCommand(Parameters):
    """The axis is held still at angle 0."""

    type: Literal["locked"]

    @property
    def end_time(self) -> float:
        """Nothing happens."""
        return 0.0

    def motion(self, axis: Side, ratio: float) -> Motion:
        """The motion of ``axis`` in rad."""
        return Motion(axis, SignalData(Hold().move()))


class FreeCommand(Parameters):
    """Nothing acts on the axis from outside."""

    type: Literal["free"] = "free"

    @property
    def end_time(self) -> float:
        """Nothing happens."""
        return 0.0


MotorCommand = Annotated[
    TorqueCommand | PositionCommand | VelocityCommand | MotionCommand | LockedCommand | FreeCommand,
    Field(discriminator="type"),
]
OutputCommand = Annotated[MotionCommand | LockedCommand | FreeCommand, Field(discriminator="type")]


class Command(Part):
    """What drives the motor, and what moves the output."""

    motor: MotorCommand
    """Torque, closed loop, prescribed motion, lock, or nothing."""
    output: OutputCommand = FreeCommand()
    """Prescribed motion or lock of the output; free by default."""

    def contribute(self, build: Builder) -> None:
        """Add the torque of the motor; prescribed motions are ``motions``' and add no element."""
        if isinstance(self.motor, Part):
            self.motor.contribute(build)

    def motions(self, ratio: float) -> list[Motion]:
        """The prescribed motions, for a drive of signed ``ratio``."""
        axes: list[tuple[Side, MotorCommand | OutputCommand]] = [
            ("motor", self.motor),
            ("output", self.output),
        ]
        return [
            command.motion(axis, ratio)
            for axis, command in axes
            if isinstance(command, MotionCommand | LockedCommand)
        ]

    def reference(self, ratio: float) -> SignalData | None:
        """The angle (rad) that a position loop wants of the output, if there is one."""
        return self.motor.reference(ratio, "output") if isinstance(self.motor, PositionCommand) else None

    def sampled(self, ratio: float) -> SampledController | None:
        """The sampled controller of the motor, if there is one; it feeds the ``held_torque`` element."""
        return self.motor.sampled(ratio) if isinstance(self.motor, _Servo) else None

    @property
    def end_time(self) -> float:
        """Time in s after which everything commanded is constant; infinite when it never is."""
        return max(self.motor.end_time, self.output.end_time)
