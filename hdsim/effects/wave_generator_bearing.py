"""Orders of the wave generator's ball bearing, as a ripple of friction and of the transmission."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible, Shape
from hdsim.effects._kernels import ARCMIN, harmonics, periodic_friction
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Parameters, Signature


class BearingComponent(Parameters):
    """One harmonic of the bearing's ripple."""

    at: Literal["larger_ball", "cage", "outer_ring", "inner_ring", "ball_spin"]
    """What makes it: a ball that is larger than the others and meets the two lobes, the set of balls against
    the housing, a place on the outer or on the inner ring that every ball passes, or a place on one ball."""
    harmonic: int = Field(1, ge=1)
    """Multiple of that order."""
    friction_nm: Annotated[
        float,
        Plausible(0.001, 0.1, "estimate: up to the Coulomb friction itself", of="motor_rated_torque"),
    ] = Field(0.0, ge=0)
    """Amplitude of the friction at the motor shaft, N m."""
    error_arcmin: float = Field(0.0, ge=0, le=60)
    """Amplitude of the kinematic error, arcmin at the output."""
    phase_deg: float = 0.0
    """Phase of both at zero angle, degrees."""


def _way(label: str, harmonics: tuple[int, ...]) -> Fitting:
    """A larger ball's order and its multiples."""
    return Fitting(
        Harmonic.components("friction_nm", 0.002, len(harmonics)),
        shapes=(Shape("ball_to_pitch_diameter", (0.07, 0.0825, 0.095, 0.1075, 0.12), linear=True),),
        settings={"components": [{"at": "larger_ball", "harmonic": k} for k in harmonics]},
        label=label,
        turns=20.0,
    )


class WaveGeneratorBearing(Effect):
    """T = -sum A (1 + sin u) tanh(w_m/w_s) on the motor and e = sum E sin u, u an order of the bearing.

    The inner ring turns with the wave generator, the outer one with the flexspline. For balls that roll, n of
    them, with gamma = d cos(alpha)/D of ball and pitch diameter, the cage turns by (1 - gamma)/2 of the one
    and (1 + gamma)/2 of the other; per turn of the wave generator against the flexspline balls pass a place
    of the outer ring n (1 - gamma)/2 times and one of the inner ring n (1 + gamma)/2 times, a place on a ball
    meets a ring (1 - gamma^2)/(2 gamma) times, and one ball meets the two lobes 1 + gamma times. That one,
    between the orders 1 and 2 of the wave generator and no multiple of either, is what a diagnosis looks for.
    """

    title: ClassVar[str] = "wave-generator bearing"
    source: ClassVar[str] = (
        "kinematics of balls that roll between round rings (Harris and Kotzalas 2006, Rolling Bearing "
        "Analysis), and two lobes; geometry (23 balls of 4 mm on 42 mm, as fit into size 20) and amplitudes "
        "are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "direction"),
        channels=("motor_torque", "output_angle"),
        orders=(1.11, 0.46, 10.5, 12.7, 5.3),
        confused_with={
            "position_dependent_friction": "orders 1 and 2 exactly: told apart in 1/gamma turns, about ten",
            "motor_torque_ripple": "keeps its sign when the motion turns round, friction changes it",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (_way("", (1,)),)
    finer: ClassVar[tuple[Fitting, ...]] = (_way("that is felt near the lobes", (1, 2, 3)),)

    balls: int = Field(23, ge=3)
    """Number of balls n."""
    ball_to_pitch_diameter: Annotated[
        float, FIXED, Plausible(0.06, 0.14, "estimate: thin-section bearings, d/D from 1/16 to 1/7")
    ] = Field(0.095, ge=0.02, le=0.3)
    """Ball diameter times the cosine of the contact angle over the pitch diameter, gamma."""
    components: tuple[BearingComponent, ...] = Field(
        (BearingComponent(at="larger_ball", friction_nm=0.004, error_arcmin=0.02),), min_length=1
    )
    """The harmonics."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s."""

    def angle_factors(self, component: BearingComponent, ratio: float) -> tuple[float, float]:
        """Factors of the motor's and of the output's angle in u.

        Args:
            component: of the ripple.
            ratio: signed; below zero the flexspline turns with the output, above it stands still.
        """
        gamma, flexspline = self.ball_to_pitch_diameter, 1.0 if ratio < 0 else 0.0
        if component.at == "cage":
            turns, against = 0.5 * (1.0 - gamma), 0.5 * (1.0 + gamma)
        else:
            turns = {
                "larger_ball": 1.0 + gamma,
                "outer_ring": 0.5 * self.balls * (1.0 - gamma),
                "inner_ring": 0.5 * self.balls * (1.0 + gamma),
                "ball_spin": (1.0 - gamma * gamma) / (2.0 * gamma),
            }[component.at]
            against = -turns
        return component.harmonic * turns, component.harmonic * against * flexspline

    def contribute(self, build: Builder) -> None:
        """Add the friction on the motor shaft and the error to the mesh twist."""
        friction = [self.smoothing_velocity_rad_per_s, float(len(self.components))]
        error = [float(len(self.components))]
        for c in self.components:
            angle = (*self.angle_factors(c, build.ratio), math.radians(c.phase_deg))
            friction += [c.friction_nm, *angle]
            error += [c.error_arcmin * ARCMIN, *angle]
        build.element(periodic_friction, friction)
        if any(c.error_arcmin > 0 for c in self.components):
            build.twist(harmonics, error)
