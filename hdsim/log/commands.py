"""Commands around logs: info, export, verify, recover."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdsim.console import console

if TYPE_CHECKING:
    from rich.table import Table

    from hdsim.log.naming import ColumnSpec

_LOG = click.argument("log", type=click.Path(path_type=Path))


def _table(title: str, *columns: str, right: tuple[str, ...] = ()) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    for column in columns:
        table.add_column(column, justify="right" if column in right else "left", overflow="fold")
    return table


def _per_row(column: ColumnSpec) -> str:
    return " x ".join(map(str, column.shape)) if column.shape else "1"


@click.command()
@_LOG
@click.option("--columns/--no-columns", default=True, help="List the columns of each table.")
def info(log: Path, columns: bool) -> None:
    """Show what is in LOG: run, topics, tables with units, attachments."""
    from hdsim.log.info import info_log
    from hdsim.log.naming import TABLE_RECORD

    about = info_log(log)
    terminal = console()
    terminal.print(
        f"{log}: {about.size / 1e6:.3g} MB, {sum(about.messages.values())} messages in "
        f"{about.chunks} chunks, {about.start:g} s to {about.start + about.duration:g} s, "
        f"written by {about.library}",
        highlight=False,
        markup=False,
    )
    topics = _table("Topics", "topic", "type", "messages", right=("messages",))
    for topic, count in about.messages.items():
        topics.add_row(topic, about.message_types[topic], str(count))
    terminal.print(topics)
    if columns:
        for name, specs in about.tables.items():
            table = _table(f"Table {name}", "column", "unit", "a row", "description", right=("a row",))
            for spec in specs:
                table.add_row(spec.name, spec.unit, _per_row(spec), spec.description)
            terminal.print(table)
    metadata = _table("Metadata", "record", "name", "text")
    for record, values in about.metadata.items():
        if not record.startswith(TABLE_RECORD):
            for key, value in values.items():
                first, *rest = value.splitlines() or [""]
                text = f"{first} ... ({len(rest) + 1} lines)" if rest else first
                metadata.add_row(record, key, text)
    terminal.print(metadata)
    attachments = _table("Attachments", "name", "bytes", right=("bytes",))
    for name, size in about.attachments.items():
        attachments.add_row(name, str(size))
    terminal.print(attachments)


@click.command()
@_LOG
def verify(log: Path) -> None:
    """Check every CRC, index, schema and message of LOG; exit code 1 if anything is wrong."""
    from hdsim.log.check import verify_log

    report = verify_log(log)
    terminal = console()
    topics = _table(str(log), "topic", "type", "messages", right=("messages",))
    for topic in report.topics.values():
        topics.add_row(topic.topic, topic.message_type, str(topic.messages))
    terminal.print(topics)
    for problem in report.problems:
        terminal.print(f"problem: {problem}", style="red", highlight=False, markup=False)
    if not report.ok:
        raise click.exceptions.Exit(1)
    terminal.print(
        f"sound: {report.messages} messages in {report.chunks} chunks, "
        f"{len(report.attachments)} attachments, {len(report.metadata)} metadata records",
        highlight=False,
    )


@click.command()
@_LOG
@click.argument("out", type=click.Path(path_type=Path), required=False)
def recover(log: Path, out: Path | None) -> None:
    """Save everything whole in a damaged LOG, or the .partial of a killed run, to OUT.

    Without OUT, run.mcap.partial becomes run.mcap if there is none yet, and else run-recovered.mcap.
    """
    from hdsim.log.recovery import recover_log

    if out is None:
        whole = log.with_suffix("") if log.suffix == ".partial" else log
        out = whole if whole != log and not whole.exists() else whole.with_stem(whole.stem + "-recovered")
    report = recover_log(log, out)
    terminal = console()
    topics = _table(f"{out}: {report.chunks} whole chunks", "topic", "messages", right=("messages",))
    for topic, count in report.messages.items():
        topics.add_row(topic, str(count))
    terminal.print(topics)
    for lost in report.lost:
        terminal.print(f"lost: {lost}", style="yellow", highlight=False, markup=False)


@click.command()
@click.argument("name", required=False)
@click.option("--log", type=click.Path(path_type=Path), help="Fit the layout to this log.")
def layout(name: str | None, log: Path | None) -> None:
    """Print the layout NAME as JSON for the viewer; without NAME, list the layouts.

    With --log it leaves out what the log does not have, and plays at a speed that suits the run's length.
    """
    import hdsim.log.layout as layouts

    if name is None:
        for known, build in layouts.LAYOUTS.items():
            click.echo(f"{known:20}{(build.__doc__ or '').splitlines()[0]}")
        return
    if log is None:
        click.echo(layouts.to_json(layouts.build_layout(name)), nl=False)
        return
    from hdsim.log.info import info_log

    about = info_log(log)
    made = layouts.build_layout(
        name, topics=about.fields, duration=about.duration, drive_radius=about.drive_radius, facts=about.facts
    )
    click.echo(layouts.to_json(made), nl=False)
