"""Backlash beyond the rough flanks' own: wear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import WIDER, Amplitude, Fitting, Plausible, Shape
from hdsim.effects._kernels import ARCMIN
from hdsim.parts import Builder, Effect, OfTeeth, Signature

if TYPE_CHECKING:
    from hdsim.parts import Array

#: Widths of the play that are tried, as parts of the twist that a record covers.
_PARTS = (0.05, 0.05 * WIDER, 0.05 * WIDER**2)


class OutputBacklash(Effect):
    """Every tooth's gap is wider by the same angle at the output: half-gap + backlash/2.

    With a coefficient C the play b is taken up gradually, as where no two teeth have the same gap, and the
    drive rests in its middle: d = b/2 tanh(C tau) in series with the torsion spring, sharp as C grows.
    """

    title: ClassVar[str] = "backlash (wear)"
    source: ClassVar[str] = (
        "Nordin and Gutman 2002, Automatica 38:1633 (dead-zone model); level: Oldham backlash of 9 arcsec "
        "at ratio 100, Harmonic Drive HFUS-2A manual"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("direction", "torque"),
        channels=("output_angle", "output_torque"),
        confused_with={
            "torsional_hysteresis_maxwell": "a loop with area at every amplitude, finite slope at zero "
            "torque, and it stays under a bias torque",
            "torsional_hysteresis_duhem": "a loop with area at every amplitude that stays under a bias "
            "torque",
            "stiffness_nonlinearity": "soft, but with a finite slope at zero torque: the resonance falls "
            "with amplitude and stays above zero, the phase portrait has no flat "
            "segment",
        },
    )
    of_teeth: ClassVar[OfTeeth | None] = OfTeeth("backlash_arcmin", "play", 1.0)
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"backlash_arcmin": 0.3}),)),
        *(
            Fitting((Amplitude({"backlash_arcmin": part}, of_range="twist_arcmin", play=True),))
            for part in _PARTS
        ),
        *(
            Fitting(
                (Amplitude({"backlash_arcmin": part}, of_range="twist_arcmin", play=True),),
                # Taken up later than within a seventh of the torque it would be any compliance that stiffens.
                (Shape("coefficient_per_nm", (8.0, 32.0), "torque_nm", least=7.0),),
                label="taken up gradually",
                # Teeth whose gaps differ take theirs up gradually by themselves.
                mesh="toothless",
            )
            for part in _PARTS[1:]
        ),
    )

    # Ten degrees: no gear.
    backlash_arcmin: Annotated[
        float, Plausible(0.02, 5.0, "Oldham play of 6 to 28 arcsec when new, times ten for wear")
    ] = Field(0.15, ge=0, le=600)
    """Additional total play at the output, arcmin."""
    coefficient_per_nm: Annotated[
        float | None,
        Plausible(7.0, 500.0, "taken up earlier than any other compliance", of="per_rated_torque"),
    ] = Field(None, gt=0)
    """Coefficient C, 1/(N m): three quarters of the play are taken up at the torque 1/C; else a sharp gap."""

    def contribute(self, build: Builder) -> None:
        """Widen the gap of the mesh, or put the gradual play in series with the torsion spring."""
        half, coefficient = 0.5 * self.backlash_arcmin * ARCMIN, self.coefficient_per_nm
        if coefficient is None:
            build.widen_gap(half)
            return

        def wind_up(torque: Array) -> Array:
            import numpy as np

            return half * np.tanh(coefficient * torque)

        build.series_compliance(wind_up, play=half > 0)
