"""One tooth out of place, worn or raised, in a mesh that has teeth."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, OddTooth, OfTeeth, Signature

#: Where a fit looks for the tooth: every 15 degrees of the half turn of the wave generator in which each
#: tooth passes a lobe once; an arc of teeth under load is about 50 degrees wide.
_PLACES = tuple(15.0 * k + 7.5 for k in range(12))


class ToothError(Effect):
    """U(dz(x + eps + s, b + d)) instead of U(dz(x + eps, b)) for the pair of one tooth.

    U is the stored energy of a tooth pair, x the displacement of all of them, eps and b the pair's own pitch
    error and half-gap, dz the dead-zone. s is the tooth's pitch error (a bent or shifted tooth), d > 0
    material that is missing on both flanks (wear, a chipped tooth), d < 0 material too much (a burr, a
    dent's rim). Tooth k of the flexspline is at the angle 2 pi k / z_f + theta_f, of the circular spline at
    2 pi k / z_c + theta_c (theta_c = 0 where that is fixed, else theta_l); the pair acts where a lobe of the
    wave generator is on it, twice in a turn against the spline. Both lobes press alike: a tooth and its
    opposite one, half a turn on, act at the same time and look the same. Meshes `teeth` and `tabulated` have
    it; the others have no teeth.

    A tooth that is worn, or missing altogether, is hardly felt, as some sixty share the load; one that is
    out of place by more than the gap is. So a diagnosis asks for s alone.
    """

    title: ClassVar[str] = "error of a single tooth"
    source: ClassVar[str] = (
        "pair potential: Zhang et al. 2021 (Eq. 14), doi:10.21203/rs.3.rs-652069/v1; single pitch deviation "
        "as ISO 1328-1 defines it (f_pt); passing of the teeth from the kinematics; sizes are estimates"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "output_angle"),
        channels=("output_angle", "motor_torque", "output_torque"),
        orders=(2.0, 2.02, 4.0, 4.04),
        confused_with={
            "kinematic_error": "a few smooth harmonics over the whole turn, at any load, instead of a bump "
            "as wide as the arc of teeth under load",
            "damaged_tooth": "the same tooth in a model without teeth: a bump of the same size at any load",
            "sensors": "a fault of an encoder's disc repeats once per turn of its own shaft and leaves no "
            "torque",
        },
    )
    of_teeth: ClassVar[OfTeeth | None] = OfTeeth("tooth", "place")
    fittings: ClassVar[tuple[Fitting, ...]] = tuple(
        Fitting(
            # An early one takes load from its neighbours at the other sign of the torque than a late one.
            (Amplitude({"shift_um": shift_um}),),
            shapes=(Shape("tooth", _PLACES, linear=True, over_range=f"{member}_pitch_deg"),),
            settings={"member": member},
            label=f"of the {member.replace('_', ' ')}, {meets}",
            turns=1.0,
            mesh="toothed",
            # It is felt for as long as its arc is, and as suddenly as that begins.
            asks=("drive.mesh.engagement.share", "drive.mesh.engagement.edge_teeth"),
        )
        for member in ("flexspline", "circular_spline")
        for meets, shift_um in (("early", 10.0), ("late", -10.0))
    )

    member: Literal["flexspline", "circular_spline"] = "flexspline"
    """The spline that the tooth belongs to."""
    tooth: Annotated[float, FIXED] = 0.0
    """Its number, from the tooth on lobe 1 at zero angles; between two, both have a share of the error."""
    shift_um: Annotated[
        float, Plausible(1.0, 60.0, "estimate: single pitch deviations of fine teeth are 3 to 10 um")
    ] = Field(20.0, ge=-500, le=500)
    """Pitch error s of the tooth, along its normal, um: a positive one meets earlier at a positive twist."""
    widened_um: float = Field(0.0, ge=-500, le=500)
    """Half-gap d of its pair on top of its own, um: above zero both flanks are worn, below too thick."""

    def contribute(self, build: Builder) -> None:
        """Let the tooth differ."""
        build.odd_tooth(OddTooth(self.member, self.tooth, 1e-6 * self.shift_um, 1e-6 * self.widened_um))
