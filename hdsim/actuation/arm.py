"""A robot arm as the load of one of its joints' drives: gravity, inertia, and what the others' motions ask.

The torque that the joint has to give along the motion of all joints is that of the rigid arm (recursive
Newton-Euler, Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 5, by Pinocchio). While the others move
as they are told it is a trigonometric polynomial of the joint's own angle (``hdsim.actuation.urdf``), so
nothing is taken along a nominal motion: the output may wind up and swing as it does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, model_validator

from hdsim.actuation._arm_kernel import TERMS, arm_torque
from hdsim.actuation.signals import AngleTrajectory
from hdsim.errors import InputError
from hdsim.number import Number
from hdsim.parts import Builder, Parameters, State

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Time between the points at which the terms are computed, s, and the most points.
STEP_S, MOST_POINTS = 2e-3, 100_000
#: Lag of the acceleration by which an inertia that changes is heard, s: at 50 Hz its part is 6 % late.
LAG_S = 2e-4
#: Change of the inertia, as a part of it, below which it stands still.
STILL = 1e-9


class Payload(Parameters):
    """A point mass that a link of the arm carries."""

    link: str
    """Link of the URDF that carries it, beyond the joint."""
    mass_kg: Annotated[float, Number(0.4)] = Field(gt=0.0)
    """Its mass. Unit kg."""
    lever_m: Annotated[float, Number(0.2)] = Field(gt=0.0)
    """Its distance from the link's origin. Unit m."""
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Direction of that distance in the link's frame."""

    @model_validator(mode="after")
    def _somewhere(self) -> Payload:
        if not math.hypot(*self.direction) > 0:
            raise ValueError("direction must not be zero")
        return self


class Arm(Parameters):
    """A robot arm of which the drive moves one joint.

    The other joints move as ``joints`` says, or as a log has measured them; the output's angle is the
    joint's own.
    """

    file: Path
    """URDF of the arm, its base fixed; a relative name counts from the folder of the scenario that has it."""
    joint: str
    """Revolute joint that the drive moves."""
    joints: dict[str, AngleTrajectory] = {}
    """Motions of other revolute joints, by name. In a simulation those that are not named stand at 0."""
    payload: Payload | None = None
    """What the arm carries beyond what its file has."""
    mass_factor: Annotated[float, Number(0.1)] = Field(1.0, gt=0.0)
    """Factor on masses and inertias of all links of the file."""
    zero_deg: float = 0.0
    """The joint's angle in the file where the output's angle is 0. Unit deg."""
    gravity_m_per_s2: tuple[float, float, float] = (0.0, 0.0, -9.80665)
    """Acceleration of free fall in the frame of the arm's base. Unit m/s^2."""

    @model_validator(mode="after")
    def _sound(self) -> Arm:
        try:
            chain = self._chain()
            for name in (self.joint, *self.joints):
                chain.place(name)
            if self.joint in self.joints:
                raise ValueError(f"joints: {self.joint} is the joint that the drive moves")
            if self.payload is not None:
                chain.carried(self.payload.link, self.joint)
        except InputError as error:
            raise ValueError(str(error)) from None
        return self

    def _chain(self) -> Any:
        from hdsim.actuation.urdf import chain

        return chain(self.file, self.gravity_m_per_s2)

    @property
    def others(self) -> list[str]:
        """The revolute joints beside the drive's own."""
        return [name for name in self._chain().joints if name != self.joint]

    def course(self, seconds: float) -> Course:
        """What the joint has to carry while the others move as ``joints`` says.

        Args:
            seconds: time that it has to cover, s.
        """
        import numpy as np

        end = max((motion.end_time for motion in self.joints.values()), default=0.0)
        points = math.ceil(min(seconds, end) / STEP_S) + 1
        times = np.linspace(0.0, max(min(seconds, end), STEP_S), min(max(points, 2), MOST_POINTS))
        return self.along(times, {name: motion.values(times)[:3] for name, motion in self.joints.items()})

    def along(self, times: Array, motions: Mapping[str, Array]) -> Course:
        """What the joint has to carry along motions of the others.

        Args:
            times: evenly spaced, shape (n,), s.
            motions: angle, velocity, acceleration by joint, shape (3, n) each; joints that are not there
                stand at 0.

        Raises:
            InputError: a joint is not in the file.
        """
        chain, zero = self._chain(), math.radians(self.zero_deg)
        own = chain.terms(self.joint, motions, len(times), zero)
        carried = None
        if self.payload is not None:
            body, _, _ = chain.carried(self.payload.link, self.joint)
            carried = chain.terms(self.joint, motions, len(times), zero, body)
        return Course(times, own, carried)

    def point_mass(self) -> Array:
        """Inertial parameters of the payload, in the frame of the joint before its link, shape (10,)."""
        import numpy as np

        from hdsim.actuation.urdf import INERTIAL, point_mass

        if self.payload is None:
            return np.zeros(INERTIAL)
        _, rotation, place = self._chain().carried(self.payload.link, self.joint)
        direction = np.array(self.payload.direction) / math.hypot(*self.payload.direction)
        found: Array = self.payload.mass_kg * point_mass(
            place + rotation @ (self.payload.lever_m * direction)
        )
        return found


class Course:
    """Terms of a joint's torque over time; linear in the masses, so that a fit does not ask the arm again.

    Args:
        times: evenly spaced, shape (n,), s.
        own: terms of the arm as its file has it, shape (n, 6).
        carried: the same per unit of each inertial parameter of the payload's body, shape (n, 6, 10).
    """

    def __init__(self, times: Array, own: Array, carried: Array | None) -> None:
        self.times, self._own, self._carried = times, own, carried

    def terms(self, arm: Arm) -> Array:
        """Terms for the numbers of an arm, shape (n, 6)."""
        import numpy as np

        found = arm.mass_factor * self._own
        return np.asarray(found if self._carried is None else found + self._carried @ arm.point_mass())

    def part(self, arm: Arm, begins_s: float = 0.0) -> ArmTorque:
        """The load for the numbers of an arm.

        Args:
            arm: the same arm, its numbers changed.
            begins_s: time at which the course begins, s.
        """
        return ArmTorque(self.times + begins_s, self.terms(arm))

    def torque(self, arm: Arm, times: Array, motion: Array) -> Array:
        """Torque of the arm on the drive's output along a motion of it, N m, shape (n,).

        Args:
            arm: the same arm, its numbers changed.
            times: shape (n,), s.
            motion: angle, velocity and acceleration of the output, shape (3, n).
        """
        import numpy as np

        cubic = _cubic(self.times, self.terms(arm))
        inside = np.clip(times, self.times[0], self.times[-1])
        at, rate = cubic(inside), np.where(inside == times, cubic(inside, 1)[:, -1], 0.0)
        q, w, a = motion
        waves = np.column_stack([np.ones_like(q), np.cos(q), np.sin(q), np.cos(2 * q), np.sin(2 * q)])
        return np.asarray(-(np.sum(at[:, :-1] * waves, axis=1) + rate * w + at[:, -1] * a))


class ArmTorque:
    """The torque of an arm on the drive's output, without its mean inertia.

    Args:
        times: evenly spaced, shape (n,), s.
        terms: shape (n, 6).
    """

    def __init__(self, times: Array, terms: Array) -> None:
        import numpy as np

        self._times, self._terms = times, terms
        inertia = terms[:, -1]
        #: Inertia that the model has to have beside the load's own, kg m^2.
        self.inertia_kg_m2 = float(np.mean(inertia))
        self._lag = LAG_S if float(np.ptp(inertia)) > STILL * self.inertia_kg_m2 else 0.0

    @property
    def start(self) -> Array:
        """The terms at the course's begin: constant, cosine and sine of q and of 2 q, inertia; shape (6,)."""
        first: Array = self._terms[0]
        return first

    def contribute(self, build: Builder) -> None:
        """Add the torque, and where the inertia changes a state that hears the acceleration."""
        import numpy as np

        times = self._times
        pieces = _cubic(times, self._terms).c[::-1].transpose(1, 2, 0).reshape(len(times) - 1, 4 * TERMS)
        head = [times[0], times[1] - times[0], float(len(times) - 1), self._lag, self.inertia_kg_m2]
        # ``scale``: of the output's speed.
        state = State("arm_velocity", "rad/s", 0.0, 1.0, "velocity of the output, late by the arm's lag")
        build.element(
            arm_torque, np.concatenate([head, pieces.ravel()]), states=(state,) if self._lag else ()
        )


def _cubic(times: Array, terms: Array) -> Any:
    from scipy.interpolate import CubicSpline

    return CubicSpline(times, terms)
