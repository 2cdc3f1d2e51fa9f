"""The JSON schema for editors agrees with what the reader accepts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from hdsim.scenario import Scenario, ScenarioError, json_schema
from hdsim.scenario.commands import check, described
from hdsim.scenario.fields import split_unit
from hdsim.scenario.reader import flatten, read_node

jsonschema = pytest.importorskip("jsonschema")

SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return json_schema(Scenario)


@pytest.fixture(scope="module")
def validator(schema: dict[str, Any]) -> Any:
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_shipped_scenarios_satisfy_the_schema_and_the_reader(path: Path, validator: Any) -> None:
    data = flatten(read_node(path)).data
    assert [error.message for error in validator.iter_errors(data)] == []
    assert Scenario.from_yaml(path).name == data.get("name", path.stem)


@pytest.mark.parametrize("kind", ["mapping", "study", "loadcycle"])
def test_shipped_files_satisfy_their_schema_and_the_check(kind: str) -> None:
    (stored,) = SCENARIOS[0].parent.rglob(f"{kind}.schema.json")
    validator = jsonschema.Draft202012Validator(json_schema(described(kind)))
    paths = sorted(stored.parent.glob("*.yaml"))
    assert paths
    for path in paths:
        data = flatten(read_node(path)).data
        assert [(path.name, error.message) for error in validator.iter_errors(data)] == []
        assert not validator.is_valid(data | {"laod": 1})
        assert not validator.is_valid(data | {"name": 3, "description": 3})
    done = CliRunner().invoke(check, [str(path) for path in paths])
    assert done.exit_code == 0, done.output
    assert done.output.count(": OK\n") == len(paths)


def test_the_check_knows_mappings_and_studies_by_their_keys(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "time: {rate_hz: 1000}\nchannels: {output_angle: {column: a, unit: degrees}}\n"
    )
    (tmp_path / "s.yaml").write_text(
        "base: {procedure: transmission_eror, drive: {preset: seed-2021}}\nmetrics: [x]\n"
    )
    done = CliRunner().invoke(check, [str(tmp_path / "m.yaml"), str(tmp_path / "s.yaml")])
    assert isinstance(done.exception, ScenarioError)
    text = str(done.exception)
    assert "m.yaml:2: channels.output_angle.unit: found 'degrees'" in text
    assert "s.yaml:1: base.procedure" in text


def test_the_schema_refuses_what_the_reader_refuses(validator: Any) -> None:
    good = flatten(read_node(SCENARIOS[0])).data
    assert not validator.is_valid(good | {"laod": 1})
    assert not validator.is_valid({key: value for key, value in good.items() if key != "run"})
    assert not validator.is_valid(good | {"run": {"duration_s": -1}})
    assert not validator.is_valid(good | {"run": {"duration_s": "long"}})


def test_a_file_that_extends_another_may_leave_out_and_remove_anything(validator: Any) -> None:
    assert validator.is_valid({"extends": "base.yaml"})
    assert validator.is_valid({"extends": "base.yaml", "run": {"rtol": 1e-9}, "effects": None})
    assert not validator.is_valid({"extends": "base.yaml", "run": {"rtol": 1}})
    assert not validator.is_valid({"extends": "base.yaml", "runs": {}})
    assert not validator.is_valid({"extends": 3})


def test_fields_carry_titles_descriptions_and_units(schema: dict[str, Any]) -> None:
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    inertia = schema["$defs"]["Inertia"]["properties"]["motor_kg_m2"]
    assert inertia["unit"] == "kg m^2"
    assert inertia["title"] == "Motor (kg m^2)"
    assert "rotor" in inertia["description"]
    undescribed = [
        f"{name}.{field}"
        for name, definition in schema["$defs"].items()
        for field, entry in definition.get("properties", {}).items()
        if not name.endswith(".partial") and "description" not in entry and "$ref" not in entry
        and "const" not in entry
    ]  # fmt: skip
    assert undescribed == []


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("torsional_stiffness_nm_per_rad", "torsional stiffness", "N m/rad"),
        ("viscous_nm_s_per_rad", "viscous", "N m s/rad"),
        ("integral_nm_per_rad_s", "integral", "N m/(rad s)"),
        ("velocity_rad_per_s", "velocity", "rad/s"),
        ("motor_kg_m2", "motor", "kg m^2"),
        ("ratio", "ratio", ""),
        ("law", "law", ""),
        ("s", "s", ""),
    ],
)
def test_units_are_read_from_names(name: str, words: str, unit: str) -> None:
    assert split_unit(name) == (words, unit)
