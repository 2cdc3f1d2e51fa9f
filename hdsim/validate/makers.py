"""Rows about what makers print: limits, losses, wind-up, selection, strength."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdsim.validate.rows import Row, check

if TYPE_CHECKING:
    from hdsim.studies.registry import BenchRun

_LLC = "Harmonic Drive LLC, CSF/CSG catalogue"
_CHA = "Harmonic Drive AG, CHA manual 1018854, p. 54, size 20"
_PRESET = "csg-20-100"


@cache
def _bench(procedure: str) -> BenchRun:
    from hdsim.studies.bench.report import CATALOGUE_EFFECTS, run_procedure
    from hdsim.studies.known_procedures import find_procedure

    drive = {"preset": _PRESET}
    return run_procedure(find_procedure(procedure), drive, effects=CATALOGUE_EFFECTS)[0]


_LINES = {
    "hysteresis-loss": ("torsion", "hysteresis_loss", "hysteresis loss of CSG-20-100", 60.0, True),
    "lost-motion-3": ("torsion", "lost_motion", "lost motion of CSG-20-100 at 3 % of rating", 60.0, False),
    "lost-motion-4": (
        "torsion", "lost_motion_4_percent", "lost motion of CSG-20-100 at 4 % of rating", 60.0, False,
    ),
    "accuracy": ("transmission_error", "transmission_accuracy", "accuracy of CSG-20-100", 48.0, True),
}  # fmt: skip


@check(*_LINES)
def upper_limits(_: Path | None) -> Iterator[Row]:
    """The lines of the catalogue that are upper limits."""
    from hdsim.studies.known_metrics import find_metric

    for name, (procedure, metric, quantity, limit, fitted) in _LINES.items():
        run = _bench(procedure)
        value = find_metric(metric)(run.recording, run.scenario)
        remark = ""
        if name == "lost-motion-4":
            drive = run.scenario.drive
            elastic = 2 * 0.04 * drive.rated_torque_nm / drive.torsion.stiffness_k1_nm_per_rad
            remark = (
                f"the print does not say at which torque; {math.degrees(elastic) * 3600:.0f} arcsec "
                "are its own K1"
            )
        yield Row(
            name, quantity, "arcsec", _CHA, limit, value, 0.0, "upper limit", limit=True, fitted=fitted,
            remark=remark,
        )  # fmt: skip


@check("stiffness-1", "stiffness-2", "stiffness-3")
def stiffness(_: Path | None) -> Iterator[Row]:
    """Secants of the torsion cycle with hysteresis on."""
    from hdsim.drive.presets import catalogue_figures
    from hdsim.studies.bench.report import STIFFNESS
    from hdsim.studies.known_metrics import find_metric

    run, figures = _bench("torsion"), catalogue_figures(_PRESET)
    printed = (figures.stiffness_k1, figures.stiffness_k2, figures.stiffness_k3)
    for k, figure in enumerate(printed, 1):
        yield Row(
            f"stiffness-{k}", f"torsional stiffness K{k} of CSG-20-100, with hysteresis", "N m/rad", _CHA,
            figure.value, find_metric(f"stiffness_k{k}")(run.recording, run.scenario), STIFFNESS,
            "scatter of units, 30 % in second-hand reports, halved", fitted=True,
        )  # fmt: skip


#: Angle at T1 in 1e-4 rad as printed, and half of the last digit of K1, T1 and the angle over themselves.
_WIND_UP = {
    14: (5.8, 0.05 / 3.4 + 0.05 / 2.0 + 0.05 / 5.8),
    17: (4.9, 0.05 / 8.1 + 0.05 / 3.9 + 0.05 / 4.9),
    20: (5.2, 0.05 / 1.3 + 0.05 / 7.0 + 0.05 / 5.2),
    25: (5.5, 0.05 / 2.5 + 0.5 / 14.0 + 0.05 / 5.5),
}


@check(*(f"wind-up-{size}" for size in _WIND_UP))
def wind_up(_: Path | None) -> Iterator[Row]:
    """Angle at T1 with all teeth, the centre of a torsion cycle, ratio 50."""
    from hdsim.simulation.simulate import simulate
    from hdsim.studies.bench import torsion
    from hdsim.studies.metrics.torsion import torsion_loop

    for size, (printed, tolerance) in _WIND_UP.items():
        scenario = torsion.build({"preset": f"csg-{size}-50"})
        loop = torsion_loop(simulate(scenario))
        torque = scenario.drive.torsion.torque_t1_nm
        plus, minus = (float(np.interp(t, loop.torque, loop.centre)) for t in (torque, -torque))
        yield Row(
            f"wind-up-{size}", f"wind-up of CSG-{size}-50 at T1, all teeth", "1e-4 rad",
            f"{_LLC}, p. 50, Table 42", printed, 0.5e4 * (plus - minus), tolerance,
            "last digits of K1, T1 and the angle",
        )  # fmt: skip


@check("efficiency-part-load")
def efficiency_at_part_load(_: Path | None) -> Iterator[Row]:
    """Efficiency at 57 % of rated torque over that at rated torque."""
    from hdsim.studies.bench import friction
    from hdsim.studies.catalogue import lumped, measured

    def efficiency(share: float) -> float:
        return measured(
            "efficiency",
            friction.build_efficiency(lumped(_PRESET), speeds_rpm=(2000.0,), load_shares=(share,)),
        )

    yield Row(
        "efficiency-part-load", "efficiency of CSG-20-100 at 57 % of rated torque over that at 100 %", "1",
        "Harmonic Drive AG, HFUS-2A 1019658 and CSD-2A 1019659, p. 24", 0.93,
        efficiency(0.57) / efficiency(1.0), 0.03, "the makers' own scatter of efficiencies", relative=False,
        remark="friction is closed at no load and at rated load alone; in between it is too large",
    )  # fmt: skip


@check("average-torque")
def average_torque_of_the_example(_: Path | None) -> Iterator[Row]:
    """The maker's worked selection example."""
    from hdsim.drive.duty import average_torque

    torque = np.array([150.0, 82.0, 130.0, 0.0])
    speed = np.array([10.0, 20.0, 10.0, 0.0])
    time = np.array([0.2, 3.0, 0.3, 0.2])
    yield Row(
        "average-torque", "average torque of a worked selection example", "N m",
        "Honpine, How to Selection Harmonic Reduction Gear?, honpine.com", 89.0,
        average_torque(torque, speed, time), 0.5 / 89.0, "last digit of the print",
    )  # fmt: skip


@check("bearing-life-csf", "bearing-life-csg", "bearing-life-half-torque")
def bearing_life(_: Path | None) -> Iterator[Row]:
    """Life of the wave-generator bearing from simulated runs at 2000 rpm."""
    from hdsim.drive.parameters import Drive
    from hdsim.drive.ratings import ratings
    from hdsim.scenario import Scenario
    from hdsim.studies.catalogue import lumped, measured

    made = Drive.model_validate(lumped(_PRESET))

    def life(share: float) -> float:
        move = {"type": "ramp", "velocity_rpm": math.copysign(2000.0, made.ratio)}
        load = {"type": "hold", "torque_nm": -share * made.rated_torque_nm}
        scenario = Scenario.model_validate(
            {
                "drive": lumped(_PRESET),
                "command": {"motor": {"type": "motion", "trajectory": move}},
                "load": {"inertia_kg_m2": 0.05, "torque": load},
                "run": {"duration_s": 5.0},
            }
        )
        return measured("bearing_life", scenario)

    yield Row(
        "bearing-life-csf", "life class L10 of CSF: a fifth of its L50 of 35,000 h", "h",
        "Harmonic Drive AG, engineering data 1019659, p. 20, Table 20.1 and Eq. 20.3", 35_000.0 / 5.0,
        ratings("csf-20-100").rated_life.value, 0.01, "the print's own approximation (estimate)",
        remark="the model takes it from the CSF/CSG catalogue of Harmonic Drive LLC, p. 14",
    )  # fmt: skip
    yield Row(
        "bearing-life-csg", "bearing life L10 of a run at rated torque, 2000 rpm", "h", f"{_LLC}, p. 14",
        10_000.0, life(1.0), 0.05, "how the run begins (estimate)", fitted=True,
    )  # fmt: skip
    yield Row(
        "bearing-life-half-torque", "bearing life L10 of a run at half the rated torque, 2000 rpm", "h",
        f"{_LLC}, p. 14, Eq. 8: the cube of the torque", 80_000.0, life(0.5), 0.05,
        "how the run begins (estimate)",
    )  # fmt: skip


_SIMILAR = "cube of the size; last digits of both prints"


def _strength(name: str, quantity: str, table: str, printed: float, at_20: float, size: int) -> Row:
    """A printed torque against the cube of the size, from size 20, within the rounding of both."""

    def digit(value: float) -> float:
        return float(0.5 * 10.0 ** (math.floor(math.log10(value)) - 1) / value)

    return Row(
        f"{name}-{size}", quantity, "N m", f"{_LLC}, p. 14, {table}", printed, at_20 * (size / 20.0) ** 3,
        digit(printed) + digit(at_20), _SIMILAR,
    )  # fmt: skip


_SIZES = (14, 17, 25, 32)


@check(*(f"ratcheting-{size}" for size in _SIZES), *(f"buckling-{size}" for size in _SIZES))
def strength(_: Path | None) -> Iterator[Row]:
    """Torques at which the teeth skip or the flexspline folds, by geometric similarity with size 20.

    hdsim models neither: it scales what is not printed (rim, inertia, tooth stiffness) as if the sizes were
    similar, and of similar gears torques of equal stress grow as the cube of the size.
    """
    from hdsim.drive.ratings import RATIOS, ratings

    for size in _SIZES:
        rows = []
        for ratio in RATIOS[:3]:
            here, there = (ratings(f"csg-{s}-{ratio}").ratcheting_torque for s in (size, 20))
            if here is not None and there is not None:
                what = f"ratcheting torque of CSG-{size}-{ratio}, worst of ratios 50, 80, 100"
                rows.append(_strength("ratcheting", what, "Table 6", here.value, there.value, size))
        yield max(rows, key=lambda row: abs(row.deviation))
    for size in _SIZES:
        here, there = (ratings(f"csg-{s}-100").buckling_torque for s in (size, 20))
        if here is not None and there is not None:
            what = f"buckling torque of CSG-{size}"
            yield _strength("buckling", what, "Table 7", here.value, there.value, size)
