"""The command ``mapping``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdsim.console import console, reading

if TYPE_CHECKING:
    from hdsim.log.guess.findings import Draft, Ground


@click.command(short_help="Draft a mapping of a measured recording.")
@click.argument("data", type=click.Path(path_type=Path), metavar="FILE")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("mapping.yaml"),
    show_default=True,
    help="File of the mapping.",
)
@click.option(
    "--base",
    type=click.Path(path_type=Path),
    default=Path("base.yaml"),
    show_default=True,
    help="File of the base scenario.",
)
@click.option("--axis", type=int, help="Number of the axis, in a file with several.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE",
              help="Give what the file leaves open: ratio=100, time.unit=ms, COLUMN.channel=motor_angle, "
                   "COLUMN.unit=deg, COLUMN.torque_constant_nm_per_a=0.1. Repeatable.")  # fmt: skip
@click.option("--decimal", type=click.Choice([".", ","]), help="Decimal mark, where the file leaves it open.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def mapping(
    data: Path,
    output: Path,
    base: Path,
    axis: int | None,
    settings: tuple[str, ...],
    decimal: str | None,
    force: bool,
) -> int:
    """Draft a mapping of the recording FILE (channel and unit of each column), and a base scenario.

    Each key of the mapping has its reason in a comment. On a terminal, keys that the file leaves open are
    asked for; otherwise they stay comments in the mapping, are listed, and the exit status is 1.
    """
    from hdsim.errors import InputError
    from hdsim.log.guess.base import base_scenario
    from hdsim.log.guess.draft import draft
    from hdsim.log.guess.text import to_text
    from hdsim.log.mapping import Form

    for path in (output, base):
        if path.exists() and (not force or (data.exists() and path.samefile(data))):
            raise InputError(f"{path}: there is a file already; name another one, or --force")
        if not path.parent.is_dir():
            raise InputError(f"{path}: no such folder: {path.parent}")
    said = dict(_pair(setting) for setting in settings)
    form = Form.model_validate({"decimal": decimal})
    with reading(data) as tell:
        found = draft(data, said, axis, form, tell)
    while answers := _asked(found, said):
        try:
            found = draft(data, said | answers, axis, form)
        except InputError as error:
            click.echo(f"error: {error}", err=True)
        else:
            said |= answers
    scenario = base_scenario(found)
    for path, text in ((output, to_text(found, form)), (base, scenario)):
        if text is None:
            continue
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    _show(found)
    click.echo(f"mapping  {output}")
    click.echo(
        f"base     {base}"
        if scenario is not None
        else "base     none: it needs the ratio of a harmonic drive"
    )
    for question in found.open:
        click.echo(f"open: {question}", err=True)
    return 1 if found.open else 0


def _pair(setting: str) -> tuple[str, str]:
    from hdsim.errors import InputError

    key, equals, value = setting.partition("=")
    if not equals or not key or not value:
        raise InputError(f"--set: found {setting!r}, expected KEY=VALUE")
    return key.strip(), value.strip()


def _asked(found: Draft, said: dict[str, str]) -> dict[str, str]:
    """Ask for what is open, on a terminal; what has been answered, by key."""
    import sys

    answers = {}
    if sys.stdin.isatty() and sys.stderr.isatty():
        for question in found.open:
            if question.key and question.key not in said and "COLUMN" not in question.key:
                text = question.text[:1].upper() + question.text[1:]
                words = f"{text} (for example {question.example}; - leaves it open)"
                answer = click.prompt(words, default="-", show_default=False, err=True).strip()
                if answer != "-":
                    answers[question.key] = answer
    return answers


def _show(found: Draft) -> None:
    from rich.markup import escape
    from rich.table import Table

    from hdsim.log.guess.findings import Ground

    colours = {Ground.ASSUMED: "dark_orange", Ground.OPEN: "bold red"}
    table = Table("key", "value", "ground", "reason", title="; ".join(found.notes), title_justify="left",
                  title_style="", box=None, pad_edge=False)  # fmt: skip
    rows = [("ratio", found.ratio)] if found.ratio is not None else []
    rows += [(f"time {key}", answer) for key, answer in found.time.items()]
    for key, answer in rows:
        table.add_row(key, _value(answer.value), _coloured(answer.ground, colours), escape(answer.why))
    for name, channel in found.channels.items():
        table.add_row(
            name, escape(channel.source.label), _coloured(channel.ground, colours), escape(channel.why)
        )
        for key, answer in channel.keys.items():
            table.add_row(
                f"  {key}", _value(answer.value), _coloured(answer.ground, colours), escape(answer.why)
            )
    for mask in found.masks:
        table.add_row(f"mask {mask.value['channels'][0]}", "outliers", str(mask.ground), escape(mask.why))
    console().print(table)


def _value(value: object) -> str:
    from rich.markup import escape

    return "?" if value is None else f"{value:.9g}" if isinstance(value, float) else escape(str(value))


def _coloured(ground: Ground, colours: dict[Ground, str]) -> str:
    colour = colours.get(ground)
    return f"[{colour}]{ground}[/]" if colour else str(ground)
