"""The documentation is linked, its examples work and its lists are complete."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import control
import pytest
from ruamel.yaml import YAML

import hdsim
from hdsim.cli import COMMANDS
from hdsim.diagnosis.experiments import LONGEST_S
from hdsim.diagnosis.following import WEAK
from hdsim.diagnosis.verdict import IdentifiedEffect, Verdict
from hdsim.effects import catalogue
from hdsim.estimate.bridges import LOST, PLACES
from hdsim.estimate.check import SLOWEST_HZ
from hdsim.estimate.found import Gap
from hdsim.estimate.records import FEWEST_SAMPLES, SHORTEST_S
from hdsim.scenario import Scenario, json_schema
from hdsim.scenario.commands import KINDS, described
from hdsim.tell.wording import MUCH_NOISE, MUCH_STRUCTURE, SURE

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
DOCS = ROOT / "docs"
PAGES = [README, *sorted(DOCS.glob("**/*.md"))]
SECTIONS = {"extends", *Scenario.model_fields}


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def links(page: Path) -> set[str]:
    return set(re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")))


def scenario_examples() -> list[Any]:
    found = []
    for page in PAGES:
        for k, text in enumerate(blocks(page, "yaml")):
            if set(YAML(typ="safe").load(text)) <= SECTIONS:
                found.append(pytest.param(text, id=f"{page.stem}-{k}"))
    return found


def test_every_page_is_in_the_index() -> None:
    linked = {(DOCS / link).resolve() for link in links(DOCS / "README.md")}
    itself = {DOCS / f"{name}.md" for name in ("README", "index", "about")}  # they include READMEs
    assert set(DOCS.glob("**/*.md")) - itself - linked == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for link in links(page):
        if link.startswith(("http://", "https://")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), link
        if anchor:
            titles = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            anchors = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
            assert anchor in anchors, link


@pytest.mark.parametrize("text", scenario_examples())
def test_scenarios_in_the_documentation_are_valid(text: str, tmp_path: Path) -> None:
    data = YAML(typ="safe").load(text)
    base = (ROOT / "scenarios" / "seed_move.yaml").read_text(encoding="utf-8")
    (tmp_path / "base.yaml").write_text(base, encoding="utf-8")
    shutil.copy(ROOT / "scenarios/arms/six_joint.urdf", tmp_path)  # what an arm is read from
    if "extends" not in data and not {"drive", "command", "load", "run"} <= set(data):
        text = f"extends: base.yaml\n{text}"  # an excerpt
    path = tmp_path / "example.yaml"
    path.write_text(text, encoding="utf-8")
    assert hdsim.load_scenario(path).drive.rated_torque_nm > 0


@pytest.mark.parametrize("page", ["diagnose", "architecture", "fit"])
def test_named_files_are_there(page: str) -> None:
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    there = {path.name for path in (ROOT / "hdsim").rglob("*.py")}
    assert {name for name in re.findall(r"`(\w+\.py)`", text) if name not in there} == set()
    paths = re.findall(r"`((?:hdsim|tests|scenarios)/[\w/.]+)`", text)
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_the_page_of_the_diagnosis_has_the_programs_own_figures() -> None:
    text = " ".join((DOCS / "diagnose.md").read_text(encoding="utf-8").split())
    least = f"{FEWEST_SAMPLES} samples over {SHORTEST_S:g} s at {SLOWEST_HZ:g} Hz or more"
    assert f"{least}. A record is cut at [gaps](#gaps)" in text
    assert f"tried in up to {PLACES} other places" in text
    assert f"pieces below {FEWEST_SAMPLES} samples or {SHORTEST_S:g} s are left out" in text
    assert f"lose more than {100 * LOST:g} % of its readings" in text
    assert f"a single effect below {WEAK:.0%}".replace("%", " %") in text
    assert f"experiments of up to {LONGEST_S:g} s" in text
    very, sure, fairly = (round(100 * least) for least, _ in SURE[:3])
    assert f"very sure from {very} %, sure from {sure} %, fairly sure from {fairly} %" in text
    assert (MUCH_NOISE, MUCH_STRUCTURE) == (2.0, 0.1)
    assert "more than twice its noise or more than a tenth of the systematic residual" in text


def test_the_page_of_the_diagnosis_has_every_field_of_the_verdict() -> None:
    section = (DOCS / "diagnose.md").read_text(encoding="utf-8").split("## verdict.json")[1].split("## ")[0]
    named = set(re.findall(r"`(\w+)`", section))
    fields = {*Verdict.model_fields, *IdentifiedEffect.model_fields, *Gap.model_fields}
    assert fields - named == set()


def test_the_readme_has_a_whole_scenario() -> None:
    assert any(
        {"drive", "command", "load", "run"} <= set(YAML(typ="safe").load(t)) for t in blocks(README, "yaml")
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_schemas_beside_the_files_are_current(kind: str) -> None:
    (path,) = (ROOT / "scenarios").rglob(f"{kind}.schema.json")
    stored = json.loads(path.read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(json_schema(described(kind)))), "run: make schema"


def test_the_readme_counts_the_effects() -> None:
    many = len(set(catalogue()) - {"table"})  # a curve for what is no effect of the catalogue
    assert f"{many} further physical effects" in README.read_text(encoding="utf-8")


def test_the_readme_lists_every_command() -> None:
    text = README.read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"`hdsim {name}" not in text] == []


def test_the_readme_gives_a_reason_for_every_dependency_and_top_level_entry() -> None:
    text = README.read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = [*project["project"]["dependencies"]]
    for extra in project["project"]["optional-dependencies"].values():
        named += extra
    for group in project["dependency-groups"].values():
        named += [one for one in group if isinstance(one, str)]
    names = [re.split(r"[\[<>=~;! ]", requirement)[0] for requirement in named]
    assert [name for name in names if f"`{name}`" not in text] == []
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.split("\n")
    entries = {line.split("/")[0] + ("/" if "/" in line else "") for line in listed if line}
    assert [entry for entry in sorted(entries) if f"`{entry}`" not in text] == []


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    (tmp_path / "logs").mkdir()
    (example,) = blocks(README, "python")
    exec(compile(example, "README.md", "exec"), {})
    assert list(tmp_path.glob("logs/*.mcap"))
    assert list(tmp_path.glob("logs/*.png"))


def test_the_python_of_the_pages_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (environment,) = blocks(DOCS / "python.md", "python")
    space: dict[str, Any] = {}
    exec(compile(environment, "python.md", "exec"), space)
    assert space["done"].shape == (8,)
    # The example before it linearises, which `tests/simulation` does with less.
    loop = blocks(DOCS / "linearize.md", "python")[-1]
    space |= {"ct": control, "scenario": hdsim.load_scenario("scenarios/seed_move.yaml")}
    exec(compile(loop, "linearize.md", "exec"), space)
    assert space["response"].outputs.shape == (1, 201)


def test_the_effect_that_the_documentation_adds_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, test, _ = blocks(DOCS / "extending.md", "python")  # the third is of the package that is made anew
    name = "hdsim.effects.eddy_current_brake"
    path = tmp_path / "eddy_current_brake.py"
    path.write_text(code, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    space: dict[str, Any] = {}
    exec(compile(test, "extending.md", "exec"), space)
    tests = [function for title, function in space.items() if title.startswith("test_")]
    assert len(tests) == 1
    tests[0]()
