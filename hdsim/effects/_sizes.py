"""Default numbers of effects for a drive of any size and ratio.

The defaults in the effects' files are those of one gear, size 20 at ratio 100. What a number is a multiple of
(``Plausible.of``: rated torque T_N, T_N/i, K1, ...) carries it over to another: similar drives have friction
and hysteresis in proportion to what they transmit. Where a catalogue prints the quantity itself (accuracy,
hysteresis loss), the effect's ``sized`` takes that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hdsim.effects._kernels import ARCMIN
from hdsim.effects._plausible import Plausible, scales_of
from hdsim.parts import DriveSize, Effect, Parameters

#: The gear of the effects' default numbers: CSG, size 20, ratio 100 (CHA manual 1018854, p. 54; rated torque
#: as in docs/presets.md).
SIZE_20_100 = DriveSize(
    rated_torque_nm=52.0,
    ratio=100.0,
    stiffness_k1_nm_per_rad=16e3,
    accuracy_rad=0.8 * ARCMIN,
    hysteresis_loss_rad=ARCMIN,
)


def sized_defaults(effect: type[Effect], given: Mapping[str, Any], size: DriveSize) -> dict[str, Any]:
    """What an effect's fields that are not given are for a drive.

    Args:
        effect: its class.
        given: its fields that are given.
        size: the drive.

    Returns:
        The fields whose default depends on the drive, as plain data.
    """
    own, reference = (
        scales_of(one.rated_torque_nm, one.ratio, one.stiffness_k1_nm_per_rad) for one in (size, SIZE_20_100)
    )
    factors = {scale: own[scale] / reference[scale] for scale in own}
    default = {
        name: field.get_default(call_default_factory=True) for name, field in effect.model_fields.items()
    }
    found = _times(effect, default, factors) | effect.sized(given, size, SIZE_20_100)
    return {name: value for name, value in found.items() if name not in given}


def _times(kind: type[Parameters], values: Mapping[str, Any], factors: Mapping[str, float]) -> dict[str, Any]:
    """The fields of a section that depend on the drive, those of a list's entries too, as plain data."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        notes = kind.model_fields[name].metadata
        scale = next((note.of for note in notes if isinstance(note, Plausible)), "")
        if scale and isinstance(value, int | float):
            found[name] = value * factors[scale]
        elif isinstance(value, tuple) and value and all(isinstance(item, Parameters) for item in value):
            entries = [(dict(item), _times(type(item), dict(item), factors)) for item in value]
            if any(changed for _, changed in entries):
                found[name] = [
                    {key: one for key, one in entry.items() if one is not None} | changed
                    for entry, changed in entries
                ]
    return found
