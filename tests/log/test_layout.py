from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from driving import drive_run
from mcap.reader import make_reader

import hdsim.log
from hdsim.errors import InputError
from hdsim.log import (
    LogWriter,
    commands,
    info_log,
    layout,
    layout_trees,
    naming,
    read_attachments,
    states,
    verify_log,
    write_log,
)
from hdsim.log.facts import Facts, playback_speed
from hdsim.log.schemas import message_class
from hdsim.recording import Column, Recording, Table

SHIPPED = Path(hdsim.log.__file__).parent / "layouts"


def message_paths(value):
    """Every message path and topic in a layout's JSON."""
    if isinstance(value, dict):
        for part in value.values():
            yield from message_paths(part)
        yield from (key for key in value if key.startswith("/hd/"))
    elif isinstance(value, list):
        for part in value:
            yield from message_paths(part)
    elif isinstance(value, str) and value.startswith("/hd/"):
        yield value


def leaves(tree):
    return [tree] if isinstance(tree, str) else [*leaves(tree["first"]), *leaves(tree["second"])]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """A log that every layout can show: warm, at one speed, limited, and compared with a measured machine."""
    run = drive_run()
    state = run.tables["state"]
    state.columns["temperature"] = Column(20 + run.time, "degC")
    for name in ("heat", "work_supplied", "ambient_temperature"):
        state.columns[name] = Column(run.time, "J")
    steady = Table(state.time, dict(state.columns))
    steady.columns["motor_angle"] = Column(-40.0 * run.time, "rad")
    # A diagnosis writes what each model leaves of the measured channels beside what it predicts.
    left = {f"{name}_error": run.channels[name] for name in ("output_angle", "output_torque", "motor_torque")}
    model = Table(run.time, {**run.channels, **left})
    stages = dict.fromkeys(("before", "refit", "after"), model)
    tables = {**run.tables, "state": steady, "measured": run.state, **stages}
    facts = {"rated_torque_nm": 40.0, "torque_limit_nm": 0.4, "verdict": "ripple"}
    metadata = run.metadata | {"replay": json.dumps(facts)}
    recording = Recording(tables, run.static, run.events, metadata)
    return write_log(recording, tmp_path_factory.mktemp("log") / "a.mcap")


@pytest.mark.parametrize("name", list(layout.LAYOUTS))
def test_every_path_of_a_shipped_layout_exists_in_the_log_with_its_type(diagnosed, name):
    fields = info_log(diagnosed).fields
    built = json.loads((SHIPPED / f"{name}.json").read_text())
    paths = list(message_paths(built))
    assert len(paths) > 3
    shapes = {c.field: c.repeated for specs in info_log(diagnosed).tables.values() for c in specs}
    shapes |= {f"{name}_arcsec": False for name in shapes} | {"tooth_half_gap_um": True, "time": False}
    shapes |= dict.fromkeys(states.StateFinder(info_log(diagnosed).facts, 1.0).fields, False)
    for path in paths:
        topic, field = layout.split_path(path)
        assert topic in fields, path
        if field:
            assert field in fields[topic], path
            arrays = topic in (layout_trees.LOOP, layout_trees.ORDERS, layout_trees.OVER_ANGLE)
            repeated = arrays or shapes[field]
            assert bool(re.search(r"\[(:|\d+)\]$", path)) == repeated, path


@pytest.mark.parametrize("name", list(layout.LAYOUTS))
def test_shipped_layouts_are_what_the_builders_make(name):
    assert (SHIPPED / f"{name}.json").read_text() == layout.to_json(layout.build_layout(name))


@pytest.mark.parametrize("name", list(layout.LAYOUTS))
def test_the_tree_holds_each_panel_once(name):
    built = layout.build_layout(name)
    assert sorted(leaves(built["layout"])) == sorted(built["configById"])
    assert len(built["configById"]) >= 5
    for settings in built["configById"].values():
        assert settings["lichtblickPanelTitle"] == settings["foxglovePanelTitle"]


def test_logs_carry_the_layouts_that_they_can_fill(tmp_path):
    run = drive_run(duration=0.2)
    path = write_log(run, tmp_path / "a.mcap")
    found = {n: json.loads(t) for n, t in read_attachments(path).items() if n.startswith("layout-")}
    assert sorted(found) == [
        "layout-overview.json",
        "layout-positioning-error.json",
        "layout-tooth-contact.json",
    ]
    for built in found.values():
        # The motor turns at 250 rad/s.
        assert built["playbackConfig"]["speed"] == 0.01
        for path_text in message_paths(built):
            topic, field = layout.split_path(path_text)
            assert not field or field in info_log(path).fields[topic]


def test_what_a_log_lacks_is_left_out(tmp_path):
    run = drive_run(duration=0.5)
    del run.tables["teeth"]
    del run.static["tooth_half_gap"]
    for name in ("tracking_error", "reference_angle", "engaged_share", "output_angle"):
        del run.tables["state"].columns[name]
    path = write_log(run, tmp_path / "a.mcap")
    built = json.loads(read_attachments(path)["layout-overview.json"])
    assert sorted(leaves(built["layout"])) == sorted(built["configById"])
    assert "3D!drive" not in built["configById"]
    assert "Plot!output_angle" not in built["configById"]
    (error,) = (s for p, s in built["configById"].items() if p == "Plot!error")
    assert [line["label"] for line in error["paths"]] == ["transmission"]


def test_a_drive_without_teeth_has_no_layout_of_them(tmp_path):
    run = drive_run()
    del run.tables["teeth"]
    path = write_log(run, tmp_path / "a.mcap")
    assert set(read_attachments(path)) == {
        "scenario.yaml",
        "layout-overview.json",
        "layout-positioning-error.json",
    }


def test_a_comparison_has_no_panel_of_what_was_measured_and_not_predicted():
    channels = {"time": "double", "motor_torque": "double", "motor_torque_error": "double"}
    topics = {f"/hd/{stage}_view": channels for stage in ("before", "refit", "after")}
    topics["/hd/measured_view"] = channels | {"output_torque": "double"}
    panels = layout.build_layout("diagnose", topics=topics)["configById"]
    assert "Plot!motor_torque" in panels
    assert "Plot!output_torque" not in panels


def test_lines_are_told_apart_by_what_differs():
    facts = Facts(teeth_rate_hz=1e4)

    def labels(name, panel):
        built = layout.build_layout(name, facts=facts)
        return [line["label"] for line in built["configById"][panel]["paths"]]

    assert labels("diagnose", "Plot!output_torque") == ["after", "refit", "before", "measured"]
    assert labels("overview", "Plot!error") == ["tracking", "transmission"]
    assert labels("overview", "Plot!motor_torque") == ["motor", "friction"]
    assert labels("tooth-contact", "Plot!force_of_three_teeth") == ["no. 0", "no. 5", "no. 10"]
    assert labels("tooth-contact", "Plot!engaged_share") == ["engaged_share"]


def test_every_plot_says_what_is_on_its_axes():
    for name in layout.LAYOUTS:
        for settings in layout.build_layout(name)["configById"].values():
            if "xAxisVal" in settings:
                assert re.fullmatch(r"\[[^\]]+\]", settings["yAxisLabel"]), settings["lichtblickPanelTitle"]
                assert settings["xAxisLabel"]
                assert (settings["xAxisLabel"] == "time [s]") == (settings["xAxisVal"] == "timestamp")


def plots(built, title):
    (found,) = (s for s in built["configById"].values() if s["lichtblickPanelTitle"] == title)
    return found


def test_a_limit_is_drawn_where_the_run_comes_near_it():
    title = "Torque at the output [N m]"
    far = Facts(rated_torque_nm=52, highest_output_torque_nm=3)
    assert [p["value"] for p in plots(layout.build_layout("overview", facts=far), title)["paths"]] == [
        "/hd/state_view.output_torque",
        "/hd/state_view.load_torque",
    ]
    near = Facts(rated_torque_nm=52, lowest_output_torque_nm=-60, highest_output_torque_nm=30)
    panel = plots(layout.build_layout("overview", facts=near), title)
    assert [(p["value"], p["label"]) for p in panel["paths"][2:]] == [("52", "rated"), ("-52", "-rated")]
    # Level lines do not widen an axis by themselves.
    assert panel["maxYValue"] > 52
    assert panel["minYValue"] < -60


def test_axes_of_forces_keep_still():
    title = "Tooth forces now [N]"
    both = Facts(lowest_force_n=-41, highest_force_n=23)
    panel = plots(layout.build_layout("tooth-contact", facts=both), title)
    assert (panel["minYValue"], panel["maxYValue"]) == (-50, 50)
    panel = plots(layout.build_layout("tooth-contact", facts=Facts(highest_force_n=23)), title)
    assert -5 < panel["minYValue"] < 0
    assert panel["maxYValue"] == 30


def test_a_tooth_that_is_sampled_below_the_mesh_rate_is_not_plotted_over_time():
    """A tooth meshes twice a turn: at 600 rpm 20 times a second."""
    shown = []
    for rate in (20.0, 100.0, 199.0, 201.0):
        facts = Facts(motor_speed_rad_per_s=20 * math.pi, teeth_rate_hz=rate)
        shown.append(
            "Plot!force_of_three_teeth" in layout.build_layout("tooth-contact", facts=facts)["configById"]
        )
    assert shown == [False, False, False, True]


def test_nothing_that_is_normal_is_shown_in_red():
    for name in layout.LAYOUTS:
        for id, settings in layout.build_layout(name)["configById"].items():
            if id.startswith("Gauge!"):
                assert settings["colorMode"] == "gradient"
            assert "rules" not in settings or settings["rules"] == []


def attached(path):
    return {
        name.removeprefix("layout-").removesuffix(".json"): json.loads(text)
        for name, text in read_attachments(path).items()
        if name.startswith("layout-")
    }


def titles(built):
    return {settings["lichtblickPanelTitle"] for settings in built["configById"].values()}


def test_layouts_are_those_of_what_the_log_holds_and_the_point_of_the_run_comes_first(diagnosed, tmp_path):
    found = attached(diagnosed)
    assert list(found) == ["diagnose", "warm-up", "orders", "overview", "positioning-error", "tooth-contact"]
    assert {
        "Transmission error over the angle [arcsec]",
        "Orders of the transmission error [arcsec]",
    } <= titles(found["orders"])
    assert "Temperature [degC]" in titles(found["warm-up"])
    assert not any(panel.startswith("3D!") for panel in found["warm-up"]["configById"])
    assert {"Verdict", "Events", "Measured and modelled"} <= titles(found["diagnose"])
    assert plots(found["diagnose"], "Verdict")["fallbackLabel"] == "ripple"
    assert list(attached(write_log(drive_run(), tmp_path / "a.mcap"))) == [
        "overview",
        "positioning-error",
        "tooth-contact",
    ]


def test_speed_is_in_every_layout_of_a_run(diagnosed):
    for name, built in attached(diagnosed).items():
        if name != "tooth-contact":
            assert "Motor speed [rad/s]" in titles(built), name


def test_what_is_set_while_a_run_is_watched_is_in_the_layout_for_it():
    assert "Parameters!parameters" in layout.build_layout("live")["configById"]


def test_states_change_where_the_run_does(diagnosed):
    run = drive_run()
    with open(diagnosed, "rb") as file:
        found = [
            (m.log_time, message_class(s.name, s.data).FromString(m.data))
            for s, _, m in make_reader(file).iter_messages([states.TOPIC])
        ]
    assert found[0][0] == naming.EPOCH_NS
    torque, motor = run["output_torque"], run["motor_torque"]
    wanted = list(zip(np.sign(torque), np.abs(motor) >= 0.4, strict=True))
    for k, at in enumerate(naming.to_ns(run.time).tolist()):
        # What lasts for a few samples only is left out.
        if k < 12 or len(set(wanted[k - 12 : k + 13])) > 1:
            continue
        state = next(m for t, m in reversed(found) if t <= at)
        assert state.flank == ("positive flank" if torque[k] > 0 else "negative flank")
        assert state.torque == "up to rated torque"
        assert state.motor == ("motor at its limit" if abs(motor[k]) >= 0.4 else "motor below its limit")
    # A state that lasts is said again now and then, and at the end, because viewers draw it up to there.
    assert found[-1][0] > naming.to_ns(run.time)[-2]
    assert len(found) < 400


@pytest.mark.parametrize(
    ("duration", "speed"),
    [(0.02, 0.01), (0.5, 0.05), (5.0, 0.5), (10.0, 1.0), (60.0, 1.0), (90.0, 2.0), (1800.0, 5.0), (0.0, 1.0)],
)
def test_short_runs_play_slowly_and_long_ones_fast(duration, speed):
    assert playback_speed(duration) == speed


@pytest.mark.parametrize(
    ("rpm", "speed"), [(0, 1.0), (200, 1.0), (240, 1.0), (241, 0.5), (600, 0.2), (2000, 0.1), (1e6, 0.01)]
)
def test_what_turns_fast_plays_slowly(rpm, speed):
    """At four turns a second and 30 frames a second an ellipse turns by 48 degrees a frame."""
    facts = Facts(motor_speed_rad_per_s=rpm * 2 * math.pi / 60)
    built = layout.build_layout("overview", duration=20.0, facts=facts)
    assert built["playbackConfig"]["speed"] == speed
    # A layout that shows nothing turn need not be slow.
    assert layout.build_layout("warm-up", duration=20.0, facts=facts)["playbackConfig"]["speed"] == 1.0


@pytest.mark.parametrize("size", [7, 400, 10**6])
def test_the_log_knows_how_fast_its_motor_turned(tmp_path, size):
    run = drive_run(duration=2.0)
    path = tmp_path / "a.mcap"
    with LogWriter(path, metadata=run.metadata) as log:
        for name, table in run.tables.items():
            for begin in range(0, len(table), size):
                rows = slice(begin, begin + size)
                columns = {n: Column(c.values[rows], c.unit) for n, c in table.columns.items()}
                log.write(name, Table(table.time[rows], columns))
    facts = info_log(path).facts
    assert facts.motor_speed_rad_per_s == pytest.approx(np.abs(run["motor_velocity"]).max(), rel=1e-3)
    assert facts.teeth_rate_hz == pytest.approx(50.0)
    assert facts.lowest_force_n == 0.0
    assert facts.largest_force_n == pytest.approx(np.abs(run.tables["teeth"]["normal_force"]).max())


def test_an_empty_log_has_no_layout(tmp_path):
    path = write_log(Recording({"x": Table([0.0])}, metadata={"scenario": "a"}), tmp_path / "a.mcap")
    assert list(read_attachments(path)) == ["scenario.yaml"]
    with pytest.raises(InputError, match="no topic that layout 'overview' shows"):
        layout.build_layout("overview", topics=info_log(path).fields)


def test_the_command_prints_a_layout_for_a_log(diagnosed):
    run = CliRunner().invoke
    listed = run(commands.layout, [])
    assert [line.split()[0] for line in listed.output.splitlines()] == list(layout.LAYOUTS)
    assert json.loads(run(commands.layout, ["overview"]).output) == layout.build_layout("overview")
    fitted = json.loads(run(commands.layout, ["diagnose", "--log", str(diagnosed)]).output)
    assert fitted["playbackConfig"]["speed"] == 0.2
    error = run(commands.layout, ["nothing"]).exception
    assert isinstance(error, InputError)
    assert "there are: overview, positioning-error" in str(error)
    assert verify_log(diagnosed).ok
