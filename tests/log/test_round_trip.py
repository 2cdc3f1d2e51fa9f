from __future__ import annotations

import io
import math
import struct

import numpy as np
import pytest
from comparing import assert_same, assert_same_bits
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mcap.records import Channel, Schema
from mcap.writer import Writer

from hdsim.errors import InputError
from hdsim.log import LogWriter, naming, open_log, read_attachments, verify_log, write_log
from hdsim.log.scan import map_file, walk
from hdsim.log.schemas import message_class
from hdsim.recording import Column, Event, Recording, Table

doubles = hnp.from_dtype(np.dtype("<f8"))
names = st.text(min_size=1, max_size=8)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    n = draw(st.integers(0, 40))
    steps = draw(hnp.arrays(np.float64, n, elements=st.floats(1e-6, 10.0)))
    columns = {}
    for name in draw(st.lists(names, max_size=4, unique=True)):
        k = draw(st.one_of(st.none(), st.integers(0, 5)))
        values = draw(hnp.arrays(np.float64, (n,) if k is None else (n, k), elements=doubles))
        columns[name] = Column(values, draw(st.text(max_size=4)), draw(st.text(max_size=8)))
    return Table(np.cumsum(steps) - 5.0, columns)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    found = draw(st.lists(st.sampled_from(["state", "teeth", "x", "A_b"]), max_size=3, unique=True))
    static_shape = hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3)
    return Recording(
        {name: draw(tables()) for name in found},
        static={
            name: Column(draw(hnp.arrays(np.float64, static_shape, elements=doubles)), "m", "d")
            for name in draw(st.lists(names, max_size=3, unique=True))
        },
        events=[
            Event(draw(st.floats(-1e3, 1e6)), level, draw(st.text(max_size=5)), draw(st.text(max_size=5)))
            for level in draw(st.lists(st.sampled_from(["info", "warning", "error"]), max_size=3))
        ],
        metadata=draw(st.dictionaries(names, st.text(max_size=20), max_size=3)),
    )


@given(recordings())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_recording_comes_back_bit_by_bit(tmp_path, recording):
    path = write_log(recording, tmp_path / "run.mcap")
    assert_same(open_log(path), recording)
    problems = verify_log(path).problems
    assert [p for p in problems if p != "there is no attachment"] == []


def test_a_run_with_everything_comes_back_bit_by_bit(recording, tmp_path):
    path = recording.save(tmp_path / "logs" / "run.mcap")
    assert_same(open_log(path), recording)
    assert verify_log(path).ok
    assert read_attachments(path)["scenario.yaml"] == b"preset: seed-2021\n"
    assert [p.name for p in path.parent.iterdir()] == ["run.mcap"]


def test_nan_payloads_and_the_sign_of_zero_survive(tmp_path):
    odd = struct.unpack("<2d", struct.pack("<2Q", 0x7FF8000000000123, 0x8000000000000000))
    table = Table(np.arange(2.0), {"a": Column(np.array(odd), "1")})
    back = open_log(write_log(Recording({"state": table}), tmp_path / "a.mcap"))
    assert_same_bits(back["a"], np.array(odd))


def test_rows_larger_than_a_chunk(tmp_path):
    values = np.random.default_rng(0).standard_normal((3, 300_000))
    recording = Recording({"field": Table(np.arange(3.0), {"u": Column(values, "m")})})
    path = write_log(recording, tmp_path / "a.mcap")
    assert_same(open_log(path), recording)


def test_blocks_of_any_size_give_the_same_file(recording, tmp_path):
    state = recording.tables["state"]

    def write(path, cuts):
        with LogWriter(path, metadata={"a": "b"}, view_rate_hz=500.0) as log:
            for begin, end in zip([0, *cuts], [*cuts, len(state)], strict=True):
                block = {n: Column(c.values[begin:end], c.unit) for n, c in state.columns.items()}
                log.write("state", Table(state.time[begin:end], block))
        return path.read_bytes()

    whole = write(tmp_path / "a.mcap", [])
    rng = np.random.default_rng(1)
    for index in range(3):
        cuts = sorted(rng.integers(0, len(state), 10 ** (index + 1)).tolist())
        assert write(tmp_path / "b.mcap", cuts) == whole


def test_equal_recordings_give_equal_files(recording, tmp_path):
    first = write_log(recording, tmp_path / "a.mcap").read_bytes()
    assert write_log(recording, tmp_path / "b.mcap").read_bytes() == first


def test_a_writer_may_use_its_block_again(tmp_path):
    time, values = np.zeros(10), np.zeros(10)
    written = []
    with LogWriter(tmp_path / "a.mcap", metadata={}, view_rate_hz=7.0) as log:
        for block in range(20):
            time[:] = np.arange(10) + 10 * block
            values[:] = np.sin(time)
            log.write("state", Table(time / 10.0, {"a": Column(values, "1")}))
            written.append(values.copy())
        time[:] = values[:] = np.nan
    assert_same_bits(open_log(tmp_path / "a.mcap")["a"], np.concatenate(written))
    assert verify_log(tmp_path / "a.mcap").problems == ["there is no attachment"]


def test_integers_and_booleans_become_doubles(tmp_path):
    columns = {"n": Column(np.arange(3), "1"), "on": Column(np.array([True, False, True]), "1")}
    back = open_log(write_log(Recording({"state": Table(np.arange(3.0), columns)}), tmp_path / "a.mcap"))
    assert back["n"].tolist() == [0, 1, 2]
    assert back["on"].tolist() == [1, 0, 1]


def test_metadata_and_attachments_lie_before_the_first_chunk(recording, tmp_path):
    path = write_log(recording, tmp_path / "a.mcap", attachments={"b.json": "{}", "c.bin": b"\x00"})
    opcodes = [span.opcode for span in walk(map_file(path))]
    first_chunk = opcodes.index(0x06)
    assert opcodes[0] == 0x01
    assert opcodes[1:5] == [0x0C, 0x09, 0x09, 0x09]
    assert first_chunk > 4
    found = {name: data for name, data in read_attachments(path).items() if not name.startswith("layout-")}
    assert found == {"b.json": b"{}", "c.bin": b"\x00", "scenario.yaml": b"preset: seed-2021\n"}


def test_statistics_join_the_metadata(tmp_path):
    log = LogWriter(tmp_path / "a.mcap", metadata={"seed": "1"})
    log.write("state", Table(np.arange(2.0), {"a": Column(np.zeros(2), "1")}))
    log.close({"steps": "17"})
    assert open_log(tmp_path / "a.mcap").metadata == {"seed": "1", "steps": "17"}


def test_an_exception_leaves_a_sound_log_that_says_so(tmp_path):
    path = tmp_path / "a.mcap"

    def run() -> None:
        with LogWriter(path, metadata={}, attachments={"a": "b"}) as log:
            log.write("state", Table(np.arange(5.0), {"a": Column(np.arange(5.0), "1")}))
            raise ZeroDivisionError("the spring broke")

    with pytest.raises(ZeroDivisionError):
        run()
    assert verify_log(path).ok
    back = open_log(path)
    assert back["a"].tolist() == [0, 1, 2, 3, 4]
    assert back.metadata["incomplete"] == "ZeroDivisionError: the spring broke"
    assert back.events[-1].level == "error"
    assert back.events[-1].time == 4.0
    assert not (tmp_path / "a.mcap.partial").exists()


def test_log_times_are_nanoseconds_of_the_documented_epoch():
    assert np.datetime64("2020-01-01T00:00:00", "ns").astype(np.int64) == naming.EPOCH_NS
    assert naming.to_ns(np.array([1e-9, 0.1])).tolist() == [
        naming.EPOCH_NS + 1,
        naming.EPOCH_NS + 100_000_000,
    ]


def foreign_copy(path, out, encode):
    """Write a log anew by the mcap package, each message through ``encode(class, body)``."""
    from mcap.reader import make_reader

    with open(path, "rb") as source, open(out, "wb") as target:
        reader, writer = make_reader(source), Writer(target, chunk_size=4096)
        writer.start()
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        ids: dict[int, int] = {}
        classes: dict[int, type] = {}
        source.seek(0)
        for schema, channel, message in make_reader(source).iter_messages():
            assert isinstance(schema, Schema)
            assert isinstance(channel, Channel)
            if channel.message_encoding != "protobuf":
                continue
            if channel.id not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(
                    channel.topic, "protobuf", schema_id, channel.metadata
                )
                classes[channel.id] = message_class(schema.name, schema.data)
            body = encode(classes[channel.id], message.data)
            writer.add_message(ids[channel.id], message.log_time, body, message.publish_time)
        writer.finish()


def test_messages_that_another_program_serialized_are_read(recording, tmp_path):
    """Zeros left out, topics mixed in each chunk, other channel numbers: still the same doubles."""
    recording.tables["state"] = state = Table(
        recording.time[:500],
        {n: Column(np.round(c.values[:500]), c.unit) for n, c in recording.channels.items()},
    )
    state["motor_angle"][:] = np.nan_to_num(state["motor_angle"]) + 0.0
    state["time"][:] = 0.0
    path = write_log(recording, tmp_path / "a.mcap")
    foreign_copy(path, tmp_path / "b.mcap", lambda cls, body: cls.FromString(body).SerializeToString())
    assert (tmp_path / "b.mcap").stat().st_size
    back = open_log(tmp_path / "b.mcap")
    recording.events.sort(key=lambda e: naming.to_ns(np.array([e.time]))[0])
    for name in ("motor_angle", "output torque", "time"):
        np.testing.assert_array_equal(back[name], state[name])
    np.testing.assert_array_equal(
        back.tables["teeth"]["normal_force"], recording.tables["teeth"]["normal_force"]
    )
    assert [e.message for e in back.events]


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (Table(np.array([2.0]), {"b": Column(np.zeros(1), "1")}), "began with columns a .*this block has b"),
        (Table(np.array([2.0]), {"a": Column(np.zeros((1, 2)), "1")}), "began with columns"),
        (Table(np.array([1.0]), {"a": Column(np.zeros(1), "1")}), r"1\.0 s follows 1\.0 s"),
        (Table(np.array([2.0, math.nan]), {"a": Column(np.zeros(2), "1")}), "nan s cannot be logged"),
        (Table(np.array([2.0]), {"a": Column(np.array(["x"]), "1")}), "allowed: numbers"),
        (Table(np.array([2.0]), {"a": Column(np.zeros((1, 2, 3)), "1")}), r"allowed: \(n,\) or \(n, k\)"),
        (Table(np.array([2.0]), {"a": Column(np.zeros(2), "1")}), "2 rows"),
    ],
)
def test_a_block_that_does_not_continue_its_table_is_refused(tmp_path, second, message):
    log = LogWriter(tmp_path / "a.mcap", metadata={})
    log.write("state", Table(np.array([1.0]), {"a": Column(np.zeros(1), "1")}))
    with pytest.raises(InputError, match=message):
        log.write("state", second)
    log.close()
    assert open_log(tmp_path / "a.mcap").time.tolist() == [1.0]


@pytest.mark.parametrize("name", ["static", "state_view", "a b", "", "events"])
def test_tables_whose_topic_is_taken_are_refused(tmp_path, name):
    with pytest.raises(InputError, match="table name"), LogWriter(tmp_path / "a.mcap", metadata={}) as log:
        log.write(name, Table(np.zeros(0)))


def test_places_that_cannot_be_written_are_input_errors(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a folder"):
        LogWriter(tmp_path, metadata={})
    with pytest.raises(InputError, match="cannot be written"):
        LogWriter(tmp_path / "file" / "a.mcap", metadata={})
    with pytest.raises(InputError, match="allowed: text"):
        LogWriter(tmp_path / "a.mcap", metadata={"n": 1})  # type: ignore[dict-item]


def test_importing_the_package_loads_nothing_heavy():
    import subprocess
    import sys

    code = (
        "import sys, hdsim.log, hdsim.log.commands; "
        "print(sorted({'mcap', 'numpy', 'google.protobuf', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_mcap_package_reads_every_message(recording, tmp_path):
    from mcap.reader import NonSeekingReader

    path = write_log(recording, tmp_path / "a.mcap")
    reader = NonSeekingReader(io.BytesIO(path.read_bytes()), validate_crcs=True)
    counts: dict[str, int] = {}
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        assert schema is not None
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        if counts[channel.topic] == 8 and channel.message_encoding == "protobuf":
            parsed = message_class(schema.name, schema.data).FromString(message.data)
            if channel.topic == "/hd/state":
                assert parsed.time == recording.time[7]
                assert parsed.output_torque == recording["output torque"][7]
                assert math.isnan(parsed.motor_angle)
    assert counts["/hd/state"] == 30_000
    assert counts["/hd/teeth"] == 300
    assert counts["/hd/static"] == 1
    assert counts["/hd/events"] == 3
    assert "/hd/empty" not in counts
