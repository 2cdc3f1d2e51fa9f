"""What a scenario says about the flanks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from hdsim.number import Number
from hdsim.parts import Parameters

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hdsim.surface.flank import Flank

    Array = NDArray[np.float64]


#: D of ground to milled flanks is 2.3 to 2.7; G differs by decades between two machinings, and by the method
#: that it is identified with.
_DIMENSION, _ROUGHNESS = Number(0.05, far=1.15, asked=True), Number(1.5, far=50.0, asked=True)


class FlankParameters(Parameters):
    """A rough flank as its two fractal parameters."""

    fractal_dimension: Annotated[float, _DIMENSION] = Field(gt=2, lt=3)
    """Fractal dimension D of the surface."""
    fractal_roughness_m: Annotated[float, _ROUGHNESS] = Field(gt=0, lt=1e-3)
    """Fractal roughness G, m."""

    def build(self) -> Flank:
        """The flank."""
        from hdsim.surface.flank import Flank

        return Flank(self.fractal_dimension, self.fractal_roughness_m)


class RoughFlanks(Parameters):
    """The two flanks of a tooth pair, and how their roughness becomes one surface and a half-gap.

    The defaults are the flanks that Zhang et al. (2021) measured. Their Table 4 prints G as identified with
    Eq. 18, whose constant is not that of their profile (Eq. 1); here stands the G with which Eq. 1 has the
    measured structure functions, 5.22 and 1.62 times smaller. ``hdsim.drive.presets.PRINTED_FLANKS`` holds
    the numbers as printed.
    """

    circular_spline: FlankParameters = FlankParameters(
        fractal_dimension=2.4272, fractal_roughness_m=2.384e-11
    )
    """Flank of the circular spline; default: shaped, Zhang et al. (2021), Table 4, G mended for Eq. 18."""
    flexspline: FlankParameters = FlankParameters(fractal_dimension=2.643, fractal_roughness_m=1.152e-10)
    """Flank of the flexspline; default: hobbed, Zhang et al. (2021), Table 4, G mended for Eq. 18."""
    equivalent_surface: Literal["summed", "averaged"] = "summed"
    """Two flanks as one: structure functions summed, or D and G averaged as in Zhang et al. (2021)."""
    structure_function_constant: Literal["corrected", "printed"] = "corrected"
    """Constant by which structure functions are summed: that of the profile, or Eq. 18 as printed."""
    backlash: Literal["full", "single"] = "full"
    """Half-gap from all frequencies with random phases, or from the single wave of Eq. 15."""
    sampling_length_m: float = Field(2.1e-3, gt=0, le=1)
    """Longest wave L of the full sum, m; 2.1 mm reproduces Table 4 of Zhang et al. (2021)."""
    highest_frequency_index: int = Field(25, ge=0, le=60)
    """Index of the highest frequency of the full sum."""
    asperity_density: float = Field(1.5, gt=1, le=10)
    """Ratio gamma of neighbouring frequencies."""
    truncated_diameter_m: float = Field(1e-3, gt=0, le=1)
    """Wave length 2r' of the single wave, m."""
    seed: int | None = Field(None, ge=0)
    """Seed of the phases; the run's own seed when left out."""

    def equivalent(self) -> Flank:
        """The rough surface that stands for the pair."""
        from hdsim.surface.flank import equivalent_surface

        return equivalent_surface(
            self.circular_spline.build(),
            self.flexspline.build(),
            self.equivalent_surface,
            constant=self.structure_function_constant,
        )

    def half_gaps(self, teeth: int, seed: int | list[int]) -> Array:
        """Half-gap of every tooth, shape (teeth,), m.

        Args:
            teeth: number of teeth.
            seed: seed to use when the scenario sets none for the flanks.
        """
        import numpy as np

        from hdsim.surface.backlash import single_frequency_half_gap, tooth_half_gaps

        surface = self.equivalent()
        if self.backlash == "single":
            gap = single_frequency_half_gap(
                surface, truncated_diameter_m=self.truncated_diameter_m, gamma=self.asperity_density
            )
            return np.full(teeth, gap)
        return tooth_half_gaps(
            surface,
            teeth,
            seed if self.seed is None else self.seed,
            length_m=self.sampling_length_m,
            highest_index=self.highest_frequency_index,
            gamma=self.asperity_density,
        )

    def sliding_half_gaps(
        self, teeth: int, points: int, seed: int | list[int], slide_m: float | None = None
    ) -> Array:
        """Half-gap of every tooth at points along its flank, shape (teeth, points), m.

        Args:
            teeth: number of teeth.
            points: contact points, evenly spaced over the slide.
            seed: seed to use when the scenario sets none for the flanks.
            slide_m: length that the contact point travels, m; the sampling length when None.
        """
        import numpy as np

        from hdsim.surface.backlash import sliding_half_gaps
        from hdsim.surface.profile import random_phases, wm_profile

        surface = self.equivalent()
        own_seed = seed if self.seed is None else self.seed
        if self.backlash == "single":
            slide = self.sampling_length_m if slide_m is None else slide_m
            heights = wm_profile(
                np.linspace(0.0, slide, points),
                surface.D,
                surface.G_m,
                phases=random_phases(teeth, own_seed, 0)[:, 0],
                reading="single",
                gamma=self.asperity_density,
                truncated_diameter_m=self.truncated_diameter_m,
            )
            return np.asarray(np.abs(heights))
        return sliding_half_gaps(
            surface,
            teeth,
            points,
            own_seed,
            slide_m=slide_m,
            length_m=self.sampling_length_m,
            highest_index=self.highest_frequency_index,
            gamma=self.asperity_density,
        )
