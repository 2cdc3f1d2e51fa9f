"""The shapes of signals, without units: what a trapezoid, a chirp or a recorded signal *is*.

``hdsim.actuation.signals`` turns each into one class per physical quantity, whose fields carry units. A
field marked with ``Amount(k)`` is in the unit of the signal's k-th time derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, SerializeAsAny, model_validator

from hdsim.actuation import _signal_kernel as law
from hdsim.actuation.signal_data import Move, Segment, hold, joined, profile
from hdsim.parts import Parameters


@dataclass(frozen=True)
class Amount:
    """Marks a field in the unit of the signal's ``order``-th time derivative."""

    order: int = 0


class Shape(Parameters):
    """A signal without units."""

    start_time_s: float = Field(0.0, ge=0.0)
    """When the shape begins, its initial value held before; in a sequence, a pause first. Unit s."""

    def shape(self) -> Move:
        """The signal from its own start, times in s."""
        raise NotImplementedError

    def move(self) -> Move:
        """The signal from time 0."""
        return self.shape().delayed(self.start_time_s)


class Hold(Shape):
    """A constant."""

    value: Annotated[float, Amount()] = 0.0
    """The constant."""
    duration_s: float | None = Field(None, ge=0.0)
    """Length in a sequence (a pause between moves); without it the hold never ends. Unit s."""

    def shape(self) -> Move:
        """One piece."""
        duration = 0.0 if self.duration_s is None else self.duration_s
        return Move((hold(0.0, self.value),), duration, self.value, self.value)


class Step(Shape):
    """A jump at the start time."""

    height: Annotated[float, Amount()]
    """Value after the jump less the value before."""
    initial: Annotated[float, Amount()] = 0.0
    """Value before the jump."""

    def shape(self) -> Move:
        """One piece."""
        final = self.initial + self.height
        return Move((hold(0.0, final),), 0.0, self.initial, final)


class Ramp(Shape):
    """Growth at a constant rate."""

    velocity: Annotated[float, Amount(1)]
    """Rate of change, signed."""
    duration_s: float | None = Field(None, gt=0.0)
    """Length of the ramp; without it the ramp never ends. Unit s."""
    acceleration: Annotated[float, Amount(2), Field(gt=0.0)] | None = None
    """Rate at which the ramp takes up its rate and, with a duration, gives it back; without it at once."""

    def shape(self) -> Move:
        """Parabola, line, parabola; the first and last only with an acceleration."""
        rate = self.velocity
        taken = 0.0 if self.acceleration is None else abs(rate) / self.acceleration
        pull = math.copysign(self.acceleration or 0.0, rate)
        first = 0.0 if self.acceleration else rate
        if self.duration_s is None:
            parabola = profile([(taken, pull, 0.0)], 0.5 * rate * taken, first)
            line = Segment(law.CUBIC, [taken], [(parabola.final, rate, 0.0, 0.0)])
            return Move((*(parabola.segments[:1] if taken else ()), line), math.inf, 0.0, 0.0)
        if self.duration_s < 2.0 * taken:
            raise ValueError(
                f"the ramp takes up its rate in {taken:.6g} s and gives it back in as long: "
                f"duration_s must be at least {2.0 * taken:.6g}, found {self.duration_s:.6g}"
            )
        phases = [(taken, pull, 0.0), (self.duration_s - 2.0 * taken, 0.0, 0.0), (taken, -pull, 0.0)]
        return profile(phases, rate * (self.duration_s - taken), first)

    @model_validator(mode="after")
    def _fits(self) -> Ramp:
        self.shape()
        return self


class Trapezoid(Shape):
    """A move with a trapezoidal velocity; triangular when too short to reach its maximum.

    Source: Biagiotti and Melchiorri (2008), Trajectory Planning for Automatic Machines and Robots, sec. 3.2.
    """

    distance: Annotated[float, Amount()]
    """Length of the move, signed."""
    maximum_velocity: Annotated[float, Amount(1), Field(gt=0.0)]
    """Bound of the velocity."""
    maximum_acceleration: Annotated[float, Amount(2), Field(gt=0.0)]
    """Bound of the acceleration, reached while speeding up and slowing down."""

    def shape(self) -> Move:
        """Three phases of constant acceleration."""
        length, a = abs(self.distance), self.maximum_acceleration
        velocity = min(self.maximum_velocity, math.sqrt(length * a))
        rise = velocity / a
        cruise = max(0.0, length / velocity - rise) if velocity > 0.0 else 0.0
        a = math.copysign(a, self.distance)
        return profile([(rise, a, 0.0), (cruise, 0.0, 0.0), (rise, -a, 0.0)], self.distance)


class SCurve(Shape):
    """A move with bounded jerk: seven phases, fewer when it is short (double-S velocity).

    Source: Biagiotti and Melchiorri (2008), Trajectory Planning for Automatic Machines and Robots, sec. 3.4,
    with equal bounds at both ends and rest before and after.
    """

    distance: Annotated[float, Amount()]
    """Length of the move, signed."""
    maximum_velocity: Annotated[float, Amount(1), Field(gt=0.0)]
    """Bound of the velocity."""
    maximum_acceleration: Annotated[float, Amount(2), Field(gt=0.0)]
    """Bound of the acceleration."""
    maximum_jerk: Annotated[float, Amount(3), Field(gt=0.0)]
    """Bound of the jerk, reached in every phase of changing acceleration."""

    def shape(self) -> Move:
        """Seven phases of constant jerk."""
        length, v = abs(self.distance), self.maximum_velocity
        a, j = self.maximum_acceleration, self.maximum_jerk

        def rise(velocity: float) -> tuple[float, float]:
            """Duration of one jerk phase and of the whole acceleration to ``velocity``."""
            if velocity * j >= a * a:
                return a / j, a / j + velocity / a
            return math.sqrt(velocity / j), 2.0 * math.sqrt(velocity / j)

        ramp, rising = rise(v)
        cruise = length / v - rising
        if cruise < 0.0:
            cruise = 0.0
            if length >= 2.0 * a**3 / j**2:
                ramp = a / j
                # The acceleration phase takes ramp + v/a and covers length/2: v (ramp + v/a) = length.
                v = 0.5 * a * (math.sqrt(ramp * ramp + 4.0 * length / a) - ramp)
                rising = ramp + v / a
            else:
                ramp = math.cbrt(length / (2.0 * j))
                rising = 2.0 * ramp
        j = math.copysign(j, self.distance)
        flat = max(0.0, rising - 2.0 * ramp)
        peak = j * ramp
        phases = [(ramp, 0.0, j), (flat, peak, 0.0), (ramp, peak, -j), (cruise, 0.0, 0.0)]
        phases += [(ramp, 0.0, -j), (flat, -peak, 0.0), (ramp, -peak, j)]
        return profile(phases, self.distance)


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


class Sequence(Shape):
    """Moves one after the other, each added to the last value of the one before."""

    initial: Annotated[float, Amount()] = 0.0
    """Value before the first move."""
    moves: list[SerializeAsAny[Shape]] = Field(min_length=1)
    """Moves in order; a ``hold`` with a duration is a pause."""
    repeat: int = Field(1, ge=1)
    """How often the list of moves is run through."""

    @model_validator(mode="after")
    def _ends(self) -> Sequence:
        endless = [k for k, move in enumerate(self.moves[:-1], 1) if math.isinf(move.move().duration)]
        if self.repeat > 1 and math.isinf(self.moves[-1].move().duration):
            endless.append(len(self.moves))
        if endless:
            raise ValueError(f"move {endless[0]} of the sequence never ends: give it a duration or cycles")
        return self

    def shape(self) -> Move:
        """The moves, joined."""
        return joined([move.move() for move in self.moves] * self.repeat, self.initial)


class Recorded(Shape):
    """A signal read from a CSV file with a header line; first and last value are held outside its times."""

    file: Path
    """CSV file; in a scenario, a relative name counts from the folder of the scenario that names it."""
    time_column: str = "time"
    """Header of the column of times, in s, strictly increasing."""
    value_column: str = "value"
    """Header of the column of values."""
    interpolation: Literal["linear", "pchip", "spline"] = "linear"
    """Straight lines, monotone cubics with continuous slope, or a cubic spline with continuous curvature."""
    value_factor: float = 1.0

    def shape(self) -> Move:
        """One cubic piece between each two samples.

        Raises:
            InputError: the file cannot be read as described.
        """
        from hdsim.actuation.recorded import interpolated

        return interpolated(
            self.file, self.time_column, self.value_column, self.interpolation, self.value_factor
        )


def _sines(lines: list[tuple[float, float, float]], offset: float, duration: float) -> Move:
    """A sum of (amplitude, rad/s, phase) that stops after ``duration`` (s)."""
    flat = [number for line in lines for number in line]
    piece = Segment(law.SINES, [0.0], [(offset, float(len(lines)), *flat)])
    initial = offset + sum(a * math.sin(phase) for a, _, phase in lines)
    if math.isinf(duration):
        return Move((piece,), duration, initial, initial)
    final = offset + sum(a * math.sin(omega * duration + phase) for a, omega, phase in lines)
    return Move((piece, hold(duration, final)), duration, initial, final)
