"""A flexspline that stiffens with load, in series with the torsion spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Inverse, Plausible, Shape
from hdsim.parts import Builder, Effect, Signature

if TYPE_CHECKING:
    from hdsim.parts import Array


class FlexsplineStiffening(Effect):
    """d = arctan(C tau)/(C K_0), that is a stiffness K = K_0 (1 + (C tau)^2).

    It comes in series with the drive's own compliance chain; to use it alone, set the chain's stiffness high.
    """

    title: ClassVar[str] = "stiffening flexspline"
    source: ClassVar[str] = (
        "Zhang, Ahmad and Liu 2015, IEEE/ASME Trans. Mechatronics 20:178 (flexspline part); the numbers are"
        " estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque",),
        channels=("output_angle", "output_torque"),
        confused_with={
            "stiffness_nonlinearity": "grows without bound in twist; compare beyond rated torque",
            "wave_generator_compliance": "depends on the wave generator's torque, so on its friction: it "
            "shows hysteresis when the motor turns",
            "output_backlash": "no stiffness at all over a fixed gap, gone under a bias torque",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Inverse("stiffness_nm_per_rad", 1.0e5),),
            # Taken up within less of the torque it would be a play.
            (Shape("coefficient_per_nm", (0.7, 2.0, 6.0), "torque_nm", most=8.0),),
        ),
    )

    stiffness_nm_per_rad: Annotated[
        float, Plausible(1.0, 300.0, "estimate: in series with a drive of K1", of="stiffness_k1")
    ] = Field(1.0e5, gt=0)
    """Stiffness K_0 at zero torque, at the output, N m/rad."""
    coefficient_per_nm: Annotated[
        float,
        Plausible(0.2, 8.0, "stiffens within the drive's torques, later than a play", of="per_rated_torque"),
    ] = Field(0.02, gt=0)
    """Coefficient C, 1/(N m): the stiffness has doubled at the torque 1/C."""

    def contribute(self, build: Builder) -> None:
        """Put the compliance in series with the torsion spring."""

        def wind_up(torque: Array) -> Array:
            import numpy as np

            return np.arctan(self.coefficient_per_nm * torque) / (
                self.coefficient_per_nm * self.stiffness_nm_per_rad
            )

        build.series_compliance(wind_up)
