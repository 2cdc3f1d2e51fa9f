"""Every number of one run by its name, taken when it is asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hdsim.errors import HdsimError, InputError
from hdsim.studies.known_metrics import find_metric, metrics

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario


class NotInRun(InputError, KeyError):  # noqa: N818 - read aloud: "not in run"
    """The run does not contain what a metric is about; the message says what is missing."""

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True)
class Measured:
    """A number of a run.

    Args:
        value: in ``unit``; infinite for a time that never comes.
        unit: as in ``arcsec``; ``1`` for a pure number.
        description: one line that says what it is.
        source: the standard, manual or paper that defines it.
    """

    value: float
    unit: str
    description: str
    source: str

    def __str__(self) -> str:
        shown = "never" if math.isinf(self.value) else f"{self.value:.4g}"
        return shown if self.unit == "1" or math.isinf(self.value) else f"{shown} {self.unit}"


class RunMetrics(Mapping[str, Measured]):
    """Name -> :class:`Measured`; a number is computed when it is first asked for, and kept.

    What the run does not contain is not in the mapping: asking for it by name raises an error that says what
    is missing. Going through the mapping computes all that there is.

    Args:
        recording: the run.
        scenario: what was run.
    """

    def __init__(self, recording: Recording, scenario: Scenario) -> None:
        self.recording, self.scenario = recording, scenario
        self._known: dict[str, Measured | str] = {}

    def __getitem__(self, name: str) -> Measured:
        """One number.

        Raises:
            NotInRun: the run does not contain it.
            InputError: there is no metric of that name.
        """
        if name not in self._known:
            metric = find_metric(name)
            try:
                value = float(metric(self.recording, self.scenario))
            except HdsimError as error:
                self._known[name] = str(error)
            else:
                about = (metric.unit, metric.description, metric.source)
                self._known[name] = "found no number (NaN)" if math.isnan(value) else Measured(value, *about)
        found = self._known[name]
        if isinstance(found, str):
            raise NotInRun(found)
        return found

    def __contains__(self, name: object) -> bool:
        return name in metrics() and self.get(str(name)) is not None

    def __iter__(self) -> Iterator[str]:
        return (name for name in metrics() if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def metrics_of(recording: Recording, scenario: Scenario | None = None) -> RunMetrics:
    """The numbers of a recording.

    Args:
        recording: a run, simulated or read from a log.
        scenario: what was run; the one that the recording carries when None.

    Raises:
        InputError: the recording carries no scenario: it is no simulated run.
    """
    if scenario is None:
        text = recording.metadata.get("scenario")
        if text is None:
            raise InputError(
                "metrics() needs the scenario of the run; this recording carries none: hand one over"
            )
        from hdsim.scenario import Scenario

        scenario = Scenario.from_text(text, "the run's scenario")
    return RunMetrics(recording, scenario)
