"""Commands about scenarios: ``check``, ``schema``, ``effects``, ``examples``, ``new``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdsim.console import console
from hdsim.scenario.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from pydantic import BaseModel


@click.command(short_help="Check scenarios and say what they describe.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check(files: tuple[str, ...]) -> None:
    """Check scenarios: one line for every mistake, or OK, what each describes, and what it hardly means."""
    from hdsim.scenario.doubts import doubts
    from hdsim.scenario.model import Scenario

    problems: list[Problem] = []
    for file in files:
        try:
            scenario = Scenario.from_yaml(file)
        except ScenarioError as error:
            problems += error.problems
        else:
            click.echo(f"{file}: OK\n{scenario.summary()}")
            for doubt in doubts(scenario):
                click.echo(f"{file}: warning: {doubt}", err=True)
    if problems:
        raise ScenarioError(problems)


@click.command(short_help="Print the JSON schema of scenarios, for editors.")
@click.argument("of", type=click.Choice(["scenario", "loadcycle"]), default="scenario")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write it to this file.")
def schema(of: str, output: Path | None) -> None:
    """Print the JSON schema (draft 2020-12) of scenarios, or of the load cycles of ``hdsim select``.

    An editor with the YAML language server completes and checks a file that begins with the line

    # yaml-language-server: $schema=hdsim.schema.json
    """
    import json

    from hdsim.errors import InputError
    from hdsim.scenario.model import Scenario
    from hdsim.scenario.schema import json_schema

    described: type[BaseModel] = Scenario
    if of == "loadcycle":
        from hdsim.study.selection import LoadCycle

        described = LoadCycle
    text = json.dumps(json_schema(described), indent=1)
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
