"""Rough tooth flanks: Weierstrass-Mandelbrot profiles, equivalent surface of two flanks, backlash.

The names below are loaded when they are first used, so that reading the parameter models stays light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.surface.backlash import single_frequency_half_gap, sliding_half_gaps, tooth_half_gaps
    from hdsim.surface.files import read_heights
    from hdsim.surface.flank import (
        Flank,
        corrected_flank,
        equivalent_surface,
        structure_function,
        structure_function_constant,
    )
    from hdsim.surface.profile import random_phases, wm_profile

_HOME = {
    "Flank": "flank",
    "corrected_flank": "flank",
    "equivalent_surface": "flank",
    "structure_function": "flank",
    "structure_function_constant": "flank",
    "random_phases": "profile",
    "read_heights": "files",
    "wm_profile": "profile",
    "single_frequency_half_gap": "backlash",
    "sliding_half_gaps": "backlash",
    "tooth_half_gaps": "backlash",
}

__all__ = [
    "Flank",
    "corrected_flank",
    "equivalent_surface",
    "random_phases",
    "read_heights",
    "single_frequency_half_gap",
    "sliding_half_gaps",
    "structure_function",
    "structure_function_constant",
    "tooth_half_gaps",
    "wm_profile",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the module that defines it."""
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
