"""Worn flanks: every tooth's own gap grows, and the structure behind the mesh stays what it was."""

from typing import Any

import numpy as np
import pytest

from hdsim.drive import _teeth
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.effects.flank_wear import FlankWear


def teeth_of(mesh: dict[str, Any], growth: float) -> Any:
    drive = Drive.model_validate({"preset": "seed-2021", "mesh": mesh})
    parts = [FlankWear(growth=growth)] if growth else []
    return Model(drive, parts, load_inertia_kg_m2=0.5).teeth


@pytest.mark.parametrize("mesh", [{}, {"gap_along_flank": True}, {"model": "tabulated"}])
@pytest.mark.parametrize("growth", [1.4, -0.5])
def test_each_gap_grows_and_the_structure_stays(mesh: dict[str, Any], growth: float) -> None:
    new, worn = teeth_of(mesh, 0.0), teeth_of(mesh, growth)
    assert worn.half_gaps_m == pytest.approx((1 + growth) * new.half_gaps_m)
    torque = np.array([3.0, 20.0, 52.0])
    assert worn.structure_wind_up(torque) == pytest.approx(new.structure_wind_up(torque), rel=1e-12)
    # Where all teeth of the arcs touch, the mesh turns by what their gaps have grown; along a flank
    # it is the part that is under load there which counts.
    more = growth * float(new.half_gaps_m.mean()) / new.lever_m
    assert worn.wind_up(150.0) - new.wind_up(150.0) == pytest.approx(
        more, rel=0.2 if "gap_along_flank" in mesh else 0.06
    )


def test_the_same_gaps_drawn_wider_have_the_same_potential() -> None:
    worn, drawn = teeth_of({}, 0.8), teeth_of({"gap_factor": 1.8}, 0.0)
    for x in (-3e-6, 1e-6, 2.5e-6):
        for angle in (0.2, 1.9):
            one, other = (np.array(_teeth.teeth_potential(t.parameters, x, angle)) for t in (worn, drawn))
            assert one == pytest.approx(other, rel=1e-9)


def test_the_table_of_worn_teeth_is_theirs() -> None:
    worn = teeth_of({"model": "tabulated"}, 1.5)
    assert worn.table_error is not None
    assert worn.table_error < 2e-3
