"""All bench procedures on one drive, beside the lines of the catalogue."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hdsim.errors import HdsimError
from hdsim.studies.known_metrics import find_metric
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.registry import BenchRun, Procedure

if TYPE_CHECKING:
    from hdsim.drive.catalogue import CatalogueFigures

#: Effects of a drive that is a preset: what the catalogue prints besides stiffness and friction.
CATALOGUE_EFFECTS = {"set": "catalogue"}

#: Allowed deviation from a printed typical friction torque.
TYPICAL = 0.10

#: Allowed deviation from a printed stiffness: makers report that units scatter by up to 30 %, and the closing
#: tips of the hysteresis loop raise the secant K3 of the centre line by 4 to 10 %.
STIFFNESS = 0.15

#: Allowed deviation from a printed efficiency: the makers' own scatter.
EFFICIENCY = 0.03


@dataclass(frozen=True)
class Line:
    """A line of a catalogue.

    Args:
        value: printed value in the metric's unit.
        limit: whether it is an upper limit; a typical value otherwise.
        tolerance: allowed deviation from a typical value, in the unit.
        source: where it is printed.
    """

    value: float
    limit: bool
    tolerance: float
    source: str

    def holds(self, measured: float) -> bool:
        """Whether a measured value is inside the line."""
        return measured <= self.value if self.limit else abs(measured - self.value) <= self.tolerance

    def __str__(self) -> str:
        return f"< {self.value:.4g}" if self.limit else f"{self.value:.4g} ± {self.tolerance:.2g}"


@dataclass(frozen=True)
class Row:
    """A figure of the drive.

    Args:
        procedure: test that it comes from.
        metric: its name.
        unit: its unit.
        description: what it is.
        value: measured; NaN when it could not be.
        line: the catalogue's line, if there is one.
        problem: why there is no value; empty if there is.
    """

    procedure: str
    metric: str
    unit: str
    description: str
    value: float
    line: Line | None
    problem: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the value is inside the catalogue's line; None without one."""
        if self.problem:
            return False
        return None if self.line is None else self.line.holds(self.value)


def catalogue_lines(figures: CatalogueFigures) -> dict[str, Line]:
    """The catalogue's lines by the name of the metric that they are about."""
    found = {
        name: Line(ARCSEC * figure.value, True, 0.0, figure.source.citation)
        for name, figure in (
            ("transmission_accuracy", figures.accuracy),
            ("hysteresis_loss", figures.hysteresis_loss),
            ("lost_motion", figures.lost_motion),
            ("repeatability", figures.repeatability),
        )
    }
    running = dict(figures.running_torque).get(2000.0)
    for name, figure in (
        ("stiffness_k1", figures.stiffness_k1),
        ("stiffness_k2", figures.stiffness_k2),
        ("stiffness_k3", figures.stiffness_k3),
        ("starting_torque", figures.input_starting_torque),
        ("running_torque", running),
        ("back_driving_torque", figures.back_driving_torque),
    ):
        if figure is not None:
            share = STIFFNESS if name.startswith("stiffness") else TYPICAL
            found[name] = Line(figure.value, False, share * figure.value, figure.source.citation)
    if figures.efficiency is not None:
        figure = figures.efficiency
        found["efficiency"] = Line(figure.value, False, EFFICIENCY, figure.source.citation)
    return found


def run_procedure(
    procedure: Procedure,
    drive: Mapping[str, Any],
    *,
    effects: Mapping[str, Any] | None = None,
    run: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
    on_time: Callable[[str, float, float], object] | None = None,
) -> list[BenchRun]:
    """Simulate a procedure, once for each of its variants.

    Args:
        procedure: which.
        drive: section ``drive`` of a scenario.
        effects: section ``effects``.
        run: fields of the section ``run`` that win.
        options: options of the procedure's ``build`` for every run; a variant's own win.
        on_time: called now and then with the name of the run, the simulated time and its end, s.

    Raises:
        HdsimError: the scenario is wrong or its run fails.
    """
    from hdsim.simulation.simulate import simulate

    runs = []
    for variant in procedure.variants:
        chosen = dict(options or {}) | dict(variant)
        scenario = procedure.build(drive, effects=effects, run=run, **chosen)
        end = scenario.run.duration_s
        told = None
        if on_time is not None:
            label = ", ".join([procedure.title, *(f"{k} {v}" for k, v in variant.items())])

            def told(t: float, label: str = label, end: float = end) -> object:
                return on_time(label, t, end)

        runs.append(BenchRun(variant, scenario, simulate(scenario, on_time=told)))
    return runs


def figures_of(procedure: Procedure, runs: Sequence[BenchRun], lines: Mapping[str, Line]) -> list[Row]:
    """The metrics of a procedure, read from its first run, beside the catalogue's lines."""
    rows = []
    for name in procedure.metrics:
        one = find_metric(name)
        value, problem = math.nan, ""
        try:
            value = one(runs[0].recording, runs[0].scenario)
        except HdsimError as error:
            problem = str(error)
        rows.append(Row(procedure.name, name, one.unit, one.description, value, lines.get(name), problem))
    return rows
