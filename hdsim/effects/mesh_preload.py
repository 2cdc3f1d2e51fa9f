"""Preload of the mesh: teeth that are pressed together before there is a load."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.effects._kernels import ARCMIN
from hdsim.parts import Builder, Effect, OfTeeth, Signature


class MeshPreload(Effect):
    """Every tooth's half-gap is smaller by delta, as an angle at the output: b - delta.

    Where that is negative both flanks of a tooth press on their neighbours: U(x - b + delta) + U(-x - b +
    delta) instead of a dead-zone, with U the stored energy of one flank and x the displacement. The drive
    has no play then, teeth carry load at rest, and around zero torque the mesh is stiffer by the second
    flank. The catalogue's stiffness is that of the preloaded drive. With wear (``output_backlash``) the sum
    of both counts. A lumped mesh has no teeth: there it only takes up the play that other effects add; a
    rigid one has none. A diagnosis asks for it where the model has teeth, whose gaps may be too wide.
    """

    title: ClassVar[str] = "mesh preload"
    source: ClassVar[str] = (
        "Harmonic Drive's catalogues state zero backlash of the teeth; Materials 2021, 14:5057 (drives are "
        "usually designed with zero backlash at the mesh); two flanks: the paper's dead-zone, Eq. 14, each; "
        "no interference is published: the default, an estimate, presses a tooth of the paper's drive with "
        "6 % of its force at rated torque"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "direction"),
        channels=("output_angle", "output_torque"),
        confused_with={
            "output_backlash": "the opposite: it opens a gap around zero torque that a preload closes",
            "stiffness_nonlinearity": "stiffer at large torques, a preloaded mesh around none",
        },
    )
    of_teeth: ClassVar[OfTeeth | None] = OfTeeth("interference_arcmin", "play", -2.0)
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"interference_arcmin": 0.1}),), mesh="toothed"),
    )

    interference_arcmin: Annotated[
        float,
        Plausible(0.1, 0.6, "estimate: half-gaps of the surfaces are 0.6 to 3.3 um, 0.08 to 0.45 arcmin"),
    ] = Field(0.3, ge=0, le=10)
    """Interference delta by which each flank's gap is smaller, arcmin at the output."""

    def contribute(self, build: Builder) -> None:
        """Narrow the gap of the mesh."""
        build.widen_gap(-self.interference_arcmin * ARCMIN)
