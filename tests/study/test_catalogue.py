"""The simulated drive has the catalogue's figures."""

from pathlib import Path

import pytest

from hdsim.studies.catalogue import catalogue_table


@pytest.mark.parametrize("preset", ["seed-2021", "csg-20-100"])
def test_every_line_of_the_catalogue_holds(preset: str) -> None:
    lines = catalogue_table(preset)
    assert len(lines) >= 12
    assert [line.quantity for line in lines if not line.holds] == []


def test_the_table_of_the_readme_is_the_simulation() -> None:
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    table = text.split("## How well it agrees")[1].split("## ")[0]
    told = [row.strip("| ").split(" | ") for row in table.splitlines() if row.startswith("| ")][1:]
    lines = catalogue_table("seed-2021")
    # The force belongs to the teeth in the arcs.
    lines[-2:] = reversed(lines[-2:])
    assert len(told) == len(lines)
    for (quantity, printed, simulated, *_), line in zip(told, lines, strict=True):
        values = [printed, simulated]
        for cell, value in zip(values, (line.catalogue, line.simulated), strict=True):
            number, unit = cell.replace(",", "").split(" ", 1)
            scale = {"mN m": 1e3, "%": 1e2}.get(unit, 1.0)
            digit = 10.0 ** -len(number.partition(".")[2]) if "." in number else 1.0
            # Stiffnesses are rounded to four digits.
            digit = 10.0 if line.unit == "N m/rad" else digit
            assert float(number) == pytest.approx(scale * value, abs=0.51 * digit), quantity
