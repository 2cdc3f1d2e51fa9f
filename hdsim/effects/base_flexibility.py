"""A housing on a flexible mount, in series with the torsion spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Inverse
from hdsim.parts import Builder, Effect, Signature

if TYPE_CHECKING:
    from hdsim.parts import Array


class BaseFlexibility(Effect):
    """d = (1 - 1/i)^2 tau / K_b.

    With the fixed spline turned by theta_b, Willis' equation (theta_m - theta_b) = i (theta_l - theta_b)
    moves the output by (1 - 1/i) theta_b; by virtual work the mount carries the torque (1 - 1/i) tau. The
    housing's inertia is neglected: valid well below the mount's own resonance.
    """

    title: ClassVar[str] = "base flexibility"
    source: ClassVar[str] = (
        "Willis' equation of epicyclic gears (e.g. Mueller 1982, Epicyclic Drive Trains) and virtual work; "
        "the default stiffness is an estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "frequency"),
        channels=("output_angle",),
        confused_with={
            "flexspline_stiffening": "not linear in torque",
            "stiffness_nonlinearity": "not linear in torque; a linear softening of all segments alike is "
            "the mount, or a drive that is softer than its catalogue value (which"
            " scatters by 30 %)",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting((Inverse("stiffness_nm_per_rad", 5.0e5),)),)

    stiffness_nm_per_rad: float = Field(5.0e5, gt=0)
    """Torsional stiffness K_b of the mount about the drive's axis, N m/rad."""

    def contribute(self, build: Builder) -> None:
        """Put the mount in series with the torsion spring."""
        compliance = (1.0 - 1.0 / build.ratio) ** 2 / self.stiffness_nm_per_rad

        def wind_up(torque: Array) -> Array:
            return compliance * torque

        build.series_compliance(wind_up)
