"""Numbers out of messages: the fields that origins name, and which fields there are."""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.mapping import Origin
from hdsim.log.readers.contract import Message, Numbers, missing

Messages = Callable[[Path, set[str] | None], Iterator[Message]]
"""Messages of these topics of a file, or of all."""

#: Messages among which the fields of every topic are looked for, and elements of an array that are offered.
_LOOKED_AT = 2000
_ELEMENTS = 16
_OF_JOINTS = ("position", "velocity", "effort")


@dataclass
class Samples:
    """Numbers of one topic, or of a whole table.

    Args:
        values: arrays (n,) by origin; NaN where the recording has nothing.
        stamps: times (n,) of the messages in ns since 1970, by kind of stamp; empty for tables, and without
            ``header`` where messages have none.
    """

    values: dict[Origin, Numbers] = field(default_factory=dict)
    stamps: dict[str, NDArray[np.int64]] = field(default_factory=dict)


def read_topics(
    path: Path, origins: Sequence[Origin], messages: Messages, limit: int | None = None
) -> dict[str, Samples]:
    """Numbers at ``origins``, by topic; of the first ``limit`` messages only where that is given."""
    by_topic: dict[str, list[Origin]] = {}
    for origin in origins:
        by_topic.setdefault(str(origin.topic), []).append(origin)
    rows = {topic: array("d") for topic in by_topic}
    kinds = ("log", "publish", "header")
    stamps = {topic: {kind: array("q") for kind in kinds} for topic in by_topic}
    for topic, logged, published, decode in islice(messages(path, set(by_topic)), limit):
        place = f"{path}: {topic}"
        own = stamps[topic]
        try:
            message = decode()
        except Exception as error:  # whatever a decoder says of bytes that are not its own
            number = len(own["log"]) + 1
            raise InputError(f"{place}: message {number} cannot be decoded: {error}") from None
        rows[topic].extend(_pick(message, origin, place) for origin in by_topic[topic])
        own["log"].append(logged)
        own["publish"].append(published)
        header = _header_time(message)
        if header is not None:
            own["header"].append(header)
    found = {}
    for topic, wanted in by_topic.items():
        values = np.array(rows[topic], np.float64).reshape(-1, len(wanted))
        count = len(values)
        of_kind = {kind: np.array(own, np.int64) for kind, own in stamps[topic].items() if len(own) == count}
        columns: dict[Origin, Numbers] = {origin: values[:, k] for k, origin in enumerate(wanted)}
        found[topic] = Samples(columns, of_kind)
    return found


def fields_of(path: Path, messages: Messages) -> list[Origin]:
    """Every field that is a number, of every topic that is among the first messages."""
    found: dict[Origin, None] = {}
    for topic, _, _, decode in islice(messages(path, None), _LOOKED_AT):
        try:
            message = decode()
        except Exception:  # an encoding of somebody's own is no source of numbers
            continue
        found |= dict.fromkeys(_leaves(message, topic, ""))
    return list(found)


def _leaves(value: Any, topic: str, before: str) -> Iterator[Origin]:
    names = list(_member(value, "name")) if not before and _has(value, "name") else []
    for name in _fields(value):
        if name.startswith("_") or name in ("header", "name"):
            continue
        try:
            member = _member(value, name)
        except (KeyError, AttributeError):
            continue
        path = f"{before}{name}"
        if isinstance(member, bool | int | float):
            yield Origin(topic=topic, field=path)
        elif isinstance(member, str | bytes) or member is None:
            continue
        elif hasattr(member, "__len__") and not isinstance(member, dict):
            if names and name in _OF_JOINTS and len(member) == len(names):
                yield from (Origin(topic=topic, field=name, joint=joint) for joint in names)
            elif len(member) and isinstance(member[0], int | float | np.number):
                few = range(min(len(member), _ELEMENTS))
                yield from (Origin(topic=topic, field=f"{path}[{k}]") for k in few)
        else:
            yield from _leaves(member, topic, f"{path}.")


def _header_time(message: Any) -> int | None:
    try:
        stamp = _member(_member(message, "header"), "stamp")
        nanoseconds = "nanosec" if _has(stamp, "nanosec") else "nsec"
        return int(_member(stamp, "sec")) * 1_000_000_000 + int(_member(stamp, nanoseconds))
    except (KeyError, AttributeError, TypeError, ValueError):
        return None


def _has(value: Any, name: str) -> bool:
    return name in value if isinstance(value, dict) else hasattr(value, name)


def _member(value: Any, name: str) -> Any:
    return value[name] if isinstance(value, dict) else getattr(value, name)


def _fields(value: Any) -> list[str]:
    if isinstance(value, dict):
        return list(value)
    descriptor = getattr(value, "DESCRIPTOR", None)
    if descriptor is not None:
        return [f.name for f in descriptor.fields]
    return list(getattr(value, "__dataclass_fields__", {}) or getattr(value, "__slots__", []))


def _pick(message: Any, origin: Origin, place: str) -> float:
    """The number that an origin means in a message; NaN where the message leaves it out."""
    value: Any = message
    for part in str(origin.field).split("."):
        name, *indices = re.findall(r"[^\[\]]+", part)
        try:
            value = _member(value, name)
        except (KeyError, AttributeError):
            there = ", ".join(n for n in _fields(value) if not n.startswith("_"))
            raise InputError(f"{place}: no field {origin.field!r}; there are: {there}") from None
        for index in indices:
            try:
                value = value[int(index)]
            except (ValueError, IndexError, TypeError):
                raise InputError(f"{place}: {origin.field!r}: there is no element {index}") from None
    if origin.joint is not None:
        names = list(_member(message, "name")) if _has(message, "name") else []
        if origin.joint not in names:
            raise missing(Path(place), "joint", origin.joint, names)
        if len(value) == 0:
            return np.nan
        value = value[names.index(origin.joint)]
    try:
        return float(value)
    except (TypeError, ValueError):
        hint = ": name an element, such as [0], or a joint" if hasattr(value, "__len__") else ""
        raise InputError(f"{place}: field {origin.field!r} is no number{hint}") from None
