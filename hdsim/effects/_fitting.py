"""How an effect is fitted to data: which of its numbers scale its trace, and which shape it.

An effect may declare ``fittings``, a tuple of ``Fitting``; without one it can be simulated but not named
by a diagnosis. The terms say in which numbers the trace is, nearly, proportional to a coefficient; a
diagnosis simulates each term once at its unit size and has the trace that the effect leaves in every channel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from pydantic import BaseModel

#: What a range is measured in, beside the field's own unit: numbers of the drive, SI units at the output or,
#: with "motor", at the motor. ``cubic_stiffness``: the coefficient that doubles K1's torque at rated torque.
Scale = Literal[
    "",
    "rated_torque",
    "motor_rated_torque",
    "per_rated_torque",
    "per_motor_rated_torque",
    "stiffness_k1",
    "motor_stiffness_k1",
    "cubic_stiffness",
]


@dataclass(frozen=True)
class Plausible:
    """Where the size of an effect's number usually lies: ``Annotated[float, Plausible(...)]`` at its field.

    No bound: what no number can be is the field's own ``gt``, ``ge``, ``lt`` or ``le``. It is what an
    engineer believes before a measurement, about 95 % of drives; its geometric mean is a typical value.

    Args:
        low: of the number's size, in the field's unit (or times ``of``).
        high: the same.
        source: where the range comes from.
        of: number of the drive that both are multiples of.
    """

    low: float
    high: float
    source: str
    of: Scale = ""

    def times(self, scales: Mapping[str, float]) -> tuple[float, float]:
        """The range in the field's unit, for a drive with these scales."""
        factor = scales[self.of] if self.of else 1.0
        return self.low * factor, self.high * factor


def scales_of(rated_torque_nm: float, ratio: float, stiffness_k1_nm_per_rad: float) -> dict[str, float]:
    """The numbers of a drive that ranges are multiples of, SI units."""
    motor = rated_torque_nm / abs(ratio)
    return {
        "rated_torque": rated_torque_nm,
        "motor_rated_torque": motor,
        "per_rated_torque": 1.0 / rated_torque_nm,
        "per_motor_rated_torque": 1.0 / motor,
        "stiffness_k1": stiffness_k1_nm_per_rad,
        "motor_stiffness_k1": stiffness_k1_nm_per_rad / ratio**2,
        "cubic_stiffness": stiffness_k1_nm_per_rad**3 / rated_torque_nm**2,
    }


@dataclass(frozen=True)
class Range:
    """What is known of a field before a measurement.

    Attributes:
        least: lowest legal value (not included where the field says ``gt``).
        most: largest legal value.
        plausible: where it usually lies, if the field says.
    """

    least: float
    most: float
    plausible: Plausible | None


def range_of(effect: type[BaseModel], path: str) -> Range:
    """Bounds and plausible range of an effect's field, as its file declares them.

    Args:
        effect: the effect's class.
        path: dotted path; a number is any item of a list.

    Raises:
        KeyError: there is no such field.
    """
    kind: Any = effect
    *sections, last = [key for key in path.split(".") if not key.isdigit()]
    for section in sections:
        kind = _model_in(kind.model_fields[section].annotation)
    least, most, plausible = -math.inf, math.inf, None
    for note in kind.model_fields[last].metadata:
        if isinstance(note, Plausible):
            plausible = note
        least = float(getattr(note, "ge", getattr(note, "gt", least)))
        most = float(getattr(note, "le", getattr(note, "lt", most)))
    return Range(least, most, plausible)


def _model_in(annotation: Any) -> type[BaseModel]:
    """The section that a field holds, through ``| None`` and ``tuple``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        if inner is not type(None) and inner is not Ellipsis:
            return _model_in(inner)
    raise KeyError(f"{annotation} holds no section")


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

    @property
    def paths(self) -> tuple[str, ...]:
        """Every field that a fit of it moves, phases and other angles included."""
        found: list[str] = []
        for term in self.terms:
            if isinstance(term, Amplitude):
                found += term.units
            elif isinstance(term, Inverse):
                found.append(term.path)
            elif isinstance(term, Harmonic):
                found += [term.amplitude, term.phase]
            else:
                found += [f"{term.section}.0.{term.amplitude}", f"{term.section}.0.phase_deg"]
        return tuple(dict.fromkeys([*found, *(shape.path for shape in self.shapes)]))

    def items(self, section: str) -> list[Any]:
        """Items that a list of the effect has before periodic terms add theirs."""
        here: Any = self.settings
        for key in section.split("."):
            here = here.get(key, {})
        return list(here)
