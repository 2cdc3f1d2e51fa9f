# ruff: noqa: E501 (one case a line reads best)
"""Every kind of mistake gives one line: file, line, field, what was found, what is allowed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field, FilePath, field_validator, model_validator

from hdsim.errors import InputError
from hdsim.parts import Parameters
from hdsim.scenario.problems import ScenarioError
from hdsim.scenario.validation import load_model


class Hertz(Parameters):
    law: Literal["hertz"]
    width_m: float = Field(gt=0, lt=1)
    """Width of the line contact, m."""


class Constant(Parameters):
    law: Literal["constant"]
    stiffness_n_per_m: float = Field(gt=0)
    """Stiffness of a tooth pair, N/m."""
    constant: float = 1.0
    """A field named like the choice itself."""


class Shaft(Parameters):
    inertia_kg_m2: float = Field(gt=0)
    """Moment of inertia of the rotor, kg m^2."""
    teeth: int = Field(200, ge=20)
    """Number of teeth."""
    locked: bool = False
    """Hold the shaft still."""
    side: Literal["motor", "output"] = "motor"
    """Side of the gear."""


class Machine(Parameters):
    shaft: Shaft
    contact: Annotated[Hertz | Constant, Field(discriminator="law")] | None = None
    orders: list[Annotated[float, Field(gt=0)]] = Field([], max_length=3)
    """Orders per turn."""
    window: tuple[float, float] = (0.0, 1.0)
    """Start and end, s."""
    torque: float | Shaft | list[float] = 0.0
    """A number, a list or a shaft."""
    table: FilePath | None = None
    """Recorded torque."""
    named: dict[str, Hertz] = Field(default_factory=dict)
    """Contacts by name."""
    label: str = ""
    """Free text."""

    @field_validator("label")
    @classmethod
    def _no_shouting(cls, value: str) -> str:
        if value.isupper():
            raise ValueError("shouting is not allowed")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Machine:
        if self.window[1] < self.window[0]:
            raise ValueError(f"window must not end before it starts, found {self.window}")
        if self.label == "refuse":
            raise InputError("no machine is called refuse")
        return self


SHAFT = "shaft: {inertia_kg_m2: 1.0e-4}\n"

CASES = {
    "unknown key with a near one": (
        "shaft:\n  inertia_kgm2: 1\n",
        2, "shaft.inertia_kgm2", ["unknown key", "expected 'inertia_kg_m2'"],
    ),
    "unknown key without a near one": (SHAFT + "zzz: 1\n", 2, "zzz", ["expected one of shaft, contact"]),
    "missing field": (
        "label: x\nshaft:\n  teeth: 30\n",
        2, "shaft.inertia_kg_m2", ["found nothing", "a number greater than 0", "Moment of inertia", "kg m^2"],
    ),
    "negative": ("shaft:\n  inertia_kg_m2: -1e-4\n", 2, "shaft.inertia_kg_m2", ["found -0.0001 (number)"]),
    "text for a number": ("shaft:\n  inertia_kg_m2: heavy\n", 2, "shaft.inertia_kg_m2", ["'heavy' (text)"]),
    "quoted number": ("shaft:\n  inertia_kg_m2: '1'\n", 2, "shaft.inertia_kg_m2", ["'1' (text)", "a number"]),
    "true for a number": ("shaft:\n  inertia_kg_m2: true\n", 2, "shaft.inertia_kg_m2", ["true (true/false)"]),
    "null for a number": ("shaft:\n  inertia_kg_m2:\n", 2, "shaft.inertia_kg_m2", ["nothing (null)"]),
    "yes is text in YAML 1.2": (
        "shaft:\n  inertia_kg_m2: 1\n  locked: yes\n", 3, "shaft.locked", ["'yes' (text)", "true or false"],
    ),
    "broken whole number": (
        "shaft:\n  inertia_kg_m2: 1\n  teeth: 20.5\n", 3, "shaft.teeth", ["20.5 (number)", "a whole number at least 20"],
    ),
    "literal": (
        "shaft:\n  inertia_kg_m2: 1\n  side: moter\n", 3, "shaft.side", ["'motor', 'output'", "did you mean 'motor'?"],
    ),
    "list for a mapping": ("shaft:\n  - 1\n", 1, "shaft", ["a list of 1", "a mapping with inertia_kg_m2"]),
    "wrong choice": (
        SHAFT + "contact:\n  law: herz\n", 3, "contact.law", ["one of hertz, constant", "did you mean 'hertz'?"],
    ),
    "no choice": (SHAFT + "contact:\n  width_m: 1\n", 2, "contact.law", ["found nothing", "one of hertz, constant"]),
    "text for a choice": (SHAFT + "contact: hertz\n", 2, "contact", ["'hertz' (text)", "law is one of"]),
    "bound inside a choice": (
        SHAFT + "contact:\n  law: hertz\n  width_m: 2\n",
        4, "contact.width_m", ["2 (whole number)", "greater than 0 and less than 1", "Width of the line contact, m"],
    ),
    "choice named like its field": (
        SHAFT + "contact:\n  law: constant\n  stiffness_n_per_m: 1\n  constant: bad\n", 5, "contact.constant", ["'bad'"],
    ),
    "item of a list": (SHAFT + "orders: [1,\n  2,\n  -3]\n", 4, "orders[2]", ["-3", "greater than 0"]),
    "too long a list": (SHAFT + "orders: [1, 2, 3, 4]\n", 2, "orders", ["a list of 4", "length at most 3"]),
    "wrong length of a pair": (SHAFT + "window: [1]\n", 2, "window[1]", ["found nothing", "a number"]),
    "check across fields": (SHAFT + "window: [2, 1]\n", 1, "", ["must not end before it starts"]),
    "check of a field": (SHAFT + "label: AAA\n", 2, "label", ["found 'AAA' (text), but shouting"]),
    "an error of ours": (SHAFT + "label: refuse\n", 1, "", ["no machine is called refuse"]),
    "union of types": (SHAFT + "torque: abc\n", 2, "torque", ["a number or a mapping", "or a list of number"]),
    "union, model meant": (SHAFT + "torque: {inertia_kg_m2: -1}\n", 2, "torque.inertia_kg_m2", ["greater than 0"]),
    "union, list meant": (SHAFT + "torque: [1, x]\n", 2, "torque[1]", ["'x' (text), expected a number"]),
    "model under a free key": (
        SHAFT + "named:\n  left:\n    law: hertz\n    width_m: x\n", 5, "named.left.width_m", ["'x'"],
    ),
    "missing file": (SHAFT + "table: no.csv\n", 2, "table", ["found no such file", "'no.csv'"]),
    "directory for a file": (SHAFT + "table: .\n", 2, "table", ["found a directory"]),
}  # fmt: skip


def errors_of(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "machine.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_model(path, Machine)
    return str(caught.value).split("\n")


@pytest.mark.parametrize(("text", "line", "field", "parts"), CASES.values(), ids=CASES.keys())
def test_one_mistake_gives_one_line(
    tmp_path: Path, text: str, line: int, field: str, parts: list[str]
) -> None:
    lines = errors_of(tmp_path, text)
    assert len(lines) == 1, lines
    where = f"{tmp_path / 'machine.yaml'}:{line}: " + (f"{field}: " if field else "")
    assert lines[0].startswith(where)
    for part in parts:
        assert part in lines[0]


def test_all_mistakes_are_reported_in_the_order_of_the_file_and_missing_ones_last(tmp_path: Path) -> None:
    lines = errors_of(tmp_path, "shaft:\n  teeth: 3\nzzz: 1\norders: [1, x]\n")
    fields = [line.split(": ")[1] for line in lines]
    assert fields == ["shaft.teeth", "zzz", "orders[1]", "shaft.inertia_kg_m2"]


def test_a_good_file_gives_the_model(tmp_path: Path) -> None:
    (tmp_path / "torque.csv").write_text("0,0\n")
    path = tmp_path / "machine.yaml"
    path.write_text("shaft: {inertia_kg_m2: 1e-4, teeth: 100.0}\ntable: torque.csv\nwindow: [0, 2]\n")
    machine = load_model(path, Machine)
    assert machine.shaft.inertia_kg_m2 == 1e-4
    assert machine.shaft.teeth == 100
    assert machine.window == (0.0, 2.0)
    assert machine.table == tmp_path / "torque.csv"


def test_a_base_gives_its_own_file_and_line(tmp_path: Path) -> None:
    folder = tmp_path / "bases"
    folder.mkdir()
    (folder / "base.yaml").write_text("\n\nshaft:\n  inertia_kg_m2: -1\ntable: gone.csv\n")
    lines = errors_of(tmp_path, "extends: bases/base.yaml\nlabel: LOUD\n")
    assert len(lines) == 3
    text = "\n".join(lines)
    assert f"{folder / 'base.yaml'}:4: shaft.inertia_kg_m2: found -1" in text
    assert f"{folder / 'base.yaml'}:5: table: found no such file" in text
    assert f"{tmp_path / 'machine.yaml'}:2: label: found 'LOUD'" in text
