"""Rows of a table by their names: functions that make rows register for them, patterns choose among them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatch
from typing import Any, Protocol, TypeVar

from hdsim.errors import InputError


class Named(Protocol):
    """A row: anything with a name."""

    @property
    def name(self) -> str:
        """By which it is asked for."""
        ...


R = TypeVar("R", bound=Named)
F = TypeVar("F", bound=Callable[..., Any])


def registrar(makers: dict[str, F]) -> Callable[..., Callable[[F], F]]:
    """A decorator for functions that make the rows of some names; ``makers`` has them by name."""

    def check(*names: str) -> Callable[[F], F]:
        """Register a function that makes the rows of these names."""

        def register(function: F) -> F:
            makers.update(dict.fromkeys(names, function))
            return function

        return register

    return check


def chosen(known: Sequence[str], only: Iterable[str], what: str) -> list[str]:
    """The names that match a pattern (``eq-*``), or all when there is none.

    Args:
        known: all names, in order.
        only: patterns.
        what: what is missing, in the words of an error: ``no row``.

    Raises:
        InputError: a pattern matches nothing.
    """
    patterns = list(only)
    for pattern in patterns:
        if not any(fnmatch(name, pattern) for name in known):
            raise InputError(f"{what} is called {pattern!r}; there are: {', '.join(known)}")
    return [name for name in known if not patterns or any(fnmatch(name, p) for p in patterns)]


def made(
    makers: Mapping[str, F],
    wanted: Sequence[str],
    make: Callable[[F], Iterable[R]],
    on_row: Callable[[R], object] | None = None,
) -> list[R]:
    """The wanted rows, in the order of their names; each function is called once.

    Args:
        makers: the functions by the names of their rows.
        wanted: names.
        make: calls a function.
        on_row: called with each row as soon as it is there.
    """
    rows: list[R] = []
    for function in dict.fromkeys(makers[name] for name in wanted):
        for row in make(function):
            if row.name in wanted:
                rows.append(row)
                if on_row is not None:
                    on_row(row)
    return sorted(rows, key=lambda row: wanted.index(row.name))
