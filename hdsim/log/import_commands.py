"""The command ``import``."""

from __future__ import annotations

from pathlib import Path

import click

from hdsim.console import reading


@click.command(name="import")
@click.argument("data", type=click.Path(path_type=Path))
@click.option(
    "--mapping",
    type=click.Path(path_type=Path),
    help="YAML file with channel and unit of each column.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="The log [default: logs/DATA.mcap].")
def import_data(data: Path, mapping: Path | None, output: Path | None) -> None:
    """Turn the recording DATA (CSV, Excel, Parquet, MATLAB, HDF5, TDMS, MDF, MCAP, ROS) into a log."""
    from hdsim.errors import InputError
    from hdsim.log.importing import import_recording, write_imported

    path = Path("logs") / f"{data.stem}.mcap" if output is None else output
    if path.suffix != ".mcap":
        raise InputError(f"--output: found {path}, expected a file name that ends in .mcap")
    if path.exists() and data.exists() and path.samefile(data):
        raise InputError(f"--output: {path} is the file to be read")
    with reading(data) as tell:
        recording = import_recording(data, mapping, tell)
    write_imported(recording, path)
    time = recording.time
    click.echo(f"imported {len(time)} samples over {time[-1] - time[0]:.6g} s: {', '.join(recording)}")
    for event in recording.events:
        if event.source == "import" and not event.message.startswith("imported"):
            click.echo(f"note     {event.message}")
    click.echo(f"log      {path}")
