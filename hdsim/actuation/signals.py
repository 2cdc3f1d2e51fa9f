"""Signals with units: trajectories of an angle or a velocity, and torques over time.

Each shape of ``hdsim.actuation.shapes`` becomes one class per quantity, with one field per unit: the
``distance`` of a trapezoid is ``distance_rad``, ``distance_deg`` or ``distance_turns`` for an angle.
``AngleTrajectory``, ``VelocityTrajectory`` and ``TorqueSignal`` are the unions, told apart by ``type``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, cast, get_args, get_origin

from pydantic import Field, ValidationError, create_model, model_validator
from pydantic.fields import FieldInfo

from hdsim.actuation import shapes, waves
from hdsim.actuation.signal_data import SignalData
from hdsim.errors import InputError
from hdsim.parts import Parameters

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from hdsim.kernel import Kernel

    Array = NDArray[np.float64]

_DEG, _TURN = math.pi / 180.0, 2.0 * math.pi
_RPM = _TURN / 60.0


@dataclass(frozen=True)
class Quantity:
    """What a signal is a signal of.

    Args:
        name: prefix of its classes.
        units: for the signal and each of its derivatives, unit suffix to factor to SI; the first is SI.
        words: field names that differ from the shape's.
        shapes: the shapes that make sense for it, by their ``type``.
    """

    name: str
    units: tuple[dict[str, float], ...]
    words: dict[str, str]
    shapes: dict[str, Any]


_ANY: dict[str, Any] = {
    "hold": shapes.Hold,
    "step": shapes.Step,
    "ramp": shapes.Ramp,
    "sine": waves.Sine,
    "chirp": waves.Chirp,
    "multisine": waves.Multisine,
    "triangle": waves.Triangle,
    "recorded": shapes.Recorded,
}

ANGLE = Quantity(
    "Angle",
    (
        {"rad": 1.0, "deg": _DEG, "turns": _TURN},
        {"rad_per_s": 1.0, "deg_per_s": _DEG, "rpm": _RPM},
        {"rad_per_s2": 1.0, "deg_per_s2": _DEG, "rpm_per_s": _RPM},
        {"rad_per_s3": 1.0, "deg_per_s3": _DEG},
    ),
    {"value": "angle"},
    {**_ANY, "trapezoid": shapes.Trapezoid, "s_curve": shapes.SCurve},
)
VELOCITY = Quantity(
    "Velocity",
    (
        {"rad_per_s": 1.0, "deg_per_s": _DEG, "rpm": _RPM},
        {"rad_per_s2": 1.0, "deg_per_s2": _DEG, "rpm_per_s": _RPM},
        {"rad_per_s3": 1.0, "deg_per_s3": _DEG},
    ),
    {"value": "velocity", "velocity": "acceleration", "acceleration": "jerk"},
    _ANY,
)
TORQUE = Quantity(
    "Torque",
    ({"nm": 1.0}, {"nm_per_s": 1.0}, {"nm_per_s2": 1.0}),
    {"value": "torque", "velocity": "rate", "acceleration": "rate_change"},
    _ANY,
)


class SignalModel(Parameters):
    """A signal with units, as a scenario writes it. It is also what ``Builder.signal`` takes."""

    shape: ClassVar[type[shapes.Shape]]
    amounts: ClassVar[dict[str, dict[str, float]]]
    units: ClassVar[dict[str, float]]

    @model_validator(mode="after")
    def _sound(self) -> SignalModel:
        try:
            _ = self.si
        except ValidationError as error:
            raise ValueError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None
        return self

    @cached_property
    def si(self) -> shapes.Shape:
        """The shape in SI units."""
        given: dict[str, Any] = {}
        for name, info in self.shape.model_fields.items():
            if name in self.amounts:
                units = self.amounts[name]
                found = {field: factor for field, factor in units.items() if getattr(self, field) is not None}
                if len(found) > 1 or (not found and info.is_required()):
                    verdict = f"found {' and '.join(found)}" if found else "none is given"
                    raise ValueError(f"give exactly one of {', '.join(units)}; {verdict}")
                for field, factor in found.items():
                    given[name] = factor * getattr(self, field)
            elif name == "moves":
                given[name] = [move.si for move in self.moves]  # type: ignore[attr-defined]
            elif name == "value_factor":
                given[name] = self._value_factor()
            else:
                given[name] = getattr(self, name)
        return self.shape(**given)

    def _value_factor(self) -> float:
        """From the unit of a recorded file to SI."""
        raise NotImplementedError

    @cached_property
    def data(self) -> SignalData:
        """The signal made ready to run, in SI units; kept for signals of the same numbers.

        Raises:
            InputError: a recorded file cannot be read.
        """
        shape = self.si
        return _kept(_Given(shape, type(shape), repr(shape))) if shape.lasting else SignalData(shape.move())

    @property
    def kernel(self) -> Kernel:
        """The signal kernel."""
        return SignalData.kernel

    @property
    def end_time(self) -> float:
        """Time in s after which the signal is constant; infinite when it never is."""
        return self.data.end_time

    def pack(self) -> Array:
        """Parameters of the kernel, float64."""
        return self.data.pack()

    def corners(self, start: float, end: float) -> Array:
        """Times in (start, end), in s, where the signal or one of its first two derivatives jumps."""
        return self.data.corners(start, end)

    def joints(self, start: float, end: float) -> Array:
        """Times in (start, end), in s, where pieces of the signal meet."""
        return self.data.joints(start, end)

    def values(self, times: ArrayLike) -> Array:
        """Value and three time derivatives, SI, shape (4, n), at ``times`` (s), shape (n,)."""
        return self.data.values(times)


@dataclass(frozen=True)
class _Given:
    """A shape; alike where kind and numbers are, which its text tells in full."""

    shape: shapes.Shape = field(compare=False)
    kind: type[shapes.Shape]
    text: str


@lru_cache(maxsize=32)
def _kept(given: _Given) -> SignalData:
    """A shape made ready: runs side by side, and a run and what is integrated beside it, share signals."""
    return SignalData(given.shape.move())


class _RecordedModel(SignalModel):
    """A recorded signal: its file is read when the scenario is checked, so that mistakes show there."""

    @model_validator(mode="after")
    def _readable(self) -> _RecordedModel:
        from hdsim.actuation.recorded import read_columns

        given: Any = self
        try:
            read_columns(given.file, [given.time_column, given.value_column])
        except InputError as error:
            raise ValueError(str(error)) from None
        return self

    def _value_factor(self) -> float:
        given: Any = self
        return self.units[given.value_unit]


def _order(info: FieldInfo) -> shapes.Amount | None:
    """The ``Amount`` of a field of a shape, also when the field may be left out."""
    inner: list[Any] = list(info.metadata)
    for choice in get_args(info.annotation):
        inner += get_args(choice)[1:] if get_origin(choice) is Annotated else []
    return next((mark for mark in inner if isinstance(mark, shapes.Amount)), None)


def _bare(info: FieldInfo) -> Any:
    """Type of a number field without its ``Amount``, but with its bounds."""
    bounds: list[Any] = list(info.metadata)
    for choice in get_args(info.annotation) if get_origin(info.annotation) in (Union, UnionType) else ():
        bounds += get_args(choice)[1:] if get_origin(choice) is Annotated else []
    bounds = [mark for mark in bounds if not isinstance(mark, shapes.Amount)]
    return Annotated[(float, *bounds)] if bounds else float


def _fields(
    quantity: Quantity, shape: type[shapes.Shape]
) -> tuple[dict[str, Any], dict[str, dict[str, float]]]:
    """Fields with units for a shape, and which of them stand for which field of the shape."""
    fields: dict[str, Any] = {}
    amounts: dict[str, dict[str, float]] = {}
    for name, info in shape.model_fields.items():
        amount = _order(info)
        if amount is not None:
            units = quantity.units[amount.order]
            word = quantity.words.get(name, name)
            amounts[name] = {f"{word}_{suffix}": factor for suffix, factor in units.items()}
            single = len(units) == 1 and info.is_required()
            for field in amounts[name]:
                kind = _bare(info)
                text = f"{info.description} Unit: {field.removeprefix(word + '_')}."
                if len(units) > 1:
                    text += f" Give one of {', '.join(amounts[name])}."
                if single:
                    fields[field] = (kind, Field(description=text))
                else:
                    fields[field] = (kind | None, Field(None, description=text))
        elif name == "value_factor":
            choices = Literal[tuple(quantity.units[0])]  # type: ignore[valid-type]
            default = next(iter(quantity.units[0]))
            fields["value_unit"] = (choices, Field(default, description="Unit of the values in the file."))
        elif name != "moves":
            fields[name] = (info.annotation, info)
    return fields, amounts


def _model(quantity: Quantity, kind: str, shape: type[shapes.Shape], **more: Any) -> type[SignalModel]:
    """One class: a shape with the units of a quantity."""
    fields, amounts = _fields(quantity, shape)
    fields["type"] = (Literal[kind], Field(description="Shape of the signal."))
    base: type[SignalModel] = _RecordedModel if shape is shapes.Recorded else SignalModel
    made: Any = create_model(
        f"{quantity.name}{shape.__name__}",
        __base__=base,
        __module__=__name__,
        __doc__=shape.__doc__,
        **fields,
        **more,
    )
    made.shape = shape
    made.amounts = amounts
    made.units = quantity.units[0]
    return cast(type[SignalModel], made)


def _union(quantity: Quantity) -> Any:
    """The discriminated union of all signals of a quantity, sequences included."""
    simple = [_model(quantity, kind, shape) for kind, shape in quantity.shapes.items()]
    member = Annotated[Union[tuple(simple)], Field(discriminator="type")]  # type: ignore[valid-type]  # noqa: UP007
    info = shapes.Sequence.model_fields["moves"]
    moves = (list[member], Field(min_length=1, description=info.description))  # type: ignore[valid-type]
    whole = [*simple, _model(quantity, "sequence", shapes.Sequence, moves=moves)]
    return Annotated[Union[tuple(whole)], Field(discriminator="type")]  # noqa: UP007


if TYPE_CHECKING:
    AngleTrajectory = SignalModel
    VelocityTrajectory = SignalModel
    TorqueSignal = SignalModel
else:
    AngleTrajectory = _union(ANGLE)
    VelocityTrajectory = _union(VELOCITY)
    TorqueSignal = _union(TORQUE)
