"""The command ``run``."""

from __future__ import annotations

import math
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario
    from hdsim.simulation.run import Run


@click.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The log [default: logs/SCENARIO.mcap]."
)
@click.option("--plot/--no-plot", default=True, show_default=True, help="Draw the figure beside the log.")
@click.option("--verify/--no-verify", default=True, show_default=True, help="Check the log after the run.")
@click.option("--live", is_flag=True, help="Stream to viewers while it simulates (needs hdsim[live]).")
@click.option(
    "--speed",
    type=click.FloatRange(1e-4, 1e4),
    default=1.0,
    show_default=True,
    help="Of --live, to real time.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8765,
    show_default=True,
    help="Of --live; 0: any free one.",
)
def run(
    scenario: Path, output: Path | None, plot: bool, verify: bool, live: bool, speed: float, port: int
) -> int:
    """Simulate SCENARIO, write its log, and draw its figure."""
    import hdsim
    from hdsim.errors import InputError

    loaded = hdsim.load_scenario(scenario)
    path = Path("logs") / f"{scenario.stem}.mcap" if output is None else output
    if path.suffix != ".mcap":
        raise InputError(f"--output: found {path}, expected a file name that ends in .mcap")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path.parent}: cannot be made ({error.strerror})") from error

    from hdsim.scenario.doubts import doubts
    from hdsim.simulation.simulate import simulate_to_log

    for doubt in doubts(loaded):
        click.echo(f"{scenario}: warning: {doubt}", err=True)
    session = None
    if live:
        from hdsim.live.session import LiveRun

        session = LiveRun(loaded, speed=speed, port=port)
        click.echo(f"live     {session.address}")
    try:
        with progress(loaded.run.duration_s, f"{loaded.name}") as on_time:
            done = simulate_to_log(loaded, path, on_time=on_time, live=session)
        if session is not None:
            session.finish()
    finally:
        if session is not None:
            session.close()
    tell(done, loaded.run.duration_s)
    recording = hdsim.open_log(path)
    if "state" in recording.tables and len(recording.time) > 1:
        tell_numbers(recording, loaded)
    click.echo(f"log      {path}")
    if verify:
        from hdsim.log import verify_log

        report = verify_log(path)
        click.echo(f"verified {'yes' if report.ok else 'NO: ' + '; '.join(report.problems)}")
    if plot:
        picture = path.with_suffix(".png")
        try:
            recording.plot().savefig(picture)
            click.echo(f"picture  {picture}")
        except InputError as error:
            click.echo(f"picture  none: {error}")
    click.echo(f"replay   hdsim replay {shlex.quote(str(path))}")
    if done.failure:
        click.echo(f"error: the run stopped early: {done.failure}", err=True)
        return 1
    return 1 if done.audit.gave_back else 0


def tell(run: Run, duration_s: float) -> None:
    """Print what a run came to."""
    audit, work = run.audit, run.statistics
    reached = f"{duration_s:g} s" if run.reached_s is None else f"{run.reached_s:g} of {duration_s:g} s"
    click.echo(
        f"simulated {reached} in {work.steps} steps ({work.nfev} right-hand sides); energy audit: "
        f"residual {audit.residual:.2e} J of {audit.exchanged:.3g} J exchanged ({audit.relative:.1e})"
    )
    if audit.gave_back:
        click.echo(
            f"error: energy from nothing: {audit.gave_back} gave back {audit.given_back:.2e} J", err=True
        )


def tell_numbers(recording: Recording, scenario: Scenario) -> None:
    """Print the run's numbers beside what the drive may carry, and what happened that should not."""
    from rich.table import Table

    from hdsim.console import console
    from hdsim.studies.engineering import engineering_rows, told_events

    table = Table()
    table.add_column("quantity")
    table.add_column("value", justify="right")
    table.add_column("unit")
    table.add_column("limit", justify="right")
    table.add_column("held against")
    table.add_column("share", justify="right")
    last = ""
    for row in engineering_rows(recording.metrics(scenario)):
        if last and row.section != last:
            table.add_section()
        last = row.section
        value, unit = row.measured.value, row.measured.unit
        told = row.limit and not row.least and math.isfinite(value)
        share = f"{value / row.limit:.0%}" if row.limit and told else ""
        bad = row.holds is False
        table.add_row(
            row.name.replace("_", " "),
            "never" if math.isinf(value) else f"{value:.4g}",
            unit,
            "" if row.limit is None else f"{'≥' if row.least else '≤'} {row.limit:.5g}",
            row.of,
            share,
            style="bold red" if bad else None,
        )
    console().print(table)
    for event in told_events(recording.events):
        click.echo(f"{event.level}: {event.time:.4g} s, {event.source}: {event.message}", err=True)


class progress:  # noqa: N801 - used as a function
    """A progress bar over simulated time on a terminal, once time goes on; nothing elsewhere.

    Args:
        total: length of the run, s.
        title: what is running.
    """

    def __init__(self, total: float, title: str) -> None:
        self.total, self.title = total, title
        self._bar: Any = None

    def __enter__(self) -> Any:
        if not sys.stderr.isatty():
            return None
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.3g} of {task.total:.3g} s"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        task = self._bar.add_task(self.title, total=self.total)

        def reached(t: float) -> None:
            self._bar.start()  # not before: until then the terminal tells of what is compiled
            self._bar.update(task, completed=t)

        return reached

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()
