"""Backlash beyond the rough flanks' own: wear."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting
from hdsim.effects._kernels import ARCMIN
from hdsim.parts import Builder, Effect, Signature


class OutputBacklash(Effect):
    """Every tooth's gap is wider by the same angle at the output: half-gap + backlash/2."""

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
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"backlash_arcmin": 0.3}),)),
        # The trace is far from linear in the play, so several plays are tried.
        *(
            Fitting((Amplitude({"backlash_arcmin": part}, of_range="twist_arcmin"),))
            for part in (0.05, 0.15, 0.5)
        ),
    )

    backlash_arcmin: float = Field(0.15, ge=0)
    """Additional total play at the output, arcmin."""

    def contribute(self, build: Builder) -> None:
        """Widen the gap of the mesh."""
        build.widen_gap(0.5 * self.backlash_arcmin * ARCMIN)
