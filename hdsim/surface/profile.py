"""Weierstrass-Mandelbrot profiles of many teeth at once.

Source: Zhang et al. (2021), doi:10.21203/rs.3.rs-652069/v1, Eq. 1 and 15; the full sum after
Majumdar and Bhushan (1990), J. Tribology 112:205, and Yan and Komvopoulos (1998), J. Appl. Phys. 84:3617.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.errors import InputError
from hdsim.surface.flank import Flank

Array = NDArray[np.float64]
Reading = Literal["full", "single"]

#: Density of asperities, gamma of Table 1.
GAMMA = 1.5
#: Sampling length at which the full sum reproduces Table 4 of the source, m.
SAMPLING_LENGTH_M = 2.1e-3
#: Index of the highest frequency of the full sum at which it reproduces Table 4.
HIGHEST_INDEX = 25
#: Places up to which each is computed by itself.
FEW = 16


def random_phases(
    teeth: int, seed: int | list[int] | np.random.Generator, highest_index: int = HIGHEST_INDEX
) -> Array:
    """Independent phases, uniform between 0 and 2 pi, shape (teeth, highest_index + 1), rad.

    Args:
        teeth: number of profiles.
        seed: seed of ``numpy.random.default_rng``, or a generator.
        highest_index: index of the highest frequency.
    """
    return np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, (teeth, highest_index + 1))


def frequency_index(length_m: float, truncated_diameter_m: float, gamma: float = GAMMA) -> int:
    """Index n0 = int(log(L / 2r') / log(gamma)) of the wave of length 2r', Table 1 of the source."""
    return int(math.log(length_m / truncated_diameter_m) / math.log(gamma))


def wm_profile(
    x_m: ArrayLike,
    D: float,
    G_m: float,
    *,
    phases: ArrayLike,
    length_m: float = SAMPLING_LENGTH_M,
    reading: Reading = "full",
    gamma: float = GAMMA,
    truncated_diameter_m: float = 1e-3,
) -> Array:
    """Height profiles of rough flanks, zero at x = 0.

    ``full``, all frequencies gamma^n / L, n = 0 .. N-1:

        z(x) = A sum_n gamma^((D-3) n) (cos phi_n - cos(2 pi gamma^n x / L - phi_n)),
        A = L (G/L)^(D-2) sqrt(ln gamma)

    ``single``, Eq. 1 and 15 as printed, the one wave of length 2r':

        z(x) = G^(D-2) sqrt(ln gamma) (2r')^(3-D) (cos phi - cos(pi x / r' - phi))

    The single wave is the term of the sum with gamma^n = L / 2r'.

    Args:
        x_m: positions along the flank, shape (points,), m.
        D: fractal dimension, 2 < D < 3.
        G_m: fractal roughness, m.
        phases: rad; for ``full`` shape (teeth, N) or (N,), for ``single`` shape (teeth,) or a number.
        length_m: sampling length L, m; unused by ``single``.
        reading: ``full`` or ``single``.
        gamma: density of asperities, above 1.
        truncated_diameter_m: 2r', m; used by ``single`` only.

    Returns:
        Heights, shape (teeth, points), or (points,) when ``phases`` describes one profile; m.
    """
    Flank(D, G_m)
    if not gamma > 1.0:
        raise InputError(f"gamma must exceed 1, found {gamma}")
    x = np.atleast_1d(np.asarray(x_m, dtype=float))
    phi = np.asarray(phases, dtype=float)
    if reading == "single":
        if phi.ndim > 1:
            raise InputError(f"the single-frequency reading wants one phase a tooth, found shape {phi.shape}")
        d = truncated_diameter_m
        amplitude = d * (G_m / d) ** (D - 2.0) * math.sqrt(math.log(gamma))
        phi = phi[..., None]
        return np.asarray(amplitude * (np.cos(phi) - np.cos(2.0 * math.pi * x / d - phi)))
    if reading != "full":
        raise InputError(f"reading must be 'full' or 'single', found {reading!r}")
    if phi.ndim not in (1, 2) or phi.shape[-1] == 0:
        raise InputError(f"the full sum wants phases of shape (teeth, frequencies), found {phi.shape}")
    n = np.arange(phi.shape[-1])
    amplitude = length_m * (G_m / length_m) ** (D - 2.0) * math.sqrt(math.log(gamma))
    a_cos = amplitude * gamma ** ((D - 3.0) * n) * np.cos(phi)
    a_sin = amplitude * gamma ** ((D - 3.0) * n) * np.sin(phi)
    # cos(w x - phi) = cos(w x) cos(phi) + sin(w x) sin(phi): two matrix products for all teeth.
    risen, sines = _waves((x / length_m).tobytes(), len(n), gamma)
    return np.asarray(a_cos @ risen - a_sin @ sines)


@lru_cache(maxsize=8)
def _waves(places: bytes, frequencies: int, gamma: float) -> tuple[Array, Array]:
    """1 - cos(w x) and sin(w x) of all waves at places x / L, shape (frequencies, points) each; read-only.

    Kept: drives that differ in their phases alone share them.
    """
    rates = np.asarray(math.pi * gamma ** np.arange(frequencies))
    half = _turned(rates, np.frombuffer(places))
    # As 2 sin^2(w x / 2), so that small heights near x = 0 don't cancel.
    risen, sines = 2.0 * half.imag**2, 2.0 * half.imag * half.real
    risen.setflags(write=False)
    sines.setflags(write=False)
    return risen, sines


def _turned(rates: Array, x: Array) -> NDArray[np.complex128]:
    """exp(i rate x), shape (rates, points); of evenly spaced places by products of a few of them."""
    points = len(x)
    if points > FEW:
        step = (x[-1] - x[0]) / (points - 1)
        off = np.max(np.abs(x - (x[0] + step * np.arange(points))))
        if off <= 4.0 * np.finfo(float).eps * np.max(np.abs(x)):
            stride = math.isqrt(points)
            starts = x[0] + step * stride * np.arange(-(-points // stride))
            far, near = (np.exp(1j * rates[:, None] * part) for part in (starts, step * np.arange(stride)))
            return np.asarray((far[:, :, None] * near[:, None, :]).reshape(len(rates), -1)[:, :points])
    angle = rates[:, None] * x
    return np.asarray(np.cos(angle) + 1j * np.sin(angle))
