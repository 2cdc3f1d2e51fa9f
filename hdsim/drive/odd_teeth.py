"""Teeth that differ from the drawn ones, as numbers for the compiled meshes (``hdsim.drive._odd_tooth``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _mesh_layout as place

if TYPE_CHECKING:
    from hdsim.drive.parameters import Geometry
    from hdsim.parts import OddTooth

#: Share of an error below which a tooth has none of it.
NO_SHARE = 1e-9


def odd_numbers(odd_teeth: Sequence[OddTooth], geometry: Geometry) -> NDArray[np.float64]:
    """Each as the two teeth next to its number, with their shares of it, shape (n, ``PER_ODD``)."""
    rows = []
    for odd in odd_teeth:
        circular = odd.member == "circular_spline"
        count = geometry.circular_spline_teeth if circular else geometry.flexspline_teeth
        first = math.floor(odd.tooth)
        beyond = odd.tooth - first
        for tooth, share in ((first, 1.0 - beyond), (first + 1, beyond)):
            if share > NO_SHARE:
                rows.append([float(circular), float(tooth % count), share, odd.shift_m, odd.widened_m])
    return np.array(rows, dtype=float).reshape(-1, place.PER_ODD)


def farthest_push(odd_teeth: Sequence[OddTooth]) -> float:
    """How far odd teeth may push the ring without a twist, m."""
    return max((max(abs(odd.shift_m), -odd.widened_m) for odd in odd_teeth), default=0.0)
