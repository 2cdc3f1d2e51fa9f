"""Protobuf schemas that a log carries, as serialized FileDescriptorSets, and classes made from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hdsim.log import naming

if TYPE_CHECKING:
    from google.protobuf.descriptor import FileDescriptor
    from google.protobuf.message import Message

    from hdsim.log.naming import ColumnSpec

EVENT_TIME_FIELD = 1000
"""Number of the field ``time`` (s, double) that hdsim adds to ``foxglove.Log``; other readers skip it."""


def table_schema(message_type: str, columns: Sequence[ColumnSpec], *, time: bool = True) -> bytes:
    """FileDescriptorSet of one message type with a double, or packed doubles, for each column.

    Args:
        message_type: full name, ``hdsim.State``.
        columns: fields in their order.
        time: whether the first field is ``time``, in s.
    """
    from google.protobuf import descriptor_pb2

    package, _, name = message_type.rpartition(".")
    field_type = descriptor_pb2.FieldDescriptorProto
    files = descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name=f"{package}/{name}.proto", package=package, syntax="proto3")
    message = file.message_type.add(name=name)
    fields = [("time", False)] if time else []
    fields += [(c.field, c.repeated) for c in columns]
    for index, (field, repeated) in enumerate(fields):
        message.field.add(
            name=field,
            json_name=field,
            number=naming.field_number(index),
            label=field_type.LABEL_REPEATED if repeated else field_type.LABEL_OPTIONAL,
            type=field_type.TYPE_DOUBLE,
        )
    return files.SerializeToString(deterministic=True)


def descriptor_set(file: FileDescriptor) -> bytes:
    """FileDescriptorSet of a generated file with everything that it imports, imports first."""
    from google.protobuf import descriptor_pb2

    files = descriptor_pb2.FileDescriptorSet()
    seen: set[str] = set()

    def add(one: FileDescriptor) -> None:
        if one.name in seen:
            return
        seen.add(one.name)
        for dependency in one.dependencies:
            add(dependency)
        one.CopyToProto(files.file.add())

    add(file)
    return files.SerializeToString(deterministic=True)


def event_schema() -> bytes:
    """``foxglove.Log`` with one field more: the run's time of the event in s, to the last bit."""
    from foxglove_schemas_protobuf import Log_pb2
    from google.protobuf import descriptor_pb2

    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(Log_pb2.DESCRIPTOR))
    field_type = descriptor_pb2.FieldDescriptorProto
    (log,) = (m for f in files.file for m in f.message_type if f.package == "foxglove" and m.name == "Log")
    log.field.add(
        name="time",
        json_name="time",
        number=EVENT_TIME_FIELD,
        label=field_type.LABEL_OPTIONAL,
        type=field_type.TYPE_DOUBLE,
    )
    return files.SerializeToString(deterministic=True)


def message_class(message_type: str, schema: bytes) -> type[Message]:
    """Class that parses messages of a schema.

    Raises:
        ValueError: the schema is no FileDescriptorSet or does not hold the type.
    """
    from google.protobuf import descriptor_pb2, descriptor_pool, message, message_factory

    pool = descriptor_pool.DescriptorPool()
    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(schema)
        for file in files.file:
            pool.Add(file)
        descriptor: Any = pool.FindMessageTypeByName(message_type)
        return message_factory.GetMessageClass(descriptor)
    except (message.DecodeError, KeyError, TypeError) as error:
        raise ValueError(f"schema of {message_type} cannot be used: {error}") from None
