"""Cubic stiffening, parallel to the torsion spring."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.kernel import STORED, TWIST, TWIST_TORQUE, element
from hdsim.parts import Builder, Effect, Signature


@element
def cubic(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Add tau = k_3 d^3 on the twist d. Parameter: k_3."""
    twist = inputs[TWIST]
    outputs[TWIST_TORQUE] -= parameters[0] * twist * twist * twist
    jacobian[TWIST_TORQUE * columns + TWIST] -= 3.0 * parameters[0] * twist * twist
    outputs[STORED] += 0.25 * parameters[0] * twist * twist * twist * twist


class StiffnessNonlinearity(Effect):
    """tau = k_1 d + k_3 d^3: adds k_3 d^3 to the drive's own spring; the energy k_3 d^4/4 is stored."""

    title: ClassVar[str] = "cubic stiffness"
    source: ClassVar[str] = (
        "Tuttle and Seering 1996, IEEE Trans. Robotics and Automation 12:368; Taghirad and Belanger 1998, "
        "J. Dyn. Syst. Meas. Control 120:439; default: 5 % more torque at the wind-up of rated load, an "
        "estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque",),
        channels=("output_angle", "output_torque"),
        confused_with={
            "flexspline_stiffening": "saturates toward pi/2 in its own wind-up; same sign, compare beyond "
            "rated torque",
            "output_backlash": "no stiffness at all over a fixed gap, gone under a bias torque",
            "wave_generator_compliance": "stiffens exponentially, most below half of rated torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting((Amplitude({"cubic_nm_per_rad3": 3.0e8}),)),)

    cubic_nm_per_rad3: Annotated[
        float, Plausible(5e-3, 2.0, "K3 is 1.8 times K1 in catalogues", of="cubic_stiffness")
    ] = Field(3.0e8, ge=0)
    """Cubic stiffness k_3 at the output, N m/rad^3."""

    def contribute(self, build: Builder) -> None:
        """Add the cubic torque parallel to the torsion spring."""
        build.element(cubic, [self.cubic_nm_per_rad3])
