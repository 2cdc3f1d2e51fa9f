"""Kinematic error: the output of the unloaded drive differs from motor angle over ratio, periodically."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from hdsim.effects._fitting import Fitting, Harmonic, Periodic, Plausible
from hdsim.effects._kernels import ARCMIN, Turn, factors, harmonics
from hdsim.parts import Builder, DriveSize, Effect, Parameters, Signature


class ErrorComponent(Parameters):
    """One harmonic of the kinematic error."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``."""
    amplitude_arcmin: Annotated[
        float | None,
        Plausible(3e-3, 3.0, "catalogue accuracy 0.5 to 1.5 arcmin peak to peak; coarse drives more"),
    ] = Field(None, ge=0, le=60)
    """Amplitude (half of peak to peak) as an angle at the output, arcmin."""
    amplitude_rad: float | None = Field(None, ge=0)
    """The same in rad; give one of the two."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""
    per: Turn = "wave_generator_turn"
    """What ``order`` counts: turns of the wave generator (errors of the fixed member), of the output (its own
    eccentricity), or of the wave generator against the output member (errors of the turning member)."""

    @model_validator(mode="after")
    def _one_amplitude(self) -> ErrorComponent:
        if (self.amplitude_arcmin is None) == (self.amplitude_rad is None):
            raise ValueError("give exactly one of amplitude_arcmin and amplitude_rad")
        return self

    @property
    def amplitude(self) -> float:
        """Amplitude in rad."""
        return (self.amplitude_rad or 0.0) + (self.amplitude_arcmin or 0.0) * ARCMIN


def _default_components() -> tuple[ErrorComponent, ...]:
    table: tuple[tuple[float, float, Turn], ...] = (
        (2, 0.20, "wave_generator_turn"),
        (2, 0.10, "relative_turn"),
        (4, 0.05, "wave_generator_turn"),
        (1, 0.03, "wave_generator_turn"),
        (1, 0.12, "output_turn"),
        (2, 0.04, "output_turn"),
    )
    return tuple(ErrorComponent(order=n, amplitude_arcmin=a, per=per) for n, a, per in table)


#: Components of a plain fit; a finer one has the same, and takes over what was found of them.
_ORDERS: list[dict[str, Any]] = [
    {"order": 2, "per": "wave_generator_turn"},
    {"order": 2, "per": "relative_turn"},
    {"order": 4, "per": "wave_generator_turn"},
]
#: Their multiples, and lobes of the output. What goes round once with the output may as well be an
#: eccentricity, which has a name of its own.
_MULTIPLES: list[dict[str, Any]] = [
    {"order": 6, "per": "wave_generator_turn"},
    {"order": 4, "per": "relative_turn"},
]
_LOBES: list[dict[str, Any]] = [{"order": n, "per": "output_turn"} for n in (2, 3)]


def _further(*besides: float) -> Periodic:
    """Other orders, as the order spectrum has them."""
    return Periodic(
        "components",
        "amplitude_arcmin",
        0.1,
        "output_angle",
        settings={"per": "wave_generator_turn"},
        besides=(1.0, 2.0, 2.02, 4.0, *besides),
    )


class KinematicError(Effect):
    """e = sum A sin(order * angle + phase), added to the mesh twist theta_m/i - theta_f + e.

    The builder derives the reaction torques from e: the motor feels tau (1/i + de/dtheta_m), without which
    the model would create energy (virtual work). With the circular spline fixed the orders per
    wave-generator turn of an order-2 ``relative_turn`` component are 2 z_c/z_f (2.02 at ratio 100), and an
    order-1 ``output_turn`` component is 1/ratio (0.01). The default components sum to the catalogue's
    transmission accuracy of about 1 arcmin peak to peak; they are those of size 20 at ratio 100, printed with
    0.8 arcmin, and grow with the printed accuracy of another preset.
    """

    title: ClassVar[str] = "kinematic error"
    source: ClassVar[str] = (
        "Tuttle and Seering 1996, IEEE Trans. Robotics and Automation 12:368 (form); Ghorbel, Gandhi and "
        "Alpeter 2001, J. Mech. Des. 123:90 (pure kinematic error); level: Harmonic Drive catalogue, "
        "angular transmission accuracy; the split over orders is an estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "output_angle"),
        channels=("output_angle", "motor_torque", "output_torque"),
        orders=(2.0, 2.02, 4.0, 1.0, 0.01, 0.02),
        confused_with={
            "motor_torque_ripple": "ripple moves both encoders alike (no quasi-static transmission error) "
            "and its order is locked to poles and slots; under a stiff speed loop it"
            " shows only in the current, constant with speed, while this one grows "
            "there with speed squared",
            "wave_generator_eccentricity": "only order 1 per wave-generator turn, no order 2",
            "output_eccentricity": "only order 1 per output turn",
            "sensors": "encoder eccentricity stays with the encoder when it is re-clocked; two opposed "
            "heads cancel odd orders; on the motor it reaches the transmission error divided by "
            "the ratio",
            "damaged_tooth": "a short bump: many harmonics of one pass, in a narrow range of angle",
            "load_dependent_kinematic_error": "grows with the torque and changes its sign with it",
        },
    )
    several: ClassVar[bool] = True
    printed: ClassVar[bool] = True
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (*Harmonic.components("amplitude_arcmin", 0.1, 3), _further()),
            turns=1.0,
            settings={"components": _ORDERS},
            lives_in=("wave_generator_angle",),
        ),
        Fitting(
            Harmonic.components("amplitude_arcmin", 0.1, 3),
            label="of the output",
            turns=50.0,
            settings={"components": [{"order": n, "per": "output_turn"} for n in (1, 2, 3)]},
            lives_in=("output_angle",),
        ),
    )

    #: Without an output's encoder no order spectrum shows which orders there are, and where a record passes
    #: a resonance the spectrum misses some.
    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (*Harmonic.components("amplitude_arcmin", 0.1, 5), _further(4.04, 6.0)),
            label="with multiples of its orders",
            turns=1.0,
            settings={"components": [*_ORDERS, *_MULTIPLES]},
            lives_in=("wave_generator_angle",),
            refines=("",),
        ),
        Fitting(
            (*Harmonic.components("amplitude_arcmin", 0.1, 7), _further(4.04, 6.0)),
            label="with multiples, and of the output",
            needs=("output_angle",),
            turns=20.0,
            settings={"components": [*_ORDERS, *_MULTIPLES, *_LOBES]},
            lives_in=("wave_generator_angle", "output_angle"),
            refines=("", "with multiples of its orders"),
        ),
    )

    components: tuple[ErrorComponent, ...] = Field(default_factory=_default_components, min_length=1)
    """The harmonics."""

    @classmethod
    def sized(cls, given: Mapping[str, Any], size: DriveSize, reference: DriveSize) -> dict[str, Any]:
        """The default components, as large as the printed accuracy wants them."""
        larger = (size.accuracy_rad or reference.accuracy_rad) / reference.accuracy_rad
        if larger == 1.0:
            return {}
        return {
            "components": [
                {"order": c.order, "amplitude_arcmin": larger * (c.amplitude_arcmin or 0.0), "per": c.per}
                for c in _default_components()
            ]
        }

    def contribute(self, build: Builder) -> None:
        """Add the harmonics to the mesh twist."""
        numbers = [float(len(self.components))]
        for c in self.components:
            numbers += [c.amplitude, *factors(c.order, c.per), math.radians(c.phase_deg)]
        build.twist(harmonics, numbers)
