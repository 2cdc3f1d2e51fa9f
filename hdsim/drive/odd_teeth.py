"""Teeth that differ from the drawn ones, as numbers for the compiled meshes (``hdsim.drive._odd_tooth``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive import _mesh_layout as place

if TYPE_CHECKING:
    from hdsim.drive.toothed import Teeth
    from hdsim.parts import OddTooth

#: Share of an error below which a tooth has none of it.
NO_SHARE = 1e-9


def with_odd_teeth(teeth: Teeth, odd_teeth: Sequence[OddTooth]) -> Teeth:
    """The same teeth but for some; the catalogue's stiffness stays that of the drive without them.

    Args:
        teeth: as drawn; left as they are.
        odd_teeth: each is written as the two teeth next to its number, with their shares of it.
    """
    if not odd_teeth:
        return teeth
    found, rows = copy(teeth), []
    geometry = teeth.drive.geometry
    for odd in odd_teeth:
        circular = odd.member == "circular_spline"
        count = geometry.circular_spline_teeth if circular else geometry.flexspline_teeth
        first = math.floor(odd.tooth)
        beyond = odd.tooth - first
        for tooth, share in ((first, 1.0 - beyond), (first + 1, beyond)):
            if share > NO_SHARE:
                rows.append([float(circular), float(tooth % count), share, odd.shift_m, odd.widened_m])
    found.parameters = np.concatenate([teeth.parameters, np.ravel(rows)])
    found.parameters[place.ODD_COUNT] = len(rows)
    found.parameters[place.ODD_AT] = len(teeth.parameters)
    # How far a tooth may push the ring without a twist.
    found.parameters[place.LARGEST_PITCH_ERROR] += max(
        max(abs(odd.shift_m), -odd.widened_m) for odd in odd_teeth
    )
    return found
