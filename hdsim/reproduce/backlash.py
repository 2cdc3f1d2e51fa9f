"""Table 4's backlashes, Fig. 8 and 9, the micron-level rules of section 4.1."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.reproduce import paper
from hdsim.reproduce.rows import Row, Verdict, check
from hdsim.surface.backlash import single_frequency_half_gap, tooth_half_gaps
from hdsim.surface.flank import Flank
from hdsim.surface.profile import HIGHEST_INDEX, SAMPLING_LENGTH_M, random_phases, wm_profile

DRAWS = 2000

_TABLE = tuple(f"table-4-D{D:g}-G{G:.0e}" for D, G, _ in paper.BACKLASH)


def averages(D: float, G_m: float) -> NDArray[np.float64]:
    """Mean |z| of every phase draw, shape (draws,), m."""
    return tooth_half_gaps(Flank(D, G_m), DRAWS, 1)


def length(value: float) -> str:
    """A length with a readable unit."""
    return f"{value * 1e6:.3g} um" if value > 1e-8 else f"{value * 1e9:.3g} nm"


@check(*_TABLE)
def table_4() -> Iterator[Row]:
    """Eight cells of the backlash table."""
    for name, (D, G, printed) in zip(_TABLE, paper.BACKLASH, strict=True):
        gaps = averages(D, G)
        mean, spread = float(gaps.mean()), float(gaps.std() / gaps.mean())
        single = single_frequency_half_gap(Flank(D, G))
        draw = f"(one draw: +-{100 * spread:.0f} %); single wave {length(single)}"
        values = {"mean_m": mean, "relative_spread": spread, "single_wave_m": single}
        if printed is None:
            yield Row(
                name,
                "Table 4 (backlash)",
                f"average backlash, D = {D:g}, G = {G:g} m",
                "cell empty",
                f"{length(mean)} {draw}",
                Verdict.OPEN,
                "the value is missing; both readings give about the same",
                f"{length(mean)}",
                values,
            )
            continue
        error = mean / printed - 1
        yield Row(
            name,
            "Table 4 (backlash)",
            f"average backlash, D = {D:g}, G = {G:g} m",
            length(printed),
            f"{length(mean)}, {100 * error:+.1f} % {draw}",
            Verdict.CHOICE if abs(error) < 0.07 else Verdict.CONTRADICTED,
            f"mean |z| over 0..L of the full sum, L = {SAMPLING_LENGTH_M * 1e3:.1f} mm, {HIGHEST_INDEX + 1} "
            f"frequencies, {DRAWS} phase draws; the paper states neither L nor the averaging, and prints one "
            "frequency only",
            "b = mean |z|, with the sum over all n in Eq. 15",
            values | {"relative_error": error},
            _choices(Flank(D, G), printed, single),
        )


def _choices(flank: Flank, printed: float, single: float) -> dict[str, str]:
    """What was chosen for Table 4, and a cell at other values."""

    def cell(**other: Any) -> str:
        value = float(tooth_half_gaps(flank, 200, 1, **other).mean())
        return f"{100 * (value / printed - 1):+.0f} %"

    rms = float(tooth_rms(flank) / printed - 1)
    return {
        f"sampling length L = {SAMPLING_LENGTH_M * 1e3:.1f} mm": f"1 mm {cell(length_m=1e-3)}, "
        f"4 mm (the scan) {cell(length_m=4e-3)}",
        f"frequencies up to n_max = {HIGHEST_INDEX}": f"10 {cell(highest_index=10)}, "
        f"15 {cell(highest_index=15)}",
        "b = mean of |z|": f"rms of z {100 * rms:+.0f} %",
        paper.SUM: f"one frequency, as printed, with 2r' = 1 mm {100 * (single / printed - 1):+.0f} %",
    }


def tooth_rms(flank: Flank) -> float:
    """Root mean square of z over 0..L, averaged over phase draws, m."""
    phases = random_phases(200, 1, HIGHEST_INDEX)
    x = (np.arange(256) + 0.5) * (SAMPLING_LENGTH_M / 256)
    z = wm_profile(x, flank.D, flank.G_m, phases=phases, length_m=SAMPLING_LENGTH_M)
    return float(np.sqrt((z**2).mean(axis=-1)).mean())


def _trend(flanks: list[Flank]) -> list[float]:
    return [float(averages(f.D, f.G_m).mean()) for f in flanks]


_OVER_D = [Flank(D, 1e-12) for D in (2.2, 2.4, 2.6, 2.8)]
_OVER_G = [Flank(2.3, G) for G in (1e-15, 1e-13, 1e-11, 1e-9)]


@check("fig-8", "fig-9")
def figures() -> Iterator[Row]:
    """Backlash falls with D, rises with G."""
    over_D, over_G = _trend(_OVER_D), _trend(_OVER_G)
    for name, label, values, falling in (("fig-8", "D", over_D, True), ("fig-9", "G", over_G, False)):
        waves = [single_frequency_half_gap(f) for f in (_OVER_D if falling else _OVER_G)]
        monotone = all((np.diff(v) < 0).all() if falling else (np.diff(v) > 0).all() for v in (values, waves))
        verb = "falls" if falling else "rises"
        yield Row(
            name,
            f"Fig. {name[-1]}",
            f"backlash {verb} with {label}",
            f"{verb}",
            f"{', '.join(length(v) for v in values)}",
            Verdict.REPRODUCED if monotone else Verdict.CONTRADICTED,
            "the trend holds for the mean of the full sum and for one frequency, at any L; the curves "
            "themselves hang on phases that the paper doesn't give",
            values={f"mean_m_{i}": v for i, v in enumerate(values)},
        )


@check("rule-D", "rule-G")
def micron_rules() -> Iterator[Row]:
    """Section 4.1: D about 2.5 and G below 1e-13 m for micron-level backlash."""
    at_2_4 = float(averages(2.4, 1e-12).mean())
    at_2_5 = float(averages(2.5, 1e-12).mean())
    micron = _micron_D(1e-12)
    yield Row(
        "rule-D",
        "Section 4.1",
        "to ensure micron-level backlash, D should be about 2.5",
        "D about 2.5",
        f"at G = 1e-12 m: {length(at_2_4)} at D = 2.4, {length(at_2_5)} at D = 2.5",
        Verdict.CHOICE if at_2_5 < _MICRON_LEVEL_M else Verdict.CONTRADICTED,
        "enough, as the paper says, but not needed: its own row D = 2.4 is below a micron already, and which "
        "D gives a micron depends on G",
        f"D = {micron:.2f} gives 1 um at G = 1e-12 m",
        {"at_2_4_m": at_2_4, "at_2_5_m": at_2_5, "D_of_one_micron": micron},
        {
            "G = 1e-12 m, that of the paper's rows over D": f"{length(_mean(2.5, 1e-9))} at G = 1e-9 m",
            "micron level: below 2 um": f"below 0.1 um it {'holds' if at_2_5 < 1e-7 else 'does not hold'}",
        },
    )
    pair = float(averages(paper.AVERAGED.D, paper.AVERAGED.G_m).mean())
    both, mended = (_mean(f.D, f.G_m) for f in (paper.summed(), paper.mended()))
    arcsec = math.degrees(pair / (paper.PITCH_DIAMETER_M / 2)) * 3600
    at_rule = _mean(2.3, 1e-13)
    yield Row(
        "rule-G",
        "Section 4.1",
        "to ensure micron-level backlash, G should be below 1e-13 m",
        "G < 1e-13 m",
        f"at D = 2.3: {length(at_rule)} at G = 1e-13 m; measured pair (G = 1.55e-10 m): {length(pair)} = "
        f"{arcsec:.1f} arcsec; summed {length(both)}, with G corrected for Eq. 18 {length(mended)}",
        Verdict.CHOICE if at_rule < _MICRON_LEVEL_M else Verdict.CONTRADICTED,
        "enough at the D of the paper's rows over G, but not needed: its own measured surface has a G a "
        "thousand times larger and a backlash below a micron",
        values={
            "at_rule_m": at_rule,
            "averaged_pair_m": pair,
            "summed_pair_m": both,
            "mended_pair_m": mended,
            "averaged_pair_arcsec": arcsec,
        },
        choices={
            "D = 2.3, that of the paper's rows over G": f"{length(_mean(2.2, 1e-13))} at D = 2.2",
            "micron level: below 2 um": f"below 1 um it {'holds' if at_rule < 1e-6 else 'does not hold'}",
        },
    )


#: What section 4.1 is taken to mean by the micron level, m.
_MICRON_LEVEL_M = 2e-6


def _mean(D: float, G_m: float) -> float:
    return float(averages(D, G_m).mean())


def _micron_D(G_m: float) -> float:
    """D at which the average backlash is 1 um."""
    from scipy.optimize import brentq

    return float(brentq(lambda D: math.log(float(averages(D, G_m).mean()) / 1e-6), 2.05, 2.9, xtol=1e-4))
