"""The messages of a log lie in the order of their times, whatever order they were written in."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
from driving import drive_run
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader

from hdsim.errors import InputError
from hdsim.log import LogWriter, open_log, recover_log, verify_log, write_log
from hdsim.recording import Column, Event, Recording, Table


def disorder(path: Path) -> list[str]:
    """What ``mcap doctor`` says of the order: topics of messages that are earlier than one before them.

    Its check (``check_message_order``) holds each message against the largest log time so far in the file.
    """
    topics: dict[int, str] = {}
    found, largest = [], 0
    with open(path, "rb") as file:
        for record in StreamReader(file).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                if record.log_time < largest:
                    found.append(topics[record.channel_id])
                largest = max(largest, record.log_time)
    return found


def chunks(path: Path) -> list[Chunk]:
    with open(path, "rb") as file:
        return [r for r in StreamReader(file, emit_chunks=True).records if isinstance(r, Chunk)]


def wide(rows: int, rate: float, columns: int) -> Table:
    rng = np.random.default_rng(columns)
    values = {f"x{k}": Column(rng.standard_normal(rows), "m") for k in range(columns)}
    return Table(np.arange(rows) / rate, values)


def test_tables_written_one_after_the_other_lie_in_the_order_of_time(tmp_path):
    tables = {"state": wide(6000, 1000.0, 40), "slow": wide(60, 10.0, 40), "fast": wide(9000, 2000.0, 5)}
    events = [Event(0.05 * k, "info", "x", "tick" * (k % 7)) for k in range(100)]
    path = write_log(Recording(tables, events=events, metadata={"scenario": "a: 1"}), tmp_path / "a.mcap")
    assert disorder(path) == []
    assert len(chunks(path)) >= 4
    assert verify_log(path).problems == []
    back = open_log(path)
    for name, table in tables.items():
        np.testing.assert_array_equal(back.tables[name].time, table.time)
        for column, values in table.columns.items():
            np.testing.assert_array_equal(back.tables[name][column], values.values)
    assert back.events == events


def test_a_run_with_scene_loops_and_views_lies_in_the_order_of_time(tmp_path):
    path = write_log(drive_run(), tmp_path / "a.mcap")
    topics = {t.topic for t in verify_log(path).topics.values()}
    assert {"/hd/state_loop", "/hd/state_view", "/hd/scene", "/hd/transforms", "/joint_states"} <= topics
    assert disorder(path) == []


def test_a_short_log_has_several_chunks_each_with_all_that_it_needs(tmp_path):
    path = write_log(Recording({"state": wide(10_000, 1000.0, 20)}), tmp_path / "a.mcap")
    found = chunks(path)
    # About eight, so that damage to one costs an eighth.
    assert 6 <= len(found) <= 12
    starts = [chunk.message_start_time for chunk in found]
    assert starts == sorted(starts)
    content = bytearray(path.read_bytes())
    begin = content.index(found[3].data)
    content[begin + 100] ^= 1
    path.write_bytes(content)
    report = recover_log(path, tmp_path / "b.mcap")
    assert report.chunks == len(found) - 1
    assert disorder(tmp_path / "b.mcap") == []
    assert len(open_log(tmp_path / "b.mcap").time) > 8000


@pytest.mark.parametrize("compression", ["zstd", "none"])
def test_the_compression_is_the_one_that_was_asked_for(tmp_path, compression):
    with LogWriter(tmp_path / "a.mcap", metadata={}, compression=compression) as log:
        log.write("state", wide(100, 1000.0, 2))
    assert {c.compression for c in chunks(tmp_path / "a.mcap")} == {
        "" if compression == "none" else compression
    }


def test_where_there_is_no_room_for_the_log_what_was_computed_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.mcap"

    def full(source: object, target: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    log = LogWriter(path, metadata={})
    log.write("state", wide(100, 1000.0, 2))
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(InputError, match=r"No space left.*a\.mcap\.partial holds everything"):
            log.close()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap.partial"]
    recover_log(tmp_path / "a.mcap.partial", path)
    assert len(open_log(path).time) == 100
