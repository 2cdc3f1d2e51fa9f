"""Commands about what people write: ``check``, ``schema``, ``effects``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdsim.console import console
from hdsim.scenario.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from pydantic import BaseModel

#: Kinds of files that people write, and their classes.
KINDS = {
    "scenario": "hdsim.scenario.model:Scenario",
    "mapping": "hdsim.log.mapping:Mapping",
    "study": "hdsim.study.engine.definition:Study",
    "loadcycle": "hdsim.study.selection:LoadCycle",
}


@click.command(short_help="Check scenarios, mappings, studies and load cycles; say what they describe.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check(files: tuple[str, ...]) -> None:
    """Check files: one line for every mistake, or OK, what each describes, and what it hardly means.

    What a file is shows in its keys: a mapping has channels, a study a base or metrics, a load cycle phases;
    all others are scenarios.
    """
    problems: list[Problem] = []
    for file in files:
        try:
            summary, doubts = _checked(file)
        except ScenarioError as error:
            problems += error.problems
        else:
            click.echo(f"{file}: OK\n{summary}")
            for doubt in doubts:
                click.echo(f"{file}: warning: {doubt}", err=True)
    if problems:
        raise ScenarioError(problems)


def _checked(file: str) -> tuple[str, list[str]]:
    """What a file describes, and doubts about it."""
    from hdsim.scenario.extends import read_tree
    from hdsim.scenario.validation import load_model

    keys = read_tree(file).value.keys()
    if keys & {"channels", "time"}:
        from hdsim.log.mapping import Mapping

        return load_model(file, Mapping).summary(), []
    if keys & {"metrics", "base", "parameters"}:
        from hdsim.study.engine.reading import load_study

        plan = load_study(file)
        varied = f"varies {', '.join(plan.units)}" if plan.units else "varies nothing"
        measured = ", ".join(metric.name for metric in plan.metrics)
        return f"  study of {len(plan.runs)} runs: {varied}\n  measures {measured}", []
    if "phases" in keys:
        from hdsim.study.selection import load_cycle

        return f"  load cycle of {len(load_cycle(file).phases)} phases", []
    from hdsim.scenario.doubts import doubts
    from hdsim.scenario.model import Scenario

    scenario = Scenario.from_yaml(file)
    return scenario.summary(), list(doubts(scenario))


def described(of: str) -> type[BaseModel]:
    """The class of a kind of file."""
    from importlib import import_module

    module, _, name = KINDS[of].partition(":")
    found: type[BaseModel] = getattr(import_module(module), name)
    return found


@click.command(short_help="Print the JSON schema of scenarios or other files, for editors.")
@click.argument("of", type=click.Choice(list(KINDS)), default="scenario")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write it to this file.")
def schema(of: str, output: Path | None) -> None:
    """Print the JSON schema (draft 2020-12) of scenarios, or of mappings, studies or load cycles.

    An editor with the YAML language server completes and checks a file that begins with the line

    # yaml-language-server: $schema=hdsim.schema.json
    """
    import json

    from hdsim.errors import InputError
    from hdsim.scenario.schema import json_schema

    text = json.dumps(json_schema(described(of)), indent=1)
    if output is None:
        click.echo(text)
        return
    try:
        output.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{output}: cannot be written ({error.strerror})") from error
    click.echo(f"wrote {output}; begin a {of} with\n# yaml-language-server: $schema={output.as_posix()}")


@click.command(short_help="List the physical effects that a scenario can turn on.")
def effects() -> None:
    """List the physical effects that a scenario can turn on, with their sources and the orders they show."""
    from rich.table import Table

    from hdsim.effects import catalogue

    table = Table("effect", "what it is", "source", "orders per wave-generator turn")
    for name, effect in catalogue().items():
        orders = ", ".join(f"{order:g}" for order in effect.signature.orders)
        table.add_row(name, effect.title, effect.source, orders)
    terminal = console()
    terminal.print(table)
