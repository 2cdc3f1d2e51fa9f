"""The command ``linearize``."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hdsim.console import console

if TYPE_CHECKING:
    import control

    from hdsim.simulation.modes import Mode
    from hdsim.simulation.operating_point import OperatingPoint


@click.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option(
    "--load-torque-nm", type=float, help="Torque on the output [default: the scenario's at --time-s]."
)
@click.option("--motor-angle-rad", type=float, default=0.0, show_default=True, help="Motor angle.")
@click.option(
    "--motor-velocity-rad-per-s", type=float, default=0.0, show_default=True, help="Motor velocity."
)
@click.option(
    "--time-s", type=float, default=0.0, show_default=True, help="Time at which the load torque is read."
)
@click.option("--hold-motor", is_flag=True, help="Hold the motor; only the load torque is an input.")
@click.option("--closed-loop", is_flag=True, help="With the scenario's controller.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Draw the Bode plot into this file.")
@click.option("--json", "as_json", is_flag=True, help="Print matrices, modes and operating point as JSON.")
def linearize(
    scenario: Path,
    load_torque_nm: float | None,
    motor_angle_rad: float,
    motor_velocity_rad_per_s: float,
    time_s: float,
    hold_motor: bool,
    closed_loop: bool,
    output: Path | None,
    as_json: bool,
) -> None:
    """Linearise the drive of SCENARIO around a loaded operating point; list its modes."""
    import hdsim
    from hdsim.errors import InputError

    if hold_motor and closed_loop:
        raise InputError("--hold-motor and --closed-loop exclude each other: a held motor has no loop")
    loaded = hdsim.load_scenario(scenario)

    from hdsim.simulation import linear
    from hdsim.simulation.modes import modes

    point = linear.find_operating_point(
        loaded,
        time=time_s,
        load_torque_nm=load_torque_nm,
        motor_angle_rad=motor_angle_rad,
        motor_velocity_rad_per_s=motor_velocity_rad_per_s,
    )
    system = linear.linearize(loaded, operating_point=point, hold_motor=hold_motor)
    if closed_loop:
        system = linear.close_loop(loaded, system)
    found = modes(system)
    if as_json:
        click.echo(json_module.dumps(as_data(system, found, point), indent=1))
    else:
        tell(system, found, point, loaded.name)
    if output is not None:
        from hdsim.plot.bode import plot_bode
        from hdsim.plot.commands import save_figure

        kind = "motor held" if hold_motor else "closed loop" if closed_loop else "open loop"
        figure = plot_bode(
            system, title=f"{loaded.name}: frequency response", subtitle=f"{kind}, {about(point)}"
        )
        save_figure(figure, output, quiet=as_json)


def about(point: OperatingPoint) -> str:
    """The operating point in a line."""
    values = point.outputs
    return (
        f"load torque {point.load_torque:g} N m, motor torque {point.motor_torque:.4g} N m, "
        f"motor at {values['motor_angle']:g} rad and {values['motor_velocity']:g} rad/s, "
        f"transmission error {values['transmission_error'] * 206264.806:.4g} arcsec"
    )


def tell(system: control.StateSpace, found: list[Mode], point: OperatingPoint, name: str) -> None:
    """Print operating point and modes."""
    from rich.table import Table

    table = Table("mode", "Hz", "damping ratio", "pole (1/s)", "state that takes part most", "share")
    integrators = sum(mode.pole == 0 for mode in found)
    for mode in found:
        kind = "oscillation" if mode.oscillates else "integrator" if mode.pole == 0 else "decay"
        if mode.pole.real > 0:
            kind = f"unstable {kind}" if mode.oscillates else "unstable"
        table.add_row(
            kind,
            f"{mode.frequency_hz:.5g}" if mode.oscillates else "",
            f"{mode.damping_ratio:.4f}" if mode.oscillates else "",
            f"{mode.pole.real:.5g}" + (f" ± {mode.pole.imag:.5g}i" if mode.oscillates else ""),
            # Several integrators share one space, in which no state stands out.
            "" if mode.pole == 0 and integrators > 1 else mode.state,
            "" if mode.pole == 0 and integrators > 1 else f"{mode.participation:.2f}",
        )
    terminal = console()
    terminal.print(f"{name}: {about(point)}", highlight=False, markup=False)
    terminal.print(f"inputs {', '.join(system.input_labels)}", highlight=False, markup=False)
    terminal.print(f"outputs {', '.join(system.output_labels)}", highlight=False, markup=False)
    terminal.print(table)
    if not any(mode.oscillates for mode in found):
        terminal.print(
            "nothing oscillates: without load the output may float in the backlash (--load-torque-nm)"
        )


def as_data(system: control.StateSpace, found: list[Mode], point: OperatingPoint) -> dict[str, Any]:
    """Everything as plain data; SI units, complex poles as real and imaginary part."""
    return {
        "operating_point": {
            "time_s": point.time,
            "motor_torque_nm": point.motor_torque,
            "load_torque_nm": point.load_torque,
            "outputs": point.outputs,
        },
        "inputs": list(system.input_labels),
        "outputs": list(system.output_labels),
        "states": list(system.state_labels),
        "A": system.A.tolist(),
        "B": system.B.tolist(),
        "C": system.C.tolist(),
        "D": system.D.tolist(),
        "modes": [
            {
                "pole_per_s": [mode.pole.real, mode.pole.imag],
                "frequency_hz": mode.frequency_hz,
                "damping_ratio": None if mode.pole == 0 else mode.damping_ratio,
                "state": mode.state,
                "participation": mode.participation,
            }
            for mode in found
        ],
    }
