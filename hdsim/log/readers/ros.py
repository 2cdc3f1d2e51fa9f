"""ROS bags, versions 1 and 2, by rosbags; read message by message."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hdsim.errors import InputError
from hdsim.log.readers.contract import Message, missing, needed


def rosbags(part: str) -> Any:
    """A module of the package rosbags.

    Raises:
        InputError: it is not installed.
    """
    return needed("rosbags", f"rosbags.{part}", "ros", "ROS bags and messages")


def messages(path: Path, topics: set[str] | None) -> Iterator[Message]:
    """Messages of these topics, or of all, of a ROS 1 bag (a file) or a ROS 2 bag (its folder)."""
    high, types = rosbags("highlevel"), rosbags("typesys")
    place = path if path.is_dir() or path.suffix == ".bag" else path.parent
    version = types.Stores.ROS1_NOETIC if path.suffix == ".bag" else types.Stores.LATEST
    try:
        with high.AnyReader([place], default_typestore=types.get_typestore(version)) as reader:
            there = list(reader.topics)
            for topic in sorted((topics or set()) - set(there)):
                raise missing(path, "topic", topic, there)
            chosen = [c for c in reader.connections if topics is None or c.topic in topics]
            for connection, at, body in reader.messages(connections=chosen):
                yield (
                    connection.topic,
                    at,
                    at,
                    lambda body=body, kind=connection.msgtype: reader.deserialize(body, kind),  # type: ignore[misc]
                )
    except (high.AnyReaderError, OSError) as error:
        raise InputError(f"{path}: cannot be read as a ROS bag: {error}") from None
