"""Whether the messages of a log's channel parse as their schema says."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
from mcap import records

from hdsim.log import joint_states, scan, schemas
from hdsim.log.reader import double_fields
from hdsim.log.rows import HEAD, DoubleField, RowLayout


class MessageCheck:
    """Whether messages of a channel parse."""

    def __init__(self, channel: records.Channel, schema: records.Schema | None) -> None:
        self._json = channel.message_encoding == "json"
        self._fields: list[DoubleField] | None = None
        self._class: Any = None
        self._joints = False
        self.reason: str | None = None
        if channel.message_encoding == "protobuf" and schema is not None:
            self._class = schemas.message_class(schema.name, schema.data)
            fields = double_fields(schema)
            self._fields = None if fields is None else [f for _, f in fields]
        elif (
            channel.message_encoding == "cdr"
            and schema is not None
            and schema.name == joint_states.MESSAGE_TYPE
        ):
            self._joints = True
        elif not self._json:
            self.reason = f"topic {channel.topic}: encoding {channel.message_encoding!r} is not checked here"

    def take(self, run: scan.Run) -> str | None:
        """Check a run of messages; returns what is wrong."""
        if self._fields is not None:
            first = memoryview(run.data)[run.start + HEAD.size : run.start + run.size]
            layout = RowLayout.of_message(self._fields, first)
            whole = np.frombuffer(run.data, np.uint8, run.count * run.size, run.start)
            # All tags and lengths are right, and all else is doubles: nothing is left that could not parse.
            if layout is not None and layout.matches(whole.reshape(run.count, run.size)):
                run = replace(run, count=1)
        if self._class is None and not self._json and not self._joints:
            return None
        for index, body in enumerate(scan.message_bodies(run)):
            try:
                if self._joints:
                    wrong = joint_states.problem_of(bytes(body))
                    if wrong:
                        return f"message {index} of a run does not parse: {wrong}"
                elif self._json:
                    json.loads(body, parse_constant=_refuse)
                else:
                    self._class.FromString(body)
            except Exception as error:  # protobuf and json raise types of their own
                return f"message {index} of a run does not parse: {error}"
        return None


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not JSON")
