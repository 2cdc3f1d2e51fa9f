"""What drives a stepped joint from outside: signals of one piece that is rewritten before every step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from hdsim.actuation import _signal_kernel as law
from hdsim.actuation._kernels import motor_torque
from hdsim.actuation.command import LockedCommand, MotionCommand, PositionCommand, VelocityCommand
from hdsim.actuation.loads import SignalTorque
from hdsim.actuation.signal_data import Move, SignalData, hold
from hdsim.drive import _layout as layout
from hdsim.errors import InputError

if TYPE_CHECKING:
    from hdsim.drive.model import Model
    from hdsim.parts import Builder
    from hdsim.scenario import Scenario

MotorInput = Literal["torque", "angle", "velocity", "motion"]
OutputInput = Literal["torque", "motion"]

_UNITS = {"torque": "N m", "angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}


class _Servo:
    """A scenario's controller on an input reference."""

    def __init__(self, command: PositionCommand | VelocityCommand, signal: SignalData) -> None:
        self.command, self.signal = command, signal

    def contribute(self, build: Builder) -> None:
        self.command.follow(build, self.signal)


@dataclass(frozen=True)
class Given:
    """What a user sets at every step: a value and, of a motion, its derivatives; one signal of the model.

    Args:
        names: of the value, then of its time derivatives.
        signal: what the model holds; its one piece is rewritten before a step.
        about: one line, of the value.
        part: what hands the signal to the model; None where the model prescribes ``axis`` by it.
        axis: ``motor`` or ``output``.
    """

    names: tuple[str, ...]
    signal: SignalData
    about: str
    part: Any = None
    axis: str = ""

    @property
    def units(self) -> dict[str, str]:
        """Units by name."""
        return {name: _UNITS[name.rpartition("_")[2]] for name in self.names}

    @property
    def told(self) -> dict[str, str]:
        """One line on every name."""
        value, *derivatives = self.names
        order = ("first", "second")
        rates = {n: f"{order[k]} time derivative of {value}" for k, n in enumerate(derivatives)}
        return {value: self.about} | rates

    def place(self, model: Model) -> tuple[int, int]:
        """Where in the system's reals the start of the signal's piece stands, and its four coefficients."""
        integers = model.system.integers
        first = layout.LISTS + layout.PER_ELEMENT * int(integers[layout.ELEMENTS])
        first += layout.PER_TWIST * int(integers[layout.TWISTS])
        which = next(k for k, one in enumerate(model.signals) if one is self.signal)
        at = int(integers[first + layout.PER_SIGNAL * which + 1])
        packed = self.signal.pack()
        record = int(packed[law.HEADER + 3 * int(packed[0])])
        return at + law.HEADER, at + record + 1


def motor_given(scenario: Scenario, kind: MotorInput | None) -> Given:
    """The motor's input; what the scenario does to its motor when None.

    Raises:
        InputError: the scenario has no controller for it, or a sampled one.
    """
    command = scenario.command.motor
    if kind is None:
        kind = "motion" if isinstance(command, MotionCommand | LockedCommand) else "torque"
        kind = {"position": "angle", "velocity": "velocity"}.get(command.type, kind)  # type: ignore[assignment]
    signal = _held()
    if kind == "torque":
        about = "torque of the motor on its shaft"
        return Given(("motor_torque",), signal, about, SignalTorque(signal, motor_torque))
    if kind == "motion":
        return _motion("motor")
    wanted = "position" if kind == "angle" else "velocity"
    if not isinstance(command, PositionCommand | VelocityCommand) or command.type != wanted:
        raise InputError(
            f"motor input {kind}: found the motor command {command.type!r}, expected {wanted!r}, whose "
            "controller follows it"
        )
    if command.sample_period_s is not None:
        raise InputError(
            f"motor input {kind}: the scenario's controller is sampled; take the motor torque as input, or "
            "leave sample_period_s out"
        )
    names = ("commanded_angle", "commanded_velocity", "commanded_acceleration")[command.order :]
    return Given(names, signal, f"commanded {kind}, at the {command.at}", _Servo(command, signal))


def output_given(scenario: Scenario, kind: OutputInput | None) -> Given:
    """The output's input; what the scenario does to its output when None."""
    if kind is None:
        moved = isinstance(scenario.command.output, MotionCommand | LockedCommand)
        kind = "motion" if moved else "torque"
    if kind == "motion":
        return _motion("output")
    signal = _held()
    return Given(("load_torque",), signal, "external torque on the output", SignalTorque(signal))


def _motion(side: str) -> Given:
    """A prescribed motion of one side."""
    names = tuple(f"prescribed_{side}_{what}" for what in ("angle", "velocity", "acceleration"))
    return Given(names, _held(), f"prescribed angle of the {side}", axis=side)


def _held() -> SignalData:
    """A signal whose one piece will be rewritten."""
    return SignalData(Move((hold(0.0, 0.0),), math.inf, 0.0, 0.0))
