"""Nested settings by dotted paths, as a scenario's file has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def at(data: Any, path: str) -> Any:
    """The value at a dotted path of nested mappings; numbers in the path are indices of lists.

    Raises:
        LookupError: there is none.
    """
    for key in path.split("."):
        data = data[int(key)] if isinstance(data, list) else data[key]
    return data


def put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set a value by its dotted path; numbers in the path are indices of lists that are there."""
    here: Any = data
    *parents, last = path.split(".")
    for key in parents:
        here = here[int(key)] if isinstance(here, list) else here.setdefault(key, {})
    if isinstance(here, list):
        here[int(last)] = value
    else:
        here[last] = value


def merge(data: dict[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """``more`` laid over ``data`` in place; lists are appended to lists."""
    for key, value in more.items():
        below = data.get(key)
        if isinstance(value, Mapping) and isinstance(below, dict):
            merge(below, value)
        elif isinstance(value, list) and isinstance(below, list | tuple):
            data[key] = [*below, *value]
        else:
            data[key] = copied(value)
    return data


def copied(value: Any) -> Any:
    """A copy as dicts and lists all the way down; arrays become lists, and parameters what a file has."""
    if hasattr(value, "model_dump"):
        return value.model_dump(mode="json")
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: copied(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [copied(item) for item in value]
    return value


def in_places(wanted: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with the items of their lists where others have those alike; the rest of them follows."""
    data: dict[str, Any] = copied(given)
    for key, value in wanted.items():
        if isinstance(value, Mapping):
            data[key] = in_places(value, data.get(key, {}))
        elif isinstance(value, list):
            rest, data[key] = data.get(key, []), []
            for item in value:
                place = next((k for k, other in enumerate(rest) if other | item == other), None)
                data[key].append({} if place is None else rest.pop(place))
            data[key] += rest
    return data
