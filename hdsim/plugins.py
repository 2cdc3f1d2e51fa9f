"""Additions from other packages, by Python's entry points: read when asked for, and never in the way.

A package names them in its ``pyproject.toml``, in the groups ``hdsim.effects``, ``hdsim.contact_laws``,
``hdsim.presets``, ``hdsim.metrics`` and ``hdsim.controllers`` (docs/extending.md). One that cannot be used is
left out with a warning that names its distribution.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from hdsim.errors import PluginWarning

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@dataclass(frozen=True)
class Plugin:
    """Something from another package.

    Args:
        name: how a scenario or a study asks for it.
        value: what its entry point names.
        distribution: name and version of the package.
    """

    name: str
    value: Any
    distribution: str


@cache
def _entry_points() -> Any:
    """Those of every installed package; they are read once, which takes some hundredths of a second."""
    from importlib.metadata import entry_points

    return entry_points()


@cache
def _loaded(group: str) -> tuple[Plugin, ...]:
    """Everything of a group that can be imported."""
    found = []
    for entry in sorted(
        _entry_points().select(group=f"hdsim.{group}"), key=lambda one: (one.name, _home(one))
    ):
        try:
            value = entry.load()
        except Exception as error:  # whatever another package does wrong
            said = f"{type(error).__name__}: {' '.join(str(error).split())}"
            _warn(group, entry.name, _home(entry), f"{entry.value} cannot be imported: {said}")
        else:
            found.append(Plugin(entry.name, value, _home(entry)))
    return tuple(found)


def _home(entry: EntryPoint) -> str:
    """Name and version of the distribution that an entry point is of."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown distribution"


def plugins(group: str, known: Iterable[str], wrong: Callable[[Plugin], str]) -> dict[str, Plugin]:
    """What other packages add to a group, by name.

    Args:
        group: ``effects``, ``contact_laws``, ``presets``, ``metrics`` or ``controllers``.
        known: names that are taken.
        wrong: why one cannot be used; empty when it can.
    """
    found: dict[str, Plugin] = {}
    taken = dict.fromkeys(known, "hdsim")
    for one in _loaded(group):
        complaint = wrong(one)
        if not re.fullmatch(r"[a-z][a-z0-9_-]*", one.name):
            complaint = "found a name that is not of small letters, digits and _"
        if one.name in taken:
            complaint = f"{taken[one.name]} has one of this name already"
        if complaint:
            _warn(group, one.name, one.distribution, complaint)
            continue
        taken[one.name] = one.distribution
        found[one.name] = one
    return found


def wrong_choice(one: Plugin, base: type, field: str, method: str) -> str:
    """Why a model cannot be one of a scenario's choices; empty when it can.

    Args:
        one: the plugin.
        base: class that it must derive from.
        field: its field of type ``Literal``, by which a scenario chooses it.
        method: what it must have.
    """
    if not (isinstance(one.value, type) and issubclass(one.value, base)):
        return f"found {one.value!r}, expected a subclass of {base.__module__}.{base.__qualname__}"
    stated = getattr(one.value, "model_fields", {}).get(field)
    if stated is None or get_args(stated.annotation) != (one.name,):
        return f'expected its field {field}: Literal["{one.name}"]'
    return "" if callable(getattr(one.value, method, None)) else f"expected a method {method}"


def _warn(group: str, name: str, distribution: str, complaint: str) -> None:
    warnings.warn(
        f"{distribution}: hdsim.{group}: {name} is left out: {complaint}", PluginWarning, stacklevel=3
    )
