"""The joint states of a log as a bag for ROS 2: an MCAP file of profile ``ros2``.

That profile wants every channel in CDR with its quality of service (https://mcap.dev/spec/registry#ros2), and
readers of bags refuse a file of another one, or with a message that is none of ROS 2. So a log, whose tables
are protobuf, cannot be a bag; this is the part of it that can.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from mcap import records
from mcap.opcode import Opcode

from hdsim.errors import InputError
from hdsim.log import scan
from hdsim.log.container import Container, MessageIndexes, encode, opened
from hdsim.log.joint_states import TOPIC

_QUALITY = """\
- history: keep_last
  depth: 10
  reliability: reliable
  durability: volatile
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""


def write_bag(path: Path, out: Path) -> None:
    """Write the joint states of a log as a bag of one file.

    Raises:
        InputError: the log cannot be read, is damaged, or has no joint states; ``out`` cannot be written.
    """
    data = scan.map_file(path)
    with opened(out, out) as stream:
        container = Container(stream, profile="ros2")
        try:
            found = _copy(data, container)
        except scan.DamageError as error:
            raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
        container.finish()
    if not found:
        raise InputError(
            f"{path} has no {TOPIC}: neither the angle of the motor nor that of the output is in it"
        )


def _copy(data: scan.Buffer, container: Container) -> bool:
    schemas: dict[int, records.Schema] = {}
    channels: dict[int, records.Channel] = {}
    found = False
    for span in scan.walk(data):
        if span.opcode != Opcode.CHUNK:
            continue
        for run in scan.runs(scan.open_chunk(data, span).data, channels.__contains__):
            if run.opcode == Opcode.SCHEMA:
                schema = scan.parse(records.Schema, run.data, run.span)
                schemas[schema.id] = schema
            elif run.opcode == Opcode.CHANNEL:
                channel = scan.parse(records.Channel, run.data, run.span)
                if channel.topic == TOPIC and channel.message_encoding == "cdr":
                    channels[channel.id] = replace(channel, metadata={"offered_qos_profiles": _QUALITY})
            elif run.opcode == Opcode.MESSAGE:
                found = True
                heads = scan.message_heads(run)
                channel = channels[int(heads["channel"][0])]
                schema = schemas[channel.schema_id]
                head = encode(schema) + encode(channel)
                indexes = MessageIndexes()
                indexes.add(channel.id, heads["log_time"], len(head) + run.size * np.arange(run.count))
                body = run.data[run.start : run.start + run.size * run.count]
                container.chunk(head + body, indexes, [schema], [channel])
    return found
