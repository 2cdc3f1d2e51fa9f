"""What a study can measure: metrics and bench procedures, found by name.

A metric is one number of one run; a procedure is the scenario of a bench test, the metrics that it is made
for, and its picture. Both register themselves where they are defined; ``known_metrics`` and
``known_procedures`` import those modules and look them up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from hdsim.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

T = TypeVar("T")
Measure = Callable[["Recording", "Scenario"], float]


@dataclass(frozen=True)
class Metric:
    """One number of a run.

    Args:
        name: how a study asks for it.
        unit: unit of the value, as in ``arcsec`` or ``N m/rad``; ``1`` for a pure number.
        description: one line that says what it is.
        source: the standard, manual or paper that defines it.
        measure: the function.
    """

    name: str
    unit: str
    description: str
    source: str
    measure: Measure

    def __call__(self, recording: Recording, scenario: Scenario) -> float:
        """The value for a run.

        Raises:
            InputError: the run does not contain what the metric is about (no reversal, no dwell, ...).
        """
        return self.measure(recording, scenario)


@dataclass(frozen=True)
class BenchRun:
    """A run of a procedure: the options it was built with, its scenario and what came out."""

    options: Mapping[str, Any]
    scenario: Scenario
    recording: Recording


#: Builds a procedure's scenario: ``build(drive, *, effects=None, run=None, **options)`` returns a Scenario.
#: ``drive`` and ``effects`` are these sections of a scenario, e.g. ``{"preset": "seed-2021"}``; ``run`` holds
#: fields of the section ``run`` that replace the procedure's own (``seed``, ``rtol``, ...); the options are
#: those in the docstring of the procedure's ``build``.
Build = Callable[..., "Scenario"]


@dataclass(frozen=True)
class Procedure:
    """A test of the test bench.

    Args:
        name: how the command line asks for it.
        title: what it is, for people.
        source: the standard or manual that it follows.
        build: scenario for a drive and options.
        metrics: names of the metrics that it is made for.
        plot: picture of its runs, one for each of ``variants``.
        variants: the options of each run that the picture shows; one run with the defaults as a rule.
    """

    name: str
    title: str
    source: str
    build: Build
    metrics: tuple[str, ...]
    plot: Callable[[Sequence[BenchRun]], Figure]
    variants: tuple[Mapping[str, Any], ...] = field(default=({},))


registered_metrics: dict[str, Metric] = {}
registered_procedures: dict[str, Procedure] = {}


def metric(name: str, unit: str, description: str, source: str) -> Callable[[Measure], Metric]:
    """Register a function ``(recording, scenario) -> float`` as a metric."""

    def register(measure: Measure) -> Metric:
        if name in registered_metrics:
            raise ValueError(f"there are two metrics {name!r}")
        registered_metrics[name] = Metric(name, unit, description, source, measure)
        return registered_metrics[name]

    return register


def procedure(given: Procedure) -> Procedure:
    """Register a bench procedure."""
    if given.name in registered_procedures:
        raise ValueError(f"there are two procedures {given.name!r}")
    registered_procedures[given.name] = given
    return given


def named(kind: str, name: str, known: Mapping[str, T]) -> T:
    """What is known by that name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    if name in known:
        return known[name]
    from difflib import get_close_matches

    near = get_close_matches(name, known, 3)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    raise InputError(f"unknown {kind} {name!r}; {hint}there are: {', '.join(known)}")
