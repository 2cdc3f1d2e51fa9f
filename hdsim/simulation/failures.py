"""Why a run stopped before its end, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hdsim.drive.model import Model
    from hdsim.simulation.solvers import Integration

Array = NDArray[np.float64]

#: Motor speed beyond which a run is stopped: a hundred times what such motors reach, rad/s.
FASTEST = 1e5


class RunawayError(ArithmeticError):
    """A shaft is faster than any drive can be."""


@dataclass(frozen=True)
class Guard:
    """A state that gives a run up when it grows beyond a limit.

    Args:
        index: in the state vector.
        limit: in the state's unit.
        name: for the message.
    """

    index: int
    limit: float
    name: str

    def error(self) -> RunawayError:
        """What a run that is given up says."""
        return RunawayError(f"{self.name} exceeds {self.limit:g}")


def speed_guard(model: Model) -> Guard | None:
    """The guard over the speed of the motor, or of the output where the motor's motion is prescribed.

    The output's limit is the same speed behind an ideal gear: errors of the teeth that turned faster would be
    followed period by period, for minutes.
    """
    side = "motor" if "motor" in model.place_of else "output"
    if side not in model.place_of:
        return None
    at = model.place_of[side] + 1
    return Guard(at, FASTEST if side == "motor" else FASTEST / abs(model.ratio), state_names(model)[at])


def state_names(model: Model) -> list[str]:
    """Names of a model's states, in their order in the state vector."""
    names = [""] * model.system.size
    for name, at in model.place_of.items():
        label = name if name == "motor" else f"{name} less ideal"
        names[at], names[at + 1] = f"{label} angle (rad)", f"{label} velocity (rad/s)"
    energies = model.system.quadratures
    first = len(names) - energies - len(model.states)
    for k, state in enumerate(model.states):
        names[first + k] = f"{state.name} ({state.unit})"
    if energies:
        names[-energies:] = ["work supplied (J)", "work delivered (J)", "heat (J)"]
    return names


def told(model: Model, found: Integration) -> str:
    """One line on a failed integration: what stopped it, the likely cause, the last state."""
    names = state_names(model)
    state = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, found.y_end, strict=True))
    return f"{found.message} {_likely_cause(model, found, names)} Last state: {state}."


def _likely_cause(model: Model, found: Integration, names: list[str]) -> str:
    """One sentence on what probably stopped the integration."""
    if isinstance(found.exception, KeyboardInterrupt):
        return "Stopped from outside."
    if found.exception is not None and not isinstance(found.exception, RunawayError):
        return "The method itself raised."
    # The energies grow in any long run; the others are compared with the sizes that matter.
    count = len(names) - model.system.quadratures
    growth = np.abs(found.y_end[:count]) / model.system.scale[:count]
    turned = model.place_of.get("motor")
    if turned is not None:
        growth[turned] = 0.0
    worst = int(np.argmax(growth)) if len(growth) else 0
    if len(growth) and (growth[worst] > 1e4 or isinstance(found.exception, RunawayError)):
        return (
            f"Likely cause: {names[worst]} runs away (unstable loop, wrong sign of a gain, "
            f"or a torque that nothing balances)."
        )
    if found.suspect is not None:
        return f"Likely cause: {names[found.suspect]} changes faster than the method can follow."
    return "Likely cause: a parameter outside its law's range, or a tolerance finer than rounding allows."
