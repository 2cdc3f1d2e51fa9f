"""Every controller as one linear system: x' = A x + B w, u = C x + D w, built with ``control``.

w = [reference angle, its velocity, its acceleration, motor angle, motor velocity, output angle, output
velocity]; u is the motor torque. ``Loop`` says where the reference and the feedback are; a controller
asks it for rows over w and adds and multiplies them with ``control`` systems.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, Protocol

from hdsim.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Side = Literal["motor", "output"]

#: Names of w, in order.
INPUTS = (
    "reference_position",
    "reference_velocity",
    "reference_acceleration",
    "motor_angle",
    "motor_velocity",
    "output_angle",
    "output_velocity",
)


@dataclass(frozen=True)
class Loop:
    """Where a control loop is closed.

    Args:
        ratio: signed ratio motor angle / output angle.
        at: side on which the reference is given.
        feedback: side that is fed back.
        order: 0 when the reference is an angle, 1 when it is a velocity (w[0] is then 0).
    """

    ratio: float
    at: Side
    feedback: Side
    order: int = 0

    def row(self, **weights: float) -> Any:
        """A static system over w with the given weights."""
        import control as ct
        import numpy as np

        unknown = [name for name in weights if name not in INPUTS]
        if unknown:
            raise InputError(f"no controller input {unknown[0]!r}; there are: {', '.join(INPUTS)}")
        if self.order and "reference_position" in weights:
            raise InputError("a velocity command has no reference_position; use reference_velocity")
        row = np.zeros((1, len(INPUTS)))
        for name, weight in weights.items():
            row[0, INPUTS.index(name)] = weight
        return ct.ss(np.zeros((0, 0)), np.zeros((0, len(INPUTS))), np.zeros((1, 0)), row)

    def scale(self, start: Side, end: Side) -> float:
        """Factor from an angle at one side to the same angle at another."""
        if start == end:
            return 1.0
        return self.ratio if end == "motor" else 1.0 / self.ratio

    def sense(self, side: Side) -> float:
        """1, or -1 when a positive motor torque moves ``side`` backwards."""
        return math.copysign(1.0, self.ratio) if side == "output" else 1.0

    def reference(self, order: int, side: Side) -> Any:
        """The reference's derivative of an order (of the angle) as seen at ``side``."""
        return self.row(**{INPUTS[order]: self.scale(self.at, side)})

    def measured(self, order: int, side: Side) -> Any:
        """The measured angle (0) or velocity (1) at ``side``."""
        return self.row(**{f"{side}_{'velocity' if order else 'angle'}": 1.0})

    def error(self, order: int, side: Side) -> Any:
        """Reference less measurement, of the angle (0) or the velocity (1), at ``side``."""
        return self.reference(order, side) - self.measured(order, side)


class Law(Protocol):
    """A controller that can be written as a linear system."""

    def model_dump(self) -> dict[str, Any]:
        """Its numbers by name; controllers of one class with the same ones are the same."""

    def system(self, loop: Loop) -> Any:
        """Its ``control.StateSpace`` from w to the motor torque."""

    def tracking_gain(self, C: Array, integrators: Any) -> Array:
        """L (n,) of the back-calculation: how each state follows the torque that the limit cuts off."""


@dataclass(frozen=True)
class CanonicalController:
    """x' = A x + B w + L (T - u), u = C x + D w, T = u limited.

    Args:
        A: (n, n).
        B: (n, 7).
        C: (n,).
        D: (7,).
        L: (n,), 0 without anti-windup.
        integrators: (n,) bool, states that are pure integrals of w.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    L: Array
    integrators: Any

    def pack(self, column: int, order: int, limit: float) -> Array:
        """Parameters of the ``controller`` kernel; see there."""
        import numpy as np

        head = [len(self.C), column, order, limit]
        return np.concatenate([head, self.A.ravel(), self.B.ravel(), self.C, self.D, self.L])


def integrator(gain: float) -> Any:
    """Gain / s, with its output as the state."""
    import control as ct

    return ct.ss([[0.0]], [[gain]], [[1.0]], [[0.0]])


def low_pass(time: float) -> Any:
    """1 / (time s + 1), with its output as the state."""
    import control as ct

    return ct.ss([[-1.0 / time]], [[1.0 / time]], [[1.0]], [[0.0]])


def canonical_controller(law: Law, loop: Loop) -> CanonicalController:
    """Bring a controller into the canonical form.

    Args:
        law: the controller.
        loop: where it is closed.

    Returns:
        The form, kept for controllers of the same numbers; its arrays are read-only.

    Raises:
        InputError: the controller asks for an input that there is not.
    """
    return _kept(_Given(law, type(law), repr(law.model_dump()), loop))


@dataclass(frozen=True)
class _Given:
    """A controller and its loop; alike where kind and numbers are."""

    law: Law = field(compare=False)
    kind: type[Law]
    numbers: str
    loop: Loop


@lru_cache(maxsize=256)
def _kept(given: _Given) -> CanonicalController:
    """The form of a controller: ``control`` takes milliseconds, and drives side by side share controllers."""
    import numpy as np

    system = given.law.system(given.loop)
    A, B = np.array(system.A, dtype=float), np.array(system.B, dtype=float)
    C, D = np.array(system.C, dtype=float).ravel(), np.array(system.D, dtype=float).ravel()
    integrators = ~A.any(axis=0) & ~A.any(axis=1) & (C != 0.0)
    found = CanonicalController(A, B, C, D, np.array(given.law.tracking_gain(C, integrators)), integrators)
    for values in (found.A, found.B, found.C, found.D, found.L, found.integrators):
        values.setflags(write=False)
    return found
