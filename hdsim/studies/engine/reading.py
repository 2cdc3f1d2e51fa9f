"""Reads a study's YAML file, and checks all of it before the first run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdsim.errors import InputError
from hdsim.scenario.extends import read_tree, resolve_extends
from hdsim.scenario.fields import split_unit
from hdsim.scenario.names import check, parse, unit
from hdsim.scenario.problems import Mark, Problem, ScenarioError, dotted
from hdsim.scenario.reader import KeyPath, Node, Source, flatten
from hdsim.scenario.validation import build
from hdsim.studies.engine.definition import Base, Study
from hdsim.studies.engine.worker import OPTIONS, PRESET, Recipe, remakes_base

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario
    from hdsim.studies.engine.design import RunPoint
    from hdsim.studies.registry import Metric

#: Sections whose name says nothing more about a parameter.
_SECTIONS = ("drive", "effects", "command", "load", "run", "options")


@dataclass(frozen=True)
class Plan:
    """A study that has been checked, with all its runs.

    Args:
        study: what the user wrote.
        scenario: the base scenario; its seed is that of the first drive.
        recipe: how to make the scenario of a run.
        runs: all runs, by index.
        metrics: what is measured.
        units: unit of every parameter.
    """

    study: Study
    scenario: Scenario
    recipe: Recipe
    runs: tuple[RunPoint, ...]
    metrics: tuple[Metric, ...]
    units: dict[str, str] = field(default_factory=dict)

    @property
    def definition(self) -> dict[str, Any]:
        """Everything that decides the results, as plain data."""
        study = self.study.model_dump(mode="json", exclude={"name", "description", "confidence", "base"})
        return {"study": study, "recipe": [self.recipe.base, self.recipe.written]}


def load_study(path: str | Path) -> Plan:
    """Read a study and check it.

    ``base.scenario`` may be the path of a scenario's file, relative to the study's, or a scenario that is
    written there and may extend a file.

    Raises:
        ScenarioError: one line for every mistake, with file and line.
    """
    root = read_tree(path)
    base = root.value.get("base")
    if base is not None and isinstance(base.value, dict) and "scenario" in base.value:
        base.value["scenario"] = _scenario_node(base.value["scenario"])
    source = flatten(root)
    study = build(_without_paths(source), Study)
    if not study.name:
        study = study.model_copy(update={"name": Path(path).stem[:200]})
    return plan(study, source)


def _scenario_node(node: Node) -> Node:
    if isinstance(node.value, str):
        here = Path(node.mark.file).parent / node.value
        loaded = read_tree(here)
        loaded.value.setdefault("name", Node(here.stem[:200], Mark(str(here))))
        return loaded
    if isinstance(node.value, dict):
        return resolve_extends(node, Path(node.mark.file), [])
    return node


def _without_paths(source: Source) -> Source:
    """A list of metrics may be written as one name."""
    data = dict(source.data)
    if isinstance(data.get("metrics"), str):
        data["metrics"] = [data["metrics"]]
    return Source(data, source.marks)


def plan(study: Study, source: Source | None = None) -> Plan:
    """Check a study that was read, or made in Python.

    Args:
        study: the study.
        source: where its values were written, for messages.

    Raises:
        ScenarioError: with every mistake found.
    """
    from hdsim.scenario.model import Scenario
    from hdsim.studies.engine.design import runs
    from hdsim.studies.known_metrics import find_metric

    source = source or Source(study.model_dump(mode="json"), {(): Mark(study.name or "study")})
    scenario, recipe = base_recipe(study.base, tuple(study.parameters), source)
    problems: list[Problem] = []
    metrics = []
    for k, name in enumerate(study.metrics):
        with _collected(problems, source, ("metrics", k)):
            metrics.append(find_metric(name))
    complete = scenario.model_dump(mode="json")
    for name in study.parameters:
        if not name.startswith(OPTIONS):
            with _collected(problems, source, ("parameters", name)):
                check(name, complete, Scenario)
    if not problems:
        found = runs(study, scenario.run.seed)
        _check_values(study, recipe, found, source, problems)
    if problems:
        raise ScenarioError(sorted(problems, key=lambda problem: problem.mark.line))
    units = {name: "1" if remakes_base(name) and name == PRESET else unit(name) for name in study.parameters}
    return Plan(study, scenario, recipe, tuple(found), tuple(metrics), units)


def base_recipe(base: Base, names: tuple[str, ...], source: Source) -> tuple[Scenario, Recipe]:
    """The base scenario and the recipe of the runs, every part checked against the file.

    Raises:
        ScenarioError: the base scenario, or a section that the procedure is given, is wrong.
    """
    from hdsim.drive.parameters import Drive
    from hdsim.scenario.model import Effects, Scenario
    from hdsim.studies.known_procedures import find_procedure

    if base.scenario is not None:
        part = _part(source, ("base", "scenario"), base.scenario)
        built = build(part, Scenario)
        given: dict[str, Any] = {"scenario": built.model_dump(mode="json")}
        written = {name: base.scenario.get(name) or {} for name in ("drive", "effects")}
        return built, Recipe(json.dumps(given), json.dumps(written), names)
    problems: list[Problem] = []
    with _collected(problems, source, ("base", "procedure")):
        find_procedure(base.procedure or "")
    if problems:
        raise ScenarioError(problems)
    build(_part(source, ("base", "drive"), base.drive or {}), Drive)
    if base.effects is not None:
        build(_part(source, ("base", "effects"), base.effects), Effects)
    given = {
        "procedure": base.procedure,
        "drive": base.drive,
        "effects": base.effects,
        "run": base.run,
        "options": base.options,
    }
    recipe = Recipe(json.dumps(given), "{}", names)
    try:
        built = Recipe(recipe.base, "{}", ()).scenario(())
    except ScenarioError as error:
        raise ScenarioError(
            Problem(source.mark(("base",)), f"base: {problem.field}", problem.text)
            for problem in error.problems
        ) from None
    except (InputError, ValueError) as error:
        raise ScenarioError([Problem(source.mark(("base",)), "base", " ".join(str(error).split()))]) from None
    return built, recipe


def _part(source: Source, path: KeyPath, data: dict[str, Any]) -> Source:
    """A section as a source of its own that knows its places in the file."""
    marks = {place[len(path) :]: mark for place, mark in source.marks.items() if place[: len(path)] == path}
    marks.setdefault((), source.mark(path))
    return Source(data, marks)


@contextmanager
def _collected(problems: list[Problem], source: Source, path: KeyPath) -> Iterator[None]:
    """Turn an error into a problem at a place of the file."""
    try:
        yield
    except ScenarioError as error:
        place = source.mark(path)
        problems += [Problem(place, _label(path), problem.text) for problem in error.problems]
    except InputError as error:
        problems.append(Problem(source.mark(path), _label(path), str(error)))


def _label(path: KeyPath) -> str:
    return f"parameters: {path[1]}" if path[0] == "parameters" and len(path) > 1 else dotted(path)


def _check_values(
    study: Study, recipe: Recipe, found: list[RunPoint], source: Source, problems: list[Problem]
) -> None:
    """Every parameter alone, over the base: stated values all, drawn ones at their smallest and largest."""
    for k, name in enumerate(study.parameters):
        values = [run.values[k] for run in found]
        if name in study.distributions:
            values = [min(values), max(values)]
        tried: list[Any] = []
        for value in values:
            if any(type(value) is type(other) and value == other for other in tried):
                continue
            tried.append(value)
            single = Recipe(recipe.base, recipe.written, (name,))
            mistake = _mistake(single, name, value)
            if mistake:
                problems.append(Problem(source.mark(("parameters", name)), f"parameters: {name}", mistake))
                break


def _mistake(single: Recipe, name: str, value: Any) -> str:
    """What is wrong with one value of one parameter by itself; empty when nothing is.

    Whether it fits the other parameters is known only in the run, whose row then holds the reason.
    """
    try:
        single.scenario((value,))
    except ScenarioError as error:
        own = [p.text for p in error.problems if p.field.startswith(name) or remakes_base(name)]
        return own[0] if own else ""
    except InputError as error:
        return str(error)
    return ""


def described(path: str) -> str:
    """Last parts of a parameter's name, in words.

    Example:
        >>> described("drive.mesh.flanks.flexspline.fractal_dimension")
        'flexspline fractal dimension'
    """
    *before, last = parse(path)
    while before and before[-1] in _SECTIONS:
        before.pop()
    if not before and parse(path)[0] == "load":
        before = ["load"]  # the load's inertia is none of the drive's
    # An entry of a list needs the list's name and its owner's.
    owner = before[-1:] if before and isinstance(before[-1], str) else before[-3:]
    return " ".join(str(part) for part in [*owner, split_unit(str(last))[0]]).replace("_", " ")
