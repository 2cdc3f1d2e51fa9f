"""What a sensor makes of a channel: pure functions of the true values, for logs and for sampled controllers.

Imports numpy: load lazily. Noise is a function of seed, channel and the instant (to 1 ns), not of the order
of calls: a controller that reads sample by sample and a log that reads everything at once see the same.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

Array = NDArray[np.float64]


class Sensor(Protocol):
    """A sensor between a channel and its reader."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Other channels that ``read`` looks up in its context."""

    @property
    def history(self) -> float:
        """How far before the instant of reading the true values must reach, s."""

    def read(self, times: Array, values: Array, at: Array, context: Mapping[str, Array]) -> Array:
        """Reading at the instants ``at``.

        Args:
            times: shape (n,), s, increasing; a reading before ``times[0]`` sees the first values.
            values: shape (n,), the channel's true values at ``times``, linear in between.
            at: shape (m,), s.
            context: true values of the channels in ``needs``, shape (n,) each.

        Returns:
            Shape (m,), the readings.
        """


@dataclass(frozen=True)
class Noise:
    """White Gaussian noise: standard deviation ``deviation``, reproducible for (seed, channel, instant)."""

    deviation: float
    seed: int
    channel: str

    def at(self, times: Array) -> Array:
        """Noise at ``times`` (s), same shape."""
        if self.deviation == 0.0:
            return np.zeros_like(times)
        from scipy.special import ndtri

        key = np.random.SeedSequence([self.seed, zlib.crc32(self.channel.encode())]).generate_state(
            1, np.uint64
        )[0]
        bits = _mixed(np.round(times * 1e9).astype(np.int64).view(np.uint64) ^ key)
        uniform = ((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
        return np.asarray(self.deviation * ndtri(uniform), dtype=np.float64)


def _mixed(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """SplitMix64's output function, a bijection of 64 bits (Steele, Lea and Flood 2014, OOPSLA)."""
    x = bits * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    result: NDArray[np.uint64] = x ^ (x >> np.uint64(31))
    return result


def quantised(values: Array, step: float) -> Array:
    """``values`` rounded to the nearest multiple of ``step`` (0: unchanged)."""
    return values if step == 0.0 else np.asarray(np.floor(values / step + 0.5) * step)


@dataclass(frozen=True)
class Ripple:
    """(amplitude + relative * x) sin(order * angle + phase), amplitude in the channel's unit."""

    channel: str
    order: float
    amplitude: float
    relative: float
    phase: float


@dataclass(frozen=True)
class EncoderReader:
    """count(theta(t - t_d) + a sin(theta - phi) + ripples + noise): eccentricity a, steps and delay."""

    step: float
    eccentricity: float
    phase: float
    delay: float
    noise: Noise
    ripples: tuple[Ripple, ...] = ()

    @property
    def needs(self) -> tuple[str, ...]:
        """Channels of the angles that the ripples count."""
        return tuple(sorted({r.channel for r in self.ripples}))

    @property
    def history(self) -> float:
        """Reach into the past, s."""
        return self.delay

    def read(self, times: Array, values: Array, at: Array, context: Mapping[str, Array]) -> Array:
        """Reading of the angle; see ``Sensor``."""
        angle = np.interp(at - self.delay, times, values)
        angle = angle + self.eccentricity * np.sin(angle - self.phase)
        for r in self.ripples:
            counted = np.interp(at - self.delay, times, _channel(context, r.channel))
            angle = angle + r.amplitude * np.sin(r.order * counted + r.phase)
        return quantised(angle + self.noise.at(at), self.step)


@dataclass(frozen=True)
class DifferencedReader:
    """(encoder(t) - encoder(t - h)) / h: the speed that a servo drive computes from its encoder."""

    encoder: EncoderReader
    channel: str
    window: float

    @property
    def needs(self) -> tuple[str, ...]:
        """The angle's channel, and those that the encoder needs."""
        return (self.channel, *(name for name in self.encoder.needs if name != self.channel))

    @property
    def history(self) -> float:
        """Reach into the past, s."""
        return self.encoder.history + self.window

    def read(self, times: Array, values: Array, at: Array, context: Mapping[str, Array]) -> Array:
        """Reading of the speed; see ``Sensor``."""
        angle = _channel(context, self.channel)
        now = self.encoder.read(times, angle, at, context)
        before = self.encoder.read(times, angle, at - self.window, context)
        return np.asarray((now - before) / self.window)


@dataclass(frozen=True)
class LinearReader:
    """round((1 + g) x (1 + sum r sin) + sum a sin + offset + noise), x delayed: torque sensor, tachometer."""

    gain_error: float
    offset: float
    step: float
    delay: float
    noise: Noise
    ripples: tuple[Ripple, ...] = ()

    @property
    def needs(self) -> tuple[str, ...]:
        """Channels of the angles that the ripples count."""
        return tuple(sorted({r.channel for r in self.ripples}))

    @property
    def history(self) -> float:
        """Reach into the past, s."""
        return self.delay

    def read(self, times: Array, values: Array, at: Array, context: Mapping[str, Array]) -> Array:
        """Reading of the value; see ``Sensor``."""
        true = np.interp(at - self.delay, times, values)
        reading = true * (1.0 + self.gain_error) + self.offset
        for r in self.ripples:
            angle = np.interp(at - self.delay, times, _channel(context, r.channel))
            reading = reading + (r.amplitude + r.relative * true) * np.sin(r.order * angle + r.phase)
        return quantised(reading + self.noise.at(at), self.step)


def _channel(context: Mapping[str, Array], name: str) -> Array:
    if name not in context:
        raise InputError(f"a sensor needs the channel {name!r}; there are: {', '.join(context) or 'none'}")
    return context[name]


def step_of(counts_per_turn: int | None) -> float:
    """Angle of one count in rad (0 without quantisation)."""
    return 0.0 if counts_per_turn is None else 2.0 * math.pi / counts_per_turn
