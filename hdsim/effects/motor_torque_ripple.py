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
    """Ripple of cogging, and of what the windings give: load and friction.

    Parameters: number, ratio, number of frictions, then T_c, b, w_s of each friction, then order, cogging
    amplitude, share, phase of each component.
    """
    angle = inputs[MOTOR_ANGLE]
    speed = inputs[MOTOR_VELOCITY]
    load = inputs[TRANSMITTED_TORQUE] / parameters[1]
    frictions = int(parameters[2])
    load_w = 0.0
    for i in range(frictions):
        smoothing = parameters[5 + 3 * i]
        sign = math.tanh(speed / smoothing)
        load += parameters[3 + 3 * i] * sign + parameters[4 + 3 * i] * speed
        load_w += parameters[3 + 3 * i] * (1.0 - sign * sign) / smoothing + parameters[4 + 3 * i]
    first = 3 + 3 * frictions
    for i in range(int(parameters[0])):
        order = parameters[first + 4 * i]
        cogging = parameters[first + 1 + 4 * i]
        share = parameters[first + 2 + 4 * i]
        sine = math.sin(order * angle + parameters[first + 3 + 4 * i])
        cosine = math.cos(order * angle + parameters[first + 3 + 4 * i])
        supplied = share * load * sine
        outputs[MOTOR_TORQUE] += cogging * sine + supplied
        jacobian[MOTOR_TORQUE * columns + MOTOR_ANGLE] += (cogging + share * load) * order * cosine
        jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] += share * load_w * sine
        jacobian[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE] += share * sine / parameters[1]
        outputs[STORED] += cogging / order * cosine
        outputs[SUPPLIED] += supplied * speed
        jacobian[SUPPLIED * columns + MOTOR_ANGLE] += share * load * order * cosine * speed
        jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += supplied + share * load_w * sine * speed
        jacobian[SUPPLIED * columns + TRANSMITTED_TORQUE] += share * sine * speed / parameters[1]


class RippleComponent(Parameters):
    """One harmonic of the ripple."""

    order: float = Field(gt=0)
    """Periods per motor turn: lcm(poles, slots) for cogging, 6 times the pole pairs for the windings, the
    pole pairs for the offset of a current sensor, a ripple as constant as cogging."""
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
    """Amplitude as a share of the torque that the windings give to load and friction."""
    phase_deg: float = 0.0
    """Phase at zero motor angle, degrees."""


class MotorTorqueRipple(Effect):
    """T = sum (T_cog + share * (tau/i + T_f)) sin(order * theta_m + phase).

    Cogging is conservative: its energy T_cog cos(...)/order is stored, and it does not vanish without a load.
    The winding's share follows the torque that the windings give at steady speed, which is the transmitted
    one and the Coulomb and viscous friction T_f of the motor shaft, and is supplied power: without a load
    that of friction is left.
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
        frictions = build.input_frictions
        numbers = [float(len(self.components)), build.ratio, float(len(frictions))]
        for f in frictions:
            numbers += [f.coulomb_nm, f.viscous_nm_s_per_rad, f.smoothing_velocity_rad_per_s]
        for c in self.components:
            numbers += [c.order, c.cogging_nm, c.share, math.radians(c.phase_deg)]
        build.element(ripple, numbers)
