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

    @property
    def lasting(self) -> bool:
        """Whether its numbers alone say what it is, and no file does."""
        return True


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

    @property
    def lasting(self) -> bool:
        """Whether that of every move is."""
        return all(move.lasting for move in self.moves)


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

    @property
    def lasting(self) -> bool:
        """The file may change."""
        return False

    def shape(self) -> Move:
        """One cubic piece between each two samples.

        Raises:
            InputError: the file cannot be read as described.
        """
        from hdsim.actuation.recorded import interpolated

        return interpolated(
            self.file, self.time_column, self.value_column, self.interpolation, self.value_factor
        )
