"""``hdsim fit``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hdsim.tell.commands_shared import measured_options, opened

if TYPE_CHECKING:
    from hdsim.estimate.outcome import FitResult


@click.command()
@measured_options
@click.option(
    "--free", multiple=True, metavar="PATH", help="A parameter to be estimated; without it all declared ones."
)
@click.option("--fix", multiple=True, metavar="PATH", help="A parameter that stays fixed.")
@click.option(
    "--apart", multiple=True, metavar="PATH", help="A parameter of a group that is estimated by itself."
)
def fit(
    measured: tuple[Path, ...],
    model: Path,
    mapping: Path | None,
    holdout: tuple[Path, ...],
    free: tuple[str, ...],
    fix: tuple[str, ...],
    apart: tuple[str, ...],
    out: Path,
    load: Any,
    zeros: Any,
    force: bool,
    black_box: bool,
    all_data: bool,
) -> int:
    """Estimate a scenario's parameters from measured records.

    Gives every parameter with its 95 % confidence interval, or the parameters that it is confounded with.
    All records share the parameters, and the zeros of torque sensors (--zeros). PATH is a parameter's place
    in the scenario, such as drive.friction.coulomb_nm.
    """
    import hdsim
    from hdsim.estimate.outcome import result_of
    from hdsim.tell.fit_report import save_fit
    from hdsim.tell.terminal import Progress
    from hdsim.tell.words import NOT_FROM_ALL_DATA

    scenario, records, held = opened(measured, holdout, mapping, model, out)
    with Progress() as tell:
        found = hdsim.fit(
            records, scenario, holdout=held, free=free, fix=fix, apart=apart, load=load, zeros=zeros,
            force=force, black_box=black_box, all_data=all_data, on_step=tell,
        )  # fmt: skip
        tell("writing the report")
        page = save_fit(found, model, out)
    _show(result_of(found))
    if all_data and found.estimated_from == "training":
        click.echo(NOT_FROM_ALL_DATA)
    click.echo(f"report   {page}")
    click.echo(f"scenario {out / 'fitted.yaml'}")
    return 0


def _show(result: FitResult) -> None:
    """Print the estimates, the held-out residuals and what needs attention."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    from hdsim.console import console
    from hdsim.tell.beside import baselines
    from hdsim.tell.fit_report import GAP_HEAD, gap_rows, summary
    from hdsim.tell.words import FROM_ALL_DATA, named_number, shown

    out = console()
    out.print(Text(summary(result)), highlight=False)
    numbers = Table(box=SIMPLE_HEAD)
    for k, name in enumerate(("parameter", "unit", "model", "estimate", "95 % interval")):
        numbers.add_column(name, justify="right" if k in (2, 3) else "left")
    for path, number in result.numbers.items():
        if number.interval is not None:
            told = f"{shown(number.interval[0])} to {shown(number.interval[1])}"
            told += " (from the prior)" if number.tied_to else ""
        else:
            told = "not identifiable"
            told += (
                f", confounded with {'; '.join(named_number(n)[0] for n in number.tied_to)}"
                if number.tied_to
                else ""
            )
        words, unit = named_number(path)
        start = "" if number.start is None else shown(number.start)
        style = "bold" if path in result.moved else ""
        numbers.add_row(words, unit, start, shown(number.value), told, style=style)
    out.print(numbers)
    if result.estimated_from == "all":
        out.print(Text(FROM_ALL_DATA), highlight=False)
    gaps = Table(box=SIMPLE_HEAD, title="RMS residual on held-out data", title_justify="left")
    for name in GAP_HEAD:
        gaps.add_column(name, justify="left" if name in GAP_HEAD[:2] else "right")
    for row in gap_rows(result):
        gaps.add_row(*row)
    out.print(gaps)
    for said in baselines(result.gap):
        out.print(Text(said), highlight=False)
    for problem in result.data_problems:
        if problem.severity != "info":
            said = f"{problem.severity}: {problem.record}: {problem.channel}: {problem.message}"
            out.print(Text(said, style="yellow"), highlight=False)
