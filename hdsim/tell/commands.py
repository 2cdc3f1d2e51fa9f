"""``hdsim diagnose``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from hdsim.tell.commands_shared import measured_options, opened


@click.command()
@measured_options
@click.option("--thorough", is_flag=True, help="Look for a third effect and more, however long that takes.")
def diagnose(
    measured: tuple[Path, ...],
    model: Path,
    mapping: Path | None,
    holdout: tuple[Path, ...],
    out: Path,
    load: Any,
    zeros: Any,
    force: bool,
    black_box: bool,
    all_data: bool,
    thorough: bool,
) -> int:
    """Find which physical effect a model is missing.

    Checks the data, compares them with the model, re-estimates the model's parameters, locates the residual,
    identifies effects of the catalogue, adds them to the model, and validates it on held-out data.
    """
    from hdsim.diagnosis.workflow import diagnose as run
    from hdsim.tell.findings import gather
    from hdsim.tell.save import save
    from hdsim.tell.terminal import Progress, show
    from hdsim.tell.words import NOT_FROM_ALL_DATA

    scenario, records, held = opened(measured, holdout, mapping, model, out)
    with Progress() as tell:
        found = run(
            records, scenario, holdout=held, load=load, zeros=zeros, force=force, black_box=black_box,
            thorough=thorough, all_data=all_data, on_step=tell,
        )  # fmt: skip
        tell("finding the next experiment, writing the report")
        told = gather(found)
        report = save(found, model, out, told)
    show(told)
    if all_data and found.verdict.estimated_from == "training":
        click.echo(NOT_FROM_ALL_DATA)
    click.echo(f"report   {report}")
    if found.verdict.scenario:
        click.echo(f"scenario {found.verdict.scenario}")
    if found.verdict.next_experiment is not None and found.verdict.next_experiment.scenario:
        click.echo(f"next     {found.verdict.next_experiment.scenario}")
    return 0
