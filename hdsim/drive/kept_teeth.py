"""The teeth of a drive, kept for the next model that has the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.contact.parameters import TableLawParameters
from hdsim.drive.parameters import Drive, Friction, Inertia, TabulatedMesh, TeethMesh, ToothedMesh
from hdsim.drive.toothed import Teeth

Array = NDArray[np.float64]


def teeth_of(
    drive: Drive,
    mesh: ToothedMesh,
    wind_ups: Sequence[Callable[[Array], Array]],
    *,
    extra_half_gap_rad: float,
    seed: int,
    gap_growth: float = 0.0,
    table_for: frozenset[str] | None = None,
    odd: bool = False,
) -> Teeth:
    """``Teeth``, kept for the next model: a fit makes hundreds that differ in numbers that no tooth sees.

    What it returns is shared: its numbers are to be copied before they are changed.

    Args:
        drive: see ``Teeth``.
        mesh: likewise.
        wind_ups: likewise.
        extra_half_gap_rad: likewise.
        seed: likewise.
        gap_growth: likewise.
        table_for: fingerprints of teeth that are taken from a table; others are summed, for a table of
            them would serve once. As the mesh says when None.
        odd: some will differ from the drawn ones. Where they come and go the solver takes short steps, so a
            table of the drawn ones saves more than it costs even where it serves once.
    """
    given: Any = {"extra_half_gap_rad": extra_half_gap_rad, "seed": seed, "gap_growth": gap_growth}
    if table_for is not None:
        summed = teeth_of(drive, _as(TeethMesh, mesh), wind_ups, **given)
        if not odd and summed.fingerprint not in table_for:
            return summed
        return teeth_of(drive, _as(TabulatedMesh, mesh), wind_ups, **given)
    if isinstance(mesh.contact, TableLawParameters):
        # Its file may change between two drives of one process.
        found = Teeth(drive, mesh, wind_ups, **given)
        found.warn()
        return found
    seen = mesh.model_copy(update={"ring": "dynamic", "damping_nm_s_per_rad": 0.0})
    torsion = drive.torsion.model_copy(update={"damping_nm_s_per_rad": 0.0})
    unseen: dict[str, Any] = {"preset": None, "friction": Friction(), "inertia": Inertia()}
    bare = drive.model_copy(update=unseen | {"torsion": torsion, "mesh": seen})
    found = _kept_teeth(bare, tuple(wind_ups), extra_half_gap_rad, seed, gap_growth)
    found.warn()
    return found


def _as(kind: type[TeethMesh | TabulatedMesh], mesh: ToothedMesh) -> ToothedMesh:
    """The same teeth, summed or from a table."""
    if isinstance(mesh, kind):
        return mesh
    common = {name: getattr(mesh, name) for name in ToothedMesh.model_fields}
    return kind.model_validate(common | {"model": "tabulated" if kind is TabulatedMesh else "teeth"})


@lru_cache(maxsize=16)
def _kept_teeth(
    drive: Drive,
    wind_ups: tuple[Callable[[Array], Array], ...],
    extra_half_gap_rad: float,
    seed: int,
    gap_growth: float,
) -> Teeth:
    assert isinstance(drive.mesh, TeethMesh | TabulatedMesh)
    given: Any = {"extra_half_gap_rad": extra_half_gap_rad, "seed": seed, "gap_growth": gap_growth}
    return Teeth(drive, drive.mesh, wind_ups, **given)
