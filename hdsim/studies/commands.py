"""The commands ``bench`` and ``presets``."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from hdsim.studies.bench.report import Line, Row


@click.command()
@click.argument("drive")
@click.option(
    "--only", multiple=True, metavar="NAME", help="Only this procedure; may be given several times."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder of the figures [default: bench/NAME].",
)
@click.option("--plot/--no-plot", default=True, show_default=True, help="Draw a figure of every procedure.")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the rough flanks.")
@click.option("--list", "listing", is_flag=True, is_eager=True, help="List the procedures and their metrics.")
def bench(
    drive: str, only: tuple[str, ...], output: Path | None, plot: bool, seed: int | None, listing: bool
) -> int:
    """Put DRIVE on the test bench: a preset's name, or a scenario whose drive and effects are taken.

    A preset is tested with kinematic error and torsional hysteresis on. Prints every figure beside the
    catalogue's line, if there is one.
    """
    from hdsim.studies.bench.report import figures_of, run_procedure
    from hdsim.studies.known_procedures import find_procedure, procedures

    chosen = [find_procedure(name) for name in only] or list(procedures().values())
    if listing:
        for one in chosen:
            click.echo(f"{one.name}: {one.title} ({one.source})")
            click.echo(f"    {', '.join(one.metrics)}")
        return 0
    name, section, effects, run, lines = benched(drive)
    if seed is not None:
        run["seed"] = seed
    folder = Path("bench") / name if output is None else output
    rows: list[Row] = []
    pictures: list[Path] = []
    with _progress() as on_time:
        for one in chosen:
            runs = run_procedure(one, section, effects=effects, run=run, on_time=on_time)
            rows += figures_of(one, runs, lines)
            if plot:
                pictures.append(_save(one.plot(runs), folder / f"{one.name}.png"))
    _print(rows, f"{name} on the test bench")
    for picture in pictures:
        click.echo(f"picture  {picture}")
    missed = [row.metric for row in rows if row.holds is False]
    if missed:
        click.echo(f"outside the catalogue's lines: {', '.join(missed)}", err=True)
    return 1 if missed else 0


@click.command()
@click.argument("name", required=False)
def presets(name: str | None) -> None:
    """List the drives that are ready to use, or what is printed about the gear called NAME.

    NAME is a preset, or a gear of which ratings alone are on record (csg-32-100, shg-20-100, csf-40-120).
    """
    from rich.table import Table

    from hdsim.console import console
    from hdsim.drive.parameters import Drive
    from hdsim.drive.presets import catalogue_figures, outside, preset_names
    from hdsim.drive.printed import Figure
    from hdsim.drive.printed_gear import printed_gear
    from hdsim.drive.ratings import ratings_of_preset
    from hdsim.errors import InputError

    if name is not None:
        limits = ratings_of_preset(name)
        try:
            figures = None if limits and name not in preset_names() else catalogue_figures(name)
        except ValueError as error:
            raise InputError(str(error)) from None
        table = Table(
            "quantity", "value", "seen", "source", title=f"Printed about {name}, SI units but rpm and h"
        )
        gear = printed_gear(limits.size, limits.ratio) if limits else {}
        if limits and limits.series == "shg":
            del gear["wave_generator_inertia"]  # the hat type's, with its hollow shaft, is another one
        printed = (vars(limits) if limits else {}) | gear | (vars(figures) if figures else {})
        for field, value in printed.items():
            if isinstance(value, Figure):
                table.add_row(
                    field.replace("_", " "),
                    f"{value.value:.4g}",
                    value.source.confidence,
                    value.source.citation,
                )
        for rpm, value in figures.running_torque if figures else ():
            table.add_row(
                f"running torque, {rpm:g} rpm",
                f"{value.value:.4g}",
                value.source.confidence,
                value.source.citation,
            )
        console().print(table)
        return
    columns = ("ratio", "rated torque, N m", "K1, N m/rad", "K3, N m/rad", "accuracy, arcmin")
    table = Table("preset", title="Presets")
    for column in columns:
        table.add_column(column, justify="right")
    for known in preset_names():
        figures = catalogue_figures(known)
        table.add_row(
            known,
            f"{figures.ratio:g}",
            f"{figures.rated_torque.value:g}",
            f"{figures.stiffness_k1.value:g}",
            f"{figures.stiffness_k3.value:g}",
            f"{figures.accuracy.value * 3437.7467707849396:.2g}",
        )
    for known, one in outside().items():
        try:
            drive = Drive.model_validate({"preset": known})
        except ValueError as error:
            raise InputError(f"preset {known} of {one.distribution}: {error}") from None
        k1, k3 = drive.torsion.stiffness_k1_nm_per_rad, drive.torsion.stiffness_k3_nm_per_rad
        table.add_row(
            f"{known} ({one.distribution})",
            f"{abs(drive.ratio):g}",
            f"{drive.rated_torque_nm:g}",
            f"{k1:g}",
            f"{k3:g}",
            "",
        )
    console().print(table)


def benched(given: str) -> tuple[str, dict[str, Any], dict[str, Any], dict[str, Any], dict[str, Line]]:
    """Name, sections ``drive`` and ``effects``, fields of ``run``, and the catalogue's lines.

    Raises:
        InputError: neither a preset nor a scenario that can be read.
    """
    from hdsim.drive.presets import catalogue_figures, outside, preset_names
    from hdsim.errors import InputError
    from hdsim.studies.bench.report import CATALOGUE_EFFECTS

    if given in (*preset_names(), *outside()):
        section = {"preset": given}
        return given, section, dict(CATALOGUE_EFFECTS), {}, _lines(given)
    path = Path(given)
    if not path.exists():
        try:
            catalogue_figures(given)
        except ValueError as error:
            raise InputError(f"DRIVE: found {given!r}, neither a file nor a preset: {error}") from None
    import hdsim

    scenario = hdsim.load_scenario(path)
    kept = ("method", "rtol", "atol", "max_step_s", "seed")
    run = {name: value for name in kept if (value := getattr(scenario.run, name)) is not None}
    preset = scenario.drive.preset
    lines = {} if preset is None else _lines(preset)
    effects = {name: effect.model_dump() for name, effect in scenario.effects.active().items()}
    return path.stem, scenario.drive.model_dump(), effects, run, lines


def _lines(preset: str) -> dict[str, Line]:
    """The catalogue's lines of a preset; none of those of other packages."""
    from hdsim.drive.presets import catalogue_figures, outside
    from hdsim.studies.bench.report import catalogue_lines

    return {} if preset in outside() else catalogue_lines(catalogue_figures(preset))


def _print(rows: list[Row], title: str) -> None:
    """The figures as a table."""
    from rich.table import Table

    from hdsim.console import console

    table = Table(title=title)
    table.add_column("test")
    table.add_column("figure")
    table.add_column("simulated", justify="right")
    table.add_column("catalogue", justify="right")
    table.add_column("unit")
    table.add_column("inside")
    last = ""
    for row in rows:
        if row.procedure != last and last:
            table.add_section()
        verdict = {None: "", True: "[green]yes[/]", False: "[bold red]NO[/]"}[row.holds]
        table.add_row(
            row.procedure if row.procedure != last else "",
            row.metric,
            row.problem or ("never" if math.isinf(row.value) else f"{row.value:.4g}"),
            "" if row.line is None else str(row.line),
            row.unit,
            verdict,
        )
        last = row.procedure
    console().print(table)


def _save(figure: Any, path: Path) -> Path:
    """Write a picture.

    Raises:
        InputError: the file cannot be written.
    """
    from hdsim.errors import InputError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
    except OSError as error:
        raise InputError(f"{path}: the picture cannot be written ({error.strerror})") from error
    return path


def _progress() -> AbstractContextManager[Callable[[str, float, float], object] | None]:
    """A bar over the simulated time of each run on a terminal; nothing elsewhere."""
    from contextlib import contextmanager

    @contextmanager
    def bar() -> Iterator[Callable[[str, float, float], object] | None]:
        if not sys.stderr.isatty():
            yield None
            return
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
            task = shown.add_task("")
            yield lambda label, t, end: shown.update(task, description=label, completed=t, total=end)

    return bar()


@click.command(short_help="Simulate a preset's catalogue lines; print both with the error.")
@click.argument("preset")
def catalogue(preset: str) -> int:
    """Measure every line that the catalogue prints of PRESET on the drive without further effects.

    Stiffness, friction, efficiency, resonance and tooth load, each beside the printed or analytic value with
    its error. Exit status 1 when one is outside its tolerance.
    """
    from rich.table import Table

    from hdsim.console import console
    from hdsim.studies.catalogue import catalogue_table

    lines = catalogue_table(preset)
    table = Table(title=f"{preset}: catalogue and simulation", title_justify="left", title_style="bold")
    for name in ("quantity", "catalogue", "simulated", "unit", "error", "allowed", "holds"):
        table.add_column(name, justify="left" if name in ("quantity", "unit", "holds") else "right")
    for line in lines:
        error, allowed = f"{100 * line.deviation:+.2f} %", f"{100 * line.tolerance:.0f} %"
        if line.absolute:
            error, allowed = f"{line.deviation:+.3f}", f"{line.tolerance:g}"
        holds = "yes" if line.holds else "NO"
        table.add_row(
            line.quantity, f"{line.catalogue:.4g}", f"{line.simulated:.4g}", line.unit, error, allowed, holds
        )
    console().print(table)
    sources = dict.fromkeys(line.source for line in lines)
    click.echo("Sources: " + "; ".join(sources))
    return 0 if all(line.holds for line in lines) else 1
