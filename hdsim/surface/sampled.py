"""Profiles as an instrument samples them: form removal, structure function, synthetic ones to compare.

Source of the structure function: Zhang et al. (2021), doi:10.21203/rs.3.rs-652069/v1, Eq. 16.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.surface.flank import Flank
from hdsim.surface.profile import GAMMA, wm_profile

Array = NDArray[np.float64]
Detrend = Literal["none", "mean", "line"]


def measured_structure_function(heights_m: ArrayLike, steps: ArrayLike) -> Array:
    """Mean squared height difference of profiles over lags of whole samples, Eq. 16.

    Args:
        heights_m: shape (profiles, points) or (points,); NaN marks a missing height, m.
        steps: lags in samples, shape (k,).

    Returns:
        Shape (profiles, k) or (k,), m^2.
    """
    z = np.asarray(heights_m, dtype=float)
    mean = np.nanmean if np.isnan(z).any() else np.mean
    return np.stack([mean((z[..., k:] - z[..., :-k]) ** 2, axis=-1) for k in np.asarray(steps)], axis=-1)


def detrended(heights_m: ArrayLike, detrend: Detrend = "line") -> Array:
    """Profiles without their mean, or without their least-squares line; NaN stays NaN.

    Args:
        heights_m: shape (profiles, points) or (points,), m.
        detrend: ``none``, ``mean`` or ``line``.
    """
    z = np.asarray(heights_m, dtype=float)
    if detrend == "none":
        return z
    known = np.isfinite(z)
    count = known.sum(axis=-1, keepdims=True)
    z = z - np.where(known, z, 0.0).sum(axis=-1, keepdims=True) / count
    if detrend == "mean":
        return np.asarray(z)
    x = np.where(known, np.linspace(-1.0, 1.0, z.shape[-1]), 0.0)
    x = np.where(known, x - x.sum(axis=-1, keepdims=True) / count, 0.0)
    slope = (np.where(known, z, 0.0) * x).sum(axis=-1, keepdims=True) / (x**2).sum(axis=-1, keepdims=True)
    return np.asarray(z - slope * x)


def synthetic_profiles(
    flank: Flank,
    profiles: int,
    points: int,
    spacing_m: float,
    seed: int | list[int] | np.random.Generator,
    *,
    noise_rms_m: float = 0.0,
    gamma: float = GAMMA,
    lattice: float | None = None,
) -> Array:
    """Weierstrass-Mandelbrot profiles as an instrument would sample them, shape (profiles, points), m.

    The waves reach from ten times the profile's length (slopes and bows that detrending meets) down to a
    third of the spacing; what is shorter is independent from sample to sample and enters as white noise of
    its variance. The lattice of frequencies lies anywhere, so that nothing is tuned to it.

    Args:
        flank: the surface.
        profiles: number of profiles.
        points: samples of a profile.
        spacing_m: distance of samples, m.
        seed: seed or generator.
        noise_rms_m: rms of white noise added to every sample, m.
        gamma: density of asperities.
        lattice: place of the lattice between two frequencies, 0..1; random when None.
    """
    rng = np.random.default_rng(seed)
    length = 10.0 * points * spacing_m * gamma ** (rng.uniform() if lattice is None else lattice)
    waves = 1 + math.ceil(math.log(3.0 * length / spacing_m) / math.log(gamma))
    phases = rng.uniform(0.0, 2.0 * math.pi, (profiles, waves))
    x = spacing_m * np.arange(points)
    z = wm_profile(x, flank.D, flank.G_m, phases=phases, length_m=length, gamma=gamma)
    # Sum over n >= waves of A_n^2 / 2, a geometric series.
    first = length * (flank.G_m / length) ** (flank.D - 2.0) * gamma ** ((flank.D - 3.0) * waves)
    unresolved = 0.5 * math.log(gamma) * first**2 / (1.0 - gamma ** (2.0 * (flank.D - 3.0)))
    return np.asarray(z + math.sqrt(unresolved + noise_rms_m**2) * rng.standard_normal(z.shape))
