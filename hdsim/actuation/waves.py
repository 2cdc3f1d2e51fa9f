"""The shapes of periodic signals and of sweeps, without units; see ``hdsim.actuation.shapes``."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from hdsim.actuation import _signal_kernel as law
from hdsim.actuation.shapes import Amount, Shape
from hdsim.actuation.signal_data import Move, Segment, hold


class Sine(Shape):
    """A sine wave: offset + amplitude sin(2 pi f t + phase)."""

    amplitude: Annotated[float, Amount(), Field(ge=0.0)]
    """Amplitude."""
    frequency_hz: float = Field(gt=0.0)
    """Frequency in Hz."""
    phase_deg: float = 0.0
    """Phase at the start, in deg; -90 starts at the lowest point, at rest."""
    offset: Annotated[float, Amount()] = 0.0
    """Mean value."""
    cycles: float | None = Field(None, gt=0.0)
    """Number of periods, then the last value is held; without it the sine never ends."""

    def shape(self) -> Move:
        """One piece."""
        phase = math.radians(self.phase_deg)
        duration = math.inf if self.cycles is None else self.cycles / self.frequency_hz
        line = (self.amplitude, 2.0 * math.pi * self.frequency_hz, phase)
        return _sines([line], self.offset, duration)


class Multisine(Shape):
    """A sum of sines of equal amplitude, with phases that keep its peak low.

    Frequencies are a list, or the multiples of ``fundamental_hz`` from ``lowest_hz`` to ``highest_hz``.
    The phases are Schroeder's, phi_k = -pi k (k - 1) / N (M. R. Schroeder, Synthesis of low-peak-factor
    signals, IEEE Trans. Inf. Theory 16, 1970, for a flat spectrum), unless given.
    """

    amplitude: Annotated[float, Amount(), Field(ge=0.0)]
    """Amplitude of each sine."""
    frequencies_hz: list[Annotated[float, Field(gt=0.0)]] | None = Field(None, min_length=1)
    """Frequencies in Hz."""
    fundamental_hz: float | None = Field(None, gt=0.0)
    """Spacing of the frequency grid in Hz; the signal repeats after one over it."""
    lowest_hz: float | None = Field(None, gt=0.0)
    """Lowest frequency of the grid in Hz; the fundamental when left out."""
    highest_hz: float | None = Field(None, gt=0.0)
    """Highest frequency of the grid in Hz."""
    odd_harmonics_only: bool = False
    """Leave even multiples of the fundamental out, so that even nonlinearities show there."""
    phases_deg: list[float] | None = None
    """Phase of each sine in deg; Schroeder's when left out."""
    offset: Annotated[float, Amount()] = 0.0
    """Mean value."""
    duration_s: float | None = Field(None, gt=0.0)
    """Length, then the last value is held; without it the signal never ends. Unit s."""

    def grid(self) -> list[float]:
        """Frequencies in Hz."""
        if self.frequencies_hz is not None:
            return list(self.frequencies_hz)
        if self.fundamental_hz is None or self.highest_hz is None:
            return []
        base = self.fundamental_hz
        low = max(1, math.ceil((self.lowest_hz or base) / base - 1e-9))
        high = math.floor(self.highest_hz / base + 1e-9)
        return [k * base for k in range(low, high + 1) if k % 2 or not self.odd_harmonics_only]

    @model_validator(mode="after")
    def _has_lines(self) -> Multisine:
        gridded = [self.fundamental_hz, self.lowest_hz, self.highest_hz] != [None] * 3
        if gridded == (self.frequencies_hz is not None):
            raise ValueError("give either frequencies_hz or fundamental_hz with highest_hz")
        lines = self.grid()
        if not lines:
            raise ValueError(
                "the frequency grid is empty: give fundamental_hz and highest_hz, with a multiple of "
                "fundamental_hz between lowest_hz and highest_hz"
            )
        if self.phases_deg is not None and len(self.phases_deg) != len(lines):
            raise ValueError(f"phases_deg has {len(self.phases_deg)} entries for {len(lines)} frequencies")
        return self

    def shape(self) -> Move:
        """One piece."""
        grid = self.grid()
        n = len(grid)
        if self.phases_deg is None:
            phases = [-math.pi * k * (k - 1) / n for k in range(1, n + 1)]
        else:
            phases = [math.radians(phase) for phase in self.phases_deg]
        lines = [(self.amplitude, 2.0 * math.pi * f, phase) for f, phase in zip(grid, phases, strict=True)]
        return _sines(lines, self.offset, math.inf if self.duration_s is None else self.duration_s)


class Chirp(Shape):
    """A sine whose frequency sweeps from one value to another, its phase continuous throughout."""

    amplitude: Annotated[float, Amount(), Field(ge=0.0)]
    """Amplitude."""
    start_frequency_hz: float = Field(gt=0.0)
    """Frequency at the start in Hz."""
    end_frequency_hz: float = Field(gt=0.0)
    """Frequency at the end in Hz."""
    duration_s: float = Field(gt=0.0)
    """Length of the sweep in s; its last value is held afterwards."""
    sweep: Literal["linear", "exponential"] = "exponential"
    """Growth of the frequency with time."""
    phase_deg: float = 0.0
    """Phase at the start in deg."""
    offset: Annotated[float, Amount()] = 0.0
    """Mean value."""

    def shape(self) -> Move:
        """One piece."""
        first, last = 2.0 * math.pi * self.start_frequency_hz, 2.0 * math.pi * self.end_frequency_hz
        phase = math.radians(self.phase_deg)
        growth = math.log(last / first)
        if self.sweep == "linear" or growth == 0.0:
            kind, rate = law.LINEAR_CHIRP, (last - first) / self.duration_s
            swept = 0.5 * (first + last) * self.duration_s
        else:
            kind, rate = law.EXPONENTIAL_CHIRP, growth / self.duration_s
            swept = (last - first) / rate
        piece = Segment(kind, [0.0], [(self.offset, self.amplitude, first, rate, phase)])
        initial = self.offset + self.amplitude * math.sin(phase)
        final = self.offset + self.amplitude * math.sin(phase + swept)
        return Move((piece, hold(self.duration_s, final)), self.duration_s, initial, final)


class Triangle(Shape):
    """A triangle wave that starts at its mean and rises, as in a torsion test (0, +A, -A, 0)."""

    amplitude: Annotated[float, Amount(), Field(gt=0.0)]
    """Amplitude."""
    frequency_hz: float = Field(gt=0.0)
    """Frequency in Hz."""
    offset: Annotated[float, Amount()] = 0.0
    """Mean value."""
    cycles: int | None = Field(None, gt=0)
    """Number of periods, then the mean is held; without it the triangle never ends."""

    def shape(self) -> Move:
        """One piece, whose corners follow from its frequency."""
        piece = Segment(law.TRIANGLE, [0.0], [(self.offset, self.amplitude, self.frequency_hz)])
        if self.cycles is None:
            return Move((piece,), math.inf, self.offset, self.offset)
        duration = self.cycles / self.frequency_hz
        return Move((piece, hold(duration, self.offset)), duration, self.offset, self.offset)


def _sines(lines: list[tuple[float, float, float]], offset: float, duration: float) -> Move:
    """A sum of (amplitude, rad/s, phase) that stops after ``duration`` (s)."""
    flat = [number for line in lines for number in line]
    piece = Segment(law.SINES, [0.0], [(offset, float(len(lines)), *flat)])
    initial = offset + sum(a * math.sin(phase) for a, _, phase in lines)
    if math.isinf(duration):
        return Move((piece,), duration, initial, initial)
    final = offset + sum(a * math.sin(omega * duration + phase) for a, omega, phase in lines)
    return Move((piece, hold(duration, final)), duration, initial, final)
