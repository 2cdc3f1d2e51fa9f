"""Kinematic error that grows with the transmitted torque: a torsion spring that is not the same all round."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible
from hdsim.effects._kernels import Turn, factors
from hdsim.kernel import (
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    OUTPUT_ANGLE,
    OUTPUT_TORQUE,
    STORED,
    TWIST,
    TWIST_TORQUE,
    element,
)
from hdsim.parts import Builder, Effect, Parameters, Signature


@element
def uneven_stiffness(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """Every torque of V = chi^2/2 sum k sin(a theta_m + b theta_l + phi).

    Parameters: number of terms, then k (N m/rad), a, b, phi (rad) of each.
    """
    twist = inputs[TWIST]
    half = 0.5 * twist * twist
    for i in range(int(parameters[0])):
        stiffness = parameters[1 + 4 * i]
        a = parameters[2 + 4 * i]
        b = parameters[3 + 4 * i]
        angle = a * inputs[MOTOR_ANGLE] + b * inputs[OUTPUT_ANGLE] + parameters[4 + 4 * i]
        value = stiffness * math.sin(angle)
        slope = stiffness * math.cos(angle)
        outputs[STORED] += half * value
        outputs[TWIST_TORQUE] -= twist * value
        jacobian[TWIST_TORQUE * columns + TWIST] -= value
        jacobian[TWIST_TORQUE * columns + MOTOR_ANGLE] -= twist * a * slope
        jacobian[TWIST_TORQUE * columns + OUTPUT_ANGLE] -= twist * b * slope
        outputs[MOTOR_TORQUE] -= half * a * slope
        jacobian[MOTOR_TORQUE * columns + TWIST] -= twist * a * slope
        jacobian[MOTOR_TORQUE * columns + MOTOR_ANGLE] += half * a * a * value
        jacobian[MOTOR_TORQUE * columns + OUTPUT_ANGLE] += half * a * b * value
        outputs[OUTPUT_TORQUE] -= half * b * slope
        jacobian[OUTPUT_TORQUE * columns + TWIST] -= twist * b * slope
        jacobian[OUTPUT_TORQUE * columns + MOTOR_ANGLE] += half * a * b * value
        jacobian[OUTPUT_TORQUE * columns + OUTPUT_ANGLE] += half * b * b * value


class StiffnessComponent(Parameters):
    """One harmonic of the stiffness."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``."""
    stiffness_nm_per_rad: Annotated[
        float,
        Plausible(
            0.005,
            0.2,
            "estimate: an error of 1 to 50 arcsec at rated torque, size 20 at ratio 100",
            of="stiffness_k1",
        ),
    ] = Field(1e3, ge=0)
    """Amplitude k of the stiffness, N m/rad at the output."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""
    per: Turn = "wave_generator_turn"
    """What ``order`` counts, as in ``kinematic_error``."""


class LoadDependentKinematicError(Effect):
    """V = chi^2/2 sum k sin(order * angle + phase) in the twist chi: the stiffness varies with the angle.

    Under a torque tau the output lags by tau/(K + k sin(...)), that is by an error of amplitude k tau/K^2
    besides the wind-up, in proportion to the torque and with its sign: together with ``kinematic_error`` the
    amplitude and the phase that are measured at an order change with the load. One potential gives all
    torques, so the motor feels chi^2/2 dk/dtheta_m, without which a turn under load would create energy.
    Orders 1 per turn of the wave generator come from how it is assembled (off its axis, tilted), so they
    change when the drive is assembled anew. A rigid mesh has no twist. The drive's own spring must be
    stiffer than the components together; inside a play it acts as a spring of k sin(...).
    """

    title: ClassVar[str] = "load-dependent kinematic error"
    source: ClassVar[str] = (
        "Ghorbel, Gandhi and Alpeter 2001, J. Mech. Des. 123:90 (what is measured is a pure kinematic error "
        "and a part of the torsional flexibility, and depends on load and assembly); the balls of the oval "
        "bearing in the stiffness: Trans. JSME C 55(509):216, 1989; the law, a stiffness over the angle, is "
        "the plainest with one potential; the default, 15 arcsec at the rated 52 N m of a size 20 drive, is "
        "an estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "torque"),
        channels=("output_angle", "motor_torque", "output_torque"),
        orders=(2.0, 2.02, 4.0, 1.0),
        confused_with={
            "kinematic_error": "has the same amplitude at any torque; under a torque that never changes the "
            "two are one, and a sign change of the torque turns this one's phase by 180 degrees",
            "wave_generator_eccentricity": "only order 1 per wave-generator turn, at any torque",
            "damaged_tooth": "a short bump, at any torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            Harmonic.components("stiffness_nm_per_rad", 500.0, 4),
            turns=1.0,
            settings={
                "components": [
                    {"order": order, "per": per, "stiffness_nm_per_rad": 0.0}
                    for order, per in (
                        (2, "wave_generator_turn"),
                        (2, "relative_turn"),
                        (4, "wave_generator_turn"),
                        (1, "wave_generator_turn"),
                    )
                ]
            },
        ),
    )

    components: tuple[StiffnessComponent, ...] = Field(
        (StiffnessComponent(order=2, stiffness_nm_per_rad=1e3),), min_length=1
    )
    """The harmonics."""

    def misfit(self, least_stiffness_nm_per_rad: float) -> str:
        """Softer than this somewhere, the spring would hold no twist there."""
        together = sum(c.stiffness_nm_per_rad for c in self.components)
        if together < least_stiffness_nm_per_rad:
            return ""
        return (
            f"components: found {together:.4g} N m/rad together, expected less than the "
            f"{least_stiffness_nm_per_rad:.4g} N m/rad of the drive's own torsion spring (drive.torsion): "
            "where they are soft, nothing would hold the twist"
        )

    def contribute(self, build: Builder) -> None:
        """Add the uneven part of the torsion spring."""
        numbers = [float(len(self.components))]
        for c in self.components:
            numbers += [c.stiffness_nm_per_rad, *factors(c.order, c.per), math.radians(c.phase_deg)]
        build.element(uneven_stiffness, numbers)
