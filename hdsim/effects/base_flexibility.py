"""A housing on a flexible mount: in series with the torsion spring, or a body that rings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field, model_validator

from hdsim.effects._fitting import Fitting, Inverse, Plausible, Shape
from hdsim.kernel import DISSIPATED, STORED, element
from hdsim.parts import Builder, Effect, Signature, State

if TYPE_CHECKING:
    from hdsim.parts import Array


@element
def mounted_housing(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """Spring and damper of the mount. Parameters: K_b, d, J_b; own states: b, rad, and db/dt, rad/s."""
    angle = inputs[own]
    speed = inputs[own + 1]
    outputs[own] += speed
    jacobian[own * columns + own + 1] += 1.0
    outputs[own + 1] -= (parameters[0] * angle + parameters[1] * speed) / parameters[2]
    jacobian[(own + 1) * columns + own] -= parameters[0] / parameters[2]
    jacobian[(own + 1) * columns + own + 1] -= parameters[1] / parameters[2]
    outputs[DISSIPATED] += parameters[1] * speed * speed
    jacobian[DISSIPATED * columns + own + 1] += 2.0 * parameters[1] * speed
    outputs[STORED] += 0.5 * (parameters[0] * angle * angle + parameters[2] * speed * speed)


_COMPLIANCE = Inverse("stiffness_nm_per_rad", 5.0e5)
_RINGING = Fitting(
    (_COMPLIANCE,),
    (Shape("natural_frequency_hz", (20.0, 45.0, 100.0, 225.0), least=5.0, most=500.0),),
    label="with housing inertia",
)


class BaseFlexibility(Effect):
    """J_b b'' = -(1 - 1/i) tau - K_b b - d b', twist + (1 - 1/i) b; without inertia (1 - 1/i)^2 tau / K_b.

    With the fixed spline turned by b, Willis' equation (theta_m - b) = i (theta_l - b) moves the output by
    (1 - 1/i) b; by virtual work the mount carries the torque (1 - 1/i) tau. The mesh, its kinematic error and
    the torsion damper see every angle from the housing. The motor's torque and friction do not act on it: the
    motor stands elsewhere, or its torque is small beside tau. Without an inertia the housing follows at once:
    valid well below the mount's own resonance. A rigid mesh has no compliance, and no housing that moves.
    """

    title: ClassVar[str] = "base flexibility"
    source: ClassVar[str] = (
        "Willis' equation of epicyclic gears (e.g. Mueller 1982, Epicyclic Drive Trains) and virtual work; "
        "the default stiffness and damping are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "frequency"),
        channels=("output_angle",),
        confused_with={
            "flexspline_stiffening": "not linear in torque",
            "wave_generator_compliance": "not linear in torque: softest about zero torque",
            "stiffness_nonlinearity": "not linear in torque; a linear softening of all segments alike is "
            "the mount, or a drive that is softer than its catalogue value (which"
            " scatters by 30 %)",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting((_COMPLIANCE,)), _RINGING)
    finer: ClassVar[tuple[Fitting, ...]] = (_RINGING,)

    stiffness_nm_per_rad: Annotated[
        float, Plausible(2.0, 300.0, "estimate: a mount is stiffer than the drive", of="stiffness_k1")
    ] = Field(5.0e5, gt=0)
    """Torsional stiffness K_b of the mount about the drive's axis, N m/rad."""
    housing_inertia_kg_m2: float = Field(0.0, ge=0)
    """Inertia J_b of the housing about the drive's axis, kg m^2 (0: it follows at once)."""
    # Above hearing a housing is no rigid body on a spring.
    natural_frequency_hz: Annotated[
        float | None, Plausible(10.0, 300.0, "estimate: robot links and brackets ring there")
    ] = Field(None, gt=0, le=2e4)
    """The same as the frequency at which the housing alone rings on its mount, Hz; give one of the two."""
    damping_ratio: Annotated[float, Plausible(0.005, 0.2, "estimate: bolted steel and aluminium")] = Field(
        0.05, ge=0, le=2
    )
    """Damping of the housing alone on its mount, as a share of the critical one."""

    @model_validator(mode="after")
    def _one_inertia(self) -> BaseFlexibility:
        if self.housing_inertia_kg_m2 > 0 and self.natural_frequency_hz is not None:
            raise ValueError("give housing_inertia_kg_m2 or natural_frequency_hz, not both")
        return self

    @property
    def inertia_kg_m2(self) -> float:
        """Inertia of the housing, however it was given; 0 without."""
        if self.natural_frequency_hz is None:
            return self.housing_inertia_kg_m2
        return self.stiffness_nm_per_rad / (2.0 * math.pi * self.natural_frequency_hz) ** 2

    def contribute(self, build: Builder) -> None:
        """Put the mount in series with the torsion spring, or let the housing turn on it."""
        stiffness, inertia = self.stiffness_nm_per_rad, self.inertia_kg_m2
        if inertia > 0:
            damping = 2.0 * self.damping_ratio * math.sqrt(stiffness * inertia)
            scale = build.rated_torque_nm / stiffness
            states = (
                State("housing_angle", "rad", 0.0, scale, "housing against the ground"),
                State("housing_velocity", "rad/s", 0.0, scale * math.sqrt(stiffness / inertia), "its rate"),
            )
            own = build.element(mounted_housing, [stiffness, damping, inertia], states=states)
            build.housing(own, inertia)
            return
        compliance = (1.0 - 1.0 / build.ratio) ** 2 / stiffness

        def wind_up(torque: Array) -> Array:
            return compliance * torque

        build.series_compliance(wind_up)
