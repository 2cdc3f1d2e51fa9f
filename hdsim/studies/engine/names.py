"""Dotted names of a scenario's fields, as in ``effects.kinematic_error.components[0].amplitude_arcmin``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any

from hdsim.errors import InputError
from hdsim.scenario.fields import Shape, shape_of, split_unit
from hdsim.scenario.problems import dotted
from hdsim.scenario.reader import KeyPath

_PART = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)((?:\[[0-9]+\])*)")
#: Keys that choose which other keys a mapping has; setting one drops the others.
_KINDS = ("type", "law", "model", "kind")


def parse(name: str) -> KeyPath:
    """Keys and indices of a dotted name.

    Raises:
        InputError: it is not of the form ``a.b[0].c``.
    """
    path: list[str | int] = []
    for part in name.split("."):
        match = _PART.fullmatch(part)
        if match is None:
            raise InputError(f"{name!r} is no name of a parameter; expected one such as load.inertia_kg_m2")
        path.append(match[1])
        path += [int(index) for index in re.findall(r"[0-9]+", match[2])]
    return tuple(path)


def unit(name: str) -> str:
    """Unit of the field, from its name's suffix; ``1`` for a pure number.

    Example:
        >>> unit("drive.mesh.flanks.flexspline.fractal_roughness_m")
        'm'
    """
    last = [part for part in parse(name) if isinstance(part, str)][-1]
    return split_unit(last)[1] or "1"


def known_names(data: Any, model: Any) -> list[str]:
    """Every field of a scenario that holds a single value, and every effect, by dotted name.

    Args:
        data: the scenario with all defaults, as plain data.
        model: the class ``Scenario``.
    """
    return [dotted(path) for path in _leaves(data, shape_of(model), ())]


def _leaves(value: Any, shape: Shape | None, path: KeyPath) -> Iterator[KeyPath]:
    if isinstance(value, dict):
        for key, child in value.items():
            inner = shape.narrowed(value).child(key) if shape is not None else None
            if isinstance(child, dict) and inner is not None and inner.optional:
                yield (*path, key)
            yield from _leaves(child, inner, (*path, key))
    elif isinstance(value, list):
        for index, child in enumerate(value):
            yield from _leaves(child, shape.child(index) if shape is not None else None, (*path, index))
    else:
        yield path


def check(name: str, data: Any, model: Any) -> None:
    """Whether a scenario has the field.

    Raises:
        InputError: it has not; the message names the nearest that it has.
    """
    path = parse(name)
    here: Any = data
    shape: Shape | None = shape_of(model)
    for depth, item in enumerate(path):
        if here is None and depth:
            raise InputError(
                f"found {name!r}, but {dotted(path[:depth])} is off in the base; turn it on there "
                f"({dotted(path[:depth])}: {{}})"
            )
        shape = shape.narrowed(here) if shape is not None else None
        child = shape.child(item) if shape is not None else None
        has = (isinstance(here, dict) and item in here) or (
            isinstance(here, list) and isinstance(item, int) and item < len(here)
        )
        if not has and (child is None or isinstance(item, int)):
            raise InputError(f"found an unknown parameter, {_suggestion(name, data, model)}")
        here, shape = (here[item] if has else None), child
    if isinstance(here, list):
        raise InputError(f"found {name!r}, a list of {len(here)}; expected one entry of it, as in {name}[0]")


def _suggestion(name: str, data: Any, model: Any) -> str:
    known = known_names(data, model)
    last = name.rsplit(".", 1)[-1]
    near = (
        get_close_matches(name, known, 1, cutoff=0.75)
        or [n for n in known if n.rsplit(".", 1)[-1] == last][:3]
    )
    if not near:
        ends = {n.rsplit(".", 1)[-1]: n for n in known}
        near = [ends[end] for end in get_close_matches(last, ends, 1, cutoff=0.6)]
    if near:
        return f"expected {' or '.join(repr(n) for n in near)}"
    return "expected the dotted name of a scenario's field, such as 'load.inertia_kg_m2'"


def set_value(data: dict[str, Any], name: str, value: Any) -> None:
    """Set a field in plain data, in place; missing mappings on the way are made.

    Setting ``type``, ``law``, ``model`` or ``kind`` to another value drops the mapping's other keys, as when
    a scenario extends another one.
    """
    path = parse(name)
    here: Any = data
    for item in path[:-1]:
        if isinstance(here, dict) and here.get(item) is None:
            here[item] = {}
        here = here[item]
    last = path[-1]
    if last in _KINDS and isinstance(here, dict) and here.get(last) != value:
        here.clear()
    here[last] = value


def get_value(data: Any, name: str) -> Any:
    """Value of a field in plain data; None when a mapping on the way is missing."""
    for item in parse(name):
        if data is None:
            return None
        data = data.get(item) if isinstance(data, dict) else data[item]
    return data
