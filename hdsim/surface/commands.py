"""The command ``surface``: D and G of a measured flank."""

from __future__ import annotations

from pathlib import Path

import click

from hdsim.console import console


@click.command(short_help="Find D and G of a measured flank.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--spacing-um", type=click.FloatRange(min=0, min_open=True), help="Distance of points, um.")
@click.option("--unit", help="Unit of the file's values: m, mm, um (default for text), nm.")
@click.option("--columns", is_flag=True, help="Profiles run down the columns of a map.")
@click.option(
    "--min-lag-um", type=click.FloatRange(min=0, min_open=True), help="Shortest lag of the fit, um."
)
@click.option("--max-lag-um", type=click.FloatRange(min=0, min_open=True), help="Longest lag of the fit, um.")
@click.option("--noise", default="none", help="none, fit, or the instrument's noise in nm rms.")
@click.option("--detrend", type=click.Choice(["none", "mean", "line"]), default="line", show_default=True)
@click.option("--lateral-resolution-um", type=click.FloatRange(min=0), default=0.0, help="For the warnings.")
@click.option("--height-resolution-nm", type=click.FloatRange(min=0), default=0.0, help="For the warnings.")
@click.option("--figure", type=click.Path(path_type=Path), help="Write the fit and its residuals here.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of the table.")
def surface(
    file: Path,
    spacing_um: float | None,
    unit: str | None,
    columns: bool,
    min_lag_um: float | None,
    max_lag_um: float | None,
    noise: str,
    detrend: str,
    lateral_resolution_um: float,
    height_resolution_nm: float,
    figure: Path | None,
    as_json: bool,
) -> None:
    """Find the fractal dimension D and roughness G of a measured flank from its structure function.

    FILE is plain text (heights; positions and heights; or a map) or what a profilometer writes.
    """
    import json
    from typing import Any

    from hdsim.errors import InputError
    from hdsim.surface.files import read_heights
    from hdsim.surface.identify import identify

    data = read_heights(file, spacing_m=spacing_um and spacing_um * 1e-6, unit=unit, columns=columns)
    low = min_lag_um * 1e-6 if min_lag_um else data.spacing_m
    share = 40 if noise == "none" else 10
    high = max_lag_um * 1e-6 if max_lag_um else data.heights_m.shape[1] * data.spacing_m / share
    options: dict[str, Any] = {"noise": _noise(noise), "detrend": detrend}
    found = identify(
        data.heights_m,
        data.spacing_m,
        lags_m=(low, high),
        lateral_resolution_m=lateral_resolution_um * 1e-6,
        height_resolution_m=height_resolution_nm * 1e-9,
        **options,
    )
    if as_json:
        curves = ("lags_m", "structure_m2", "fitted_m2")
        report = {"source": data.source} | {
            name: value.tolist() if name in curves else value for name, value in vars(found).items()
        }
        click.echo(json.dumps(report, indent=1))
    else:
        _print(found, data.source, data.heights_m.shape, data.spacing_m)
    if figure is not None:
        from hdsim.surface.figure import plot_identification

        try:
            plot_identification(found, data.source).savefig(figure, dpi=150)
        except (OSError, ValueError) as error:
            raise InputError(f"{figure}: cannot be written ({error})") from None
        click.echo(f"wrote {figure}", err=as_json)


def _noise(text: str) -> float | str:
    """``none``, ``fit``, or metres."""
    from hdsim.errors import InputError

    if text in ("none", "fit"):
        return text
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < 1e6:
        raise InputError(f"--noise: expected none, fit or a noise in nm rms, found {text!r}")
    return value * 1e-9


def _print(found: object, source: str, shape: tuple[int, ...], spacing_m: float) -> None:
    """The identification as a table, warnings after it."""
    from typing import cast

    from rich.table import Table

    from hdsim.surface.identify import Identification

    result = cast(Identification, found)
    table = Table(title=f"{source}: {shape[0]} profiles of {shape[1]} points, {spacing_m * 1e6:.4g} um apart")
    for name, justify in (("quantity", "left"), ("value", "right"), ("95 % interval", "left")):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    low, high = result.D_interval
    table.add_row("fractal dimension D", f"{result.D:.4f}", f"{low:.4f} .. {high:.4f}")
    low, high = result.G_interval_m
    table.add_row("fractal roughness G", f"{result.G_m:.3e} m", f"{low:.2e} .. {high:.2e} m")
    table.add_row("G with Eq. 18 as printed", f"{result.G_printed_m:.3e} m", "")
    first, last = result.lags_m[0] * 1e6, result.lags_m[-1] * 1e6
    table.add_row("lags of the fit", f"{first:.4g} .. {last:.4g} um", f"{len(result.lags_m)} lags")
    table.add_row("Sa, Sq", f"{result.Sa_m * 1e6:.4g}, {result.Sq_m * 1e6:.4g} um", "after form removal")
    if result.noise_rms_m:
        table.add_row(
            "noise", f"{result.noise_rms_m * 1e9:.1f} nm rms", f"{100 * result.noise_share:.0f} % of S"
        )
    terminal = console()
    terminal.print(table)
    for warning in result.warnings:
        terminal.print(f"warning: {warning}", style="yellow", markup=False)
