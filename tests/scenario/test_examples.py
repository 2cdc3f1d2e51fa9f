"""Scenarios to start from: listed, copied, never overwritten."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim import cli
from hdsim.errors import InputError
from hdsim.scenario.examples import copy, description, examples

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_in_a_clone_they_are_its_scenarios() -> None:
    found = examples()
    assert found["seed_move"].samefile(SCENARIOS / "seed_move.yaml")
    assert found["bases/kinova_rigid"].samefile(SCENARIOS / "bases" / "kinova_rigid.yaml")
    assert all(len(description(path)) > 30 for path in found.values())


@pytest.mark.parametrize("name", examples())
def test_a_copy_stands_alone(name: str, tmp_path: Path) -> None:
    out = tmp_path / "new" / "mine.yaml"
    written = copy(name, out)
    assert written[0] == out
    assert out.read_text(encoding="utf-8").startswith(
        "# yaml-language-server: $schema=scenario.schema.json\n"
    )
    assert hdsim.load_scenario(out).drive == hdsim.load_scenario(examples()[name]).drive
    assert json.loads((out.parent / "scenario.schema.json").read_text())["title"] == "hdsim scenario"
    assert sorted(written) == sorted(out.parent.iterdir())


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    out = tmp_path / "mine.yaml"
    copy("sine_tracking", out)
    with pytest.raises(InputError, match=r"mine\.yaml is there already"):
        copy("seed_move", out)
    assert copy("sine_tracking", tmp_path / "again.yaml") == [tmp_path / "again.yaml"]
    base = tmp_path / "seed_move.yaml"  # what the example extends
    base.write_text("name: my own\n")
    with pytest.raises(InputError, match=r"seed_move\.yaml is there already"):
        copy("sine_tracking", tmp_path / "third.yaml")
    with pytest.raises(InputError, match="extends has this name"):
        copy("sine_tracking", base)
    assert base.read_text() == "name: my own\n"
    assert not (tmp_path / "third.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["new", "seed_moove"], "no example 'seed_moove'; did you mean 'seed_move'?"),
        (["new", "xyzzy"], "there are: back_driving"),
        (["new", "seed_move", "move.json"], "expected a file name that ends in .yaml"),
        (["new", "seed_move", "/dev/null/move.yaml"], "/dev/null/move.yaml: cannot be written ("),
    ],
)
def test_mistakes_are_said_in_a_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    err = capsys.readouterr().err
    assert (stopped.value.code, err.count("\n"), list(tmp_path.iterdir())) == (2, 1, [])
    assert said in err


def test_new_without_a_name_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    listings = []
    for arguments in (["examples"], ["new"]):
        with pytest.raises(SystemExit) as stopped:
            cli.main(arguments)
        assert stopped.value.code == 0
        listings.append(capsys.readouterr().out)
    assert listings[0] == listings[1]
    assert all(name in listings[0] for name in examples())


def test_an_example_is_one_call_and_a_file_is_as_good_as_what_it_holds() -> None:
    example = hdsim.example("torsion_cycle").with_({"run.duration_s": 0.01})
    path = SCENARIOS / "torsion_cycle.yaml"
    assert example.drive == hdsim.load_scenario(path).drive
    by_file = hdsim.linearize(path)
    np.testing.assert_array_equal(by_file.A, hdsim.linearize(hdsim.load_scenario(path)).A)
    with pytest.raises(InputError, match="did you mean 'torsion_cycle'"):
        hdsim.example("torsion_cycel")


def test_a_scenario_is_simulated_from_its_file(tmp_path: Path) -> None:
    path = tmp_path / "joint.yaml"
    path.write_text(
        "drive: {preset: csg-20-100, mesh: {model: lumped}}\n"
        "command: {motor: {type: locked}}\n"
        "load: {inertia_kg_m2: 0.1}\n"
        "run: {duration_s: 0.01}\n"
    )
    result = hdsim.simulate(path)
    again = hdsim.simulate_all([str(path)], ["motor_angle"])[0]
    np.testing.assert_array_equal(again["motor_angle"], result["motor_angle"])
    with pytest.raises(InputError, match=r"nowhere\.yaml"):
        hdsim.simulate(tmp_path / "nowhere.yaml")
