"""The motion behind an encoder's reading: a known error is taken out of it before it is prescribed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hdsim.effects.sensors import Sensors

if TYPE_CHECKING:
    from hdsim.estimate.records import Array
    from hdsim.parts import Effect

#: Sines of an encoder's error over its own angle: order per turn, amplitude and phase, rad.
Sines = tuple[tuple[float, float, float], ...]

#: Largest angle of an error's own period over which it is a cubic, rad: its second derivative, which the
#: inertias feel, is then right to 0.3^2 / 12, less than one percent.
PIECE_RAD = 0.3
#: Largest slope of an error over the angle: beyond it a reading may stand still while the shaft turns.
STEEPEST = 0.5
#: Newton's steps to the true angle: each squares what is left, from at most half a radian.
STEPS = 6


def errors_of(effects: Mapping[str, Effect], channel: str) -> Sines:
    """Sines in an encoder's error that are periodic in its own angle: what its scale puts into a reading."""
    from hdsim.effects._readers import EncoderReader

    sensors = effects.get("sensors")
    # The noise's seed does not matter: it is no error that is known.
    reader = sensors.readers(seed=0).get(channel) if isinstance(sensors, Sensors) else None
    if not isinstance(reader, EncoderReader):
        return ()
    found = [(r.order, r.amplitude, r.phase) for r in reader.ripples if r.channel == channel]
    found.append((1.0, reader.eccentricity, -reader.phase))
    return tuple(one for one in found if one[1])


def true_motion(breaks: Array, coefficients: Array, errors: Sines) -> tuple[Array, Array]:
    """The angle theta of a reading m = theta + sum A sin(order theta + phase), by Newton's method.

    Between breaks, more where the error bends much, it is the cubic that has theta and its rate at both ends.

    Args:
        breaks: of the reading, shape (k + 1,), s.
        coefficients: of its cubic pieces, rad of the encoder's shaft, constant terms first, shape (4, k).
        errors: at least one (``errors_of``).

    Returns:
        Breaks (n + 1,) and coefficients (4, n), n >= k.

    Raises:
        ValueError: the reading hardly rises with the angle, or falls.
    """
    from scipy.interpolate import CubicHermiteSpline, PPoly

    steepest = sum(order * abs(amplitude) for order, amplitude, _ in errors)
    if steepest > STEEPEST:
        raise ValueError(
            f"the encoder's error changes by up to {steepest:.3g} rad a radian, and at most {STEEPEST} "
            "can be taken out of its reading"
        )
    reading = PPoly(coefficients[::-1], breaks)
    breaks = _finer(breaks, coefficients, PIECE_RAD / max(order for order, _, _ in errors))
    read = reading(breaks)
    angle = read.copy()
    for _ in range(STEPS):
        error, slope = _error(angle, errors)
        angle -= (angle + error - read) / (1.0 + slope)
    rate = reading(breaks, 1) / (1.0 + _error(angle, errors)[1])
    return breaks, np.asarray(CubicHermiteSpline(breaks, angle, rate).c[::-1])


def _error(angle: Array, errors: Sines) -> tuple[Array, Array]:
    """Error and its derivative over the angle, shape (n,) each."""
    value, slope = np.zeros_like(angle), np.zeros_like(angle)
    for order, amplitude, phase in errors:
        value += amplitude * np.sin(order * angle + phase)
        slope += order * amplitude * np.cos(order * angle + phase)
    return value, slope


def _finer(breaks: Array, c: Array, most: float) -> Array:
    """Breaks between which the angle goes no farther than ``most``, rad: those given and equal parts."""
    width = np.diff(breaks)
    # Nowhere in a piece is the speed above the sum of its terms.
    fastest = np.abs(c[1]) + width * (2.0 * np.abs(c[2]) + width * 3.0 * np.abs(c[3]))
    parts = np.maximum(np.ceil(fastest * width / most), 1.0).astype(int)
    own = np.repeat(np.arange(len(width)), parts)
    part = np.arange(len(own)) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.append(breaks[own] + part * (width / parts)[own], breaks[-1])
