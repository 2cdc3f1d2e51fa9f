"""Every metric by name: importing this imports the modules that define them."""

from __future__ import annotations

from functools import cache

import hdsim.studies.metrics  # noqa: F401 - importing registers
from hdsim.plugins import Plugin, plugins
from hdsim.studies.registry import Metric, named, registered_metrics


@cache
def _outside() -> dict[str, Metric]:
    """Metrics of other packages (entry point ``hdsim.metrics``), which register when they are imported."""
    own = [name for name, one in registered_metrics.items() if one.measure.__module__.startswith("hdsim.")]

    def wrong(one: Plugin) -> str:
        fits = isinstance(one.value, Metric) and one.value.name == one.name
        return "" if fits else f"expected a Metric (hdsim.studies.registry.metric) of the name {one.name!r}"

    return {name: one.value for name, one in plugins("metrics", own, wrong).items()}


def metrics() -> dict[str, Metric]:
    """Every metric by name."""
    return registered_metrics | _outside()


def find_metric(name: str) -> Metric:
    """The metric of that name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    return named("metric", name, metrics())
