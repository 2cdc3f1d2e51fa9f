"""More load-dependent friction of the mesh than the drive has of its own."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, TRANSMITTED_TORQUE, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@element
def mesh_loss(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -c (sqrt(tau^2 + tau_s^2) - tau_s) tanh(w/w_s) on the motor. Parameters: c/|i|, tau_s, w_s."""
    speed = inputs[MOTOR_VELOCITY]
    load = inputs[TRANSMITTED_TORQUE]
    root = math.sqrt(load * load + parameters[1] * parameters[1])
    level = parameters[0] * (root - parameters[1])
    level_load = parameters[0] * load / root
    sign = math.tanh(speed / parameters[2])
    slope = level * (1.0 - sign * sign) / parameters[2]
    outputs[MOTOR_TORQUE] -= level * sign
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= slope
    jacobian[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE] -= level_load * sign
    outputs[DISSIPATED] += level * sign * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += slope * speed + level * sign
    jacobian[DISSIPATED * columns + TRANSMITTED_TORQUE] += level_load * sign * speed
    outputs[INPUT_FRICTION] += level * sign


class LoadDependentLoss(Effect):
    """T = -c_L |tau/i| tanh(w_m/w_s) on the motor, tau the transmitted torque; |tau| rounded over tau_s."""

    title: ClassVar[str] = "load-dependent mesh loss"
    source: ClassVar[str] = (
        "efficiency at rated load in Harmonic Drive's catalogues: c_L = 0.097 closes on 77 %; the default "
        "is a loss of 3 % more, the catalogue's scatter"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "direction"),
        channels=("motor_torque",),
        confused_with={
            "sensors": "a wrong torque constant is symmetric in the direction of power; this loss changes "
            "its sign between driving and back-driving",
            "input_coulomb_viscous": "independent of the load",
            "torsional_hysteresis_maxwell": "absent with the wave generator locked",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"coefficient": 0.03}),), covered_by=("drive.friction.load_coefficient",)),
    )

    coefficient: float = Field(0.03, ge=0, lt=1)
    """Share of the transmitted torque, reduced to the motor, that is lost on top of the drive's own, c_L."""
    smoothing_torque_nm: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Output torque tau_s over which |tau| is rounded, N m."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s."""

    def contribute(self, build: Builder) -> None:
        """Add the loss to the motor's friction."""
        numbers = [
            self.coefficient / abs(build.ratio),
            self.smoothing_torque_nm,
            self.smoothing_velocity_rad_per_s,
        ]
        build.element(mesh_loss, numbers)
