"""The package is as docs/architecture.md draws it: which way imports go, no circle, no large file."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
MOST_LINES = 350
#: ``Recording.save``, ``plot`` and ``metrics``: conveniences that look to the right, when they are called.
ALLOWED = {("recording", "log"), ("recording", "plot"), ("recording", "study")}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted((ROOT / "hdsim").rglob("*.py"))}


def statements(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Imports that run, at once or when a function is called; those for annotations alone do not."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
            continue
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        yield from statements(child)


def imported(source: str) -> set[str]:
    """Modules of the package that a source text imports."""
    found = set()
    for statement in statements(ast.parse(source)):
        if isinstance(statement, ast.Import):
            found |= {alias.name for alias in statement.names}
            continue
        assert not statement.level, "imports are absolute"
        home = statement.module or ""
        for alias in statement.names:
            inner = f"{home}.{alias.name}"
            found.add(inner if inner in MODULES else home)
    return {name for name in found if name.split(".")[0] == "hdsim"}


@cache
def graph() -> dict[str, set[str]]:
    return {name: imported(path.read_text(encoding="utf-8")) - {name} for name, path in MODULES.items()}


def circle(edges: dict[str, set[str]]) -> list[str]:
    """Some circle of a graph, or nothing."""
    done: set[str] = set()
    path: list[str] = []

    def visit(node: str) -> list[str]:
        if node in path:
            return path[path.index(node) :]
        if node in done:
            return []
        path.append(node)
        for following in sorted(edges.get(node, ())):
            if found := visit(following):
                return found
        done.add(path.pop())
        return []

    return next((found for node in sorted(edges) if (found := visit(node))), [])


def room(module: str) -> str:
    """Package, or single file, of a module; the commands of every package belong to the command line."""
    parts = module.split(".")
    if len(parts) == 1 or parts[1] == "__main__" or "commands" in parts[-1]:
        return "cli"  # the facade too, which hands out what the rooms have
    return parts[1]


def drawn() -> dict[str, int]:
    """Place of every room on the way of the page."""
    (block,) = re.findall(r"(?:^    .*->.*\n)+", PAGE, re.MULTILINE)
    stages = [stage.strip() for stage in block.replace("\n", " ").split("->") if stage.strip()]
    return {name.strip(): place for place, stage in enumerate(stages) for name in stage.split(",")}


def shared() -> set[str]:
    (line,) = re.findall(r"^Shared by all.*?(?=\n\n)", PAGE, re.MULTILINE | re.DOTALL)
    return set(re.findall(r"`(\w+)`", line)) | {"_abi", "_compile", "_evaluate"}


def test_no_file_is_large() -> None:
    lines = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in MODULES.items()}
    assert {name: many for name, many in lines.items() if many > MOST_LINES} == {}


def test_no_import_circle() -> None:
    assert circle(graph()) == []


def test_the_page_draws_every_room_once() -> None:
    places = drawn()
    assert not places.keys() & shared()
    assert {room(name) for name in MODULES} == places.keys() | shared()


@pytest.mark.parametrize("name", sorted({room(name) for name in MODULES} - {"cli"}))
def test_imports_go_the_way_of_the_page(name: str) -> None:
    places, common = drawn(), shared()
    wrong = []
    for module, names in graph().items():
        if room(module) != name:
            continue
        for other in sorted(names):
            there = room(other)
            if there in (name, *common) or (name, there) in ALLOWED:
                continue
            if name in common or places[there] >= places[name]:
                wrong.append(f"{module} imports {other}")
    assert wrong == []


def test_the_decision_sees_evidence_and_rules_alone() -> None:
    pure = {f"hdsim.diagnosis.{name}" for name in ("decide", "evidence", "rules")}
    seen = {name for module in pure for name in graph()[module]}
    assert seen <= pure | {"hdsim.estimate.found"}


def test_the_reading_of_imports_sees_what_it_should() -> None:
    source = "import hdsim.log\ndef f():\n    from hdsim.drive import spring\n"
    source += "if TYPE_CHECKING:\n    from hdsim.tell import save\n"
    assert imported(source) == {"hdsim.log", "hdsim.drive.spring"}
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
