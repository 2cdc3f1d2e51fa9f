"""Eq. 16-18, and what a scan like the paper's can tell of D and G."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hdsim.reproduce import paper
from hdsim.reproduce.rows import Row, Verdict, check
from hdsim.surface.flank import Flank, structure_function, structure_function_constant
from hdsim.surface.identify import identify, implied_heights
from hdsim.surface.sampled import measured_structure_function, synthetic_profiles

Array = NDArray[np.float64]

SEEDS = 100
SURROGATES = 96
NOISE_M = 58e-9
FLANKS = {"CS": paper.CIRCULAR_SPLINE, "pair": paper.AVERAGED, "FS": paper.FLEXSPLINE}


@dataclass(frozen=True)
class RoundTrip:
    """Identified from ``SEEDS`` synthetic scans: errors of D, ratios of G, coverage of the 95 % interval."""

    D_error: Array
    G_ratio: Array
    G_printed_ratio: Array
    half_width: Array
    covered: float
    warned: Array


@cache
def round_trip(flank: Flank, noise_rms_m: float = 0.0, mode: Literal["none", "fit"] = "none") -> RoundTrip:
    """Synthesise one profile a seed at the paper's sampling (1 um, 4 mm), identify, compare.

    Args:
        flank: the truth.
        noise_rms_m: white noise of the instrument, m.
        mode: whether noise is fitted.
    """
    points = round(paper.SCAN_M / paper.LAG_SPACING_M) + 1
    found = []
    for seed in range(SEEDS):
        z = synthetic_profiles(flank, 1, points, paper.LAG_SPACING_M, [seed, 2021], noise_rms_m=noise_rms_m)
        found.append(identify(z, paper.LAG_SPACING_M, noise=mode, surrogates=SURROGATES, seed=seed))
    return RoundTrip(
        np.array([f.D - flank.D for f in found]),
        np.array([f.G_m / flank.G_m for f in found]),
        np.array([f.G_printed_m / flank.G_m for f in found]),
        np.array([0.5 * (f.D_interval[1] - f.D_interval[0]) for f in found]),
        float(np.mean([f.D_interval[0] < flank.D < f.D_interval[1] for f in found])),
        np.array([bool(f.warnings) for f in found]),
    )


@check("eq-15", "eq-16", "eq-17", "eq-18")
def structure() -> Iterator[Row]:
    """Structure function of Eq. 1's surface."""
    from hdsim.surface.backlash import single_frequency_half_gap

    gap = single_frequency_half_gap(paper.AVERAGED)
    yield Row(
        "eq-15",
        "Eq. 15",
        "backlash b is the W-M profile itself",
        "b = z(x), one frequency",
        f"z changes sign and vanishes at x = 0; the wave's height is {gap * 1e6:.2f} um for 2r' = 1 mm",
        Verdict.OPEN,
        "the paper gives neither 2r', nor phase, nor how b >= 0 follows; Table 4 decides for the mean of |z|",
        "b = mean over 0..L of |sum over n|",
        {"single_wave_m": gap},
    )
    lags = np.unique(np.round(np.geomspace(1, 100, 20)).astype(int))
    ratios = []
    for flank in FLANKS.values():
        z = np.concatenate([synthetic_profiles(flank, 25, 2001, 1e-6, [s, 5]) for s in range(8)])
        S = measured_structure_function(z, lags).mean(axis=0)
        ratios.append(S / structure_function(lags * 1e-6, flank))
    spread = float(np.abs(np.log(np.array(ratios))).max())
    slope = max(abs(float(np.polyfit(np.log(lags), np.log(r), 1)[0])) for r in ratios)
    yield Row(
        "eq-16",
        "Eq. 16",
        "structure function of a profile",
        "definition",
        f"sampled W-M surfaces follow the corrected Eq. 17 within {100 * spread:.0f} %",
        Verdict.REPRODUCED if spread < 0.1 else Verdict.CONTRADICTED,
        "a definition; 200 synthetic profiles a flank, lags 1..100 um",
        values={"largest_log_difference": spread},
    )
    yield Row(
        "eq-17",
        "Eq. 17",
        "S is a power law of exponent 4 - 2 Ds",
        "tau^(4-2Ds)",
        f"exponent within {slope:.3f} on sampled W-M surfaces",
        Verdict.REPRODUCED if slope < 0.05 else Verdict.CONTRADICTED,
        "agrees with Eq. 1 summed over all frequencies; Ds = D - 1",
        values={"exponent_error": slope},
    )
    limit = structure_function_constant(2.5, "printed")
    times = [
        float(np.exp(-np.mean(np.log(structure_function(1e-5, f, "printed") / structure_function(1e-5, f)))))
        for f in FLANKS.values()
    ]
    G_bias = [t ** (1 / (2 * (f.D - 2))) for t, f in zip(times, FLANKS.values(), strict=True)]
    yield Row(
        "eq-18",
        "Eq. 18",
        "constant C of the structure function",
        "Gamma(2Ds-3) sin((2Ds-3) pi/2)/(2-Ds)",
        f"{', '.join(f'{t:.2f}' for t in times)} times too small at D = 2.427, 2.535, 2.643: G comes out "
        f"{', '.join(f'{g:.1f}' for g in G_bias)} times too large; finite at Ds = 1.5 (C = {limit:.6f} = pi)",
        Verdict.CONTRADICTED if min(times) > 1.1 and spread < 0.1 else Verdict.REPRODUCED,
        "the constant belongs to another normalisation than Eq. 1; the W-M sum, averaged over its lattice of "
        f"frequencies, has the corrected one (sampled surfaces agree within {100 * spread:.0f} %)",
        "C = (2 pi)^(4-2Ds)/2 * Gamma(2Ds-3) sin((2Ds-3) pi/2)/(2-Ds)",
        {f"G_ratio_{k}": g for k, g in zip(FLANKS, G_bias, strict=True)} | {"C_at_Ds_1_5": limit},
    )


@check("round-trip-clean")
def clean() -> Iterator[Row]:
    """Identification on clean scans."""
    trips = {name: round_trip(flank) for name, flank in FLANKS.items()}
    median = {k: float(np.median(np.abs(t.D_error))) for k, t in trips.items()}
    cover = {k: t.covered for k, t in trips.items()}
    G = {k: float(np.median(t.G_ratio)) for k, t in trips.items()}
    printed = {k: float(np.median(t.G_printed_ratio)) for k, t in trips.items()}
    yield Row(
        "round-trip-clean",
        "Section 2.4",
        f"D and G from one profile of 4 mm at 1 um, {SEEDS} seeds each, no noise",
        "no error given",
        f"median |error| of D {_listed(median, '.3f')} ({', '.join(FLANKS)}); 95 % interval covers in "
        f"{_listed({k: 100 * c for k, c in cover.items()}, '.0f')} %; G/truth {_listed(G, '.2f')}, as "
        f"printed "
        f"{_listed(printed, '.1f')}",
        Verdict.REPRODUCED if max(median.values()) < 0.02 else Verdict.CONTRADICTED,
        "least squares on logarithms over lags 1..100 um finds D; G needs the corrected constant",
        values={f"median_D_error_{k}": v for k, v in median.items()}
        | {f"coverage_{k}": v for k, v in cover.items()},
    )


@check("round-trip-noise")
def noisy() -> Iterator[Row]:
    """Identification with the noise of an instrument of 200 nm resolution."""
    plain = round_trip(paper.AVERAGED, NOISE_M)
    fitted = round_trip(paper.AVERAGED, NOISE_M, "fit")
    good = float(np.mean(np.logical_or(np.abs(fitted.D_error) < 0.05, fitted.warned)))
    yield Row(
        "round-trip-noise",
        "Table 3, section 2.4",
        f"D and G from one profile with {NOISE_M * 1e9:.0f} nm rms noise (steps of 200 nm / sqrt 12), "
        "averaged pair",
        "not mentioned",
        f"without correction D is {np.median(plain.D_error):+.2f} off (warned: "
        f"{100 * plain.warned.mean():.0f} %), G "
        f"{np.median(plain.G_ratio):.0f} times; with noise fitted D off by "
        f"{np.median(np.abs(fitted.D_error)):.3f} "
        f"(median); within 0.05 or warned: {100 * good:.0f} %",
        Verdict.OPEN,
        "white noise adds 2 s^2 to S at every lag and pushes D towards 3; whether the paper's D = 2.643 "
        "is partly "
        "noise cannot be told from what it prints",
        "S = C G^(2(Ds-1)) tau^(4-2Ds) + 2 s^2",
        {"plain_D_error": float(np.median(plain.D_error)), "good_or_warned": good},
    )


@check("resolution")
def resolution() -> Iterator[Row]:
    """Implied heights against the instrument."""
    lags = [1e-6, 1e-5, 1e-4, 1e-3]
    # What the paper's D and G say about the measured heights, by the paper's own Eq. 17 and 18.
    measured = {k: np.sqrt(structure_function(lags, f, "printed")) * 1e9 for k, f in FLANKS.items()}
    model = implied_heights(paper.FLEXSPLINE, lags) * 1e9
    below = measured["FS"].max() < paper.HEIGHT_RESOLUTION_M * 1e9
    yield Row(
        "resolution",
        "Table 3 and 4",
        "rms height differences that the identified flexspline implies",
        "resolving power 200 nm",
        f"{', '.join(f'{h:.0f}' for h in measured['FS'])} nm at 1, 10, 100, 1000 um (Eq. 18 as printed); "
        f"{', '.join(f'{h:.0f}' for h in model)} nm (corrected)",
        Verdict.OPEN if below else Verdict.REPRODUCED,
        "all of the flexspline's heights lie below the stated resolution of the instrument, up to a "
        "millimetre; its D "
        "and G can't be judged from the print"
        if below
        else "above the resolution",
        values={"largest_m": float(measured["FS"].max() * 1e-9)},
    )


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join("nan" if math.isnan(v) else format(v, form) for v in values.values())
