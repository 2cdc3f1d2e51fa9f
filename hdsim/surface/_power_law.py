"""Least-squares power laws with a noise floor, many at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PowerLaws:
    """S = exp(log_scale) lag^exponent + 2 noise_variance; every field has shape (curves,)."""

    exponent: Array
    log_scale: Array
    noise_variance: Array


def fit_power_laws(lags: Array, S: Array, noise: float | Literal["none", "fit"]) -> PowerLaws:
    """Fit power laws to curves.

    ``none``: a straight line through the logarithms. A number: that noise's 2 sigma^2 is taken off first, and
    lags where less than a tenth of S is left count little. ``fit``: for every exponent of a grid, scale and
    floor are a linear least-squares problem in relative errors (both kept >= 0); the grid is refined twice.

    Args:
        lags: shape (k,), m.
        S: shape (curves, k), m^2.
        noise: as above.
    """
    if noise == "fit":
        return _fit_floor(lags, S)
    floor = 0.0 if noise == "none" else 2.0 * float(noise) ** 2
    x = np.log(lags)
    rest = np.maximum(S - floor, 0.02 * S)
    # The variance of ln(S - floor) grows as (S / rest)^2.
    w = (rest / S) ** 2
    y = np.log(rest)
    mean = (w * x).sum(1) / w.sum(1)
    dx = x - mean[:, None]
    exponent = (w * dx * y).sum(1) / (w * dx**2).sum(1)
    log_scale = (w * y).sum(1) / w.sum(1) - exponent * mean
    return PowerLaws(exponent, log_scale, np.full(len(S), 0.5 * floor))


def _fit_floor(lags: Array, S: Array) -> PowerLaws:
    log_lag = np.log(lags / lags[-1])
    rows = np.arange(len(S))
    grid = np.broadcast_to(np.linspace(0.01, 1.99, 199), (len(S), 199))
    for reach in (0.01, 0.001):
        cost = _floors(log_lag, grid, S)[0]
        best = grid[rows, np.argmin(cost, axis=1)]
        grid = np.clip(best, reach, 2.0 - reach)[:, None] + reach * np.linspace(-1.0, 1.0, 21)
    cost, scale, floor = _floors(log_lag, grid, S)
    best_column = np.argmin(cost, axis=1)
    exponent = grid[rows, best_column]
    scale, floor = scale[rows, best_column], floor[rows, best_column]
    log_scale = np.log(np.maximum(scale, np.finfo(float).tiny)) - exponent * np.log(lags[-1])
    return PowerLaws(exponent, log_scale, 0.5 * floor)


def _floors(log_lag: Array, exponents: Array, S: Array) -> tuple[Array, Array, Array]:
    """Cost, scale and floor (>= 0) of S = scale lag^p + floor in relative errors, shaped as ``exponents``.

    Args:
        log_lag: shape (k,).
        exponents: shape (curves, m).
        S: shape (curves, k).
    """
    v = (1.0 / S)[:, None]
    u = np.exp(exponents[..., None] * log_lag) * v  # (curves, m, k)
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    u1, v1 = u.sum(-1), v.sum(-1)
    determinant = uu * vv - uv**2
    scale = (u1 * vv - v1 * uv) / determinant
    floor = (v1 * uu - u1 * uv) / determinant
    scale = np.where(floor < 0.0, u1 / uu, scale)
    floor = np.where(scale < 0.0, v1 / vv, np.maximum(floor, 0.0))
    scale = np.maximum(scale, 0.0)
    cost = ((scale[..., None] * u + floor[..., None] * v - 1.0) ** 2).sum(-1)
    return cost, scale, floor
