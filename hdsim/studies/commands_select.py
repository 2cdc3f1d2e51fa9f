"""The command ``select``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from hdsim.studies.selection import Choice, LoadCycle

#: Heading of each limit in the table.
_HEADINGS = {
    "average torque": "average",
    "average input speed": "average speed",
    "largest input speed": "largest speed",
    "repeated peak torque": "repeated peak",
    "momentary peak torque": "momentary peak",
    "momentary peaks": "stops",
    "ratcheting torque": "ratcheting",
    "buckling torque": "buckling",
    "bearing life L10": "life",
}


@click.command(short_help="Find the size that carries a load cycle.")
@click.argument("loadcycle", metavar="LOADCYCLE")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of the table.")
def select(loadcycle: str, as_json: bool) -> int:
    """Select gears for the torques and speeds of LOADCYCLE, by the makers' procedure.

    Prints the margin of each limit (allowed over required: 1 is just enough), and why a size is refused.
    Exit status 1 when none carries it.
    """
    from hdsim.studies.selection import load_cycle
    from hdsim.studies.selection import select as judge

    cycle = load_cycle(loadcycle)
    choices = judge(cycle)
    if as_json:
        click.echo(_json(cycle, choices))
    else:
        _print(cycle, choices)
    return 0 if any(choice.carries for choice in choices) else 1


def _json(cycle: LoadCycle, choices: list[Choice]) -> str:
    import json
    import math

    def number(value: float | None) -> float | None:
        return value if value is not None and math.isfinite(value) else None

    def limits(choice: Choice) -> list[dict[str, object]]:
        return [
            {
                "limit": check.name, "unit": check.unit, "asked": number(check.asked),
                "allowed": number(check.allowed), "margin": number(check.margin), "holds": check.holds,
                "source": check.source,
            }
            for check in choice.checks
        ]  # fmt: skip

    gears = [
        {"gear": c.gear.name, "carries": c.carries, "refusals": c.refusals, "limits": limits(c)}
        for c in choices
    ]
    return json.dumps(
        {"cycle": cycle.model_dump(mode="json"), "duty": _duty(cycle), "gears": gears}, indent=1
    )


def _duty(cycle: LoadCycle) -> dict[str, float]:
    duty = cycle.duty()
    return {
        "average_torque_nm": duty.average_torque_nm,
        "average_speed_rpm": duty.average_speed_rpm,
        "largest_torque_nm": duty.largest_torque_nm,
        "largest_speed_rpm": duty.largest_speed_rpm,
    }


def _print(cycle: LoadCycle, choices: list[Choice]) -> None:
    from rich.table import Table

    from hdsim.console import console

    duty = cycle.duty()
    click.echo(
        f"{cycle.name}: average torque {duty.average_torque_nm:.1f} N m, average speed "
        f"{duty.average_speed_rpm:.2f} rpm, largest torque {duty.largest_torque_nm:.4g} N m, largest speed "
        f"{duty.largest_speed_rpm:.4g} rpm, all at the output"
    )
    names = list(dict.fromkeys(check.name for choice in choices for check in choice.checks))
    table = Table(title="Allowed over asked, by gear", title_justify="left", title_style="bold")
    table.add_column("gear", no_wrap=True)
    for name in names:
        table.add_column(_HEADINGS[name], justify="right")
    table.add_column("carries it")
    for choice in choices:
        by_name = {check.name: check for check in choice.checks}
        cells = []
        for name in names:
            check = by_name.get(name)
            margin = None if check is None else check.margin
            text = "-" if margin is None else f"{margin:.2f}" if margin < 100 else ">99"
            cells.append(f"[bold red]{text}[/]" if check is not None and check.holds is False else text)
        table.add_row(choice.gear.name, *cells, "[green]yes[/]" if choice.carries else "[bold red]NO[/]")
    console().print(table)
    for choice in choices:
        if not choice.carries:
            click.echo(f"{choice.gear.name}: {'; '.join(choice.refusals)}")
    if any(check.allowed is None for choice in choices for check in choice.checks):
        click.echo("-: no source gives this limit, so it was not asked for")
    smallest: dict[tuple[str, int], str] = {}
    for choice in choices:
        if choice.carries:
            smallest.setdefault((choice.gear.series, choice.gear.ratio), choice.gear.name)
    click.echo(f"smallest that carries it: {', '.join(smallest.values())}" if smallest else "none carries it")
