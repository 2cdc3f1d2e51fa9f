"""What is known of an effect's field before a measurement: its bounds, and where its size usually lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from pydantic import BaseModel

from hdsim.number import limits

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
    notes = kind.model_fields[last].metadata
    return Range(*limits(notes), next((note for note in notes if isinstance(note, Plausible)), None))


def _model_in(annotation: Any) -> type[BaseModel]:
    """The section that a field holds, through ``| None`` and ``tuple``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        if inner is not type(None) and inner is not Ellipsis:
            return _model_in(inner)
    raise KeyError(f"{annotation} holds no section")
