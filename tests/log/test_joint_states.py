"""Joint states in our logs, as readers of the robot world see them."""

from __future__ import annotations

import numpy as np
import pytest
from driving import drive_run
from mcap.reader import make_reader

from hdsim.errors import InputError
from hdsim.log import LogWriter, export_log, verify_log, write_log
from hdsim.log.joint_states import problem_of
from hdsim.log.naming import to_ns
from hdsim.recording import Recording, Table


def read(path):
    """Messages by mcap-ros2-support, which parses the schema text and the CDR on its own."""
    pytest.importorskip("mcap_ros2", reason="mcap-ros2-support is not installed")
    from mcap_ros2.decoder import DecoderFactory

    with open(path, "rb") as file:
        found = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(m.log_time, ros) for _, _, m, ros in found.iter_decoded_messages(["/joint_states"])]


def test_joint_states_are_the_samples_of_the_run(tmp_path):
    run = drive_run()
    path = write_log(run, tmp_path / "a.mcap")
    assert verify_log(path).problems == []
    messages = read(path)
    assert len(messages) == len(run.time)
    assert all(m.name == ["motor", "output"] for _, m in messages)
    assert all(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == t for t, m in messages)
    for field, channel in (("position", "angle"), ("velocity", "velocity"), ("effort", "torque")):
        got = np.array([getattr(m, field) for _, m in messages])
        np.testing.assert_array_equal(
            got, np.column_stack([run[f"motor_{channel}"], run[f"output_{channel}"]])
        )


def test_rosbags_reads_the_same(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from rosbags.typesys import Stores, get_typestore

    run = drive_run(duration=0.5)
    path = write_log(run, tmp_path / "a.mcap")
    types = get_typestore(Stores.ROS2_HUMBLE)
    with open(path, "rb") as file:
        bodies = [m.data for _, _, m in make_reader(file).iter_messages(["/joint_states"])]
    messages = [types.deserialize_cdr(body, "sensor_msgs/msg/JointState") for body in bodies]
    np.testing.assert_array_equal([m.position[0] for m in messages], run["motor_angle"])
    np.testing.assert_array_equal([m.effort[1] for m in messages], run["output_torque"])
    assert messages[0].header.frame_id == "world"


def test_rosbags_reads_them_as_a_bag(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    run = drive_run(duration=2.0)
    log = write_log(run, tmp_path / "a.mcap")
    bag = export_log(log, tmp_path / "bag" / "joints.mcap")
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        (connection,) = reader.connections
        assert (connection.topic, connection.msgtype) == ("/joint_states", "sensor_msgs/msg/JointState")
        assert len(connection.ext.offered_qos_profiles) == 1
        found = [(at, reader.deserialize(raw, kind.msgtype)) for kind, at, raw in reader.messages()]
    assert [at for at, _ in found] == (to_ns(run.time)).tolist()
    np.testing.assert_array_equal([m.position[0] for _, m in found], run["motor_angle"])
    np.testing.assert_array_equal([m.velocity[1] for _, m in found], run["output_velocity"])
    with open(bag, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        assert len(list(reader.iter_messages())) == len(run.time)


def test_what_is_no_bag_is_told(tmp_path):
    run = drive_run(duration=0.1)
    log = write_log(run, tmp_path / "a.mcap")
    with pytest.raises(InputError, match="is the log itself"):
        export_log(log, tmp_path / "a.mcap")
    with pytest.raises(InputError, match="holds the joint states only"):
        export_log(log, tmp_path / "b.mcap", "teeth")
    table = Table(run.time, {"load_torque": run.channels["load_torque"]})
    without = write_log(Recording({"state": table}), tmp_path / "c.mcap")
    with pytest.raises(InputError, match=r"c\.mcap has no /joint_states"):
        export_log(without, tmp_path / "d.mcap")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap", "c.mcap"]


def test_joint_states_are_thinned_to_real_samples_however_the_run_is_cut(tmp_path):
    run = drive_run(rate=1000.0)

    def write(name: str, size: int):
        with LogWriter(tmp_path / name, metadata={}, view_rate_hz=100.0, layouts=False) as log:
            for begin in range(0, len(run.time), size):
                rows = slice(begin, begin + size)
                columns = {
                    n: type(c)(c.values[rows], c.unit)
                    for n, c in run.channels.items()
                    if n != "output_torque"
                }
                log.write("state", Table(run.time[rows], columns))
        return tmp_path / name

    whole = write("whole.mcap", 10**6)
    assert whole.read_bytes() == write("cut.mcap", 77).read_bytes()
    messages = read(whole)
    assert len(messages) == 401
    np.testing.assert_array_equal([m.position[0] for _, m in messages], run["motor_angle"][::10])
    assert np.isnan([m.effort[1] for _, m in messages]).all()


def test_a_run_without_angles_has_no_joint_states(tmp_path):
    run = drive_run(duration=0.1)
    table = Table(run.time, {"load_torque": run.channels["load_torque"]})
    path = write_log(Recording({"state": table}), tmp_path / "a.mcap")
    assert read(path) == []


def test_damaged_joint_states_are_told(tmp_path):
    run = drive_run(duration=0.01)
    path = write_log(run, tmp_path / "a.mcap")
    with open(path, "rb") as file:
        body = next(make_reader(file).iter_messages(["/joint_states"]))[2].data
    assert problem_of(body) is None
    assert "end" in str(problem_of(body[:20]))
    assert "bytes long" in str(problem_of(body[:-8]))
    assert "CDR" in str(problem_of(b"{}" + body))
