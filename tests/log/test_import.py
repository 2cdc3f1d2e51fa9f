"""Measured recordings of every format become the same numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from foreign import ANGLE, TIME, N, write_csv
from viewing import apart, messages, turned

import hdsim
from hdsim.errors import InputError
from hdsim.log import info_log, read_attachments, verify_log, write_log
from hdsim.log.import_commands import import_data
from hdsim.log.importing import import_recording, write_imported
from hdsim.log.naming import EPOCH_NS
from hdsim.recording import Recording

ROOT = Path(__file__).resolve().parents[2]
MAPPINGS = ROOT / "scenarios" / "mappings"
TORQUE = 12 * np.cos(2 * np.pi * 3 * TIME)
JOINTS = ["base", "elbow"]

CHANNELS = """
ratio: -100
channels:
  motor_angle: {{{source_motor}, unit: rev, side: motor, sign: -1}}
  output_angle: {{{source_angle}, unit: deg}}
  motor_torque: {{{source_torque}, unit: A, torque_constant_nm_per_a: 2.0, side: output}}
"""


def measured() -> dict[str, np.ndarray]:
    """Numbers as a foreign recorder keeps them."""
    return {
        "ms": 1e3 * TIME + 7000,
        "motor_rev": 100 * ANGLE / (2 * np.pi),
        "angle_deg": np.rad2deg(ANGLE + 1e-4),
        "current": TORQUE / 2,
    }


def check(recording: Recording, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(recording.time, TIME, atol=1e-9)
    np.testing.assert_allclose(recording["motor_angle"], -100 * ANGLE, atol=1e2 * tolerance)
    np.testing.assert_allclose(recording["output_angle"], ANGLE + 1e-4, atol=tolerance)
    np.testing.assert_allclose(recording["motor_torque"], -TORQUE / 100, atol=tolerance)
    np.testing.assert_allclose(recording["transmission_error"], 1e-4, atol=10 * tolerance)
    assert recording.unit("motor_torque") == "N m"


@pytest.fixture
def table_mapping(tmp_path: Path) -> Path:
    names = ("motor_rev", "angle_deg", "current")
    sources = dict(zip(("source_motor", "source_angle", "source_torque"), names, strict=True))
    text = CHANNELS.format(**{key: f"column: {name}" for key, name in sources.items()})
    path = tmp_path / "map.yaml"
    path.write_text(text + "time: {column: ms, unit: ms}\n")
    return path


def topic_mapping(path: Path, topic: str, time: str) -> Path:
    joint = f"topic: {topic}, joint: elbow, field:"
    path.write_text(
        CHANNELS.format(
            source_motor="topic: /motor, field: 'state.angles[1]'",
            source_angle=f"{joint} position",
            source_torque=f"{joint} effort",
        )
        + f"time: {{topic: {topic}, {time}}}\n"
    )
    return path


def test_csv_in_foreign_units_on_the_other_side(tmp_path, table_mapping):
    check(import_recording(write_csv(tmp_path / "a.csv", measured()), table_mapping))


def test_csv_with_another_separator_lines_before_and_a_byte_order_mark(tmp_path, table_mapping):
    path = write_csv(tmp_path / "a.csv", measured(), ";")
    path.write_text("\ufeffrecorded on Monday\nby hand\n" + path.read_text(), encoding="utf-8")
    table_mapping.write_text(table_mapping.read_text() + "separator: ';'\nskip_lines: 2\n")
    check(import_recording(path, table_mapping))


def test_parquet(tmp_path, table_mapping):
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    pq.write_table(pa.table(measured()), tmp_path / "a.parquet")
    check(import_recording(tmp_path / "a.parquet", table_mapping))
    others = {name: values for name, values in measured().items() if name != "ms"}
    pq.write_table(pa.table({"MS": TIME, **others}), tmp_path / "b.parquet")
    with pytest.raises(InputError, match=r"no column 'ms'.*nearest: MS"):
        import_recording(tmp_path / "b.parquet", table_mapping)


def json_messages() -> tuple[list[bytes], list[bytes]]:
    rows = measured()
    states = [
        json.dumps({"name": JOINTS, "position": [0.0, a], "effort": [0.0, c]}).encode()
        for a, c in zip(rows["angle_deg"].tolist(), rows["current"].tolist(), strict=True)
    ]
    motors = [json.dumps({"state": {"angles": [0.0, m]}}).encode() for m in rows["motor_rev"].tolist()]
    return states, motors


def test_mcap_json_of_two_topics(tmp_path):
    from mcap.writer import Writer

    states, motors = json_messages()
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b'{"type": "object"}')
        channels = [writer.register_channel(t, "json", schema) for t in ("/arm", "/motor")]
        for k in range(N):
            at = 1_700_000_000_000_000_000 + k * 1_000_000
            writer.add_message(channels[0], at, states[k], at)
            writer.add_message(channels[1], at, motors[k], at)
        writer.finish()
    check(import_recording(tmp_path / "a.mcap", topic_mapping(tmp_path / "m.yaml", "/arm", "stamp: log")))
    for old, new, text in (
        ("/arm", "/arms", "no topic '/arms'; nearest: /arm"),
        ("elbow", "elbo", "no joint 'elbo'; nearest: elbow"),
        ("position", "positions", "no field 'positions'; there are: name, position, effort"),
        ("angles[1]", "angles[2]", "there is no element 2"),
        ("angles[1]", "angles", "is no number: name an element"),
        ("stamp: log", "stamp: header", "messages have no header stamp"),
    ):
        wrong = tmp_path / "wrong.yaml"
        wrong.write_text((tmp_path / "m.yaml").read_text().replace(old, new))
        with pytest.raises(InputError) as error:
            import_recording(tmp_path / "a.mcap", wrong)
        assert text in str(error.value)


def test_topics_of_other_rates_are_interpolated_to_the_leading_one(tmp_path):
    from mcap.writer import Writer

    with open(tmp_path / "a.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        channels = [writer.register_channel(t, "json", 0) for t in ("/fast", "/slow")]
        for k in range(101):
            writer.add_message(channels[0], k * 10**7, b'{"v": %d}' % k, k * 10**7)
            if k in (20, 70):
                writer.add_message(channels[1], k * 10**7, b'{"v": %d}' % (2 * k), k * 10**7)
        writer.finish()
    (tmp_path / "m.yaml").write_text(
        "time: {stamp: publish}\nchannels:\n  output_angle: {topic: /fast, field: v, unit: rad}\n"
        "  temperature: {topic: /slow, field: v, unit: degC}\n"
    )
    found = import_recording(tmp_path / "a.mcap", tmp_path / "m.yaml")
    np.testing.assert_allclose(found["temperature"][20:71], 2 * np.arange(20, 71))
    assert np.isnan(found["temperature"][[0, 19, 71, 100]]).all()


def ros_messages():
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64[] angles", "drive_msgs/msg/State"))
    store.register(get_types_from_msg("drive_msgs/State state", "drive_msgs/msg/Motor"))
    kinds = store.types
    states, motors = [], []
    rows = measured()
    empty = np.zeros(0)
    for k in range(N):
        stamp = kinds["builtin_interfaces/msg/Time"](sec=1700000000, nanosec=k * 1_000_000)
        header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="")
        position, effort = np.array([0, rows["angle_deg"][k]]), np.array([0, rows["current"][k]])
        states.append(
            kinds["sensor_msgs/msg/JointState"](
                header=header, name=JOINTS, position=position, velocity=empty, effort=effort
            )
        )
        inner = kinds["drive_msgs/msg/State"](angles=np.array([0, rows["motor_rev"][k]]))
        motors.append(kinds["drive_msgs/msg/Motor"](state=inner))
    return store, states, motors


def test_ros_2_bag(tmp_path):
    store, states, motors = ros_messages()
    from rosbags.rosbag2 import StoragePlugin, Writer

    for plugin in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
        bag = tmp_path / plugin.name
        with Writer(bag, version=9, storage_plugin=plugin) as writer:
            names = ("sensor_msgs/msg/JointState", "drive_msgs/msg/Motor")
            links = [
                writer.add_connection(t, n, typestore=store)
                for t, n in zip(("/arm", "/motor"), names, strict=True)
            ]
            for k in range(N):
                at = 1_700_000_000_000_000_000 + k * 1_000_000
                writer.write(links[0], at, store.serialize_cdr(states[k], names[0]))
                writer.write(links[1], at, store.serialize_cdr(motors[k], names[1]))
        mapping = topic_mapping(tmp_path / "m.yaml", "/arm", "stamp: header")
        check(import_recording(bag, mapping))
        if plugin is StoragePlugin.MCAP:
            (file,) = bag.glob("*.mcap")
            check(import_recording(file, mapping))


def test_our_own_joint_states_can_be_imported(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from driving import drive_run

    run = drive_run(duration=0.5)
    path = write_log(run, tmp_path / "a.mcap")
    (tmp_path / "m.yaml").write_text(
        "time: {}\nchannels:\n"
        "  output_angle: {topic: /joint_states, joint: output, field: position, unit: rad}\n"
        "  motor_torque: {topic: /hd/state, field: motor_torque, unit: N m}\n"
    )
    found = import_recording(path, tmp_path / "m.yaml")
    np.testing.assert_array_equal(found["output_angle"], run["output_angle"])
    np.testing.assert_allclose(found["motor_torque"], run["motor_torque"], atol=1e-6)


def test_a_log_of_ours_needs_no_mapping(tmp_path):
    from driving import drive_run

    run = drive_run(duration=0.5)
    back = import_recording(write_log(run, tmp_path / "a.mcap"))
    np.testing.assert_array_equal(back["twist"], run["twist"])
    with pytest.raises(InputError, match="needs no mapping"):
        import_recording(tmp_path / "b.csv")


def test_an_imported_recording_opens_in_the_layouts_and_reads_back(tmp_path, table_mapping):
    recording = import_recording(write_csv(tmp_path / "a.csv", measured()), table_mapping)
    path = write_imported(recording, tmp_path / "a.mcap")
    assert verify_log(path).problems == []
    back = hdsim.open_log(path)
    assert list(back.tables) == ["state"]
    np.testing.assert_array_equal(back["motor_torque"], recording["motor_torque"])
    files = read_attachments(path)
    for name in ("overview", "positioning-error"):
        assert b"/hd/measured_view.output_angle" in files[f"layout-{name}.json"]
        assert b"/hd/state" not in files[f"layout-{name}.json"]
        assert b"3D!drive" in files[f"layout-{name}.json"]
    assert "layout-diagnose.json" not in files


def test_an_import_with_both_angles_has_a_scene_of_a_drive_of_its_ratio(tmp_path, table_mapping):
    recording = import_recording(write_csv(tmp_path / "a.csv", measured()), table_mapping)
    recording.metadata["ratio"] = "-120.0"
    path = write_imported(recording, tmp_path / "a.mcap")
    record = info_log(path).metadata["hdsim.scene"]
    assert (record["flexspline_teeth"], record["circular_spline_fixed"]) == ("240", "True")
    last = messages(path, "/hd/transforms")[-1][1]
    angle = {t.child_frame_id: turned(t) for t in last.transforms}
    at = (messages(path, "/hd/transforms")[-1][0] - EPOCH_NS) / 1e9
    row = int(np.argmin(np.abs(recording.time - at)))
    for frame, channel in (("wave_generator", "motor_angle"), ("output", "output_angle")):
        assert apart(angle[frame], recording[channel][row], 2 * np.pi) < 1e-6
    recording.metadata["ratio"] = "50"
    record = info_log(write_imported(recording, tmp_path / "b.mcap")).metadata["hdsim.scene"]
    assert (record["circular_spline_teeth"], record["circular_spline_fixed"]) == ("100", "False")
    del recording.tables["state"].columns["output_angle"]
    assert "/hd/transforms" not in info_log(write_imported(recording, tmp_path / "c.mcap")).messages


def test_an_imported_recording_can_be_imported_again(tmp_path, table_mapping):
    recording = import_recording(write_csv(tmp_path / "a.csv", measured()), table_mapping)
    files = read_attachments(write_imported(recording, tmp_path / "a.mcap"))
    (tmp_path / "again.yaml").write_bytes(files["mapping.yaml"])
    again = import_recording(tmp_path / "a.csv", tmp_path / "again.yaml")
    np.testing.assert_array_equal(again["motor_torque"], recording["motor_torque"])


def test_the_command_writes_a_log_and_tells_what_is_missing(tmp_path, table_mapping):
    write_csv(tmp_path / "a.csv", measured())
    arguments = [str(tmp_path / "a.csv"), "--mapping", str(table_mapping), "-o", str(tmp_path / "o.mcap")]
    done = CliRunner().invoke(import_data, arguments)
    assert done.exit_code == 0, done.output
    assert "imported 400 samples over 0.399 s" in done.output
    assert "not measured: motor_velocity, output_velocity, output_torque, load_torque" in done.output
    check(hdsim.open_log(tmp_path / "o.mcap"))
    wrong = CliRunner().invoke(import_data, [str(tmp_path / "o.mcap"), "-o", str(tmp_path / "o.mcap")])
    assert "is the file to be read" in str(wrong.exception)
