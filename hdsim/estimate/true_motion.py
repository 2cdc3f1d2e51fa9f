"""The motion behind an encoder's reading: a known error is taken out of it before it is prescribed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hdsim.effects._kernels import ARCMIN

if TYPE_CHECKING:
    from hdsim.effects.sensors import Encoder
    from hdsim.estimate.records import Array
    from hdsim.parts import Effect

#: Shaft whose turns the ripple of a channel's own scale counts.
OWN = {"motor_angle": "wave_generator_turn", "output_angle": "output_turn"}
#: Largest angle of an error's own period over which it is a cubic, rad: its second derivative, which the
#: inertias feel, is then right to 0.3^2 / 12, less than one percent.
PIECE_RAD = 0.3
#: Largest slope of an error over the angle: beyond it a reading may stand still while the shaft turns.
STEEPEST = 0.5
#: Newton's steps to the true angle: each squares what is left, from at most half a radian.
STEPS = 6


def errors_of(effects: Mapping[str, Effect], channel: str) -> tuple[tuple[float, float, float], ...]:
    """Order per turn of its shaft, amplitude (rad) and phase (rad) of each sine in an encoder's error."""
    encoder: Encoder | None = getattr(effects.get("sensors"), channel, None)
    if encoder is None:
        return ()
    found = [
        (r.order, r.amplitude_arcsec * ARCMIN / 60.0, math.radians(r.phase_deg))
        for r in encoder.ripple
        if r.per == OWN[channel]
    ]
    if encoder.eccentricity_arcmin:
        phase = math.radians(encoder.eccentricity_phase_deg)
        found.append((1.0, encoder.eccentricity_arcmin * ARCMIN, -phase))
    return tuple(one for one in found if one[1])


def true_motion(
    breaks: Array, coefficients: Array, errors: tuple[tuple[float, float, float], ...]
) -> tuple[Array, Array]:
    """The angle theta of a reading m = theta + sum A sin(order theta + phase), by Newton's method.

    Each piece gets the cubic that has theta and its rate at both ends (Hermite), and is cut where the error
    would bend too much within it.

    Args:
        breaks: of the reading, shape (k + 1,), s.
        coefficients: of its cubic pieces, rad of the encoder's shaft, constant terms first, shape (4, k).
        errors: order, amplitude and phase of each sine (``errors_of``).

    Returns:
        Breaks (n + 1,) and coefficients (4, n), n >= k.

    Raises:
        ValueError: the reading hardly rises with the angle, or falls.
    """
    steepest = sum(order * abs(amplitude) for order, amplitude, _ in errors)
    if steepest > STEEPEST:
        raise ValueError(
            f"the encoder's error changes by up to {steepest:.3g} rad a radian, and at most {STEEPEST} "
            "can be taken out of its reading"
        )
    breaks, c = _cut(breaks, coefficients, PIECE_RAD / max(order for order, _, _ in errors))
    width = np.diff(breaks)
    ends = []
    for t in (np.zeros_like(width), width):
        read, rate = c[0] + t * (c[1] + t * (c[2] + t * c[3])), c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])
        angle = read.copy()
        for _ in range(STEPS):
            error, slope = _error(angle, errors)
            angle -= (angle + error - read) / (1.0 + slope)
        ends.append((angle, rate / (1.0 + _error(angle, errors)[1])))
    (first, left), (last, right) = ends
    chord = (last - first) / width
    square = (3.0 * chord - 2.0 * left - right) / width
    return breaks, np.array([first, left, square, (left + right - 2.0 * chord) / width**2])


def _error(angle: Array, errors: tuple[tuple[float, float, float], ...]) -> tuple[Array, Array]:
    """Error and its derivative over the angle, shape (n,) each."""
    value, slope = np.zeros_like(angle), np.zeros_like(angle)
    for order, amplitude, phase in errors:
        value += amplitude * np.sin(order * angle + phase)
        slope += order * amplitude * np.cos(order * angle + phase)
    return value, slope


def _cut(breaks: Array, c: Array, most: float) -> tuple[Array, Array]:
    """The same pieces, each in parts over which the angle goes no farther than ``most``, rad."""
    width = np.diff(breaks)
    # Nowhere in a piece is the speed above the sum of its terms.
    fastest = np.abs(c[1]) + width * (2.0 * np.abs(c[2]) + width * 3.0 * np.abs(c[3]))
    parts = np.maximum(np.ceil(fastest * width / most), 1.0).astype(int)
    own = np.repeat(np.arange(len(width)), parts)
    t = (np.arange(len(own)) - np.repeat(np.cumsum(parts) - parts, parts)) * (width / parts)[own]
    a, b, d, e = c[:, own]
    moved = np.array([a + t * (b + t * (d + t * e)), b + t * (2.0 * d + t * 3.0 * e), d + 3.0 * t * e, e])
    return np.append(breaks[own] + t, breaks[-1]), moved
