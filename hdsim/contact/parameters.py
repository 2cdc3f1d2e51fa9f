"""What a scenario says about the contact of a tooth pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

from pydantic import Field, FilePath

from hdsim.number import Number
from hdsim.parts import Parameters
from hdsim.plugins import plugins, wrong_choice

if TYPE_CHECKING:
    from hdsim.contact.law import ContactLaw
    from hdsim.surface.flank import Flank


#: Hardness of a heat treatment; stiffness of a contact that nobody has measured.
_HARDNESS, _STIFFNESS = Number(0.2, asked=True), Number(0.7, asked=True)


class ToothMaterial(Parameters):
    """Steel of one spline's teeth."""

    youngs_modulus_pa: float = Field(gt=0)
    """Young's modulus E, Pa."""
    poisson_ratio: float = Field(gt=-1, le=0.5)
    """Poisson's ratio."""
    hardness_pa: Annotated[float, _HARDNESS] = Field(3.0e9, gt=0)
    """Hardness H, Pa: 9.81e6 times the Brinell number (tempered steel of HB 280-320: 2.75-3.14e9)."""


class Materials(Parameters):
    """The two materials of a tooth pair."""

    circular_spline: ToothMaterial = ToothMaterial(youngs_modulus_pa=2.12e11, poisson_ratio=0.28)
    """Teeth of the circular spline; default 42CrMo."""
    flexspline: ToothMaterial = ToothMaterial(youngs_modulus_pa=2.09e11, poisson_ratio=0.295)
    """Teeth of the flexspline; default 40CrNiMoA."""

    @property
    def reduced_modulus_pa(self) -> float:
        """E of Hertz, 1/E = (1-nu1^2)/E1 + (1-nu2^2)/E2 (Johnson 1985, Contact Mechanics, Eq. 4.3), Pa."""
        both = (self.circular_spline, self.flexspline)
        return 1.0 / sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus_pa for m in both)

    @property
    def softer(self) -> ToothMaterial:
        """The softer of the two, which yields first (the flexspline's at equal hardness)."""
        return min((self.flexspline, self.circular_spline), key=lambda material: material.hardness_pa)


class MajumdarBhushanParameters(Parameters):
    """Fractal contact of rough flanks, Eq. 2-13 of Zhang et al. (2021).

    With the default flanks and the default hardness of 3.0 GPa, usual for the steel, the stiffness at 34.67 N
    is 4.7e8 N/m. The source prints 6e7; its own equations and flanks give 6.7e8 and more (docs/contact.md).
    """

    law: Literal["majumdar_bhushan"] = "majumdar_bhushan"
    materials: Materials = Materials()
    asperity_stiffness: Literal["printed", "fixed-asperity"] = "printed"
    """Stiffness of one asperity: Eq. 11 as printed, or Hertz's for one of fixed shape (factor 3/2)."""
    floor_force_n: float = Field(3.5, gt=0)
    """Force below which the stiffness is held constant, N; default 10 % of the source's rated tooth load."""
    nominal_area_m2: float = Field(5.0e-6, gt=0)
    """Area on which two flanks can touch, m^2; a warning tells when the asperities need more."""
    asperity_density: float = Field(1.5, gt=1, le=10)
    """Ratio gamma of neighbouring frequencies of the surface."""

    def build(self, surface: Flank) -> ContactLaw:
        """The law.

        Args:
            surface: the rough surface that stands for both flanks.
        """
        from hdsim.contact.majumdar_bhushan import MajumdarBhushan

        return MajumdarBhushan(
            surface.D,
            surface.G_m,
            self.materials.reduced_modulus_pa,
            self.materials.softer.hardness_pa,
            self.materials.softer.poisson_ratio,
            self.asperity_stiffness,
            floor_force_n=self.floor_force_n,
            nominal_area_m2=self.nominal_area_m2,
            gamma=self.asperity_density,
        )


class ConstantStiffnessParameters(Parameters):
    """Linear contact."""

    law: Literal["constant"]
    contact_stiffness_n_per_m: Annotated[float, _STIFFNESS] = Field(gt=0)
    """Stiffness of one tooth pair's contact, N/m."""

    def build(self, surface: Flank) -> ContactLaw:
        """The law; the surface is not used."""
        from hdsim.contact.constant import ConstantStiffness

        return ConstantStiffness(self.contact_stiffness_n_per_m)


class HertzLineParameters(Parameters):
    """Line contact of smooth flanks (Puttock and Thwaite 1969)."""

    law: Literal["hertz_line"]
    materials: Materials = Materials()
    face_width_m: float = Field(0.010, gt=0)
    """Length of the line of contact, m."""
    relative_radius_m: float = Field(0.001, gt=0)
    """Relative radius of curvature of the flanks, 1/R = 1/R1 + 1/R2, m."""

    def build(self, surface: Flank) -> ContactLaw:
        """The law; the surface is not used."""
        from hdsim.contact.hertz_line import HertzLine

        return HertzLine(self.face_width_m, self.relative_radius_m, self.materials.reduced_modulus_pa)


class TableLawParameters(Parameters):
    """Force over penetration from a CSV file."""

    law: Literal["table"]
    file: FilePath
    """CSV file with the columns ``penetration_m`` and ``force_n``, both rising from 0; a scenario looks
    for it relative to the file in which it is written."""

    def build(self, surface: Flank) -> ContactLaw:
        """The law; the surface is not used."""
        from hdsim.contact.measured import TableLaw

        return TableLaw.from_csv(self.file)


_LAWS = (MajumdarBhushanParameters, ConstantStiffnessParameters, HertzLineParameters, TableLawParameters)


def _laws() -> Any:
    """The union of hdsim's laws and those of other packages (entry point ``hdsim.contact_laws``)."""
    known = [get_args(law.model_fields["law"].annotation)[0] for law in _LAWS]
    found = plugins("contact_laws", known, lambda one: wrong_choice(one, Parameters, "law", "build"))
    return Union[(*_LAWS, *(one.value for one in found.values()))]


if TYPE_CHECKING:
    ContactParameters = (
        MajumdarBhushanParameters | ConstantStiffnessParameters | HertzLineParameters | TableLawParameters
    )
else:
    ContactParameters = Annotated[_laws(), Field(discriminator="law")]
"""The contact law of a tooth pair, chosen by ``law``."""
