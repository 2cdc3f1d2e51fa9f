"""Backlash beyond the rough flanks' own: wear."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field, model_validator

from hdsim.effects._fitting import WIDER, Amplitude, Fitting, Harmonic, Plausible, Shape
from hdsim.effects._kernels import ARCMIN, Turn, factors
from hdsim.parts import Builder, Effect, OfTeeth, Parameters, Signature

if TYPE_CHECKING:
    from hdsim.parts import Array

#: Widths of the play that are tried, as parts of the twist that a record covers.
_PARTS = (0.05, 0.05 * WIDER, 0.05 * WIDER**2)

#: A play in its finer formulas.
_PLAY = Amplitude({"backlash_arcmin": 0.1}, of_range="twist_arcmin", play=True)


class PlayComponent(Parameters):
    """One harmonic of a play that is not the same all round."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``; 2 where the flexspline's teeth differ: both lobes of the wave generator
    engage a third of them, whose mean goes round."""
    amplitude_arcmin: Annotated[
        float,
        Plausible(0.002, 0.5, "a tenth of the play: the mean of a third of the teeth"),
    ] = Field(0.02, ge=0, le=60)
    """Amplitude of the half of the play, arcmin at the output."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""
    per: Turn = "relative_turn"
    """What ``order`` counts, as in ``kinematic_error``."""


class OutputBacklash(Effect):
    """Every tooth's gap is wider by the same angle at the output: half-gap + backlash/2.

    With a coefficient C the play b is taken up gradually, as where no two teeth have the same gap, and the
    drive rests in its middle: d = b/2 tanh(C tau) in series with the torsion spring, sharp as C grows.

    With a spread s the half-gaps of many teeth, springs side by side, lie evenly between (1 - s) b/2 and
    (1 + s) b/2. Beyond the first the torque grows with the square of the twist, until at the uptake torque T
    the last tooth bears: a gap of (1 - s) b/2 and, in series with the torsion spring,
    d = s b/2 (2 u - u^2) with u = sqrt(min(|tau|/T, 1)). The springs of all teeth together are the drive's.

    The gap is in series with the spring and what is parallel to it: inside, a hysteresis transmits nothing.

    Nothing damps the gap unless a share f of the drive's damper c is that of the grease between the flanks:
    -f c dDelta/dt acts in the gap, too, and the rest where flanks touch.

    With components the half-gap goes round, b/2 + sum A sin(order * angle + phase), nowhere below zero: which
    teeth engage changes with the wave generator's angle. One potential gives all torques.
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

    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (_PLAY,),
            (Shape("film_share", (0.5, 1.0), linear=True),),
            label="with grease in its gap",
            mesh="toothless",
        ),
        *(
            Fitting(
                (_PLAY, *Harmonic.components("amplitude_arcmin", 0.02, len(orders))),
                (
                    Shape("uptake_torque_nm", (0.03, 0.2), of_range="torque_nm", most=1.0),
                    Shape("gap_spread", (0.4, 0.9), linear=True),
                ),
                settings={"components": [{"order": order, "amplitude_arcmin": 0.0} for order in orders]},
                label=label,
                turns=1.0 if orders else 0.0,
                mesh="toothless",
            )
            for label, orders in (("of many teeth", (2, 4)), ("of gaps that differ", ()))
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
    gap_spread: Annotated[float, Plausible(0.05, 0.9, "rough flanks deviate by a third")] = Field(
        0.0, ge=0, le=1
    )
    """Spread s of the teeth's gaps: half the difference of the widest and the least over the mean."""
    uptake_torque_nm: Annotated[
        float | None,
        Plausible(0.005, 1.0, "estimate: less than the rated torque", of="rated_torque"),
    ] = Field(None, gt=0)
    """Torque at which the last tooth bears, N m; needed with a spread."""
    film_share: Annotated[float, Plausible(0.05, 1.0, "from a trace of oil to a gap full of grease")] = Field(
        0.0, ge=0, le=1
    )
    """Share f of the drive's damper that is the grease's between the flanks, and acts in the gap, too."""
    components: tuple[PlayComponent, ...] = Field((), max_length=8)
    """Harmonics of the play around the wave generator; of a lumped mesh only."""

    @model_validator(mode="after")
    def _one_law(self) -> OutputBacklash:
        if self.gap_spread > 0.0 and self.uptake_torque_nm is None:
            raise ValueError("gap_spread needs uptake_torque_nm, the torque at which the last tooth bears")
        if self.gap_spread > 0.0 and self.coefficient_per_nm is not None:
            raise ValueError("give gap_spread or coefficient_per_nm: each says how the play is taken up")
        return self

    def contribute(self, build: Builder) -> None:
        """Widen the gap of the mesh, and put what is taken up gradually in series with the torsion spring."""
        half, coefficient = 0.5 * self.backlash_arcmin * ARCMIN, self.coefficient_per_nm
        for wave in self.components:
            phase = math.radians(wave.phase_deg)
            build.wave_of_gap(wave.amplitude_arcmin * ARCMIN, *factors(wave.order, wave.per), phase)
        build.fill_gap(self.film_share)
        if coefficient is not None:

            def gradual(torque: Array) -> Array:
                import numpy as np

                return half * np.tanh(coefficient * torque)

            build.series_compliance(gradual, play=half > 0)
            return
        build.widen_gap((1.0 - self.gap_spread) * half)
        spread, last = self.gap_spread * half, self.uptake_torque_nm
        if spread > 0.0 and last is not None:

            def one_after_another(torque: Array) -> Array:
                import numpy as np

                u = np.sqrt(np.minimum(np.abs(torque) / last, 1.0))
                return np.asarray(np.sign(torque) * spread * (2.0 * u - u * u))

            build.series_compliance(one_after_another, play=True)
