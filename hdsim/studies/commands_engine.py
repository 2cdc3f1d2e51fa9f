"""The commands ``study``, ``budget`` and ``tolerance``."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from hdsim.console import console

_workers = click.option(
    "--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes on this machine."
)
_output = click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Folder of table and picture [default: results]."
)
_scheduler = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="A Dask scheduler, such as tcp://host:8786, instead of processes here.",
)


@contextmanager
def counter(title: str) -> Iterator[Callable[[int, int], object] | None]:
    """A progress bar over runs with the time left, on a terminal; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns: list[Any] = [
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    ]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@click.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="STUDY.yaml")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Folder of the results [default: results/STUDY]."
)
@_workers
@_scheduler
@click.option(
    "--resume/--fresh",
    default=True,
    show_default=True,
    help="Continue a stopped study, or start again.",
)
def study(file: Path, output: Path | None, workers: int, scheduler: str | None, resume: bool) -> int:
    """Make every run of STUDY.yaml and write table, summary and figures.

    A study that was stopped continues where it was; its results are the same, and do not depend on the number
    of workers.
    """
    import time

    from hdsim.studies.engine.reading import load_study
    from hdsim.studies.engine.study import run_study, write_results
    from hdsim.studies.engine.summary import summarise

    plan = load_study(file)
    folder = Path("results") / file.stem if output is None else output
    started = time.perf_counter()
    with counter(plan.study.name) as on_progress:
        result = run_study(
            plan, folder, workers=workers, scheduler=scheduler, fresh=not resume, on_progress=on_progress
        )
    elapsed = time.perf_counter() - started
    failed = result.table.columns["status"].values.count("failed")
    kept = len(plan.runs) - result.made
    click.echo(
        f"{plan.study.name}: {len(plan.runs)} runs"
        + (f", {kept} of them from before" if kept else "")
        + (f", {result.made / elapsed:.3g} a second" if result.made else "")
        + (f", {failed} failed" if failed else "")
    )
    _tell_summary(summarise(plan, result.table), plan.study.confidence)
    for reason, count in _reasons(result.table.columns["reason"].values):
        click.echo(f"failed  {count} run(s): {reason}")
    written, troubles = write_results(result, folder)
    for path in written:
        click.echo(f"wrote   {path}")
    for trouble in troubles:
        click.echo(f"warning: {trouble}", err=True)
    return 0


def _reasons(reasons: list[str]) -> list[tuple[str, int]]:
    """The most frequent reasons, shortened."""
    from collections import Counter

    return Counter(reason[:160] for reason in reasons if reason).most_common(5)


def _tell_summary(summaries: list[Any], confidence: float) -> None:
    from rich.table import Table

    from hdsim.studies.engine.plots import words

    paired = any(s.pairs for s in summaries)
    several = any(s.runs > 1 for s in summaries)
    shown = Table("metric", "at")
    sure = f" ± {confidence:.0%}" if several else ""
    for column in ("runs", f"mean{sure}", *((f"less the first{sure}",) if paired else ())):
        shown.add_column(column, justify="right")
    for column in ("median", "5 % .. 95 %") if several and not paired else ():
        shown.add_column(column, justify="right")
    shown.add_column("unit")
    for s in summaries[:40]:
        runs = str(s.runs) + (f", {s.never} never" if s.never else "")
        row = [s.metric.replace("_", " "), words(s.point), runs, _with_interval(s.mean, ".5g")]
        if paired:
            row.append(_with_interval(s.difference, "+.4g") if s.pairs else "")
        elif several:
            row += [f"{s.median:.5g}", f"{s.low:.5g} .. {s.high.value:.5g}"]
        shown.add_row(*row, s.unit)
    console().print(shown)
    if len(summaries) > 40:
        click.echo(f"... and {len(summaries) - 40} more in summary.csv")
    if paired:
        click.echo("every row met the same drives, so differences are those of the stated values alone")
    if not several and any(s.point for s in summaries):
        click.echo("one drive a row: intervals need replicates (2 or more)")


def _with_interval(interval: Any, form: str) -> str:
    """A mean with the half-width of its interval, which is symmetric (Student's t)."""
    if math.isnan(interval.value):
        return "none"
    if math.isinf(interval.value):
        return "never"
    half = "" if math.isnan(interval.low) else f" ± {interval.high - interval.value:.2g}"
    return f"{interval.value:{form}}{half}"


@click.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--metric", help="Split this metric instead of the positioning error.")
@click.option(
    "--orders", type=click.IntRange(min=2), default=16, show_default=True,
    help="Orders drawn for the shares of more than six causes; fewer have exact shares.",
)  # fmt: skip
@_output
@_workers
@_scheduler
def budget(
    scenario: Path, metric: str | None, orders: int, output: Path | None, workers: int, scheduler: str | None
) -> None:
    """Split the positioning error of SCENARIO into its causes.

    Every combination of causes is run (of many causes: those that random orders go through). A cause's share
    is Shapley's: shares and rest sum to the whole, whatever their interaction.
    """
    import hdsim
    from hdsim.studies.engine.budget import error_budget
    from hdsim.studies.engine.budget_plot import plot_budget
    from hdsim.studies.engine.execute import executor

    loaded = hdsim.load_scenario(scenario)
    with executor(workers, scheduler) as (pool, width), counter("budget") as on_progress:
        found = error_budget(
            loaded, metric=metric, orders=orders, pool=pool, width=width, on_progress=on_progress
        )
    _tell_budget(found)
    stem = (Path("results") if output is None else output) / f"{scenario.stem}-budget"
    click.echo(f"wrote   {found.write_csv(stem.with_suffix('.csv'))}")
    plot_budget(found).savefig(stem.with_suffix(".png"))
    click.echo(f"wrote   {stem.with_suffix('.png')}")


def _tell_budget(found: Any) -> None:
    """Print a budget as a table, the largest cause first."""
    from rich.table import Table

    from hdsim.studies.engine.budget import POSITIONING

    unit, span = found.unit, found.whole - found.rest
    signed = found.error == POSITIONING and found.whole < 0
    where = " (the output stays behind its command: negative)" if signed else ""
    click.echo(f"{found.scenario}: {found.error.replace('_', ' ')} {abs(found.whole):.6g} {unit}{where}")
    if found.swing_arcsec:
        click.echo(
            f"warning: the output swings by {found.swing_arcsec:.3g} arcsec at rest; its mean is split",
            err=True,
        )
    table = Table("cause")
    for name in (f"share, {unit}", "of the whole", f"switched off, {unit}", f"alone, {unit}"):
        table.add_column(name, justify="right")
    for part in found.parts:
        error = part.share.standard_error
        table.add_row(
            part.cause.title,
            f"{part.share.value:+.4g}" + (f" ± {error:.2g}" if error else ""),
            f"{part.share.value / span:+.1%}" if span else "",
            f"{part.removed:+.4g}",
            f"{part.alone:+.4g}",
        )
    table.add_section()
    table.add_row("rest (all off)", *(f"{found.rest:+.4g}", "") + (f"{found.rest:+.4g}",) * 2)
    table.add_row("interaction", "", "", f"{found.interaction:+.4g}", f"{found.interaction_alone:+.4g}")
    table.add_row("whole", *(f"{found.whole:+.6g}", "") + (f"{found.whole:+.6g}",) * 2)
    console().print(table)
    how = f"{found.orders} random orders; ±: standard error" if found.orders else "all combinations"
    click.echo(f"share: Shapley, {how}, {found.runs} runs; shares and rest sum to the whole")
    click.echo("switched off, alone: one cause at a time; what they leave over is the interaction")


@click.command()
@click.argument("scenario")
@click.option("--metric", required=True, help="What must stay within the limit.")
@click.option("--limit", type=float, required=True, help="Largest allowed value of the metric, in its unit.")
@click.option(
    "--parameter", required=True, help="Dotted name of the parameter, as in drive.mesh.pitch_error_m."
)
@click.option(
    "--procedure",
    metavar="NAME",
    help="Put drive and effects of SCENARIO, or of a preset, on this bench test.",
)
@click.option(
    "--confidence", type=click.FloatRange(0.5, 1.0, max_open=True), default=0.95, show_default=True,
    help="Share of the drives that must meet the limit.",
)  # fmt: skip
@click.option(
    "--replicates", type=click.IntRange(min=1), default=20, show_default=True,
    help="Drives with other surfaces.",
)  # fmt: skip
@click.option(
    "--low", type=float, help="Lower end of the range [default: a hundredth of the scenario's value]."
)
@click.option(
    "--high", type=float, help="Upper end of the range [default: a hundred times the scenario's value]."
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True,
    help="Seed of the drives after the scenario's own.",
)  # fmt: skip
@_output
@_workers
@_scheduler
def tolerance(
    scenario: str,
    metric: str,
    limit: float,
    parameter: str,
    procedure: str | None,
    confidence: float,
    replicates: int,
    low: float | None,
    high: float | None,
    seed: int,
    output: Path | None,
    workers: int,
    scheduler: str | None,
) -> int:
    """Find the extreme value of a parameter of SCENARIO that still meets an accuracy.

    The runs are those of SCENARIO, or with --procedure a bench test of its drive (`hdsim bench --list`).
    """
    import hdsim
    from hdsim.studies.commands import benched
    from hdsim.studies.engine.definition import Base
    from hdsim.studies.engine.execute import executor
    from hdsim.studies.engine.tolerance import Probe, find_tolerance, plot_tolerance

    base: Any
    if procedure is None:
        base = hdsim.load_scenario(scenario)
    else:
        _, section, effects, run, _ = benched(scenario)
        base = Base(procedure=procedure, drive=section, effects=effects, run=run)

    def tell(probe: Probe) -> None:
        drives = len(probe.metric)
        within = f"{probe.passing:>6.1%} of drives within, quantile {probe.quantile:.4g}"
        click.echo(f"  {probe.value:<12.5g} {within if probe.given else f'no drive gives {metric}'}")
        for reason, count in probe.reasons[:3]:
            click.echo(f"  {'':<12} {count} of {drives} failed: {reason[:160]}")

    with executor(workers, scheduler) as (pool, width):
        found = find_tolerance(
            base, metric=metric, limit=limit, parameter=parameter, confidence=confidence,
            replicates=replicates, low=low, high=high, seed=seed, pool=pool, width=width, on_probe=tell,
        )  # fmt: skip
    what = f"{found.metric} <= {limit:g} {found.unit} for {confidence:.1%} of the drives"
    if found.value is None:
        click.echo(f"no value of {parameter} in the range meets {what}")
    else:
        more = " (the end of the range: all of it does)" if found.whole_range else ""
        click.echo(f"{parameter} = {found.value:.5g} {found.parameter_unit} still meets {what}{more}")
        click.echo(
            f"of all drives at least {found.yield_low:.1%} meet it there (Clopper-Pearson, "
            f"{confidence:.1%} confidence, {replicates} drives; more replicates raise this bound)"
        )
    stem = (Path("results") if output is None else output) / f"{Path(scenario).stem}-tolerance"
    click.echo(f"wrote   {found.write_csv(stem.with_suffix('.csv'))}")
    plot_tolerance(found).savefig(stem.with_suffix(".png"))
    click.echo(f"wrote   {stem.with_suffix('.png')}")
    return 0 if found.value is not None else 1
