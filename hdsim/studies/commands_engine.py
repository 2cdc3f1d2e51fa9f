"""The commands ``study``, ``budget`` and ``tolerance``."""

from __future__ import annotations

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
    help="Go on where a stopped study was, or start again.",
)
def study(file: Path, output: Path | None, workers: int, scheduler: str | None, resume: bool) -> int:
    """Make every run of STUDY.yaml and write table, summary and pictures.

    A study that was stopped goes on where it was; its results are the same, and do not depend on the number
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

    shown = Table(
        "metric", "at", "runs", "mean", f"{confidence:.0%} interval", "median", "5 % .. 95 %", "unit"
    )
    for s in summaries[:40]:
        shown.add_row(
            s.metric, words(s.point), str(s.runs), f"{s.mean.value:.5g}",
            f"{s.mean.low:.5g} .. {s.mean.high:.5g}" if s.runs > 1 else "", f"{s.median:.5g}",
            f"{s.low:.5g} .. {s.high.value:.5g}" if s.runs > 1 else "", s.unit,
        )  # fmt: skip
    terminal = console()
    terminal.print(shown)
    if len(summaries) > 40:
        click.echo(f"... and {len(summaries) - 40} more in summary.csv")


@click.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--metric", help="Split this metric instead of the positioning error.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Folder of table and picture [default: results]."
)
@_workers
@_scheduler
def budget(
    scenario: Path, metric: str | None, output: Path | None, workers: int, scheduler: str | None
) -> None:
    """Split the positioning error of SCENARIO into its causes.

    Every cause is switched off alone, and on alone; what the causes do together is the interaction.
    """
    import hdsim
    from hdsim.studies.engine.budget import error_budget, plot_budget
    from hdsim.studies.engine.execute import executor

    loaded = hdsim.load_scenario(scenario)
    with executor(workers, scheduler) as (pool, _):
        found = error_budget(loaded, metric=metric, pool=pool)
    unit = found.unit
    click.echo(f"{found.scenario}: {found.error.replace('_', ' ')} {found.whole:.4g} {unit}")
    click.echo(f"  {'cause':<26}{'switched off':>14}{'alone':>12}  {unit}")
    for part in found.parts:
        click.echo(f"  {part.cause.title:<26}{part.removed:>14.4g}{part.alone:>12.4g}")
    click.echo(f"  {'rest (all off)':<26}{found.rest:>14.4g}{found.rest:>12.4g}")
    click.echo(f"  {'interaction':<26}{found.interaction:>14.4g}{found.interaction_alone:>12.4g}")
    click.echo(f"  {'whole':<26}{found.whole:>14.4g}{found.whole:>12.4g}")
    stem = (Path("results") if output is None else output) / f"{scenario.stem}-budget"
    click.echo(f"wrote   {found.write_csv(stem.with_suffix('.csv'))}")
    plot_budget(found).savefig(stem.with_suffix(".png"))
    click.echo(f"wrote   {stem.with_suffix('.png')}")


@click.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--metric", required=True, help="What must stay within the limit.")
@click.option("--limit", type=float, required=True, help="Largest allowed value of the metric, in its unit.")
@click.option(
    "--parameter", required=True, help="Dotted name of the parameter, as in drive.mesh.pitch_error_m."
)
@click.option(
    "--confidence", type=click.FloatRange(0.5, 1.0, max_open=True), default=0.95, show_default=True,
    help="Share of the drives that must meet the limit.",
)  # fmt: skip
@click.option(
    "--replicates",
    type=click.IntRange(min=1),
    default=20,
    show_default=True,
    help="Drives with other surfaces.",
)
@click.option(
    "--low", type=float, help="Lower end of the range [default: a hundredth of the scenario's value]."
)
@click.option(
    "--high", type=float, help="Upper end of the range [default: a hundred times the scenario's value]."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the drives.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Folder of table and picture [default: results]."
)
@_workers
@_scheduler
def tolerance(
    scenario: Path,
    metric: str,
    limit: float,
    parameter: str,
    confidence: float,
    replicates: int,
    low: float | None,
    high: float | None,
    seed: int,
    output: Path | None,
    workers: int,
    scheduler: str | None,
) -> int:
    """Find the extreme value of a parameter of SCENARIO that still meets an accuracy."""
    import hdsim
    from hdsim.studies.engine.execute import executor
    from hdsim.studies.engine.tolerance import Probe, find_tolerance, plot_tolerance

    loaded = hdsim.load_scenario(scenario)

    def tell(probe: Probe) -> None:
        click.echo(
            f"  {probe.value:<12.5g} {probe.passing:>6.1%} of drives within, quantile {probe.quantile:.4g}"
        )

    with executor(workers, scheduler) as (pool, width):
        found = find_tolerance(
            loaded, metric=metric, limit=limit, parameter=parameter, confidence=confidence,
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
    stem = (Path("results") if output is None else output) / f"{scenario.stem}-tolerance"
    click.echo(f"wrote   {found.write_csv(stem.with_suffix('.csv'))}")
    plot_tolerance(found).savefig(stem.with_suffix(".png"))
    click.echo(f"wrote   {stem.with_suffix('.png')}")
    return 0 if found.value is not None else 1
