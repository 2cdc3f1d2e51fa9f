"""Writing a log while the run goes on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hdsim.errors import InputError
from hdsim.log import naming
from hdsim.log.container import Container, Watch, opened
from hdsim.log.digest import Digest
from hdsim.log.events import event_message
from hdsim.log.joint_states import MESSAGE_TYPE, JointStates, JointStateStream
from hdsim.log.ordering import order_log
from hdsim.log.streams import MessageStream, TableStream
from hdsim.log.view import DEFAULT_VIEW_RATE_HZ, MinMaxView
from hdsim.log.viewing import LoopStream, ViewStream, display_columns, scaled
from hdsim.recording import Event, Table

if TYPE_CHECKING:
    from hdsim.log.facts import Facts
    from hdsim.recording import Column

    Array = naming.Array


class LogWriter:
    """A log on its way to the disk; a context manager.

    Everything goes to ``<path>.partial``, topic by topic; closing it writes the log, in the order of time. So
    does an exception in the ``with`` block, with a record and an event of it. Only a killed process leaves a
    ``.partial``, for `hdsim.log.recover_log`.

    Metadata and attachments come first in the file, so that they survive whatever happens later.

    Args:
        path: where the log will be; folders are made, an existing log is replaced when this one is closed.
        metadata: names to text: scenario, versions, seed, solver, tolerances.
        attachments: file names to contents, such as the scenario's YAML text.
        view_rate_hz: samples a second in the decimated twin of the state; `hdsim.log.view.view_rate` has
            one that suits a run's length. Infinite keeps every sample.
        compression: of the chunks.
        watch: sees every message as it is written.
        layouts: attach the viewer's layouts that fit the log when it is closed.

    Attributes:
        drive_radius: pitch radius in m, for the camera of the layouts; a scene sets it.

    Raises:
        InputError: the file cannot be made.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        metadata: Mapping[str, str],
        attachments: Mapping[str, bytes | str] | None = None,
        view_rate_hz: float = DEFAULT_VIEW_RATE_HZ,
        compression: Literal["zstd", "none"] = "zstd",
        layouts: bool = True,
        watch: Watch | None = None,
    ) -> None:
        self.path = Path(path)
        self.partial = self.path.with_name(self.path.name + ".partial")
        for key, value in metadata.items():
            if not isinstance(value, str):
                raise InputError(f"metadata {key!r} is {type(value).__name__}; allowed: text")
        self._file = opened(self.path, self.partial)
        self._view_rate = view_rate_hz
        self._views: dict[str, ViewStream] = {}
        self._topics: dict[str, list[str]] = {}
        self._layouts = layouts
        self._digest = Digest(self, metadata, view_rate_hz)
        self.drive_radius = 0.025
        self._channels = 0
        self._tables: dict[str, TableStream] = {}
        self._messages: dict[str, MessageStream] = {}
        self._joints = JointStates(self._joint_stream)
        self._schemas: dict[str, int] = {}
        self._last_event_ns = 0
        self._open = True
        self._compression = compression
        self._container = Container(self._file, compression, draft=True)
        self._container.watch = watch
        self._container.metadata(naming.RUN_RECORD, metadata)
        for name, content in (attachments or {}).items():
            data = content.encode() if isinstance(content, str) else content
            self._container.attachment(name, naming.media_type_of(name), data, naming.EPOCH_NS)
        self._container.flush()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._open:
            return
        if error is None:
            self.close()
        else:
            self._finish(incomplete=f"{type(error).__name__}: {error}")

    def write_static(self, columns: Mapping[str, Column]) -> None:
        """Write what does not change in time, once, as one message at time zero.

        Args:
            columns: arrays of any shape; nothing is written where there are none.
        """
        if not columns:
            return
        if "static" in self._tables:
            raise InputError("the static arrays are in the log already")
        specs = naming.describe_columns(columns, rows=False)
        row = [np.asarray(c.values, np.float64).reshape(1, -1) for c in columns.values()]
        flat = [
            naming.ColumnSpec(s.name, s.field, s.unit, s.description, (values.shape[1],))
            for s, values in zip(specs, row, strict=True)
        ]
        stream = self._add_table("static", naming.STATIC_TOPIC, flat, specs, time=False)
        stream.append(None, np.array([naming.EPOCH_NS]), row)
        stream.flush()
        self._write_once(
            naming.STATIC_TOPIC + naming.VIEW_SUFFIX,
            "hdsim.StaticView",
            {about: scaled(row[index], factor) for index, factor, about in display_columns(flat)},
        )

    def write_arrays(self, topic: str, arrays: Mapping[tuple[str, str], Array]) -> None:
        """Write arrays (n,) for viewers, by name and unit, as one message at time zero of its own topic."""
        columns = {
            naming.ColumnSpec(name, name, unit, "", values.shape): values.reshape(1, -1)
            for (name, unit), values in arrays.items()
        }
        self._write_once(naming.PREFIX + topic, naming.message_type_of(topic), columns)

    def _write_once(self, topic: str, message_type: str, columns: Mapping[naming.ColumnSpec, Array]) -> None:
        if columns:
            about = {"view_of": topic.removesuffix(naming.VIEW_SUFFIX)}
            stream = self._stream(topic, message_type, list(columns), about, time=False)
            stream.append(None, np.array([naming.EPOCH_NS]), list(columns.values()))
            stream.flush()

    def write(self, name: str, block: Table) -> None:
        """Write the next rows of a table.

        Args:
            name: the table; ``state`` gets a decimated twin and a loop for viewers.
            block: rows that follow the last ones; the first block sets the columns, their order and shapes.

        Raises:
            InputError: other columns than before, or a time that does not increase.
        """
        time = np.asarray(block.time, np.float64)
        specs = naming.describe_columns(block.columns, rows=True)
        stream = self._tables.get(name) or self._add_table(name, naming.topic_of(name), specs, specs)
        columns = [np.asarray(c.values, np.float64) for c in block.columns.values()]
        stream.check(name, time, specs, columns)
        self._digest.feed(name, time, dict(zip(block.columns, columns, strict=True)))
        log_times = naming.to_ns(time)
        # The view is fed chunk by chunk, so that the file doesn't depend on how the run was cut in blocks.
        begin = 0
        while begin < len(time):
            end = min(len(time), begin + stream.room)
            rows = slice(begin, end)
            piece = [c[rows] for c in columns]
            full = stream.append(time[rows], log_times[rows], piece)
            if name in self._views:
                self._views[name].feed(time[rows], piece)
            self._joints.feed(name, time[rows], dict(zip(block.columns, piece, strict=True)))
            if full:
                self._flush_messages()
            begin = end

    def write_event(self, event: Event) -> None:
        """Write an event; it reaches the disk with the next chunk.

        Raises:
            InputError: an unknown level.
        """
        from hdsim.log.schemas import event_schema

        at = int(naming.to_ns(np.array([event.time]))[0])
        payload = event_message(event, at)
        # Log times never go back within a topic; the message itself keeps the exact time.
        self._last_event_ns = max(at, self._last_event_ns)
        self.write_messages(
            naming.EVENT_TOPIC, "foxglove.Log", event_schema, [self._last_event_ns], [payload]
        )

    def write_messages(
        self,
        topic: str,
        message_type: str,
        schema: Any,
        log_times: Iterable[int],
        payloads: Iterable[bytes],
        *,
        fields: Sequence[str] = (),
    ) -> None:
        """Write ready protobuf messages to a topic of their own, for what is no table: scenes, transforms.

        Args:
            topic: such as ``/hd/scene``.
            message_type: full protobuf name.
            schema: function that returns the serialized FileDescriptorSet; called once a topic.
            log_times: ns since 1970, not decreasing.
            payloads: one serialized message each.
            fields: of the message, as far as layouts show them.
        """
        self._check_open()
        stream = self._messages.get(topic)
        if stream is None:
            schema_id = self._schemas.setdefault(message_type, len(self._schemas) + 1)
            stream = MessageStream(
                self._container, self._next_channel(), topic, schema_id, message_type, schema()
            )
            self._messages[topic] = stream
            self._topics[topic] = list(fields)
        for log_time, payload in zip(log_times, payloads, strict=True):
            stream.append(log_time, payload)

    def write_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record of its own."""
        self._check_open()
        self._container.metadata(name, values)

    def flush(self) -> None:
        """Write out what waits for its chunk to fill, so that a killed process would not lose it."""
        for stream in self._tables.values():
            stream.flush()
        for view in self._views.values():
            view.flush()
        self._joints.flush()
        self._flush_messages()
        self._container.flush()

    def close(self, statistics: Mapping[str, str] | None = None) -> Path:
        """Finish the file and give it its name.

        Args:
            statistics: what is known at the end only (steps, run time); joins the metadata.

        Returns:
            The log's path.
        """
        if self._open:
            self._finish(statistics=statistics)
        return self.path

    def _check_open(self) -> None:
        if not self._open:
            raise InputError(f"{self.path} is closed")

    def _next_channel(self) -> int:
        self._channels += 1
        return self._channels

    def _add_table(
        self,
        name: str,
        topic: str,
        layout: Sequence[naming.ColumnSpec],
        described: Sequence[naming.ColumnSpec],
        *,
        time: bool = True,
    ) -> TableStream:
        self._check_open()
        text = naming.columns_to_json(described)
        self._container.metadata(naming.TABLE_RECORD + name, {"topic": topic, "columns": text})

        make = partial(self._stream, time=time)
        message_type = naming.message_type_of(name)
        self._tables[name] = stream = make(topic, message_type, layout, {"columns": text})
        if name in naming.VIEWED_TABLES:
            about = {"view_of": topic}
            loop_type = naming.message_type_of("loop")
            extra = display_columns(layout)
            shown = [*layout, *(column for _, _, column in extra)]
            loop = LoopStream.of(shown, lambda f: make(topic + naming.LOOP_SUFFIX, loop_type, f, about))
            twin = make(topic + naming.VIEW_SUFFIX, naming.message_type_of(name + "_view"), shown, about)
            factors = [(index, factor) for index, factor, _ in extra]
            self._views[name] = ViewStream(MinMaxView(self._view_rate), twin, factors, loop)
        return stream

    def _stream(
        self,
        topic: str,
        message_type: str,
        fields: Sequence[naming.ColumnSpec],
        about: dict[str, str],
        *,
        time: bool,
    ) -> TableStream:
        schema_id = self._schemas.setdefault(message_type, len(self._schemas) + 1)
        self._topics[topic] = [*(["time"] if time else []), *(f.field for f in fields)]
        return TableStream(
            self._container, self._next_channel(), topic, schema_id, message_type, fields, about, time=time
        )

    def _joint_stream(self) -> JointStateStream:
        schema_id = self._schemas.setdefault(MESSAGE_TYPE, len(self._schemas) + 1)
        return JointStateStream(self._container, self._next_channel(), schema_id, self._view_rate)

    def _attach_layouts(self, facts: Facts) -> None:
        """Layouts come last: what they can show is known only then, and `hdsim layout` makes them again."""
        from hdsim.log.layout import layouts_of_log

        if not self._layouts:
            return
        topics = {topic: self._topics.get(topic, []) for topic in self._container.topics}
        for name, text in layouts_of_log(topics, self._container.duration, self.drive_radius, facts).items():
            self._container.attachment(name, "application/json", text.encode(), naming.EPOCH_NS)

    def _flush_messages(self) -> None:
        for stream in self._messages.values():
            stream.flush()

    def _finish(self, statistics: Mapping[str, str] | None = None, incomplete: str | None = None) -> None:
        if incomplete is not None:
            ends = [s.last_time for s in self._tables.values() if s.last_time is not None]
            text = f"run incomplete: {incomplete}"
            self.write_event(Event(max(ends, default=0.0), "error", "hdsim.log", text))
        try:
            facts = self._digest.finish()
            for stream in self._tables.values():
                stream.flush()
            for view in self._views.values():
                view.finish()
            self._joints.flush()
            self._flush_messages()
            self._attach_layouts(facts)
            if statistics:
                self._container.metadata(naming.STATISTICS_RECORD, statistics)
            if incomplete is not None:
                self._container.metadata(naming.INCOMPLETE_RECORD, {"reason": incomplete})
            self._container.finish()
        finally:
            self._open = False
            self._file.close()
        order_log(self.partial, self.path, self._compression)
