"""Which controllers a command can have: hdsim's own, and those of other packages."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args

from pydantic import Field

from hdsim.actuation.controllers import (
    Cascade,
    Controller,
    PositionPD,
    PositionPI,
    PositionPID,
    StateSpace,
    TransferFunction,
    VelocityPI,
    VelocityPID,
)
from hdsim.plugins import Plugin, plugins, wrong_choice

_POSITION = (PositionPI, PositionPD, PositionPID, Cascade, TransferFunction, StateSpace)
_VELOCITY = (VelocityPI, VelocityPID, TransferFunction, StateSpace)


@cache
def _outside() -> dict[str, Plugin]:
    """Controllers of other packages (entry point ``hdsim.controllers``)."""
    known = {get_args(one.model_fields["type"].annotation)[0] for one in (*_POSITION, *_VELOCITY)}
    return plugins("controllers", known, lambda one: wrong_choice(one, Controller, "type", "system"))


def _union(command: str, own: tuple[type[Controller], ...]) -> Any:
    """The union of hdsim's controllers of a command and those of other packages."""
    others = [one.value for one in _outside().values() if command in one.value.commands]
    return Annotated[Union[(*own, *others)], Field(discriminator="type")]


if TYPE_CHECKING:
    PositionController = PositionPI | PositionPD | PositionPID | Cascade | TransferFunction | StateSpace
    VelocityController = VelocityPI | VelocityPID | TransferFunction | StateSpace
else:
    PositionController = _union("position", _POSITION)
    VelocityController = _union("velocity", _VELOCITY)
