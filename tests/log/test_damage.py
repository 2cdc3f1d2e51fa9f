from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from comparing import assert_same, assert_same_bits
from mcap.writer import Writer

from hdsim.errors import InputError
from hdsim.log import info_log, naming, open_log, recover_log, verify_log, write_log
from hdsim.log.container import Container, MessageIndexes
from hdsim.log.scan import TruncatedError, map_file, open_chunk, walk
from hdsim.recording import Column, Recording, Table

CHUNK = 0x06


def spans(path, opcode):
    return [s for s in walk(map_file(path)) if s.opcode == opcode]


def flip(path, at):
    with open(path, "r+b") as file:
        file.seek(at)
        byte = file.read(1)[0]
        file.seek(at)
        file.write(bytes([byte ^ 0x10]))


@pytest.fixture
def log(recording, tmp_path):
    return write_log(recording, tmp_path / "run.mcap")


def test_recovering_a_sound_log_loses_nothing(log, recording, tmp_path):
    report = recover_log(log, tmp_path / "new.mcap")
    assert report.lost == []
    assert verify_log(tmp_path / "new.mcap").ok
    back = open_log(tmp_path / "new.mcap")
    assert back.metadata.pop("recovered") == ""
    assert_same(back, recording)


@pytest.mark.slow
@pytest.mark.parametrize(("anywhere", "apart"), [(12, 5), pytest.param(30, 2, marks=pytest.mark.study)])
def test_a_flipped_byte_anywhere_is_noticed(log, anywhere, apart):
    size = log.stat().st_size
    rng = np.random.default_rng(5)
    places = [*rng.integers(8, size - 8, anywhere).tolist(), *range(size - 40, size, apart)]
    for at in places:
        flip(log, at)
        with pytest.raises(InputError, match=r"hdsim recover|not an MCAP"):
            open_log(log)
        assert not verify_log(log).ok, at
        flip(log, at)
    assert verify_log(log).ok


def test_a_flipped_byte_costs_one_chunk(log, recording, tmp_path):
    chunks = spans(log, CHUNK)
    topic = b"\x09\x00\x00\x00/hd/state"
    lost = next(s for s in chunks if topic in open_chunk(map_file(log), s).data[:4000])
    flip(log, (lost.start + lost.end) // 2)
    report = recover_log(log, tmp_path / "new.mcap")
    assert report.chunks == len(chunks) - 1
    assert len(report.lost) == 1
    assert str(lost.start) in report.lost[0]
    assert verify_log(tmp_path / "new.mcap").ok
    back = open_log(tmp_path / "new.mcap")
    assert 0 < len(back.time) < len(recording.time)
    kept = np.isin(recording.time, back.time)
    for name in recording:
        assert_same_bits(back[name], recording[name][kept])


@pytest.mark.parametrize("byte", range(1, 9))
def test_a_damaged_record_length_costs_one_chunk(log, tmp_path, byte):
    chunks = spans(log, CHUNK)
    flip(log, chunks[1].start + byte)
    report = recover_log(log, tmp_path / "new.mcap")
    assert report.chunks >= len(chunks) - 1
    assert verify_log(tmp_path / "new.mcap").ok


@pytest.mark.slow
def test_recovery_never_fails_or_invents(log, recording, tmp_path):
    """Bytes changed at random: what comes back is a sound log of rows that were written."""
    whole = log.read_bytes()
    rng = np.random.default_rng(11)
    for _ in range(25):
        data = bytearray(whole[: rng.integers(len(whole) // 2, len(whole))])
        for at in rng.integers(8, len(data), 5):
            data[at] = rng.integers(256)
        log.write_bytes(data)
        recover_log(log, tmp_path / "new.mcap")
        assert not [p for p in verify_log(tmp_path / "new.mcap").problems if "there is no" not in p]
        state = open_log(tmp_path / "new.mcap").tables.get("state")
        if state is not None:
            kept = np.isin(recording.time, state.time)
            assert_same_bits(state.time, recording.time[kept])


@pytest.mark.parametrize("share", [0.999, 0.7, 0.3])
def test_a_truncated_log_names_the_remedy_and_is_recovered(log, recording, tmp_path, share):
    end = int(share * log.stat().st_size)
    whole = sum(s.end <= end for s in spans(log, CHUNK))
    os.truncate(log, end)
    with pytest.raises(InputError, match=r"is truncated: .*hdsim recover .*run\.mcap"):
        open_log(log)
    with pytest.raises(InputError, match="hdsim recover"):
        info_log(log)
    assert not verify_log(log).ok
    report = recover_log(log, tmp_path / "new.mcap")
    assert report.chunks == whole
    assert verify_log(tmp_path / "new.mcap").ok
    back = open_log(tmp_path / "new.mcap")
    # Nothing is lost where only the summary is.
    assert ("than there are" in back.metadata["recovered"]) == (share < 0.9)
    n = len(back.tables["state"]) if "state" in back.tables else 0
    assert_same_bits(back.time, recording.time[:n])


KILLED = """
import sys, time
import numpy as np
from hdsim.log import LogWriter
from hdsim.recording import Column, Event, Table
with LogWriter(sys.argv[1], metadata={"seed": "7"}, attachments={"scenario.yaml": "a: 1"}) as log:
    log.write_event(Event(0.0, "info", "run", "begins"))
    for block in range(10_000):
        t = np.arange(1000.0) + 1000 * block
        log.write("state", Table(t, {"a": Column(np.sin(t), "rad", "angle")}))
        if block == 100:
            print("ready", flush=True)
        time.sleep(1e-4)
"""


def test_a_killed_run_is_recovered(tmp_path):
    path = tmp_path / "run.mcap"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    partial = tmp_path / "run.mcap.partial"
    with pytest.raises(InputError, match=r"no such file; .*hdsim recover .*run\.mcap\.partial"):
        open_log(path)
    whole = 0
    try:
        for span in walk(map_file(partial)):
            whole += span.opcode == CHUNK
    except TruncatedError:
        pass
    else:
        pytest.fail("the killed run left a whole file")
    report = recover_log(partial, path)
    assert report.chunks == whole >= 3
    assert verify_log(path).ok
    back = open_log(path)
    assert len(back.time) > 50_000
    assert_same_bits(back.time, np.arange(float(len(back.time))))
    assert_same_bits(back["a"], np.sin(back.time))
    assert back.unit("a") == "rad"
    assert back.metadata["seed"] == "7"
    assert [e.message for e in back.events] == ["begins"]


def test_files_that_are_no_logs_are_input_errors(tmp_path):
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "text").write_text("motor: 3\n" * 50)
    (tmp_path / "mark").write_bytes(b"\x89MCAP0\r\n")
    for read in (open_log, verify_log, info_log):
        with pytest.raises(InputError, match="no such file"):
            read(tmp_path / "missing.mcap")
        with pytest.raises(InputError, match="is a folder"):
            read(tmp_path)
        with pytest.raises(InputError, match="not an MCAP log: found an empty file"):
            read(tmp_path / "empty")
        with pytest.raises(InputError, match="not an MCAP log: found a file that begins with b'motor"):
            read(tmp_path / "text")
    with pytest.raises(InputError, match="holds nothing whole"):
        recover_log(tmp_path / "mark", tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()
    assert not (tmp_path / "new.mcap.partial").exists()


def test_recovering_onto_itself_is_refused(log):
    with pytest.raises(InputError, match="is the damaged log itself"):
        recover_log(log, log)


def test_a_foreign_mcap_is_named_as_such(tmp_path):
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/joint_states", "json", 0)
        writer.add_message(channel, 1, b'{"a": NaN}', 1)
        writer.register_channel("/silent", "json", 0)
        writer.finish()
    with pytest.raises(InputError, match="not a log of hdsim; its topics: /joint_states"):
        open_log(tmp_path / "a.mcap")
    problems = "\n".join(verify_log(tmp_path / "a.mcap").problems)
    assert "NaN is not JSON" in problems
    assert "/silent has a channel but no message" in problems
    assert "no metadata record hdsim.run" in problems


@pytest.mark.parametrize("wrong", ["index", "order", "publish", "payload", "unindexed"])
def test_verify_finds_what_a_writer_can_do_wrong(tmp_path, wrong):
    from mcap.records import Channel, Schema

    from hdsim.log.container import encode
    from hdsim.log.rows import HEAD
    from hdsim.log.schemas import table_schema

    body = b"\x09" + np.float64(3.5).tobytes()
    schema = Schema(id=1, name="hdsim.T", encoding="protobuf", data=table_schema("hdsim.T", []))
    channel = Channel(id=1, topic="/hd/t", message_encoding="protobuf", schema_id=1, metadata={})
    head = encode(schema) + encode(channel)
    bodies = [body, b"\x09\x00" if wrong == "payload" else body]
    times = [naming.EPOCH_NS + 5, naming.EPOCH_NS + (4 if wrong == "order" else 6)]
    data, offsets = head, []
    for t, b in zip(times, bodies, strict=True):
        offsets.append(len(data))
        data += HEAD.pack(5, 22 + len(b), 1, 0, t, t + (wrong == "publish")) + b
    if wrong == "index":
        offsets[1] += 1
    if wrong == "unindexed":
        times, offsets = times[:1], offsets[:1]
    indexes = MessageIndexes()
    indexes.add(1, np.array(times), np.array(offsets))
    with open(tmp_path / "a.mcap", "wb") as file:
        container = Container(file)
        container.metadata(naming.RUN_RECORD, {})
        container.attachment("a", "text/plain", b"", 0)
        container.chunk(data, indexes, [schema], [channel])
        container.finish()
    expected = {
        "index": "message index",
        "order": "log time goes back",
        "publish": "publish time differs",
        "payload": "does not parse",
        "unindexed": "message index",
    }
    assert any(expected[wrong] in p for p in verify_log(tmp_path / "a.mcap").problems)


def test_an_empty_recording_is_a_sound_log(tmp_path):
    path = write_log(Recording({}, metadata={"scenario": "a: 1"}), tmp_path / "a.mcap")
    assert verify_log(path).ok
    assert_same(open_log(path), Recording({}, metadata={"scenario": "a: 1"}))
    table = Recording({"state": Table(np.zeros(0), {"a": Column(np.zeros((0, 7)), "m")})})
    assert_same(open_log(write_log(table, tmp_path / "b.mcap")), table)
