"""Measured recordings of every format become the same numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from viewing import apart, messages, turned

import hdsim
from hdsim.errors import InputError
from hdsim.log import info_log, read_attachments, verify_log, write_log
from hdsim.log.import_commands import import_data
from hdsim.log.importing import import_recording, write_imported
from hdsim.log.naming import EPOCH_NS
from hdsim.recording import Recording

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
MAPPINGS = ROOT / "scenarios" / "mappings"
N = 400
TIME = np.arange(N) * 1e-3
ANGLE = 0.3 * np.sin(2 * np.pi * 3 * TIME)
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


def write_csv(path: Path, columns: dict[str, np.ndarray], separator: str = ",") -> Path:
    rows = np.column_stack(list(columns.values()))
    lines = [separator.join(columns), *(separator.join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n")
    return path


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


BASE = "channels:\n  output_angle: {column: a, unit: rad}\ntime: {column: t, unit: s}\n"


def simple(tmp_path: Path, time: np.ndarray, values: np.ndarray, mapping: str) -> Recording:
    (tmp_path / "m.yaml").write_text(mapping)
    return import_recording(write_csv(tmp_path / "a.csv", {"t": time, "a": values}), tmp_path / "m.yaml")


def test_a_coarse_clock_is_spread_over_the_samples(tmp_path):
    true = np.arange(100) * 0.002
    found = simple(
        tmp_path, np.floor(true / 0.016) * 0.016, true, BASE.replace("unit: s", "unit: s, quantised: true")
    )
    np.testing.assert_allclose(found.time, true, atol=1e-3)
    assert (np.diff(found.time) > 0).all()


def test_a_constant_rate_is_seen_through_a_coarse_clock_and_a_gap(tmp_path):
    # Ticks of two and a half samples: stamps come three times and twice in turn.
    true = np.arange(900) * 0.002
    true[500:] += 0.0731
    mapping = BASE.replace("unit: s", "unit: s, quantised: true")
    found = simple(tmp_path, np.floor(true / 0.005) * 0.005, true, mapping)
    for part in (slice(0, 500), slice(500, 900)):
        # The rate to a part in ten thousand, the beginning to half a tick.
        np.testing.assert_allclose(np.diff(found.time[part]), 0.002, rtol=1e-4)
        np.testing.assert_allclose(found.time[part], true[part], atol=0.0025)


def test_a_rate_that_changes_is_not_taken_for_a_constant_one(tmp_path):
    true = np.cumsum(np.where(np.arange(600) < 300, 0.002, 0.003))
    mapping = BASE.replace("unit: s", "unit: s, quantised: true")
    found = simple(tmp_path, np.floor(true / 0.016) * 0.016, true, mapping)
    np.testing.assert_allclose(found.time, true, atol=0.016)


def test_a_counter_that_wraps_goes_on(tmp_path):
    found = simple(
        tmp_path,
        np.arange(1000) * 5 % 256,
        np.zeros(1000),
        BASE.replace("unit: s", "unit: ms, wraps_at: 256"),
    )
    np.testing.assert_allclose(found.time, np.arange(1000) * 5e-3)


def test_an_angle_that_wraps_goes_on_and_a_rate_stands_for_time(tmp_path):
    turns = np.linspace(0, 40, 1000)
    found = simple(
        tmp_path,
        turns,
        turns % (2 * np.pi),
        "channels:\n  output_angle: {column: a, unit: rad, unwrap: true}\ntime: {rate_hz: 250}\n",
    )
    np.testing.assert_allclose(found["output_angle"], turns, atol=1e-12)
    np.testing.assert_allclose(found.time, np.arange(1000) / 250)


def test_gaps_are_told_and_masks_become_nan(tmp_path):
    rng = np.random.default_rng(0)
    time = np.concatenate([np.arange(500), np.arange(700, 1000)]) * 1e-3
    clean = np.sin(20 * time) + 1e-3 * rng.standard_normal(len(time))
    dirty = clean.copy()
    spikes = [50, 250, 600]
    dirty[spikes] += 0.1
    found = simple(
        tmp_path,
        time,
        dirty,
        BASE + "longest_gap_s: 0.01\nmasks:\n  - {type: interval, start_s: 0.1, end_s: 0.1995}\n"
        "  - {type: outliers, channels: [output_angle]}\n",
    )
    gone = np.flatnonzero(np.isnan(found["output_angle"]))
    assert set(range(100, 200)) | set(spikes) <= set(gone.tolist())
    assert len(gone) < 115
    np.testing.assert_allclose(json.loads(found.metadata["gaps"]), [[0.499, 0.7]])
    assert any(e.message == "gap of 0.201 s" and e.time == 0.499 for e in found.events)


def test_rows_are_selected_by_a_column(tmp_path):
    write_csv(tmp_path / "a.csv", {"t": TIME, "a": ANGLE, "fault": (np.arange(N) < 100) * 3.0})
    (tmp_path / "m.yaml").write_text(BASE + "select:\n  - {column: fault, at_most: 0}\n")
    found = import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
    np.testing.assert_array_equal(found["output_angle"], ANGLE[100:])
    assert found.time[0] == 0
    (tmp_path / "m.yaml").write_text(BASE + "select:\n  - {column: fault, at_least: 7}\n")
    with pytest.raises(InputError, match="no row meets"):
        import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("column: a,", "column: angel,", "no column 'angel'"),
        ("column: a, unit: rad", "column: a", "m.yaml:2: channels.output_angle.unit"),
        ("unit: rad", "unit: N m", "m.yaml:2: channels.output_angle.unit"),
        ("unit: rad", "unit: rad, side: input", "'motor', 'output'"),
        ("unit: rad", "unit: rad, side: motor", "that needs the ratio"),
        ("unit: rad", "unit: count", "needs counts_per_turn"),
        ("unit: rad", "unit: rad, sign: 2", "sign"),
        ("output_angle", "output_angel", "output_angle"),
        ("column: a,", "topic: /a, field: b,", "names topic '/a'"),
        ("unit: s}", "unit: s}\nratio: 0.5", "at least 1"),
        ("column: t, unit: s", "stamp: log", "neither a column nor a rate_hz"),
        ("column: t, unit: s", "column: t", "needs its unit"),
        (
            "unit: s}",
            "unit: s}\nmasks: [{type: outliers, channels: [motor_angle]}]",
            "mapped are: output_angle",
        ),
    ],
)
def test_a_wrong_mapping_is_told_with_its_place(tmp_path, old, new, expected):
    with pytest.raises(InputError) as error:
        simple(tmp_path, TIME, ANGLE, BASE.replace(old, new))
    assert expected in str(error.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "it is empty"),
        ("t,a\n", "it is empty"),
        ("t,a\n0,1\n", "one sample is no recording"),
        ("t,a\n0,1\n1,x\n", "a.csv:3: column 'a': found 'x', expected a number"),
        ("t,a\n0,1\n1\n", "a.csv:3: the line has 1 cells"),
        ("t,a\n0,1\n1,1\n1,2\n", "sample 3 at 1 s follows 1 s"),
        ("t,a\n0,1\n,1\n", "sample 2 has no time"),
        ("\x00\xff", "a.csv"),
    ],
)
def test_a_wrong_file_is_told(tmp_path, text, expected):
    (tmp_path / "m.yaml").write_text(BASE)
    (tmp_path / "a.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError) as error:
        import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
    assert expected in str(error.value)


def test_files_that_are_not_what_they_seem(tmp_path):
    (tmp_path / "m.yaml").write_text(
        BASE.replace("column: a", "topic: /a, field: b").replace("column: t, unit: s", "")
    )
    for name in ("a.mcap", "a.xyz", "bag.db3"):
        (tmp_path / name).write_text("nonsense")
        with pytest.raises(InputError, match=name.split(".")[0]):
            import_recording(tmp_path / name, tmp_path / "m.yaml")
    with pytest.raises(InputError, match="no such file"):
        import_recording(tmp_path / "nowhere.csv", tmp_path / "m.yaml")
    (tmp_path / "c.yaml").write_text(BASE)
    (tmp_path / "p.parquet").write_text("nonsense")
    with pytest.raises(InputError, match="cannot be read as Parquet"):
        import_recording(tmp_path / "p.parquet", tmp_path / "c.yaml")


def measured_file(*parts: str) -> Path:
    path = DATA.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"the measured data {path} are not here")
    return path


@pytest.mark.parametrize("joint", range(1, 8))
def test_kinova_joints_agree_with_what_the_robot_says_itself(joint):
    path = measured_file("kinova-gen3-7dof", "validation_data", "opti_traj_testing1.csv")
    found = import_recording(path, MAPPINGS / f"kinova_joint_{joint}.yaml")
    raw = np.genfromtxt(path, delimiter=",", names=True)
    assert len(found.time) == 4741
    np.testing.assert_allclose(np.diff(found.time), 1e-3, atol=1e-6)
    np.testing.assert_array_equal(found["output_angle"], raw[f"Position{joint}"])
    kept = np.isfinite(found["motor_torque"])
    assert kept.mean() > 0.95
    # The robot's own column of torque from current refers to the output.
    np.testing.assert_allclose(
        100 * found["motor_torque"][kept], raw[f"TorqueCur{joint}"][kept], rtol=2e-3, atol=5e-3
    )
    # The derivative of the position is the velocity, so time and units fit.
    slope = np.gradient(found["output_angle"], found.time)
    sound = np.isfinite(found["output_velocity"])
    assert np.corrcoef(slope[sound], found["output_velocity"][sound])[0, 1] > 0.9


def test_cycloidal_ramps_show_the_play_that_their_loops_show():
    path = measured_file("cycloidal-backlash-hysteresis", "2024-07-11__15-47-12__torqueramp__base_runin1.csv")
    found = import_recording(path, MAPPINGS / "cycloidal_small_ramps.yaml")
    assert (np.diff(found.time) > 0).all()
    output_angle, output_torque = found["motor_angle"] / 14, found["motor_torque"] * 14
    assert np.abs(output_torque).max() < 6
    # Peak to peak over the ramps to 4 N m: about 2.67 degrees for the actuator without preload.
    assert np.rad2deg(np.ptp(output_angle)) == pytest.approx(2.67, rel=0.1)
