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


def measured_options(command: F) -> F:
    """The argument and the options of a command that holds a model against measured records."""
    for option in reversed(
        (
            click.argument("measured", nargs=-1, required=True, type=_DATA),
            click.option("--model", required=True, type=_FILE, help="Scenario of the model."),
            click.option("--mapping", type=_FILE, help="What the columns mean; a log of hdsim needs none."),
            click.option("--holdout", multiple=True, type=_DATA, help="Records that only the proof sees."),
            click.option(
                "--out",
                required=True,
                type=click.Path(file_okay=False, path_type=Path),
                help="Where to write.",
            ),
            click.option(
                "--load",
                type=click.Choice(["scenario", "load_torque", "output_torque"]),
                help="Where the load's torque comes from [load_torque when measured, else scenario].",
            ),
            click.option(
                "--zeros",
                type=click.Choice(["campaign", "record", "trusted"]),
                default="campaign",
                help="Whether torque sensors have one zero in all records, in each, or none [campaign].",
            ),
            click.option("--force", is_flag=True, help="Go on in spite of errors in the data."),
            click.option(
                "--black-box",
                is_flag=True,
                help="Also say what boosted trees leave of the held-out data (hdsim[baseline]).",
            ),
        )
    ):
        command = option(command)
    return command


def opened(
    measured: tuple[Path, ...], holdout: tuple[Path, ...], mapping: Path | None, model: Path, out: Path
) -> tuple[Scenario, list[Record], list[Record]]:
    """The model, the records, and those that only the proof sees.

    Args:
        measured: files of the records.
        holdout: files of those that are held out.
        mapping: what the columns mean.
        model: file of the scenario.
        out: folder of the results: better known now than after minutes whether it can be written.

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
