"""A robot arm from its URDF, by Pinocchio: what one of its joints has to carry while all of them move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.actuation._arm_kernel import TERMS
from hdsim.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Inertial parameters of a body: mass, three moments of mass, six of inertia about the joint's origin.
INERTIAL = 10
#: Angles of the joint at which a torque that is a trigonometric polynomial of order 2 is read off exactly.
_ANGLES = 2.0 * np.pi * np.arange(5) / 5.0


@cache
def chain(file: Path, gravity: tuple[float, float, float]) -> Chain:
    """The arm of a file, read once."""
    return Chain(file, gravity)


class Chain:
    """The rigid bodies and joints of a URDF file.

    Args:
        file: the URDF; meshes are not needed.
        gravity: acceleration of free fall in the base's frame, m/s^2.

    Raises:
        InputError: Pinocchio is not there, or the file cannot be read.
    """

    def __init__(self, file: Path, gravity: Sequence[float]) -> None:
        try:
            import pinocchio
        except ImportError:
            raise InputError("a robot arm's URDF needs Pinocchio: pip install 'hdsim[arm]'") from None
        if not file.is_file():
            raise InputError(f"{file}: no such file")
        try:
            self._model = pinocchio.buildModelFromUrdf(str(file))
        except (ValueError, RuntimeError) as error:
            raise InputError(f"{file}: no URDF that Pinocchio can read: {str(error).strip()}") from None
        self.file, self._pin = file, pinocchio
        self._model.gravity.linear = np.array(gravity, dtype=float)
        self._data = self._model.createData()
        names = list(self._model.names)
        #: Place of each revolute joint in the vector of velocities, by name.
        self.joints: dict[str, int] = {
            name: joint.idx_v
            for name, joint in zip(names[1:], list(self._model.joints)[1:], strict=True)
            if joint.nv == 1 and joint.shortname().startswith("JointModelR")
        }

    def place(self, joint: str) -> int:
        """Where a joint stands among the velocities.

        Raises:
            InputError: there is no such revolute joint.
        """
        if joint not in self.joints:
            raise InputError(f"{self.file}: no revolute joint {joint!r}; there are {', '.join(self.joints)}")
        return self.joints[joint]

    def carried(self, link: str, joint: str) -> tuple[int, Array, Array]:
        """Body that a link belongs to, rotation (3, 3) and place (3,) of the link's frame there.

        Raises:
            InputError: there is no such link, or the joint does not carry it.
        """
        model = self._model
        bodies = [f.name for f in model.frames if f.type == self._pin.FrameType.BODY]
        if link not in bodies:
            raise InputError(f"{self.file}: no link {link!r}; there are {', '.join(bodies)}")
        frame = model.frames[model.getFrameId(link, self._pin.FrameType.BODY)]
        body, own = int(frame.parentJoint), int(model.getJointId(joint))
        if own not in list(model.supports[body]):
            raise InputError(f"{self.file}: {joint} does not carry the link {link!r}")
        return body, np.array(frame.placement.rotation), np.array(frame.placement.translation)

    def _states(self, joint: str, motions: Mapping[str, Array], count: int) -> tuple[Array, Array, Array]:
        angles, speeds, rates = (np.zeros((count, self._model.nv)) for _ in range(3))
        for name, motion in motions.items():
            if name != joint:
                k = self.place(name)
                angles[:, k], speeds[:, k], rates[:, k] = motion
        return angles, speeds, rates

    def terms(
        self, joint: str, motions: Mapping[str, Array], count: int, zero: float = 0.0, body: int | None = None
    ) -> Array:
        """Terms of the torque that a joint has to give, along the motion of the others.

        tau = c0 + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q + M' q' + M q'', exact: the bodies beyond the
        joint turn with it as a whole, so its own inertia M does not depend on its own angle, its weight and
        what accelerations of the base ask of it turn once with q, what centrifugal forces ask twice.

        Args:
            joint: the joint.
            motions: angle, velocity, acceleration of other joints, shape (3, count) each; the rest stands
                still at 0.
            count: of the times.
            zero: the joint's angle where q is 0, rad.
            body: one whose ten inertial parameters are asked for instead, in Pinocchio's order.

        Returns:
            c0, c1, s1, c2, s2 (N m) and M (kg m^2), shape (count, 6); (count, 6, 10) per unit of each
            parameter of ``body``.
        """
        place = self.place(joint)
        angles, speeds, rates = self._states(joint, motions, count)
        shape = (count, len(_ANGLES)) if body is None else (count, len(_ANGLES), INERTIAL)
        torque, inertia = np.zeros(shape), np.zeros((shape[0], *shape[2:]))
        still = np.zeros(self._model.nv)
        unit = np.eye(self._model.nv)[place]
        for n in range(count):
            q = angles[n]
            for k, angle in enumerate(_ANGLES):
                q[place] = angle + zero
                torque[n, k] = self._torque(q, speeds[n], rates[n], place, body)
            inertia[n] = self._torque(q, still, unit, place, body) - self._torque(
                q, still, still, place, body
            )
        waves = [np.ones(5), *(wave(k * _ANGLES) for k in (1, 2) for wave in (np.cos, np.sin))]
        size = np.array([1.0, 2.0, 2.0, 2.0, 2.0]) / len(_ANGLES)
        found = np.einsum("nk...,tk->nt...", torque, np.array(waves) * size[:, None])
        return np.concatenate([found, inertia[:, None]], axis=1).reshape(count, TERMS, *shape[2:])

    def _torque(self, q: Array, speed: Array, rate: Array, place: int, body: int | None) -> Any:
        """Inverse dynamics of one joint; per unit of a body's inertial parameters where one is named."""
        pin, model, data = self._pin, self._model, self._data
        at = pin.integrate(model, pin.neutral(model), q)
        if body is None:
            return pin.rnea(model, data, at, speed, rate)[place]
        regressor = pin.computeJointTorqueRegressor(model, data, at, speed, rate)
        return regressor[place, INERTIAL * (body - 1) : INERTIAL * body]


def point_mass(place: Array) -> Array:
    """Inertial parameters of a mass of 1 kg at a point (m), in Pinocchio's order, shape (10,)."""
    x, y, z = place
    return np.array([1.0, x, y, z, y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
