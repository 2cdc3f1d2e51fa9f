"""In words, what a run is in: which flank carries the load, and whether a limit is reached. For viewers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdsim.log.facts import Facts
from hdsim.log.naming import Array
from hdsim.log.scene_frames import Ticks
from hdsim.log.shapes import embed

TOPIC = "/hd/states"
MESSAGE_TYPE = "hdsim.States"
_FIELDS = ("flank", "torque", "motor")

_RATE_HZ = 1000.0
"""Of a log whose view keeps every sample."""
_LEAST = 9
"""Samples that a state has to last to be told: shorter ones would be labels without a bar."""
_REPEATED = 12
"""Samples after which a state that lasts is said again: viewers draw it up to the last message."""
_UNLOADED = 1e-3
"""Share of the rated torque below which no flank counts as loaded."""
_AT_LIMIT = 1 - 1e-9


class StateFinder:
    """Finds the states of a run's samples, at most at a rate, and the messages where they change.

    Args:
        facts: the torques that states are held against; without a rated torque nothing is found.
        rate: of the samples that are looked at, Hz.

    Attributes:
        fields: of the messages.
    """

    def __init__(self, facts: Facts, rate: float) -> None:
        self._facts = facts
        self.fields = _FIELDS if facts.torque_limit_nm > 0 else _FIELDS[:2]
        self._ticks = Ticks(rate if np.isfinite(rate) else _RATE_HZ)
        self._now: tuple[str, ...] | None = None
        self._told: tuple[str, ...] | None = None
        self._begun = 0.0
        self._lasted = 0
        self._untold = 0
        self._end = 0.0

    def feed(self, time: Array, columns: Mapping[str, Array]) -> tuple[Array, list[bytes]]:
        """Times (k,) of changes in the next rows, s, and now and then between, and the messages."""
        torque, rated = columns.get("output_torque"), self._facts.rated_torque_nm
        if rated <= 0 or torque is None or torque.ndim != 1 or not len(time):
            return time[:0], []
        rows = self._ticks.rows(time)
        torque = torque[rows]
        flank = np.where(torque > 0, "positive flank", "negative flank")
        flank[np.abs(torque) <= _UNLOADED * rated] = "in the gap"
        engaged = columns.get("engaged_share")
        if engaged is not None:
            flank[engaged[rows] == 0] = "in the gap"
        found = [flank, np.where(np.abs(torque) > rated, "above rated torque", "up to rated torque")]
        limit, motor = self._facts.torque_limit_nm, columns.get("motor_torque")
        if limit > 0:
            at_limit = (
                np.zeros(len(rows), bool) if motor is None else np.abs(motor[rows]) >= _AT_LIMIT * limit
            )
            found.append(np.where(at_limit, "motor at its limit", "motor below its limit"))
        samples = zip(*(f.tolist() for f in found), strict=True)
        times: list[float] = []
        messages: list[bytes] = []
        for at, words in zip(time[rows].tolist(), samples, strict=True):
            if words != self._now:
                # The run begins with the first state that lasts.
                self._begun = at if self._told is not None or self._now is None else self._begun
                self._now, self._lasted = words, 0
            self._lasted += 1
            self._untold += 1
            new = words != self._told and self._lasted >= _LEAST
            if new or (words == self._told and self._untold >= _REPEATED):
                times.append(self._begun if new else at)
                messages.append(_message(words))
                self._told, self._untold = words, 0
            self._end = at
        return np.array(times), messages

    def finish(self) -> tuple[Array, list[bytes]]:
        """The last state once more, so that it is seen to last to the end."""
        words = self._told or self._now
        if words is None or not self._untold:
            return np.zeros(0), []
        return np.array([self._begun if self._told is None else self._end]), [_message(words)]


def _message(words: Sequence[str]) -> bytes:
    return b"".join(embed(k, word.encode()) for k, word in enumerate(words, start=1))


def schema(fields: Sequence[str]) -> bytes:
    """FileDescriptorSet of the message: a text for each field."""
    from google.protobuf import descriptor_pb2

    package, _, name = MESSAGE_TYPE.partition(".")
    field_type = descriptor_pb2.FieldDescriptorProto
    files = descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name=f"{package}/{name}.proto", package=package, syntax="proto3")
    message = file.message_type.add(name=name)
    for number, field in enumerate(fields, start=1):
        message.field.add(
            name=field,
            json_name=field,
            number=number,
            label=field_type.LABEL_OPTIONAL,
            type=field_type.TYPE_STRING,
        )
    return files.SerializeToString(deterministic=True)
