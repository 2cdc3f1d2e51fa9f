"""Figures: one page for a run, a Bode plot for a linear model. Matplotlib is imported when one is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.plot.bode import plot_bode as plot_bode
    from hdsim.plot.page import plot_recording as plot_recording
    from hdsim.plot.page import plot_strip as plot_strip

_HOME = {"plot_bode": "bode", "plot_recording": "page", "plot_strip": "page"}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
