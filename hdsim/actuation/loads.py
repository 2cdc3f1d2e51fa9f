"""The ``load`` section of a scenario: what hangs on the output."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticKnownError

from hdsim.actuation._kernels import gravity_arm, load_torque
from hdsim.actuation.arm import Arm
from hdsim.actuation.signals import TorqueSignal
from hdsim.number import Number
from hdsim.parts import Builder, Part

if TYPE_CHECKING:
    from hdsim.actuation.signal_data import SignalData
    from hdsim.kernel import Kernel

#: Standard acceleration of free fall, m/s^2 (ISO 80000-3).
STANDARD_GRAVITY = 9.80665


class GravityArm(Part):
    """A mass on an arm in the field of gravity: torque -m g l sin(theta - theta_0) on the output.

    theta_0 is the angle at which the arm hangs; its energy m g l (1 - cos(theta - theta_0)) counts from
    there. The arm's inertia belongs to the load's ``inertia_kg_m2``.
    """

    mass_kg: Annotated[float, Number(0.4)] = Field(gt=0.0)
    """Mass of the arm with what it carries. Unit kg."""
    centre_of_mass_m: float = Field(gt=0.0)
    """Distance of the centre of mass from the output's axis. Unit m."""
    hanging_angle_deg: float = 0.0
    """Output angle at which the arm hangs straight down; -90 puts the arm level at angle 0. Unit deg."""
    gravity_m_per_s2: float = Field(STANDARD_GRAVITY, gt=0.0)
    """Acceleration of free fall, times the sine of the axis' inclination to the vertical. Unit m/s^2."""

    def contribute(self, build: Builder) -> None:
        """Add the torque of gravity and its energy."""
        moment = self.mass_kg * self.gravity_m_per_s2 * self.centre_of_mass_m
        build.element(gravity_arm, [moment, math.radians(self.hanging_angle_deg)])


class SignalTorque:
    """A torque over time, on the output or by another kernel elsewhere.

    Args:
        signal: the torque, N m.
        kernel: what adds it.
    """

    def __init__(self, signal: SignalData, kernel: Kernel = load_torque) -> None:
        self.signal, self.kernel = signal, kernel

    def contribute(self, build: Builder) -> None:
        """Add the torque."""
        build.element(self.kernel, [build.signal(self.signal)])


class Load(Part):
    """What hangs on the output."""

    arm: Arm | None = None
    """A robot arm of which the drive moves one joint."""
    inertia_kg_m2: Annotated[float, Number(0.5, far=15.0)] = Field(0.0, ge=0.0, validate_default=True)
    """Moment of inertia about the output's axis, beside that of ``arm``; above 0 where there is none. Unit
    kg m^2."""
    torque: TorqueSignal | None = None
    """External torque on the output over time, positive in the direction of positive output angle."""
    gravity: GravityArm | None = None
    """A mass on an arm."""

    @field_validator("inertia_kg_m2")
    @classmethod
    def _some_inertia(cls, value: float, known: ValidationInfo) -> float:
        if known.data.get("arm", ...) is None and not value > 0.0:
            raise PydanticKnownError("greater_than", {"gt": 0.0})
        return value

    def over(self, seconds: float) -> tuple[list[Any], float]:
        """The parts of the load, and the moment of inertia that the model has with them, kg m^2.

        Args:
            seconds: time that an arm's motion has to cover, s.
        """
        if self.arm is None:
            return [self], self.inertia_kg_m2
        part = self.arm.course(seconds).part(self.arm)
        return [self, part], self.inertia_kg_m2 + part.inertia_kg_m2

    def contribute(self, build: Builder) -> None:
        """Add the external torque and gravity; inertia and arm are the assembly's to ask for (``over``)."""
        if self.torque is not None:
            SignalTorque(self.torque.data).contribute(build)
        if self.gravity is not None:
            self.gravity.contribute(build)

    @property
    def end_time(self) -> float:
        """Time in s after which the external torque is constant; infinite when it never is."""
        return 0.0 if self.torque is None else self.torque.end_time
