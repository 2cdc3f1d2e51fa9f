"""Rows about motion: limit cycles over play, stick and slip, resonance, orders of the transmission error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hdsim.validate.rows import Row, check

_LOOP = "position loop over 6 arcmin of play, limit cycle"
_GELB = "harmonic balance with describing functions, Gelb and Vander Velde 1968"
_PEERS = {
    "scipy": (
        "own ODE with Modelica's ElastoBacklash, SciPy LSODA at 1e-9",
        2e-3,
        "hdsim's rtol 1e-7 and 4 kHz",
    ),
    "mujoco": ("MuJoCo, RK4 at 25 µs, the same contact", 2e-3, "hdsim's rtol 1e-7 and 4 kHz"),
    "balance": (_GELB, 0.10, "harmonics are neglected (estimate)"),
}


_REMARKS = {"balance": "SciPy and MuJoCo, which keep the harmonics, agree with hdsim"}


@cache
def _own_cycle() -> tuple[float, float]:
    from hdsim.validate import play

    return play.cycle(*play.with_hdsim())


@check(*(f"limit-cycle-{peer}-{what}" for peer in _PEERS for what in ("amplitude", "frequency")))
def limit_cycles(_data: Path | None) -> Iterator[Row]:
    """Amplitude and frequency against each of three other ways."""
    from hdsim.validate import play

    own = _own_cycle()
    for peer, (source, tolerance, because) in _PEERS.items():
        absent = peer == "mujoco" and find_spec("mujoco") is None
        if absent:
            stated = (math.nan, math.nan)
        elif peer == "balance":
            stated = play.harmonic_balance()
        else:
            stated = play.cycle(*(play.with_scipy() if peer == "scipy" else play.with_mujoco()))
        for what, unit, theirs, ours in zip(
            ("amplitude", "frequency"), ("arcsec", "Hz"), stated, own, strict=True
        ):
            yield Row(
                f"limit-cycle-{peer}-{what}", f"{_LOOP}, {what}", unit, source, theirs,
                math.nan if absent else ours, tolerance, because,
                remark="MuJoCo is not installed (group dev)" if absent else _REMARKS.get(peer, ""),
            )  # fmt: skip


@check("stick-slip")
def stick_slip(_data: Path | None) -> Iterator[Row]:
    """Where a motor stands after 1.5 s of a torque that is above its friction now and then."""
    from hdsim.scenario import Scenario
    from hdsim.simulation.setup import build_run
    from hdsim.validate.stiction import exact_stiction

    data: dict[str, Any] = {
        "drive": {
            "preset": "seed-2021",
            "mesh": {"model": "rigid"},
            "friction": {"coulomb_nm": 0.03, "viscous_nm_s_per_rad": 1e-3, "load_coefficient": 0.0},
        },
        "command": {
            "motor": {
                "type": "torque",
                "torque": {"type": "sine", "amplitude_nm": 0.045, "frequency_hz": 2.0},
            }
        },
        "load": {"inertia_kg_m2": 0.5},
        "run": {"duration_s": 1.5, "sample_rate_hz": 1000},
    }
    run = build_run(Scenario.model_validate(data))
    found = run.record()
    inertia = run.model.inertias[0] + run.model.inertias[2] / run.model.ratio**2
    _, angle, stuck = exact_stiction(lambda t: 0.045 * np.sin(4 * np.pi * t), 1.5, 0.03, 1e-3, inertia)
    worst = int(np.argmax(np.abs(found["motor_angle"] - angle)))
    yield Row(
        "stick-slip", "motor angle under stick and slip, largest deviation", "rad",
        "exact stiction from event to event, SciPy RK45 at 1e-10", float(angle[worst]),
        float(found["motor_angle"][worst]), 1e-4 * float(np.ptp(angle)),
        "1e-4 of the travel, the run's rtol", relative=False,
        remark=f"stuck for {100 * stuck:.0f} % of the time",
    )  # fmt: skip


@check("resonance")
def two_mass_resonance(_data: Path | None) -> Iterator[Row]:
    """The torsional mode with the motor free."""
    from hdsim.studies.catalogue import resonance

    simulated, analytic = resonance("csg-20-100", 0.5)
    yield Row(
        "resonance", "torsional resonance of CSG-20-100, motor free, 0.5 kg m²", "Hz",
        "two-mass formula with the print's K2", analytic, simulated, 0.01,
        "width of the sweep's grid (estimate)",
    )  # fmt: skip


def _strongest_order(preset: str, low: float, high: float) -> float:
    """Order per motor turn of the strongest line of the transmission error that random pitch errors make."""
    from hdsim.simulation.simulate import simulate
    from hdsim.studies.bench import transmission
    from hdsim.studies.metrics.transmission import transmission_error

    drive = {"preset": preset, "mesh": {"pitch_error_m": 2e-6}}
    scenario = transmission.build(drive, run={"rtol": 1e-4})
    orders, amplitude = transmission_error(simulate(scenario), scenario.drive.ratio, 1).spectrum
    inside = np.flatnonzero((orders > low) & (orders < high))
    return float(orders[inside[np.argmax(amplitude[inside])]])


@check("orders-100", "orders-50")
def orders_of_pitch_errors(_data: Path | None) -> Iterator[Row]:
    """Orders that pitch errors of the flexspline's teeth make, simulated, against a data set's table."""
    source = "GD-HDD, Table I, doi:10.1109/TMECH.2026.3699839"
    yield Row(
        "orders-100", "order of flexspline errors at ratio 100 (49.88 Hz / 24.69 Hz)", "1", source,
        49.88 / 24.69, _strongest_order("csg-20-100", 1.5, 2.5), 0.005 / 49.88 + 0.005 / 24.69,
        "last digits of the print",
    )  # fmt: skip
    yield Row(
        "orders-50", "order of flexspline errors at ratio 50", "1", source, 4.04,
        _strongest_order("csg-20-50", 3.5, 4.5), 0.005 / 4.04, "last digit of the print",
        remark="at ratio 50 the lines are 2.04 and 4.08: the printed 4.04 is neither; it is twice ratio "
        "100's 2.02",
    )  # fmt: skip
