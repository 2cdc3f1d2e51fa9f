"""Which gear carries a load cycle: the file, its mistakes, the choice, the command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hdsim.cli import main
from hdsim.scenario import json_schema
from hdsim.scenario.problems import ScenarioError
from hdsim.scenario.reader import flatten, read_node
from hdsim.studies.selection import LoadCycle, load_cycle, select

FOLDER = Path(__file__).parents[2] / "scenarios" / "loadcycles"
EXAMPLE = FOLDER / "maker_example.yaml"


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as exit_:
        main(list(arguments))
    out, err = capsys.readouterr()
    return int(exit_.value.code or 0), out, err


def test_the_makers_example_takes_the_makers_size():
    cycle = load_cycle(EXAMPLE)
    duty = cycle.duty()
    assert duty.average_torque_nm == pytest.approx(89.0, abs=0.5)  # as printed
    assert 100 * duty.largest_speed_rpm == 2000  # its largest input speed, as printed
    choices = {choice.gear.name: choice for choice in select(cycle)}
    assert next(name for name, choice in choices.items() if choice.carries) == "csg-25-100"
    assert any(
        text.startswith("average torque 89.39 N m, allowed 64") for text in choices["csg-20-100"].refusals
    )


def test_a_cycle_can_be_refused_for_each_reason_alone():
    phase = {"torque_nm": 10.0, "speed_rpm": 5.0, "duration_s": 1.0}
    easy = {"phases": [phase], "ratios": [100]}

    def refused(**changes: object) -> set[str]:
        cycle = LoadCycle.model_validate(easy | changes)
        (choice,) = (c for c in select(cycle) if c.gear.name == "csg-17-100")
        return {check.name for check in choice.checks if check.holds is False}

    assert refused() == set()
    assert refused(phases=[phase | {"torque_nm": 60.0}]) == {"average torque"}
    # A short peak counts little in the average.
    assert refused(phases=[phase, phase | {"torque_nm": 90.0, "duration_s": 1e-3}]) == {
        "repeated peak torque"
    }
    assert refused(phases=[phase | {"speed_rpm": 40.0}]) == {"average input speed"}
    assert refused(largest_speed_rpm=80.0) == {"largest input speed"}
    stop = {"torque_nm": 150.0, "duration_s": 0.1}
    assert refused(emergency_stop=stop) == {"momentary peak torque"}
    assert refused(emergency_stop=stop | {"torque_nm": 210.0}) == {
        "momentary peak torque",
        "ratcheting torque",
    }
    many = {"torque_nm": 50.0, "speed_rpm": 10.0, "duration_s": 0.1, "times": 10_000}
    assert refused(emergency_stop=many) == {"momentary peaks"}
    assert refused(life_h=1e7) == {"bearing life L10"}


def test_the_sign_of_torque_and_speed_does_not_matter():
    spans = [(30.0, 5.0), (-20.0, 7.0), (10.0, -3.0)]

    def duty(sign: float) -> object:
        phases = [{"torque_nm": sign * t, "speed_rpm": sign * n, "duration_s": 1.0} for t, n in spans]
        return LoadCycle.model_validate({"phases": phases}).duty()

    assert duty(1.0) == duty(-1.0)


@pytest.mark.parametrize(
    ("old", "new", "line", "expected"),
    [
        ("torque_nm: 150", "torque_nm: heavy", 7, "phases[0].torque_nm"),
        ("duration_s: 3.0", "duration_s: 0", 8, "greater than 0"),
        ("life_h: 7000", "lief_h: 7000", 13, "life_h"),
        ("ratios: [100]", "ratios: [90]", 14, "ratios"),
        ("largest_speed_rpm: 20", "largest_speed_rpm: -20", 11, "largest_speed_rpm"),
    ],
)
def test_mistakes_are_told_with_file_line_and_field(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, line: int, expected: str
) -> None:
    path = tmp_path / "cycle.yaml"
    path.write_text(EXAMPLE.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(ScenarioError):
        load_cycle(path)
    code, _, err = run(capsys, "select", str(path))
    assert code == 2
    assert f"cycle.yaml:{line}" in err
    assert expected in err
    assert "Traceback" not in err


def test_the_command_prints_margins_reasons_and_the_smallest(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "select", str(EXAMPLE))
    assert code == 0
    assert "smallest that carries it: csg-25-100" in out
    assert "csg-20-100: average torque 89.39 N m, allowed 64" in out
    code, out, _ = run(capsys, "select", str(EXAMPLE), "--json")
    found = json.loads(out)
    assert found["duty"]["average_torque_nm"] == pytest.approx(89.0, abs=0.5)
    assert next(gear["gear"] for gear in found["gears"] if gear["carries"]) == "csg-25-100"


def test_the_load_cycle_in_the_documentation_is_one(tmp_path: Path) -> None:
    page = (FOLDER.parents[1] / "docs" / "selection.md").read_text(encoding="utf-8")
    path = tmp_path / "cycle.yaml"
    path.write_text(page.split("```yaml\n")[1].split("```")[0], encoding="utf-8")
    assert load_cycle(path).name == "pick and place"


@pytest.mark.parametrize("name", ["csg-20-100", "seed-2021", "csg-65-160", "shg-32-100", "csf-40-120"])
def test_what_is_printed_of_a_gear_is_listed_with_how_it_was_seen(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    code, out, _ = run(capsys, "presets", name)
    assert code == 0
    assert "stiffness k1" in out
    assert ("maximum input speed" in out) == (not name.startswith("csf"))
    assert ("inertia" in out) == (not name.startswith("shg"))


def test_nothing_carries_too_much(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "cycle.yaml"
    path.write_text("phases: [{torque_nm: 1.0e5, speed_rpm: 1, duration_s: 1}]\n", encoding="utf-8")
    code, out, _ = run(capsys, "select", str(path))
    assert code == 1
    assert "none carries it" in out


def test_the_schema_beside_the_load_cycles_is_current_and_takes_them() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    stored = json.loads((FOLDER / "loadcycle.schema.json").read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(json_schema(LoadCycle))), "run: make schema"
    validator = jsonschema.Draft202012Validator(stored)
    for path in FOLDER.glob("*.yaml"):
        assert [error.message for error in validator.iter_errors(flatten(read_node(path)).data)] == []
    assert not validator.is_valid({"phases": []})
    assert not validator.is_valid(
        {"phases": [{"torque_nm": 1, "speed_rpm": 1, "duration_s": 1}], "ratio": 100}
    )
