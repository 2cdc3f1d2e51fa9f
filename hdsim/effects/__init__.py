"""Physical effects: one file each, found by its name; a scenario turns them on by that name.

A module of this package whose name has no leading underscore holds exactly one subclass of
``hdsim.parts.Effect``; adding such a file is all it takes to add an effect. Other packages add theirs by the
entry point ``hdsim.effects`` (``hdsim.plugins``).
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from hdsim.parts import Effect
from hdsim.plugins import Plugin, plugins


@cache
def catalogue() -> dict[str, type[Effect]]:
    """All effects by name, sorted: hdsim's own, then those of other packages."""
    return own() | {name: one.value for name, one in outside().items()}


@cache
def outside() -> dict[str, Plugin]:
    """The effects of other packages by name, sorted."""
    return plugins("effects", own(), _wrong)


def _wrong(one: Plugin) -> str:
    if not (isinstance(one.value, type) and issubclass(one.value, Effect)):
        return f"found {one.value!r}, expected a subclass of hdsim.parts.Effect"
    if not one.name.isidentifier():
        return "found a name that is no identifier"
    absent = [name for name in ("title", "source", "signature") if not hasattr(one.value, name)]
    return f"expected its {', '.join(absent)}" if absent else ""


@cache
def own() -> dict[str, type[Effect]]:
    """The effects of hdsim itself by name, sorted: the name is that of the file.

    Raises:
        TypeError: a module of the package holds no effect, or more than one.
    """
    found: dict[str, type[Effect]] = {}
    for name in sorted(module.name for module in pkgutil.iter_modules(__path__)):
        if name.startswith("_"):
            continue
        module = importlib.import_module(f"{__name__}.{name}")
        effects = [
            value
            for value in vars(module).values()
            if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
        ]
        if len(effects) != 1:
            raise TypeError(f"{module.__name__} must define exactly one Effect, found {len(effects)}")
        found[name] = effects[0]
    return found


__all__ = ["catalogue", "outside", "own"]
