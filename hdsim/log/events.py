"""Events of a run as messages of a log."""

from __future__ import annotations

from hdsim.errors import InputError
from hdsim.recording import Event

_LEVELS = {"info": 2, "warning": 3, "error": 4}


def event_message(event: Event, at: int) -> bytes:
    """A serialized ``foxglove.Log`` with the event's exact time besides.

    Args:
        event: what happened.
        at: its time in ns since 1970.

    Raises:
        InputError: an unknown level.
    """
    from foxglove_schemas_protobuf.Log_pb2 import Log
    from google.protobuf.timestamp_pb2 import Timestamp

    from hdsim.log.schemas import EVENT_TIME_FIELD
    from hdsim.log.streams import double_field

    if event.level not in _LEVELS:
        raise InputError(f"event level {event.level!r} is unknown; allowed: {', '.join(_LEVELS)}")
    seconds, nanos = divmod(at, 1_000_000_000)
    log = Log(
        timestamp=Timestamp(seconds=seconds, nanos=nanos),
        level=_LEVELS[event.level],  # type: ignore[arg-type]
        message=event.message,
        name=event.source,
    )
    return log.SerializeToString(deterministic=True) + double_field(EVENT_TIME_FIELD, event.time)
