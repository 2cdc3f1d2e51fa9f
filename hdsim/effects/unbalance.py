"""Unbalanced masses under gravity, at the output and at the motor."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible
from hdsim.kernel import MOTOR_TORQUE, OUTPUT_TORQUE, STORED, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature

STANDARD_GRAVITY = 9.80665  #: m/s^2


@element
def weight(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -m g r cos(theta + phi). Parameters: body (row of its torque), m g r, phi."""
    row = int(parameters[0])
    column = 2 * row
    angle = inputs[column] + parameters[2]
    outputs[row] -= parameters[1] * math.cos(angle)
    jacobian[row * columns + column] += parameters[1] * math.sin(angle)
    outputs[STORED] += parameters[1] * math.sin(angle)


class Unbalance(Effect):
    """T = -m g r cos(theta + phi), from the potential m g r sin(theta + phi); the axis is horizontal.

    ``m r`` is the static unbalance. The inertia m r^2 belongs to the load's and the motor's inertia.
    """

    title: ClassVar[str] = "unbalance"
    source: ClassVar[str] = "statics of a rigid body under gravity; default of the output: 1 kg at 0.1 m"
    signature: ClassVar[Signature] = Signature(
        lives_in=("output_angle", "wave_generator_angle"),
        channels=("motor_torque", "output_torque", "output_angle"),
        orders=(0.01, 1.0),
        exact=True,
        confused_with={
            "output_eccentricity": "kinematic: shows in the output angle without torque",
            "wave_generator_eccentricity": "kinematic: its torque grows with the load, an unbalance's does "
            "not",
            "sensors": "an eccentric encoder leaves no torque but the inertia's, which grows with the "
            "square of the speed",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Harmonic("output_kg_m", "output_phase_deg", 0.1),), label="output", lives_in=("output_angle",)
        ),
        Fitting(
            (Harmonic("motor_kg_m", "motor_phase_deg", 1e-3),),
            settings={"output_kg_m": 0.0},
            label="motor",
            lives_in=("wave_generator_angle",),
            turns=1.0,
        ),
    )

    output_kg_m: Annotated[
        float,
        Plausible(2e-4, 0.1, "weights from a thousandth of the rated torque up to it", of="rated_torque"),
    ] = Field(0.1, ge=0)
    """Static unbalance m r at the output, kg m."""
    output_phase_deg: Annotated[float, FIXED] = 0.0
    """Elevation of the output's centre of mass above the horizontal at zero output angle, degrees."""
    motor_kg_m: Annotated[
        float, Plausible(1e-5, 2e-2, "weights up to a fifth of the rated torque", of="motor_rated_torque")
    ] = Field(0.0, ge=0)
    """Static unbalance m r of the motor's rotor and wave generator, kg m."""
    motor_phase_deg: Annotated[float, FIXED] = 0.0
    """Elevation of the rotor's centre of mass above the horizontal at zero motor angle, degrees."""
    gravity_m_per_s2: Annotated[float, FIXED] = Field(STANDARD_GRAVITY, ge=0)
    """Component of gravity across the axis of rotation, m/s^2 (0: vertical axis)."""

    def contribute(self, build: Builder) -> None:
        """Add the weight's torque on output and motor."""
        for row, moment, phase in (
            (OUTPUT_TORQUE, self.output_kg_m, self.output_phase_deg),
            (MOTOR_TORQUE, self.motor_kg_m, self.motor_phase_deg),
        ):
            if moment > 0:
                build.element(weight, [row, moment * self.gravity_m_per_s2, math.radians(phase)])
