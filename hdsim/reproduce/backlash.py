"""Table 4's backlashes, Fig. 8 and 9, the micron-level rules of section 4.1."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hdsim.reproduce import paper
from hdsim.reproduce.rows import Row, Verdict, check
from hdsim.surface.backlash import single_frequency_half_gap, tooth_half_gaps
from hdsim.surface.flank import Flank, equivalent_surface
from hdsim.surface.profile import HIGHEST_INDEX, SAMPLING_LENGTH_M

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
            Verdict.REPRODUCED if abs(error) < 0.07 else Verdict.CONTRADICTED,
            f"mean |z| over 0..L of the full sum, L = {SAMPLING_LENGTH_M * 1e3:.1f} mm, {HIGHEST_INDEX + 1} "
            f"frequencies, {DRAWS} phase draws; the paper states neither L nor the averaging, and prints one "
            "frequency only",
            "b = mean |z|, with the sum over all n in Eq. 15",
            values | {"relative_error": error},
        )


def _trend(flanks: list[Flank]) -> list[float]:
    return [float(averages(f.D, f.G_m).mean()) for f in flanks]


@check("fig-8", "fig-9")
def figures() -> Iterator[Row]:
    """Backlash falls with D, rises with G."""
    over_D = _trend([Flank(D, 1e-12) for D in (2.2, 2.4, 2.6, 2.8)])
    over_G = _trend([Flank(2.3, G) for G in (1e-15, 1e-13, 1e-11, 1e-9)])
    for name, label, values, falling in (("fig-8", "D", over_D, True), ("fig-9", "G", over_G, False)):
        monotone = bool((np.diff(values) < 0).all() if falling else (np.diff(values) > 0).all())
        verb = "falls" if falling else "rises"
        yield Row(
            name,
            f"Fig. {name[-1]}",
            f"backlash {verb} with {label}",
            f"{verb}",
            f"{', '.join(length(v) for v in values)}",
            Verdict.REPRODUCED if monotone else Verdict.CONTRADICTED,
            "the curves themselves hang on phases that the paper doesn't give; trend and size are reproduced",
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
        "D about 2.5 is needed for micron-level backlash",
        "D about 2.5",
        f"at G = 1e-12 m: {length(at_2_4)} at D = 2.4, {length(at_2_5)} at D = 2.5",
        Verdict.CONTRADICTED if at_2_4 < 1e-6 else Verdict.REPRODUCED,
        "the paper's own row D = 2.4 (0.32 um) is below a micron already; which D gives a micron depends "
        "on G",
        f"D = {micron:.2f} gives 1 um at G = 1e-12 m",
        {"at_2_4_m": at_2_4, "at_2_5_m": at_2_5, "D_of_one_micron": micron},
    )
    pair = float(averages(paper.AVERAGED.D, paper.AVERAGED.G_m).mean())
    summed = equivalent_surface(paper.CIRCULAR_SPLINE, paper.FLEXSPLINE)
    both = float(averages(summed.D, summed.G_m).mean())
    arcsec = math.degrees(pair / (paper.PITCH_DIAMETER_M / 2)) * 3600
    yield Row(
        "rule-G",
        "Section 4.1",
        "G below 1e-13 m is needed for micron-level backlash",
        "G < 1e-13 m",
        f"measured pair (G = 1.55e-10 m): {length(pair)} = {arcsec:.1f} arcsec; summed {length(both)}",
        Verdict.CONTRADICTED if pair < 1e-6 else Verdict.REPRODUCED,
        "the paper's own measured surface has a G a thousand times larger and a backlash below a micron; "
        "the rule "
        "holds at D = 2.3 only",
        values={"averaged_pair_m": pair, "summed_pair_m": both, "averaged_pair_arcsec": arcsec},
    )


def _micron_D(G_m: float) -> float:
    """D at which the average backlash is 1 um."""
    from scipy.optimize import brentq

    return float(brentq(lambda D: math.log(float(averages(D, G_m).mean()) / 1e-6), 2.05, 2.9, xtol=1e-4))
