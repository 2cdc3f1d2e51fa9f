"""Torque ripple of the motor: cogging, and a share of the torque that its windings make."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Periodic, Plausible
from hdsim.kernel import (
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    STORED,
    SUPPLIED,
    TRANSMITTED_TORQUE,
    element,
)
from hdsim.parts import Builder, Effect, Parameters, Signature


@element
def ripple(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Parameters: number, ratio, then order, cogging amplitude, share, phase of each component."""
    angle = inputs[MOTOR_ANGLE]
    speed = inputs[MOTOR_VELOCITY]
    load = inputs[TRANSMITTED_TORQUE] / parameters[1]
    for i in range(int(parameters[0])):
        order = parameters[2 + 4 * i]
        cogging = parameters[3 + 4 * i]
        share = parameters[4 + 4 * i]
        sine = math.sin(order * angle + parameters[5 + 4 * i])
        cosine = math.cos(order * angle + parameters[5 + 4 * i])
        supplied = share * load * sine
        outputs[MOTOR_TORQUE] += cogging * sine + supplied
        jacobian[MOTOR_TORQUE * columns + MOTOR_ANGLE] += (cogging + share * load) * order * cosine
        jacobian[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE] += share * sine / parameters[1]
        outputs[STORED] += cogging / order * cosine
        outputs[SUPPLIED] += supplied * speed
        jacobian[SUPPLIED * columns + MOTOR_ANGLE] += share * load * order * cosine * speed
        jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += supplied
        jacobian[SUPPLIED * columns + TRANSMITTED_TORQUE] += share * sine * speed / parameters[1]


class RippleComponent(Parameters):
    """One harmonic of the ripple."""

    order: float = Field(gt=0)
    """Periods per motor turn: lcm(poles, slots) for cogging, 6 times the pole pairs for the windings."""
    cogging_nm: Annotated[
        float,
        Plausible(
            5e-4,
            0.1,
            "estimate: cogging of 0.1 to some percent of a servo motor's torque",
            of="motor_rated_torque",
        ),
    ] = Field(0.0, ge=0)
    """Amplitude of the cogging torque, N m."""
    share: float = Field(0.0, ge=0, le=1)
    """Amplitude as a share of the torque that the drive transmits, reduced to the motor."""
    phase_deg: float = 0.0
    """Phase at zero motor angle, degrees."""


class MotorTorqueRipple(Effect):
    """T = sum (T_cog + share * tau/i) sin(order * theta_m + phase).

    Cogging is conservative: its energy T_cog cos(...)/order is stored. The winding's share follows the
    transmitted torque, which is the motor torque at steady speed less friction, and is supplied power.
    """

    title: ClassVar[str] = "motor torque ripple"
    source: ClassVar[str] = (
        "Jahns and Soong 1996, IEEE Trans. Industrial Electronics 43:321 (orders of ripple and cogging); "
        "the default amplitudes, for 10 pole pairs and 24 slots, are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "torque"),
        channels=("motor_torque", "motor_velocity", "motor_angle"),
        orders=(60.0, 120.0),
        confused_with={
            "kinematic_error": "shows in the transmission error and grows in the current with speed "
            "squared; the ripple leaves the transmission error alone, is constant with "
            "speed in the current, and its phase moves when motor and wave generator are"
            " re-clocked",
            "sensors": "a ripple of the torque sensor is not felt by either encoder",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Periodic("components", "cogging_nm", 0.005, "motor_torque"),), label="cogging"),
    )

    components: tuple[RippleComponent, ...] = Field(
        (RippleComponent(order=120, cogging_nm=0.005), RippleComponent(order=60, share=0.01)), min_length=1
    )
    """The harmonics."""

    def contribute(self, build: Builder) -> None:
        """Add the ripple to the motor's torque."""
        numbers = [float(len(self.components)), build.ratio]
        for c in self.components:
            numbers += [c.order, c.cogging_nm, c.share, math.radians(c.phase_deg)]
        build.element(ripple, numbers)
