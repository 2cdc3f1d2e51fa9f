"""The command ``reproduce``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="Recompute every number of the source paper.")
@click.option("--only", multiple=True, metavar="PATTERN", help="Rows by name, wildcards allowed; repeatable.")
@click.option("--list", "listed", is_flag=True, help="List the names of the rows.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write the report into this folder.")
@click.option(
    "--format",
    "forms",
    type=click.Choice(["json", "markdown", "html"]),
    multiple=True,
    help="Form of the report; repeatable. Default: html.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of the list.")
def reproduce(
    only: tuple[str, ...], listed: bool, output: Path | None, forms: tuple[str, ...], as_json: bool
) -> None:
    """Recompute every table, figure and printed number of Zhang et al. (2021), and judge each.

    reproduced: follows from the paper's equations; with a stated choice: once something is fixed that it does
    not state. contradicted: does not follow, with the correction beside it. not determined by the paper: it
    leaves something open.
    """
    from hdsim.reproduce.checks import compute, names
    from hdsim.reproduce.report import print_rows, to_json, write

    if listed:
        click.echo("\n".join(names()))
        return
    rows = compute(only)
    if as_json:
        click.echo(to_json(rows))
    else:
        print_rows(rows)
    if output is not None:
        for form in forms or ("html",):
            for file in write(rows, output, form):
                click.echo(f"wrote {file}", err=as_json)
