"""Commands about what people write: ``check``, ``schema``, ``effects``, ``examples``, ``new``."""

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
    "study": "hdsim.studies.engine.definition:Study",
    "loadcycle": "hdsim.studies.selection:LoadCycle",
}


@click.command(short_help="Check scenarios, mappings, studies and load cycles; say what they describe.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check(files: tuple[str, ...]) -> None:
    """Check files: one line for every mistake, or OK, a summary and warnings.

    The kind of a file follows from its keys: a mapping has channels, a study a base or metrics, a load cycle
    phases; all others are scenarios.
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
        from hdsim.studies.engine.reading import load_study

        plan = load_study(file)
        varied = f"varies {', '.join(plan.units)}" if plan.units else "varies nothing"
        measured = ", ".join(metric.name for metric in plan.metrics)
        return f"  study of {len(plan.runs)} runs: {varied}\n  measures {measured}", []
    if "phases" in keys:
        from hdsim.studies.selection import load_cycle

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

    from hdsim.effects import catalogue, outside

    homes = {name: one.distribution for name, one in outside().items()}
    table = Table(
        "effect", "what it is", "source", "orders per wave-generator turn", *(["from"] if homes else [])
    )
    for name, effect in catalogue().items():
        orders = ", ".join(f"{order:g}" for order in effect.signature.orders)
        home = [homes.get(name, "hdsim")] if homes else []
        table.add_row(name, effect.title, effect.source, orders, *home)
    terminal = console()
    terminal.print(table)


@click.command(short_help="List the scenarios that come with hdsim.")
def examples() -> None:
    """List the scenarios that come with hdsim, to start from with ``hdsim new``."""
    from rich.table import Table

    from hdsim.scenario.examples import description
    from hdsim.scenario.examples import examples as shipped

    table = Table("example", "what it shows")
    for name, path in shipped().items():
        table.add_row(name, description(path))
    console().print(table)


@click.command(short_help="Copy an example, or begin an effect of your own.")
@click.argument("name", required=False, metavar="[EXAMPLE | effect]")
@click.argument("out", required=False, metavar="[FILE | NAME]")
@click.pass_context
def new(context: click.Context, name: str | None, out: str | None) -> None:
    """Copy an EXAMPLE to FILE [default: EXAMPLE.yaml], with what it extends and the schema for editors.

    Without EXAMPLE they are listed. `hdsim new effect NAME` writes the folder hdsim-NAME: a package that adds
    an effect to hdsim, with its test.
    """
    from hdsim.errors import InputError
    from hdsim.scenario.examples import copy

    if name is None:
        context.invoke(examples)
        return
    if name == "effect":
        from hdsim.scenario.effect_template import new_effect

        if out is None:
            raise InputError("hdsim new effect: expected a name, such as: hdsim new effect brake_drag")
        written = new_effect(out)
        for path in written:
            click.echo(f"wrote {path}")
        click.echo(f"next: pip install -e {written[0].parent}; pytest {written[0].parent}; hdsim effects")
        return
    written = copy(name, None if out is None else Path(out))
    for path in written:
        click.echo(f"wrote {path}")
    click.echo(f"next: hdsim check {written[0]}; hdsim run {written[0]}")
