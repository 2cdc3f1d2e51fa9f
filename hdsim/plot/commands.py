"""The command ``plot``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The picture: .png, .svg or .pdf [default: LOG with .png].",
)
def plot(log: Path, output: Path | None) -> None:
    """Draw the one-page figure of LOG."""
    import hdsim

    picture = log.with_suffix(".png") if output is None else output
    save_figure(hdsim.open_log(log).plot(), picture)


def save_figure(figure: object, path: Path, *, quiet: bool = False) -> None:
    """Write a figure and, unless quiet, say where it went.

    Raises:
        InputError: the file cannot be written, or its ending names no format that matplotlib writes.
    """
    from hdsim.errors import InputError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)  # type: ignore[attr-defined]
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: the picture cannot be written ({error})") from error
    if not quiet:
        click.echo(f"picture  {path}")
