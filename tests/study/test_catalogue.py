"""The simulated drive has the catalogue's figures."""

import pytest

from hdsim.study.catalogue import catalogue_table


@pytest.mark.parametrize("preset", ["seed-2021", "csg-20-100"])
def test_every_line_of_the_catalogue_holds(preset: str) -> None:
    lines = catalogue_table(preset)
    assert len(lines) >= 12
    assert [line.quantity for line in lines if not line.holds] == []
