"""Every metric by name: importing this imports the modules that define them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import hdsim.studies.metrics  # noqa: F401 - importing registers
from hdsim.studies.registry import Metric, named, registered_metrics

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario


def metrics() -> dict[str, Metric]:
    """Every metric by name."""
    return dict(registered_metrics)


def find_metric(name: str) -> Metric:
    """The metric of that name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    return named("metric", name, metrics())


def measure(names: Sequence[str], recording: Recording, scenario: Scenario) -> dict[str, float]:
    """Several metrics of one run, by name.

    Raises:
        InputError: an unknown metric, or one that the run does not contain.
    """
    return {name: find_metric(name)(recording, scenario) for name in names}
