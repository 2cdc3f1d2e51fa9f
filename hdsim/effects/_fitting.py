"""How an effect is fitted to data: which of its numbers scale its trace, and which shape it.

An effect may declare ``fittings``, a tuple of ``Fitting``; without one it can be simulated but not named
by a diagnosis. The terms say in which numbers the trace is, nearly, proportional to a coefficient; a
diagnosis simulates each term once at its unit size and has the trace that the effect leaves in every channel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

#: Ratio to the next start that a lone one would have, and of the widths of a play that are tried.
ALONE, WIDER = 6.0, 3.0


@dataclass(frozen=True)
class Amplitude:
    """Fields that grow in proportion to one coefficient.

    Args:
        units: field to its value at coefficient 1.
        signed: the coefficient may be negative.
        of_range: the units are parts of a range that the record covers: ``twist_arcmin``, if any.
        play: the units are the width of a play in series with the drive's spring. Its trace beside the
            spring's is the spring beyond the play: its size says how stiff that is, not how wide the play.
    """

    units: Mapping[str, float]
    signed: bool = False
    of_range: str = ""
    play: bool = False


@dataclass(frozen=True)
class Inverse:
    """A stiffness in series: the field is ``unit`` over the coefficient."""

    path: str
    unit: float


@dataclass(frozen=True)
class Harmonic:
    """Amplitude and phase of sin(angle + phase): two coefficients, of the sine and of the cosine."""

    amplitude: str
    phase: str
    unit: float


@dataclass(frozen=True)
class Periodic:
    """Harmonics whose orders per wave-generator turn are read from the data; one list item each.

    Args:
        section: path of the list.
        amplitude: field of an item that is its amplitude.
        unit: its value at coefficient 1.
        settings: further fields of an item.
        channel: the channel whose order spectrum says which orders.
        besides: orders that the fitting's other terms have; given, the term may find no other ones.
    """

    section: str
    amplitude: str
    unit: float
    channel: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    besides: tuple[float, ...] = ()


@dataclass(frozen=True)
class Shape:
    """A field in which the trace is not linear.

    Args:
        path: of the field.
        starts: values where a fit may start, in rising order.
        over_range: the starts are divided by the largest value that the record has of this: ``torque_nm`` at
            the output, or ``motor_side_torque_nm``, if any.
        linear: the field is an angle or the like, whose neighbours lie at differences, not at ratios.
        least: what lies below is another effect's; divided like the starts.
        most: the same for what lies above.
    """

    path: str
    starts: tuple[float, ...]
    over_range: str = ""
    linear: bool = False
    least: float = 0.0
    most: float = math.inf

    def neighbours(self, value: float, times: int) -> tuple[float, float]:
        """Values on both sides at the half of the starts' distance, halved ``times`` times.

        Args:
            value: the best so far.
            times: how often it was halved before.
        """
        part = 0.5 ** (times + 1)
        if self.linear:
            gap = part * (self.starts[1] - self.starts[0])
            return value - gap, value + gap
        ratio = self.starts[1] / self.starts[0] if len(self.starts) > 1 else ALONE
        return max(float(value / ratio**part), self.least), min(float(value * ratio**part), self.most)


@dataclass(frozen=True)
class Fitting:
    """One way to fit an effect.

    Args:
        terms: what scales its trace.
        shapes: what shapes it.
        settings: fields that stay as given here, nested.
        label: tells this way from the effect's others.
        needs: channels without which it cannot be told.
        turns: least travel of the wave generator, in turns, without which its trace looks like anything.
        covered_by: numbers of a scenario that say the same: where all are above zero the re-fit has had it.
        cumulative: a term has a meaning only on top of those before it, and adds to their fields.
        follows: measured channels that it takes as they are (``Builder.external``): asked only of records
            that have them.
        unless: measured channels that tell more than this way can: not asked of records that have them.
    """

    terms: tuple[Amplitude | Inverse | Harmonic | Periodic, ...]
    shapes: tuple[Shape, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    needs: tuple[str, ...] = ()
    turns: float = 0.0
    covered_by: tuple[str, ...] = ()
    cumulative: bool = False
    follows: tuple[str, ...] = ()
    unless: tuple[str, ...] = ()

    @property
    def in_series(self) -> bool:
        """Whether it fits a compliance in series with the drive's spring."""
        return any(isinstance(term, Inverse) for term in self.terms)

    @property
    def play(self) -> bool:
        """Whether it fits the width of a play."""
        return any(isinstance(term, Amplitude) and term.play for term in self.terms)

    def items(self, section: str) -> list[Any]:
        """Items that a list of the effect has before periodic terms add theirs."""
        here: Any = self.settings
        for key in section.split("."):
            here = here.get(key, {})
        return list(here)
