"""What ``hdsim diagnose`` and ``hdsim fit`` share: their options, and how the records are opened."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from hdsim.estimate.records import Record
    from hdsim.scenario import Scenario

F = TypeVar("F", bound=Callable[..., Any])

_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
#: A ROS 2 bag is a folder.
_DATA = click.Path(exists=True, path_type=Path)


def _in_threads(context: click.Context, _: click.Parameter, count: int | None) -> None:
    """Simulate in so many threads until the command has ended."""
    from hdsim.simulation.ensemble import in_threads

    if count is not None:
        context.with_resource(in_threads(count))


def measured_options(command: F) -> F:
    """The argument and the options of a command that compares a model with measured records."""
    for option in reversed(
        (
            click.argument("measured", nargs=-1, required=True, type=_DATA),
            click.option("--model", required=True, type=_FILE, help="Scenario of the model."),
            click.option(
                "--mapping", type=_FILE, help="Mapping of the file's columns; a log of hdsim needs none."
            ),
            click.option("--holdout", multiple=True, type=_DATA, help="Validation records, used in no fit."),
            click.option(
                "--out",
                required=True,
                type=click.Path(file_okay=False, path_type=Path),
                help="Folder of the results.",
            ),
            click.option(
                "--load",
                type=click.Choice(["scenario", "load_torque", "output_torque"]),
                help="Source of the load torque [load_torque when measured, else scenario].",
            ),
            click.option(
                "--zeros",
                type=click.Choice(["campaign", "record", "trusted"]),
                default="campaign",
                help="Whether torque sensors have one zero in all records, one in each, or none [campaign].",
            ),
            click.option("--force", is_flag=True, help="Continue in spite of errors in the data."),
            click.option(
                "--threads",
                type=click.IntRange(1),
                expose_value=False,
                callback=_in_threads,
                help="Simulations at the same time [one a core, up to 4]; the numbers are the same.",
            ),
            click.option(
                "--black-box",
                is_flag=True,
                help="Also fit gradient-boosted trees as a black-box baseline (hdsim[baseline]).",
            ),
            click.option(
                "--all-data",
                is_flag=True,
                help="After the validation, estimate the parameters from the held-out stretches too.",
            ),
        )
    ):
        command = option(command)
    return command


def opened(
    measured: tuple[Path, ...], holdout: tuple[Path, ...], mapping: Path | None, model: Path, out: Path
) -> tuple[Scenario, list[Record], list[Record]]:
    """The model, the records, and the validation records.

    Args:
        measured: files of the records.
        holdout: files of those that are held out.
        mapping: of the files' columns.
        model: file of the scenario.
        out: folder of the results; that it can be written is tested before the computation, not after.

    Raises:
        InputError: a record is both, a file cannot be read, or the folder cannot be written.
    """
    import hdsim
    from hdsim.console import reading
    from hdsim.estimate.records import record_from
    from hdsim.tell.staging import staged

    for path in holdout:
        if path.resolve() in {p.resolve() for p in measured}:
            raise hdsim.InputError(f"--holdout: {path} is also a measured record, which the fits see")
    scenario = hdsim.load_scenario(model)
    with staged(out, keep=False):
        pass

    def read(path: Path) -> Record:
        with reading(path) as tell:
            return record_from(hdsim.import_recording(path, mapping, tell), path.name)

    return scenario, [read(path) for path in measured], [read(path) for path in holdout]
