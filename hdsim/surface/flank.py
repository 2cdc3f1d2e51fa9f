"""A rough flank as two numbers, its structure function, and the one surface that stands for two flanks.

Sources: Zhang et al. (2021), doi:10.21203/rs.3.rs-652069/v1, Eq. 16-18; Berry and Lewis (1980),
Proc. R. Soc. Lond. A 370:459, for the increments of a Weierstrass-Mandelbrot function.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.errors import InputError

Array = NDArray[np.float64]
Constant = Literal["corrected", "printed"]
EquivalentSurface = Literal["summed", "averaged"]

#: Lags between which two summed structure functions are refitted, m.
FIT_LAGS_M = (1e-6, 1e-3)


@dataclass(frozen=True)
class Flank:
    """A rough tooth flank.

    Args:
        D: fractal dimension of the surface, 2 < D < 3.
        G_m: fractal roughness, m.
    """

    D: float
    G_m: float

    def __post_init__(self) -> None:
        if not 2.0 < self.D < 3.0:
            raise InputError(f"fractal dimension D must lie between 2 and 3, found {self.D}")
        if not (self.G_m > 0.0 and math.isfinite(self.G_m)):
            raise InputError(f"fractal roughness G must be a positive length in m, found {self.G_m}")


def structure_function_constant(D: float, constant: Constant = "corrected") -> float:
    """Constant C of S(tau) = C G^(2(Ds-1)) tau^(4-2Ds), with Ds = D - 1; dimensionless.

    ``printed`` is Eq. 18, C = Gamma(2Ds-3) sin((2Ds-3) pi/2) / (2-Ds). ``corrected`` is what the profile of
    Eq. 1 has, summed over all frequencies: with amplitudes A_n^2 = ln(gamma) G^(2(D-2)) w_n^(2D-6) at the
    frequencies w_n = gamma^n / L (cycles per m), S(tau) = sum A_n^2 (1 - cos 2 pi w_n tau), and replacing the
    sum over n by an integral over w (dn = dw / (w ln gamma)) gives C = (2 pi)^(4-2Ds) / 2 times Eq. 18.
    Both are finite at Ds = 1.5, where Gamma(x) sin(pi x / 2) tends to pi / 2.

    Args:
        D: fractal dimension of the surface, 2 < D < 3.
        constant: ``corrected`` or ``printed``.
    """
    Ds = D - 1.0
    x = 2.0 * Ds - 3.0
    # Gamma(x) sin(pi x/2) = Gamma(1+x) (pi/2) sinc(x/2): no 0 * infinity at x = 0.
    printed: float = math.gamma(1.0 + x) * (math.pi / 2.0) * float(np.sinc(x / 2.0)) / (2.0 - Ds)
    if constant == "printed":
        return printed
    if constant == "corrected":
        return float(0.5 * (2.0 * math.pi) ** (4.0 - 2.0 * Ds) * printed)
    raise InputError(f"constant must be 'corrected' or 'printed', found {constant!r}")


def structure_function(lag_m: ArrayLike, flank: Flank, constant: Constant = "corrected") -> Array:
    """Mean squared height difference over a lag, S(tau), Eq. 17; m^2.

    Args:
        lag_m: lags tau, m, any shape.
        flank: the surface.
        constant: see ``structure_function_constant``.

    Returns:
        S of the lags' shape, m^2.
    """
    Ds = flank.D - 1.0
    C = structure_function_constant(flank.D, constant)
    lag = np.asarray(lag_m, dtype=float)
    # In powers of tau / G, so that no intermediate number leaves the range of a float.
    return np.asarray(C * flank.G_m**2 * (lag / flank.G_m) ** (4.0 - 2.0 * Ds))


def flank_from_power_law(exponent: float, structure_at_1_m: float, constant: Constant = "corrected") -> Flank:
    """Flank whose structure function is ``structure_at_1_m * tau ** exponent``, the inverse of Eq. 17.

    Args:
        exponent: 4 - 2 Ds, between 0 and 2.
        structure_at_1_m: S at a lag of 1 m, m^2.
        constant: see ``structure_function_constant``.

    Raises:
        InputError: when the exponent belongs to no fractal dimension between 2 and 3.
    """
    D = 3.0 - exponent / 2.0
    if not 2.0 < D < 3.0:
        raise InputError(
            f"a structure function of exponent {exponent:.4g} is not fractal: expected between 0 and 2 "
            f"(D = 3 - exponent / 2 between 2 and 3)"
        )
    C = structure_function_constant(D, constant)
    return Flank(D, math.exp(math.log(structure_at_1_m / C) / (2.0 * (D - 2.0))))


def corrected_flank(printed: Flank) -> Flank:
    """A flank whose G was identified with Eq. 18 as printed, with the G that Eq. 1 has for the same heights.

    What was measured is the structure function; it is kept. D stays, and G falls by
    (C_printed / C_corrected)^(1 / (2 (D - 2))).

    Args:
        printed: D, and G as identified with the printed constant.
    """
    return flank_from_power_law(
        6.0 - 2.0 * printed.D, float(structure_function(1.0, printed, "printed")), "corrected"
    )


def equivalent_surface(
    flank1: Flank,
    flank2: Flank,
    method: EquivalentSurface = "summed",
    *,
    lags_m: tuple[float, float] = FIT_LAGS_M,
    constant: Constant = "corrected",
) -> Flank:
    """The rough surface that, against a smooth one, stands for two rough flanks.

    ``summed``: the heights of independent surfaces add, so their structure functions add; the sum is fitted
    by a power law (least squares on logarithms, lags spaced logarithmically). ``averaged``: arithmetic means
    of D and of G, which is what Table 4 of the source prints; it has no physical ground and gives a contact
    that is more than ten times too stiff.

    Args:
        flank1: one flank.
        flank2: the other.
        method: ``summed`` or ``averaged``.
        lags_m: shortest and longest lag of the fit, m.
        constant: constant of the structure function, for the sum and the fit alike: the one by which the
            flanks' G were identified, so that what is added is what was measured.

    Returns:
        The equivalent flank.
    """
    if method == "averaged":
        return Flank((flank1.D + flank2.D) / 2.0, (flank1.G_m + flank2.G_m) / 2.0)
    if method != "summed":
        raise InputError(f"equivalent surface must be 'summed' or 'averaged', found {method!r}")
    lags = np.geomspace(lags_m[0], lags_m[1], 121)
    total = structure_function(lags, flank1, constant) + structure_function(lags, flank2, constant)
    exponent, intercept = np.polyfit(np.log(lags), np.log(total), 1)
    return flank_from_power_law(float(exponent), math.exp(float(intercept)), constant)
