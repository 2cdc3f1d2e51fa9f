from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from driving import drive_run
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader

from hdsim.errors import InputError
from hdsim.log import (
    LogWriter,
    info_log,
    layout,
    naming,
    open_log,
    panels,
    scene,
    shapes,
    verify_log,
    write_log,
)
from hdsim.recording import Column, Table


def messages(path, topic, kind):
    with open(path, "rb") as file:
        return [(m.log_time, kind.FromString(m.data)) for _, _, m in make_reader(file).iter_messages([topic])]


def turned(transform):
    return 2 * math.atan2(transform.rotation.z, transform.rotation.w)


def same_angle(a, b):
    return abs(math.remainder(a - b, 2 * math.pi)) < 1e-9


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_log(drive_run(), tmp_path_factory.mktemp("log") / "run.mcap")


def test_the_log_with_a_scene_is_sound_and_reads_back(log):
    assert verify_log(log).ok
    assert list(open_log(log).tables) == ["state", "teeth"]


def test_frames_come_at_the_rate_that_playback_shows_and_turn_the_bodies(log):
    run = drive_run()
    frames = messages(log, scene.TRANSFORM_TOPIC, FrameTransforms)
    assert len(frames) == pytest.approx(4.0 * 30 / layout.playback_speed(4.0), abs=2)
    for log_time, frame in frames[:: len(frames) // 7]:
        k = int(np.flatnonzero(naming.to_ns(run.time) == log_time)[0])
        by_name = {t.child_frame_id: t for t in frame.transforms}
        assert {t.parent_frame_id for t in frame.transforms} == {"world"}
        assert same_angle(turned(by_name["wave_generator"]), run["motor_angle"][k])
        assert same_angle(turned(by_name["output"]), run["output_angle"][k])
        assert same_angle(turned(by_name["flexspline"]), run["ring_angle"][k])
        assert turned(by_name["circular_spline"]) == 0
        factor = float(info_log(log).metadata["hdsim.scene"]["error_factor"])
        pointed = run["output_angle"][k] + factor * run["transmission_error"][k]
        assert same_angle(turned(by_name["error_pointer"]), pointed)


def test_teeth_lie_on_the_ellipse_that_follows_the_wave_generator(log):
    run = drive_run()
    g = scene.geometry_of(run)
    frames = messages(log, panels.SCENE, SceneUpdate)
    teeth = run.tables["teeth"]
    assert len(frames) > 30
    for log_time, update in frames[3 :: len(frames) // 5]:
        (entity,) = update.entities
        k = int(np.flatnonzero(naming.to_ns(teeth.time) == log_time)[0])
        tips = np.array([[p.x, p.y] for line in entity.lines for p in line.points])[1::2]
        assert len(tips) == 200
        motor = run["motor_angle"][k * 10]
        angle = np.arctan2(tips[:, 1], tips[:, 0]) - motor
        radius = np.hypot(tips[:, 0], tips[:, 1])
        expected = g.pitch_radius_m - g.drawn_deflection * (1 - np.cos(2 * angle)) + 0.3 * g.tooth_height
        np.testing.assert_allclose(radius, expected, atol=2e-6)
        drawn = np.sort(np.mod(angle, 2 * np.pi))
        wanted = np.sort(np.mod(teeth["angle"][k], 2 * np.pi))
        np.testing.assert_allclose(np.exp(1j * drawn), np.exp(1j * wanted), atol=3e-4)


def test_engaged_teeth_are_coloured_by_their_force(log):
    teeth = drive_run().tables["teeth"]
    largest = np.abs(teeth["normal_force"]).max()
    for log_time, update in messages(log, panels.SCENE, SceneUpdate)[::20]:
        k = int(np.flatnonzero(naming.to_ns(teeth.time) == log_time)[0])
        share = teeth["normal_force"][k] / largest
        engaged = share[share > 1e-3]
        coloured = [line for line in update.entities[0].lines if len(line.colors)]
        if not len(engaged):
            assert not coloured
            continue
        (line,) = coloured
        assert len(line.points) == len(line.colors) == 2 * len(engaged)
        found = np.array([[c.r, c.g, c.b, c.a] for c in line.colors])[::2]
        np.testing.assert_allclose(found, shapes.force_colours(engaged))
    low, high = shapes.force_colours(np.array([0.0, 1.0]))
    assert low[2] > low[0]
    assert high[0] > high[2]


def test_bodies_and_legend_are_sent_once_on_a_topic_of_their_own(log):
    ((log_time, update),) = messages(log, panels.SCENE_STATIC, SceneUpdate)
    assert log_time == naming.EPOCH_NS
    frames = {e.id: e.frame_id for e in update.entities}
    assert frames == {
        "circular spline": "circular_spline",
        "wave generator": "wave_generator",
        "output": "output",
        "error pointer": "error_pointer",
        "legend": "world",
    }
    texts = " ".join(t.text for e in update.entities for t in e.texts)
    assert "deflection drawn x6" in texts
    assert "error of the output x1000" in texts
    assert "0 N tooth force" in texts
    assert "24 N" in texts
    for entity in update.entities:
        for body in entity.triangles:
            points = np.array([[p.x, p.y, p.z] for p in body.points])
            assert max(body.indices) < len(points)
            assert np.abs(points).max() < 0.06
    assert all(e.frame_locked for e in update.entities)


def volume(triangles):
    """Volume within a closed surface, by the divergence theorem."""
    points = np.array([[p.x, p.y, p.z] for p in triangles.points])
    a, b, c = (points[np.array(triangles.indices)[k::3]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def test_prisms_are_closed_and_face_outwards():
    around = np.linspace(0, 2 * np.pi, 400)[:-1]
    outer, inner = shapes.polar(0.03, around), shapes.polar(0.01, around)
    solid = shapes.prism(outer, None, -0.01, 0.02, (1, 1, 1, 1))
    ring = shapes.prism(outer, inner, -0.01, 0.02, (1, 1, 1, 1))
    assert volume(solid) == pytest.approx(np.pi * 0.03**2 * 0.03, rel=1e-3)
    assert volume(ring) == pytest.approx(np.pi * (0.03**2 - 0.01**2) * 0.03, rel=1e-3)


def test_lines_laid_out_by_numpy_are_what_protobuf_writes():
    points = np.round(np.random.default_rng(0).uniform(-1, 1, (6, 3)) * 2**21) / 2**21
    colours = np.random.default_rng(1).uniform(0, 1, (6, 4))
    line = LinePrimitive.FromString(shapes.segments(points, colours, 2.0))
    assert [[p.x, p.y, p.z] for p in line.points] == points.tolist()
    assert [[c.r, c.g, c.b, c.a] for c in line.colors] == colours.tolist()
    assert line.type == LinePrimitive.LINE_LIST
    assert line.scale_invariant


@pytest.mark.parametrize("size", [37, 400, 5000])
def test_the_scene_does_not_depend_on_how_the_run_is_cut(tmp_path, size, log):
    run = drive_run()
    path = tmp_path / "blocks.mcap"

    def cut(table, begin, end):
        rows = (table.time >= begin) & (table.time < end)
        return Table(table.time[rows], {n: Column(c.values[rows], c.unit) for n, c in table.columns.items()})

    with LogWriter(path, metadata=run.metadata) as writer:
        drawing = scene.SceneWriter(writer, scene.geometry_of(run), 4.0)
        edges = [*run.time[::size], np.inf]
        for begin, end in pairwise(edges):
            blocks = {name: cut(table, begin, end) for name, table in run.tables.items()}
            blocks = {name: block for name, block in blocks.items() if len(block)}
            drawing.write(blocks)
    for topic, kind in ((panels.SCENE, SceneUpdate), (scene.TRANSFORM_TOPIC, FrameTransforms)):
        assert messages(path, topic, kind) == messages(log, topic, kind)


def test_without_tooth_forces_the_teeth_turn_with_the_flexspline(tmp_path):
    run = drive_run(duration=1.0)
    del run.tables["teeth"]
    frames = messages(write_log(run, tmp_path / "a.mcap"), panels.SCENE, SceneUpdate)
    assert len(frames) > 100
    first = frames[40][1].entities[0].lines[0].points[1]
    k = int(np.flatnonzero(naming.to_ns(run.time) == frames[40][0])[0])
    assert math.atan2(first.y, first.x) == pytest.approx(run["ring_angle"][k], abs=1e-3)


def test_geometry_comes_from_the_metadata(tmp_path):
    metadata = {"geometry": '{"pitch_radius_m": 0.05, "circular_spline_fixed": false, "other": 1}'}
    run = drive_run()
    run.metadata.update(metadata)
    g = scene.geometry_of(run)
    assert (g.pitch_radius_m, g.circular_spline_fixed, g.flexspline_teeth) == (0.05, False, 200)
    frames = messages(write_log(run, tmp_path / "a.mcap"), scene.TRANSFORM_TOPIC, FrameTransforms)
    by_name = {t.child_frame_id: t for t in frames[50][1].transforms}
    assert turned(by_name["circular_spline"]) == turned(by_name["output"]) != 0
    assert turned(by_name["flexspline"]) == 0
    run.metadata["geometry"] = "[1"
    with pytest.raises(InputError, match="is no drive geometry"):
        scene.geometry_of(run)


def test_a_minute_at_a_kilohertz_with_teeth_and_scene_stays_small(tmp_path):
    run = drive_run(duration=60.0, rate=1000.0, teeth_every=20)
    path = write_log(run, tmp_path / "a.mcap")
    assert path.stat().st_size < 60e6
    assert len(messages(path, panels.SCENE, SceneUpdate)) == pytest.approx(1800, abs=2)


def test_half_an_hour_is_drawn_in_at_most_3600_frames():
    assert scene.frames_per_second(1800.0) * 1800.0 <= 3600
    assert scene.frames_per_second(0.02) == pytest.approx(3000.0)
