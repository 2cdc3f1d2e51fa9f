"""The command ``validate``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="Hold hdsim against printed, measured and independent values.")
@click.option("--only", multiple=True, metavar="PATTERN", help="Rows by name, wildcards allowed; repeatable.")
@click.option("--list", "listed", is_flag=True, help="List the names of the rows.")
@click.option(
    "--data",
    type=click.Path(path_type=Path),
    help="Folder with the measured records; docs/validation.md says where they are from. Without it their "
    "rows are absent.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of the table.")
@click.option("--markdown", is_flag=True, help="Print the table as Markdown.")
def validate(only: tuple[str, ...], listed: bool, data: Path | None, as_json: bool, markdown: bool) -> int:
    """Compare hdsim with what others have printed, measured or computed, in one table.

    Every row is computed when the command runs, with its source, its tolerance and where that comes from.
    Rows marked as having calibrated a parameter of the model only show that it reproduces them. A row that
    fails is shown as failing; exit status 1 when there is one.
    """
    from hdsim.console import console
    from hdsim.validate.report import print_rows, to_json, to_markdown
    from hdsim.validate.rows import Verdict
    from hdsim.validate.table import compute, names

    if listed:
        click.echo("\n".join(names()))
        return 0
    if as_json or markdown:
        rows = compute(only, data)
        click.echo(to_json(rows) if as_json else to_markdown(rows), nl=as_json)
    else:
        terminal = console()
        with terminal.status("computing") as status:
            rows = compute(only, data, lambda row: status.update(f"computed {row.name}"))
        print_rows(rows, terminal)
    return 1 if any(row.verdict == Verdict.FAILS for row in rows) else 0
