"""``hdsim diagnose``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
#: A ROS 2 bag is a folder.
_DATA = click.Path(exists=True, path_type=Path)


@click.command()
@click.argument("measured", nargs=-1, required=True, type=_DATA)
@click.option("--model", required=True, type=_FILE, help="Scenario of the model.")
@click.option("--mapping", type=_FILE, help="What the columns mean; a log of hdsim needs none.")
@click.option("--holdout", multiple=True, type=_DATA, help="Records that only the proof sees.")
@click.option(
    "--out", required=True, type=click.Path(file_okay=False, path_type=Path), help="Where to write."
)
@click.option(
    "--load",
    type=click.Choice(["scenario", "load_torque", "output_torque"]),
    help="Where the load's torque comes from [load_torque when measured, else scenario].",
)
@click.option("--force", is_flag=True, help="Go on in spite of errors in the data.")
def diagnose(
    measured: tuple[Path, ...],
    model: Path,
    mapping: Path | None,
    holdout: tuple[Path, ...],
    out: Path,
    load: Any,
    force: bool,
) -> int:
    """Find what a model is missing against measured records.

    Checks the data, compares, fits the model's own numbers, locates what is left, names effects of the
    catalogue, adds them, and proves it on data that no fit has seen.
    """
    import hdsim
    from hdsim.diagnose.workflow import diagnose as run
    from hdsim.estimate.records import record_from
    from hdsim.tell.findings import gather
    from hdsim.tell.save import save
    from hdsim.tell.staging import staged
    from hdsim.tell.terminal import Progress, show

    for path in holdout:
        if path.resolve() in {p.resolve() for p in measured}:
            raise hdsim.InputError(f"--holdout: {path} is also a measured record, which the fits see")
    scenario = hdsim.load_scenario(model)
    # Better known now than after the minutes of a diagnosis.
    with staged(out, keep=False):
        pass
    records, held = (
        [record_from(hdsim.import_recording(path, mapping), path.name) for path in paths]
        for paths in (measured, holdout)
    )
    with Progress() as tell:
        found = run(records, scenario, holdout=held, load=load, force=force, on_step=tell)
        tell("finding the next experiment, writing the report")
        told = gather(found)
        report = save(found, model, out, told)
    show(told)
    click.echo(f"report   {report}")
    if found.verdict.scenario:
        click.echo(f"scenario {found.verdict.scenario}")
    if found.verdict.next_experiment is not None and found.verdict.next_experiment.scenario:
        click.echo(f"next     {found.verdict.next_experiment.scenario}")
    return 0
