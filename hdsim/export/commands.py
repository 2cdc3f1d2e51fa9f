"""The command ``export``."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

#: Endings of what is made of a log, of a scenario as an FMU, and as a model for MuJoCo.
LOGS, FMU, MUJOCO = (".csv", ".parquet", ".mcap"), ".fmu", ".xml"
#: Options by the endings that they belong to.
_OF = {"table": LOGS, "fmi": (FMU,), "motor": (FMU,), "output": (FMU,)}


@click.command()
@click.argument("source", metavar="SOURCE", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--table", default="state", show_default=True, help="Of a log: the table to write.")
@click.option(
    "--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Of an FMU: version."
)
@click.option(
    "--motor",
    type=click.Choice(["torque", "angle", "velocity", "motion"]),
    help="Of an FMU: what drives the motor [default: as in the scenario].",
)
@click.option(
    "--output",
    type=click.Choice(["torque", "motion"]),
    help="Of an FMU: what acts on the output [default: as in the scenario].",
)
@click.pass_context
def export(
    context: click.Context,
    source: Path,
    out: Path,
    table: str,
    fmi: str,
    motor: str | None,
    output: str | None,
) -> None:
    """Write a log or a scenario for other programs; the ending of OUT says what.

    A log: .csv or .parquet, one of its tables; .mcap, its joint states as a ROS 2 bag. A scenario: .fmu, its
    joint for co-simulation; .xml, its joint for MuJoCo.
    """
    from hdsim.errors import InputError

    for name, endings in _OF.items():
        given = context.get_parameter_source(name) is not ParameterSource.DEFAULT
        if given and out.suffix in (*LOGS, FMU, MUJOCO) and out.suffix not in endings:
            raise InputError(f"--{name} belongs to {', '.join(endings)}; found {out}")
    if out.suffix == FMU:
        import hdsim
        from hdsim.export.fmu import export_fmu

        scenario = hdsim.load_scenario(source)
        click.echo(export_fmu(scenario, out, fmi=int(fmi), motor=motor, output=output))  # type: ignore[arg-type]
    elif out.suffix == MUJOCO:
        from rich.table import Table

        import hdsim
        from hdsim.console import console
        from hdsim.export.mujoco import export_mujoco

        lost = export_mujoco(hdsim.load_scenario(source), out)
        table_of = Table(
            "not as in the scenario", "in the file", "torque differs, rms", "with hdsim.export.mujoco.Rest"
        )
        for one in lost:
            back = "as in the scenario" if one.by_callback else "as in the file"
            table_of.add_row(one.what, one.instead, one.figure, back)
        console().print(table_of)
        click.echo(out)
    elif out.suffix in LOGS:
        from hdsim.log.export import export_log

        click.echo(export_log(source, out, table))
    else:
        raise InputError(f"{out} has the ending {out.suffix!r}; allowed: {', '.join((*LOGS, FMU, MUJOCO))}")
