# ruff: noqa: E501 (one case a line reads best)
"""Malformed scenarios through the command line: one line each, exit code 2, nothing written, no traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdsim.cli import main

GOOD = """\
name: good
drive:
  preset: seed-2021
  inertia:
    motor_kg_m2: 5.0e-5
  mesh:
    model: teeth
    engagement:
      kind: window
      share: 0.3
command:
  motor:
    type: torque
    torque:
      type: hold
      torque_nm: 0.1
load:
  inertia_kg_m2: 0.1
run:
  duration_s: 1.0
"""


def changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


#: Name: (content, line of the message, field, what the message says).
CASES: dict[str, tuple[str | bytes, int, str, str]] = {
    "wrong type": (changed("duration_s: 1.0", "duration_s: long"), 20, "run.duration_s", "found 'long' (text), expected a number greater than 0"),
    "quoted number": (changed("duration_s: 1.0", "duration_s: '1'"), 20, "run.duration_s", "found '1' (text)"),
    "number with its unit": (changed("duration_s: 1.0", "duration_s: 1 s"), 20, "run.duration_s", "found '1 s' (text)"),
    "true for a number": (changed("duration_s: 1.0", "duration_s: true"), 20, "run.duration_s", "found true (true/false)"),
    "list for a number": (changed("duration_s: 1.0", "duration_s: [1]"), 20, "run.duration_s", "found a list of 1"),
    "nothing for a number": (changed("duration_s: 1.0", "duration_s:"), 20, "run.duration_s", "found nothing (null)"),
    "unknown key": (changed("  duration_s", "  solver: x\n  duration_s"), 20, "run.solver", "found an unknown key, expected one of duration_s"),
    "misspelt key": (changed("duration_s: 1.0", "durations_s: 1.0"), 20, "run.durations_s", "expected 'duration_s'"),
    "misspelt section": (changed("load:", "laod:"), 17, "laod", "expected 'load'"),
    "unknown effect": (GOOD + "effects:\n  kinematic_eror: {}\n", 22, "effects.kinematic_eror", "expected 'kinematic_error'"),
    "negative inertia": (changed("motor_kg_m2: 5.0e-5", "motor_kg_m2: -5.0e-5"), 5, "drive.inertia.motor_kg_m2", "found -5e-05 (number), expected a number greater than 0"),
    "zero load inertia": (changed("inertia_kg_m2: 0.1", "inertia_kg_m2: 0"), 18, "load.inertia_kg_m2", "found 0 (whole number)"),
    "beyond an upper bound": (changed("share: 0.3", "share: 1.5"), 10, "drive.mesh.engagement.share", "greater than 0 and at most 0.9"),
    "not a number": (changed("torque_nm: 0.1", "torque_nm: .nan"), 16, "command.motor.torque.torque_nm", "found .nan, expected a finite number"),
    "infinite": (changed("torque_nm: 0.1", "torque_nm: -.inf"), 16, "command.motor.torque.torque_nm", "found -.inf"),
    "overflow": (changed("torque_nm: 0.1", "torque_nm: 1e400"), 16, "command.motor.torque.torque_nm", "found 1e400, which overflows"),
    "unknown method": (GOOD + "  method: radau\n", 21, "run.method", "did you mean 'Radau'?"),
    "unknown mesh": (changed("model: teeth", "model: tooth"), 7, "drive.mesh.model", "expected one of teeth, tabulated, lumped, rigid"),
    "command without its type": (changed("    type: torque\n", ""), 12, "command.motor.type", "found nothing, expected one of torque, position"),
    "unknown command": (changed("type: torque", "type: torqe"), 13, "command.motor.type", "did you mean 'torque'?"),
    "missing section": (changed("load:\n  inertia_kg_m2: 0.1\n", ""), 1, "load", "found nothing, expected a mapping with arm, inertia_kg_m2"),
    "key of another choice": (changed("model: teeth\n", "model: rigid\n"), 8, "drive.mesh.engagement", "found an unknown key"),
    "unknown preset": (changed("seed-2021", "seed-2022"), 2, "drive", "did you mean 'seed-2021'?"),
    "wrong tooth difference": (changed("  mesh:", "  geometry: {circular_spline_teeth: 203}\n  mesh:"), 6, "drive.geometry", "exceed flexspline_teeth by 2"),
    "broken seed": (GOOD + "  seed: 1.5\n", 21, "run.seed", "expected a whole number"),
    "too many samples": (GOOD + "  sample_rate_hz: 1e9\n", 21, "run.sample_rate_hz", "greater than 0 and at most 1000000"),
    "missing recorded file": (changed("type: hold\n      torque_nm: 0.1", "type: recorded\n      file: gone.csv"), 14, "command.motor.torque", "gone.csv"),
    "missing base": (GOOD + "extends: gone.yaml\n", 21, "extends", "found no such file"),
    "extends itself": (GOOD + "extends: scenario.yaml\n", 21, "extends", "expected no circle"),
    "tab indentation": (changed("  duration_s", "\tduration_s"), 20, "", "found a tab in the indentation, expected spaces"),
    "duplicate key": (GOOD + "  duration_s: 2.0\n", 21, "run.duration_s", "found this key again (first in line 20)"),
    "duplicate section": (GOOD + "run: {duration_s: 2.0}\n", 21, "run", "found this key again (first in line 19)"),
    "bomb": ("a: &a [x, x, x]\nb: &b [*a, *a, *a]\nc: &c [*b, *b, *b]\n", 1, "a", "found &a, expected no anchors"),
    "alias": (changed("name: good", "name: *other"), 1, "name", "found *other"),
    "tag": (changed("name: good", "name: !!python/name:os.system x"), 1, "name", "found the tag"),
    "deep nesting": ("a: " + "[" * 2000, 1, "", "found more than 32 levels"),
    "open bracket": (GOOD + "effects: {", 21, "", "begins here and is not closed"),
    "colon in text": (GOOD + "description: a: b\n", 21, "", "found a ':' where no key can stand"),
    "two documents": (GOOD + "---\n" + GOOD, 21, "", "found a second document"),
    "list at the top": ("- 1\n- 2\n", 1, "", "found a list of 2, expected a mapping"),
    "text": ("hello world\n", 1, "", "found 'hello world' (text), expected a mapping"),
    "empty": ("", 1, "", "found an empty file"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00", 1, "", "found the byte 0x89, expected YAML text in UTF-8"),
    "log instead of a scenario": (b"\x89MCAP0\r\n\x01", 1, "", "found the byte 0x89"),
    "zeros": (b"\0" * 100, 1, "", "found the control character U+0000"),
}  # fmt: skip


def run_main(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    out, err = capsys.readouterr()
    assert isinstance(stopped.value.code, int)
    return stopped.value.code, out, err


def test_the_good_scenario_is_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(GOOD)
    code, out, err = run_main(["check", str(path)], capsys)
    assert (code, err) == (0, "")
    assert out.startswith(f"{path}: OK\n  scenario  good\n  drive     seed-2021, ratio -100")


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(("content", "line", "field", "part"), CASES.values(), ids=CASES.keys())
def test_a_malformed_scenario_gives_one_line_and_writes_nothing(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    content: str | bytes,
    line: int,
    field: str,
    part: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "scenario.yaml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    code, out, err = run_main([command, "scenario.yaml"], capsys)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith(f"error: scenario.yaml:{line}: " + (f"{field}: " if field else "")), err
    assert part in err
    assert [entry.name for entry in tmp_path.iterdir()] == ["scenario.yaml"]


def test_what_is_no_file_gives_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path, part in [
        (tmp_path / "gone.yaml", "found no such file"),
        (tmp_path, "found a directory"),
        (Path("/dev/null"), "found a device or pipe"),
    ]:
        code, out, err = run_main(["check", str(path)], capsys)
        assert (code, out) == (2, "")
        assert err.startswith(f"error: {path}: {part}")
        assert err.count("\n") == 1


def test_several_files_and_several_mistakes_are_all_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text(GOOD)
    bad.write_text(GOOD.replace("0.3", "3").replace("1.0", "-1").replace("name:", "nane:"))
    code, out, err = run_main(["check", str(bad), str(good)], capsys)
    assert code == 2
    assert f"{good}: OK" in out
    fields = [line.split(": ")[2] for line in err.splitlines()]
    assert fields == ["nane", "drive.mesh.engagement.share", "run.duration_s"]


KEYS = st.sampled_from(
    ["name", "drive", "command", "load", "run", "effects", "motor", "type", "torque", "preset", "mesh", "model",
     "inertia_kg_m2", "duration_s", "contact", "law", "engagement", "kind", "geometry", "kinematic_error",
     "components", "trajectory", "moves", "extends", "gravity", "x"]
)  # fmt: skip
VALUES = (
    st.none() | st.booleans() | st.integers(-3, 300) | st.floats(-10, 10) | st.text(max_size=5)
    | st.sampled_from(["seed-2021", "teeth", "rigid", "torque", "sequence", "position", "hold", "window", "hertz_line"])
)  # fmt: skip
TREES = st.recursive(
    VALUES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=5),
    max_leaves=25,
)


@settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(KEYS, TREES, max_size=8), st.booleans())
def test_random_scenarios_never_end_in_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tree: dict[str, object], on_good: bool
) -> None:
    from hdsim.scenario.writer import to_yaml

    (tmp_path / "base.yaml").write_text(GOOD)
    text = to_yaml(tree)
    if on_good and "extends" not in tree and tree:
        text += "extends: base.yaml\n"
    path = tmp_path / "scenario.yaml"
    path.write_text(text, encoding="utf-8", newline="")
    code, _, err = run_main(["check", str(path)], capsys)
    assert code in (0, 2)
    assert all(line.startswith("error: ") and len(line) < 1500 for line in err.splitlines())
    assert (code == 0) == (err == "")
