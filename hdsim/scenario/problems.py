"""What is wrong with a scenario: one line a problem, ``file:line: field: found ..., expected ...``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hdsim.errors import InputError


@dataclass(frozen=True)
class Mark:
    """Where a value was written.

    Args:
        file: path as the user gave it (or relative to the file that named it).
        line: line number from 1; 0 when the whole file is meant.
    """

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong.

    Args:
        mark: where.
        field: dotted name of the field, empty when no field is to blame.
        text: ``found ..., expected ...``.
        absent: whether something is missing, rather than wrong.
    """

    mark: Mark
    field: str
    text: str
    absent: bool = False

    def __str__(self) -> str:
        return f"{self.mark}: {self.field}: {self.text}" if self.field else f"{self.mark}: {self.text}"


class ScenarioError(InputError):
    """A file that the user wrote cannot be used; ``problems`` holds every reason found, best first."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


def dotted(path: tuple[str | int, ...]) -> str:
    """Name of a field as people write it.

    Example:
        >>> dotted(("load", 0, "torque_nm"))
        'load[0].torque_nm'
    """
    name = ""
    for item in path:
        if isinstance(item, int):
            name += f"[{item}]"
        else:
            key = item if item.isidentifier() else shorten(repr(item), 40)
            name += f".{key}" if name else key
    return name


def shorten(text: str, limit: int = 40) -> str:
    """``text`` cut to ``limit`` characters."""
    return text if len(text) <= limit else text[: limit - 3] + "..."


def describe(value: object) -> str:
    """A short picture of a value and its type, always on one line."""
    if value is None:
        return "nothing (null)"
    if isinstance(value, bool):
        return f"{str(value).lower()} (true/false)"
    if isinstance(value, int | float):
        kind = "whole number" if isinstance(value, int) else "number"
        return f"{shorten(repr(value))} ({kind})"
    if isinstance(value, str):
        return f"{shorten(ascii(value) if not value.isprintable() else repr(value))} (text)"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if value else "an empty list"
    if isinstance(value, dict):
        keys = [shorten(ascii(key)[1:-1], 30) for key in value]
        return f"a mapping with {shorten(', '.join(keys), 60)}" if keys else "an empty mapping"
    return shorten(ascii(value))
