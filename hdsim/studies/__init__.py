"""Studies: bench procedures on simulated drives, and what comes out of them. Names resolve on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.studies.run_metrics import Measured as Measured
    from hdsim.studies.run_metrics import RunMetrics as RunMetrics
    from hdsim.studies.run_metrics import metrics_of as metrics_of

__all__ = ["Measured", "RunMetrics", "metrics_of"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.run_metrics"), name)
