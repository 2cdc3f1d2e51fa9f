"""One tooth pair: contact laws (force, stiffness, energy over penetration), dead-zone, table for kernels.

The names below are loaded when they are first used, so that reading the parameter models stays light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.contact.constant import ConstantStiffness
    from hdsim.contact.gap import dead_zone, smooth_dead_zone
    from hdsim.contact.hertz_line import HertzLine
    from hdsim.contact.kernel_table import ContactTable, tabulate
    from hdsim.contact.law import ContactLaw, ValidityWarning
    from hdsim.contact.majumdar_bhushan import MajumdarBhushan
    from hdsim.contact.measured import TableLaw
    from hdsim.contact.series import SeriesLaw

_HOME = {
    "ConstantStiffness": "constant",
    "ContactLaw": "law",
    "ContactTable": "kernel_table",
    "HertzLine": "hertz_line",
    "MajumdarBhushan": "majumdar_bhushan",
    "SeriesLaw": "series",
    "TableLaw": "measured",
    "ValidityWarning": "law",
    "dead_zone": "gap",
    "smooth_dead_zone": "gap",
    "tabulate": "kernel_table",
}

__all__ = [
    "ConstantStiffness",
    "ContactLaw",
    "ContactTable",
    "HertzLine",
    "MajumdarBhushan",
    "SeriesLaw",
    "TableLaw",
    "ValidityWarning",
    "dead_zone",
    "smooth_dead_zone",
    "tabulate",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the module that defines it."""
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
