"""A damaged tooth: a short error each time that a lobe of the wave generator passes it."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.effects._kernels import ARCMIN
from hdsim.kernel import twist
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@twist
def bump(motor_angle: float, output_angle: float, parameters: Any, error: Any) -> None:
    """Add e = A exp(kappa (cos u - 1)), u = n (theta_m - c theta_l - a). Parameters: A, n, kappa, a, c."""
    n = parameters[1]
    kappa = parameters[2]
    c = parameters[4]
    u = n * (motor_angle - c * output_angle - parameters[3])
    sine = math.sin(u)
    value = parameters[0] * math.exp(kappa * (math.cos(u) - 1.0))
    first = -n * kappa * sine * value
    second = n * n * value * (kappa * kappa * sine * sine - kappa * math.cos(u))
    error[0] += value
    error[1] += first
    error[2] -= c * first
    error[3] += second
    error[4] -= c * second
    error[5] += c * c * second


class DamagedTooth(Effect):
    """e = A exp((cos n u - 1)/(n s)^2), a periodic bump of standard deviation s over u.

    u is the wave generator's angle against the member with the damage, measured from it; n = 2 lobes pass
    the tooth in each turn. The shape is a von Mises bump: the smooth periodic form of a Gaussian.
    """

    title: ClassVar[str] = "local tooth damage"
    source: ClassVar[str] = (
        "phenomenological: von Mises bump (Mardia and Jupp 2000, Directional Statistics, 3.5.4); passing "
        "rate from the kinematics; amplitude and width are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "output_angle"),
        channels=("output_angle", "motor_torque", "output_torque"),
        orders=(2.02, 4.04, 6.06),
        confused_with={
            "kinematic_error": "a few smooth harmonics over the whole turn instead of many in a narrow "
            "range of angle",
            "tooth_error": "the same in a model that has the teeth themselves",
            "sensors": "a fault of an encoder's disc repeats once per turn of its own shaft and leaves no "
            "torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = tuple(
        Fitting(
            (Amplitude({"amplitude_arcmin": 0.2}, signed=True),),
            shapes=(
                Shape("position_deg", tuple(30.0 * k + 15.0 for k in range(12 // lobes)), linear=True),
                Shape("width_deg", (12.0,), most=30.0),
            ),
            settings={"passes_per_turn": lobes, "member": member},
            label=label,
            turns=1.0,
            mesh="toothless",
        )
        for lobes, member, label in (
            (2, "output", ""),
            (1, "output", "at one lobe"),
            (2, "fixed", "of the fixed spline"),
            (1, "fixed", "of the fixed spline, at one lobe"),
        )
    )

    # A degree is more than the pitch of the finest teeth.
    amplitude_arcmin: Annotated[
        float, Plausible(0.02, 3.0, "up to the kinematic error of a coarse drive")
    ] = Field(-0.2, ge=-60, le=60)
    """Height of the bump as an angle at the output, arcmin (negative: material is missing)."""
    # The arc of a lobe that carries load, 30 % of the teeth on two arcs, is 54 degrees wide: a tooth is felt
    # within 27 degrees of the major axis. A wider bump is a harmonic of low order, another effect.
    width_deg: Annotated[float, FIXED, Plausible(1.0, 20.0, "one tooth's way through the mesh")] = Field(
        8.0, gt=0, le=30
    )
    """Standard deviation s of the bump, degrees of the wave generator."""
    position_deg: Annotated[float, FIXED] = 0.0
    """Angle of the wave generator, at zero output angle, at which lobe 1 is on the tooth, degrees."""
    member: Literal["output", "fixed"] = "output"
    """The spline that has the damage: the one that turns with the output, or the fixed one."""
    passes_per_turn: int = Field(2, ge=1, le=2)
    """Lobes that feel the damage in one turn of the wave generator against the member."""

    def contribute(self, build: Builder) -> None:
        """Add the bump to the mesh twist."""
        n = self.passes_per_turn
        kappa = 1.0 / (n * math.radians(self.width_deg)) ** 2
        moves = 1.0 if self.member == "output" else 0.0
        numbers = [self.amplitude_arcmin * ARCMIN, float(n), kappa, math.radians(self.position_deg), moves]
        build.twist(bump, numbers)
