"""Every metric by name: importing this imports the modules that define them."""

from __future__ import annotations

import hdsim.study.metrics  # noqa: F401 - importing registers
from hdsim.study.registry import Metric, named, registered_metrics


def metrics() -> dict[str, Metric]:
    """Every metric by name."""
    return dict(registered_metrics)


def find_metric(name: str) -> Metric:
    """The metric of that name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    return named("metric", name, metrics())
