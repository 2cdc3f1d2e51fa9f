"""More load-dependent friction of the mesh than the drive has of its own."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, INPUT_FRICTION, MOTOR_TORQUE, MOTOR_VELOCITY, TRANSMITTED_TORQUE, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@element
def mesh_loss(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -c (r - tau_s) (r/tau_0)^(n - 1) s, r = sqrt(tau^2 + tau_s^2), c = c_mean + c_half p, on the motor.

    s = tanh(w/w_s) is the direction of speed, p = s tau / r times the ratio's sign that of power. Parameters:
    c_mean/|i|, tau_s, w_s, c_half/i, tau_0, n - 1.
    """
    speed = inputs[MOTOR_VELOCITY]
    load = inputs[TRANSMITTED_TORQUE]
    root = math.sqrt(load * load + parameters[1] * parameters[1])
    side = load / root
    more = math.pow(root / parameters[4], parameters[5])
    level = (root - parameters[1]) * more
    level_load = (more + parameters[5] * level / root) * side
    side_load = (1.0 - side * side) / root
    sign = math.tanh(speed / parameters[2])
    sign_w = (1.0 - sign * sign) / parameters[2]
    share = parameters[0] + parameters[3] * side * sign
    torque = share * level * sign
    torque_w = (share + parameters[3] * side * sign) * level * sign_w
    torque_load = (share * level_load + parameters[3] * side_load * sign * level) * sign
    outputs[MOTOR_TORQUE] -= torque
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= torque_w
    jacobian[MOTOR_TORQUE * columns + TRANSMITTED_TORQUE] -= torque_load
    outputs[DISSIPATED] += torque * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += torque_w * speed + torque
    jacobian[DISSIPATED * columns + TRANSMITTED_TORQUE] += torque_load * speed
    outputs[INPUT_FRICTION] += torque


class LoadDependentLoss(Effect):
    """T = -c |tau/i| |tau/tau_0|^(n - 1) tanh(w_m/w_s) on the motor, tau the transmitted torque.

    |tau| is rounded over tau_s. With n = 1 the loss is a share c of the torque; where the coefficient of
    friction changes with the teeth's force it grows otherwise, and c is the share at tau_0.

    c is c_L while the motor drives the load (w_m tau/i > 0) and c_B while the load drives the motor; between
    the two it changes with the rounded signs of speed and torque, so that nothing jumps. Driving takes
    (1 + c_L) tau/i at the motor, back-driving leaves (1 - c_B) tau/i: the efficiencies are 1/(1 + c_L) and
    1 - c_B, and they are not one number: friction raises the force between the teeth in one direction and
    lowers it in the other.
    """

    title: ClassVar[str] = "load-dependent mesh loss"
    source: ClassVar[str] = (
        "efficiency at rated load in Harmonic Drive's catalogues: c_L = 0.097 closes on 77 %; the default "
        "is a loss of 3 % more, the catalogue's scatter; two directions: Wang and Kim 2015, IEEE ICRA "
        "(directional efficiency in geared transmissions); Matsuki, Nagano and Fujimoto 2019, IEEE/ASME "
        "Trans. Mechatronics 24:2661 (89.0 % forward, 85.3 % backward of a planetary gear); exponent: "
        "ISO/TR 14179-2:2001 (a mesh's coefficient of friction goes with its force to the 0.2)"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "direction"),
        channels=("motor_torque",),
        confused_with={
            "sensors": "a wrong torque constant is symmetric in the direction of power; this loss changes "
            "its sign between driving and back-driving (in one of the two only, half of it is like a torque "
            "constant: the motor's inertia and friction without load tell)",
            "input_coulomb_viscous": "independent of the load",
            "torsional_hysteresis_maxwell": "absent with the wave generator locked",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"coefficient": 0.03}),), covered_by=("drive.friction.load_coefficient",)),
        Fitting(
            (Amplitude({"coefficient": 0.03}),),
            settings={"back_driving_coefficient": 0.0},
            label="when driving",
        ),
        Fitting(
            (Amplitude({"back_driving_coefficient": 0.03}),),
            settings={"coefficient": 0.0},
            label="when back-driving",
        ),
    )

    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"coefficient": 0.03}),),
            (Shape("load_exponent", (0.85, 1.2), least=0.6, most=1.7),),
            # Stated, as another drive's default is another torque.
            {"reference_torque_nm": 52.0},
            label="that does not grow in proportion to the load",
            refines=("",),
        ),
    )

    coefficient: Annotated[
        float, Plausible(5e-3, 0.5, "catalogue efficiencies at rated load, 67 to 85 %, cold ones less")
    ] = Field(0.03, ge=0, lt=1)
    """Share of the transmitted torque, reduced to the motor, that is lost on top of the drive's own, c_L."""
    back_driving_coefficient: Annotated[
        float | None, Plausible(5e-3, 0.5, "as c_L; a few percent from it (Matsuki 2019)")
    ] = Field(None, ge=0, lt=1)
    """The same while the load drives the motor, c_B (null: c_L)."""
    load_exponent: Annotated[
        float, Plausible(0.8, 1.4, "1.2 of a mesh (ISO/TR 14179-2), and as much below")
    ] = Field(1.0, ge=0.5, le=2.0)
    """Exponent n of the loss over the transmitted torque."""
    reference_torque_nm: Annotated[
        float, FIXED, Plausible(0.1, 2.0, "where c is told: at the rated torque", of="rated_torque")
    ] = Field(52.0, gt=0)
    """Output torque tau_0 at which c_L and c_B hold where the exponent is not 1, N m."""
    smoothing_torque_nm: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Output torque tau_s over which |tau| is rounded, N m."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s."""

    @property
    def back_driving(self) -> float:
        """c_B, given or c_L."""
        return self.coefficient if self.back_driving_coefficient is None else self.back_driving_coefficient

    @property
    def mean_coefficient(self) -> float:
        """Mean of c_L and c_B."""
        return 0.5 * (self.coefficient + self.back_driving)

    def loss_nm(self, torque_nm: float) -> float:
        """Part of a transmitted torque that is lost, mean of both directions, at the output, N m."""
        times = math.pow(torque_nm / self.reference_torque_nm, self.load_exponent)
        return self.mean_coefficient * self.reference_torque_nm * times

    def contribute(self, build: Builder) -> None:
        """Add the loss to the motor's friction."""
        numbers = [
            self.mean_coefficient / abs(build.ratio),
            self.smoothing_torque_nm,
            self.smoothing_velocity_rad_per_s,
            0.5 * (self.coefficient - self.back_driving) / build.ratio,
            self.reference_torque_nm,
            self.load_exponent - 1.0,
        ]
        build.element(mesh_loss, numbers)
