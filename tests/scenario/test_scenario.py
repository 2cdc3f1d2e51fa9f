"""The scenario as a whole: names, resolved YAML that loads again, summaries."""

from __future__ import annotations

from pathlib import Path

import pytest

import hdsim
from hdsim.scenario import Scenario

SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))

TEXT = """\
drive: {preset: seed-2021, mesh: {model: teeth, tooth_bending_stiffness_n_per_m: null}}
command:
  motor:
    type: motion
    trajectory: {type: recorded, file: data/move.csv, value_column: angle, value_unit: deg}
load: {inertia_kg_m2: 0.1}
run: {duration_s: 1}
effects:
  kinematic_error: {}
  stribeck_friction:
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "move.csv").write_text("time,angle\n0,0\n1,90\n")
    (tmp_path / "base.yaml").write_text("description: two\n" + TEXT)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "top.yaml").write_text("extends: ../base.yaml\nrun: {seed: 7}\n")
    return tmp_path


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_shipped_scenarios_survive_a_round_trip(path: Path, tmp_path: Path) -> None:
    scenario = hdsim.load_scenario(path)
    copy = tmp_path / path.name
    copy.write_text(scenario.to_yaml(), encoding="utf-8")
    again = hdsim.load_scenario(copy)
    assert again == scenario
    assert again.to_yaml() == scenario.to_yaml()


def test_paths_belong_to_the_file_that_names_them_and_survive_a_round_trip(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = Scenario.from_yaml(folder / "other" / "top.yaml")
    trajectory = scenario.command.motor.trajectory  # type: ignore[union-attr]
    assert trajectory.file == folder / "data" / "move.csv"  # type: ignore[attr-defined]
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "copy.yaml").write_text(scenario.to_yaml())
    copy = Scenario.from_yaml(elsewhere / "copy.yaml")
    assert copy == scenario
    monkeypatch.chdir(folder)
    assert Scenario.from_yaml("other/top.yaml") == scenario


def test_a_name_is_not_inherited(folder: Path) -> None:
    (folder / "base.yaml").write_text("name: base\n" + TEXT)
    assert Scenario.from_yaml(folder / "base.yaml").name == "base"
    assert Scenario.from_yaml(folder / "other" / "top.yaml").name == "top"


def test_effects_that_are_null_are_off(folder: Path) -> None:
    scenario = Scenario.from_yaml(folder / "base.yaml")
    assert list(scenario.effects.active()) == ["kinematic_error"]


def test_a_null_that_overrides_a_preset_survives_a_round_trip(folder: Path) -> None:
    scenario = Scenario.from_yaml(folder / "base.yaml")
    assert scenario.drive.mesh.tooth_bending_stiffness_n_per_m is None  # type: ignore[union-attr]
    (folder / "copy.yaml").write_text(scenario.to_yaml())
    assert Scenario.from_yaml(folder / "copy.yaml").drive == scenario.drive


def test_the_summary_names_what_matters(folder: Path) -> None:
    summary = Scenario.from_yaml(folder / "other" / "top.yaml").summary()
    for part in ("top: two", "seed-2021", "ratio -100", "kinematic_error", "motor motion", "1 s", "seed 7"):
        assert part in summary


def test_the_environment_changes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = Scenario.from_yaml(folder / "base.yaml").to_yaml()
    for name in ("RUN", "SEED", "HDSIM_RUN", "DESCRIPTION", "NAME"):
        monkeypatch.setenv(name, "other")
    monkeypatch.setenv("LANG", "C")
    assert Scenario.from_yaml(folder / "base.yaml").to_yaml() == before


def test_a_contact_table_belongs_to_the_file_that_names_it_and_must_exist(folder: Path) -> None:
    base, top = folder / "base.yaml", folder / "other" / "top.yaml"
    base.write_text(
        TEXT.replace(
            "{model: teeth, tooth_bending_stiffness_n_per_m: null}",
            "{model: teeth, contact: {law: table, file: data/contact.csv}}",
        )
    )
    with pytest.raises(hdsim.InputError) as caught:
        Scenario.from_yaml(top)
    # The base is named as the extending file reaches it.
    assert str(caught.value).startswith(f"{base}:1: drive.mesh.contact.file: found no such file")
    (folder / "data" / "contact.csv").write_text("penetration_m,force_n\n0,0\n1e-6,50\n")
    contact = Scenario.from_yaml(top).drive.mesh.contact  # type: ignore[union-attr]
    assert contact.file == folder / "data" / "contact.csv"
