"""A new effect touches three places: its file, its test, its lines in the docs. Nothing else knows its name.

The file is the one that docs/extending.md shows, in a folder that the catalogue is told of: what finds it
there finds it in ``hdsim/effects`` too.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hdsim.effects import catalogue

ROOT = Path(__file__).parents[2]
NAME = "eddy_current_brake"
#: Rooms whose code is about effects in general.
GENERAL = ("drive", "scenario", "estimate", "diagnosis", "tell")
#: The curve of what has no name, and the readings of all channels: parts of how a model is told and read.
KNOWN = {"table", "sensors"}


def run(folder: Path, code: str) -> str:
    """What a process prints whose catalogue has the folder's effects too."""
    head = f"import sys, hdsim.effects as e\ne.__path__.append({str(folder)!r})\n"
    head += f"sys.path += [{str(ROOT / 'tests' / 'diagnose')!r}, {str(ROOT / 'tests' / 'effects')!r}]\n"
    done = subprocess.run([sys.executable, "-c", head + code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    code = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]
    (tmp_path / f"{NAME}.py").write_text(code, encoding="utf-8")
    return tmp_path


def test_one_file_is_in_the_scenario_its_schema_the_list_and_the_docs_page(folder: Path) -> None:
    code = f"""
from hdsim.cli import main
from hdsim.effects.__main__ import page
from hdsim.scenario import Scenario, json_schema
from hdsim.scenario.model import Effects
assert {NAME!r} in str(json_schema(Scenario))
assert list(Effects.model_validate({{{NAME!r}: {{}}}}).active()) == [{NAME!r}]
assert "## {NAME}" in page()
main(["effects"])
"""
    assert NAME in run(folder, code)


@pytest.mark.slow
def test_one_file_is_tested_at_random_states(folder: Path) -> None:
    tests = ROOT / "tests" / "effects" / "test_every_effect.py"
    options = ["-q", "-p", "no:cacheprovider", str(tests), "-k", NAME]
    code = f"import pytest\nsys.exit(pytest.main({options!r}))"
    passed = re.search(r"(\d+) passed|^(\.+) ", run(folder, code), re.MULTILINE)
    assert passed is not None
    assert int(passed[1] or len(passed[2])) >= 8


@pytest.mark.slow
def test_one_file_is_named_by_a_diagnosis(folder: Path) -> None:
    code = f"""
from pathlib import Path
from diagnose_bench import rigid_record, scenario
from hdsim.diagnosis.workflow import diagnose

def brake(angle, velocity):
    output = velocity / 100.0
    return 15.0 * output / (1.0 + (output / 0.4) ** 2) / 100.0

verdict = diagnose([rigid_record(extra=brake, seed=2)], scenario(Path({str(folder)!r}))).verdict
print(verdict.sentence)
(found,) = verdict.effects
assert found.name == {NAME!r}
assert abs(found.parameters["critical_velocity_rad_per_s"].value / 0.4 - 1.0) < 0.05
"""
    run(folder, code)


def test_general_code_names_no_effect() -> None:
    names = set(catalogue()) - KNOWN
    said = []
    for room in GENERAL:
        for path in sorted((ROOT / "hdsim" / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                text = node.value if isinstance(node, ast.Constant) else getattr(node, "module", None)
                if isinstance(text, str) and text.removeprefix("hdsim.effects.") in names:
                    said.append(f"{path.relative_to(ROOT)}: {text}")
    assert said == []
