"""The backlash of the rough flanks grown beyond what it was: wear in proportion to each tooth's own gap."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.parts import Builder, Effect, OfTeeth, Signature


class FlankWear(Effect):
    """Every tooth's half-gap is (1 + growth) b instead of b, its own Weierstrass-Mandelbrot one.

    The structure behind the mesh keeps the spring that it was calibrated to with the gaps b: the catalogue's
    stiffness is that of the new drive. Below zero the gaps are narrower than the model's. `output_backlash`
    widens every gap by the same angle instead, so teeth whose flanks leave little gap part from the others
    less. Meshes `teeth` and `tabulated` have it; the others have no gap of their own.
    """

    title: ClassVar[str] = "grown gaps of the flanks (wear)"
    source: ClassVar[str] = (
        "half-gaps: Zhang et al. 2021 (Eq. 15), doi:10.21203/rs.3.rs-652069/v1, whose heights scale "
        "together; growth is an estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("direction", "torque"),
        channels=("output_angle", "output_torque"),
        confused_with={
            "output_backlash": "every gap wider by the same: around zero torque all teeth part alike",
            "mesh_preload": "gaps narrower by the same, below zero too",
            "torsional_hysteresis_maxwell": "a loop with area that stays under a bias torque",
            "torsional_hysteresis_duhem": "a loop with area that stays under a bias torque",
            "stiffness_nonlinearity": "soft, but with a finite slope at zero torque",
        },
    )
    of_teeth: ClassVar[OfTeeth | None] = OfTeeth("growth", "growth")
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"growth": 0.5}, signed=True),), mesh="toothed"),
    )

    growth: Annotated[
        float, Plausible(0.1, 5.0, "gaps of worn drives: Oldham play when new, times up to six")
    ] = Field(0.5, ge=-1, le=1000)
    """Part of its own half-gap by which each tooth's is wider."""

    def contribute(self, build: Builder) -> None:
        """Grow the gaps of the mesh."""
        build.grow_gaps(self.growth)
