"""MCAP files with json, protobuf or ROS 2 messages; read message by message."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from hdsim.errors import InputError
from hdsim.log.readers.contract import Message, missing
from hdsim.log.readers.ros import rosbags


def messages(path: Path, topics: set[str] | None) -> Iterator[Message]:
    """Messages of these topics, or of all that can be decoded."""
    import struct

    from mcap.exceptions import McapError
    from mcap.reader import make_reader
    from zstandard import ZstdError

    decoders: dict[int, Callable[[bytes], Any]] = {}
    try:
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            if summary is not None:
                there = [channel.topic for channel in summary.channels.values()]
                for topic in sorted((topics or set()) - set(there)):
                    raise missing(path, "topic", topic, there)
            for schema, channel, message in reader.iter_messages(
                topics=None if topics is None else list(topics)
            ):
                if channel.id not in decoders:
                    try:
                        decoders[channel.id] = _decoder(path, channel, schema)
                    except InputError:
                        if topics is not None:
                            raise
                        continue
                decode, body = decoders[channel.id], message.data
                yield (
                    channel.topic,
                    message.log_time,
                    message.publish_time,
                    lambda decode=decode, body=body: decode(body),  # type: ignore[misc]
                )
    except (McapError, ZstdError, OSError, EOFError, RuntimeError, struct.error) as error:
        words = str(error) or type(error).__name__
        raise InputError(f"{path}: cannot be read as MCAP, it is cut off or damaged: {words}") from None


def _decoder(path: Path, channel: Any, schema: Any) -> Callable[[bytes], Any]:
    """What decodes the messages of a channel."""
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding == "protobuf" and schema is not None:
        from hdsim.log.schemas import message_class

        try:
            kind: Any = message_class(schema.name, schema.data)
        except ValueError as error:
            raise InputError(f"{path}: {channel.topic}: {error}") from None
        decode: Callable[[bytes], Any] = kind.FromString
        return decode
    if channel.message_encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
        types = rosbags("typesys")
        store = types.get_typestore(types.Stores.EMPTY)
        name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
        store.register(types.get_types_from_msg(schema.data.decode(), name))
        return lambda body: store.deserialize_cdr(body, name)
    raise InputError(
        f"{path}: {channel.topic} is encoded as {channel.message_encoding!r}; allowed: json, protobuf, "
        f"cdr with a ros2msg schema"
    )
