from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from driving import drive_run
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from viewing import apart, messages, points_of, turned

from hdsim.errors import InputError
from hdsim.log import (
    LogWriter,
    info_log,
    naming,
    open_log,
    panels,
    scene,
    scene_bodies,
    scene_frames,
    scene_teeth,
    shapes,
    verify_log,
    write_log,
)
from hdsim.log.facts import playback_speed
from hdsim.recording import Column, Recording, Table


def same_angle(a, b):
    return apart(a, b, 2 * math.pi) < 1e-6


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_log(drive_run(), tmp_path_factory.mktemp("log") / "run.mcap")


def test_the_log_with_a_scene_is_sound_and_reads_back(log):
    assert verify_log(log).ok
    assert list(open_log(log).tables) == ["state", "teeth"]


def test_frames_come_at_the_rate_that_playback_shows_and_turn_the_bodies(log):
    run = drive_run()
    frames = messages(log, scene.TRANSFORM_TOPIC)
    # At least 30 for each second of playback, and one for every 15 degrees that the motor turns.
    turned_on = np.abs(np.diff(run["motor_angle"])).sum() / math.radians(15)
    assert 4.0 * 30 / playback_speed(4.0) <= len(frames)
    assert turned_on <= len(frames) < 4.0 * 30 / playback_speed(4.0) + turned_on + 2
    for log_time, frame in frames[:: len(frames) // 7]:
        k = int(np.flatnonzero(naming.to_ns(run.time) == log_time)[0])
        by_name = {t.child_frame_id: t for t in frame.transforms}
        assert {t.parent_frame_id for t in frame.transforms} == {"world"}
        assert all(t.HasField("translation") for t in frame.transforms)
        assert {t.timestamp.seconds * 10**9 + t.timestamp.nanos for t in frame.transforms} == {log_time}
        assert same_angle(turned(by_name["wave_generator"]), run["motor_angle"][k])
        assert same_angle(turned(by_name["output"]), run["output_angle"][k])
        assert turned(by_name["circular_spline"]) == 0
        factor = float(info_log(log).metadata["hdsim.scene"]["error_factor"])
        pointed = run["output_angle"][k] + factor * run["transmission_error"][k]
        assert same_angle(turned(by_name["error_pointer"]), pointed)


def test_a_motor_that_sleeps_and_sprints_has_frames_when_it_turns():
    time = np.arange(0, 100.0, 1e-3)
    angle = np.where(time < 90, 0.0, (time - 90) * 2 * math.pi)
    turns = scene_frames.Turns(1.0, 100.0)
    rows = np.concatenate(
        [turns.rows(time[k : k + 777], angle[k : k + 777]) + k for k in range(0, 10**5, 777)]
    )
    assert len(rows) == pytest.approx(90 + 240, abs=12)
    assert rows.tolist() == scene_frames.Turns(1.0, 100.0).rows(time, angle).tolist()
    fast = scene_frames.Turns(1.0, 100.0).rows(time, 1e3 * angle)
    assert len(fast) <= 18_000


@pytest.mark.parametrize("fixed", [True, False])
def test_teeth_stand_in_the_spaces_of_the_circular_spline_where_the_drive_meshes(fixed):
    """Whatever the angles, teeth on the major axis are in the middle of a space, but for the mesh's twist."""
    g = scene.SceneGeometry(circular_spline_fixed=fixed)
    motor = np.random.default_rng(0).uniform(-300, 300, 50)
    output = motor / g.ratio
    spline = np.zeros(50) if fixed else output
    ring = motor / g.ratio if fixed else np.zeros(50)
    twist = scene_teeth.mesh_twist(g, motor, output, ring - 1e-5, np.zeros(50))
    np.testing.assert_allclose(twist, 1e-5, atol=1e-12)
    frame = scene_teeth.mesh_angle(g, motor, spline, twist)
    teeth = tips(scene_teeth.flexspline_outline(g))
    spaces = tips(scene_teeth.circular_spline_outline(g))
    near = np.abs(np.remainder(teeth + math.pi / 2, math.pi) - math.pi / 2) < math.radians(8)
    assert near.sum() > 10
    for k in range(50):
        drawn = teeth[near] + frame[k]
        off = drawn[:, None] - (spaces + spline[k])
        nearest = np.abs(np.remainder(off + math.pi, 2 * math.pi) - math.pi).min(axis=1)
        assert nearest.max() < 0.01 * 2 * math.pi / 202
    # The ring is not elsewhere than the drive has it: its own tooth 0 is among the teeth that are drawn.
    from_axis = np.remainder(ring - motor, 2 * math.pi / 200)
    drawn = np.remainder((frame - motor) * 202 / 200, 2 * math.pi / 200)
    np.testing.assert_allclose(np.exp(200j * from_axis), np.exp(200j * drawn), atol=3e-3)


def tips(outline):
    """Angle of the middle of each tooth or space of an outline."""
    middles = outline.reshape(-1, 6, 3)[:, 2:4].mean(axis=1)
    return np.arctan2(middles[:, 1], middles[:, 0])


def test_flanks_are_as_far_apart_as_the_gap():
    g = scene.SceneGeometry(half_gap_m=4e-6)
    tooth = scene_teeth.flexspline_outline(g).reshape(-1, 6, 3)[0]
    space = scene_teeth.circular_spline_outline(g).reshape(-1, 6, 3)[0]

    def flank(points, radius):
        angle, at = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1])
        return radius * np.interp(radius, at, angle)

    for radius in g.pitch_radius_m + g.tooth_height * np.array([0.2, 0.4, 0.6]):
        play = flank(space[3:][::-1], radius) - flank(tooth[3:][::-1], radius)
        assert play == pytest.approx(4e-6 * 200 / 202, abs=2e-7)


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def covered(body, points):
    """Which of the points (n, 2) any triangle of a body covers, as seen along the axis."""
    corners = np.array([[p.x, p.y] for p in body.points])[np.array(body.indices)].reshape(-1, 3, 2)
    inside = np.zeros(len(points), bool)
    for a, b, c in corners:
        sides = [cross(q - p, points - p) for p, q in ((a, b), (b, c), (c, a))]
        area = cross(b - a, c - a)
        inside |= np.all([s * np.sign(area) > 0 for s in sides], axis=0) & (abs(area) > 1e-16)
    return inside


def test_bodies_cover_their_teeth_and_leave_their_spaces_open():
    g = scene.SceneGeometry(flexspline_teeth=40, circular_spline_teeth=42, half_gap_m=5e-6)
    entities = {e.id: e for e in scene_bodies.static_entities(g, naming.EPOCH_NS, scene_bodies.Shown())}
    (spline,), (ring,) = entities["circular spline"].triangles, entities["flexspline"].triangles
    space = 2 * np.pi / 42 * np.arange(42)
    depth = g.pitch_radius_m + 0.5 * g.tooth_height
    half = 0.24 * 2 * np.pi * g.pitch_radius_m / 42
    for side in (-1, 1):
        # In the play of a flank, a micrometre wide, and as far behind the flank.
        free = shapes.polar(depth, space + side * (half + 3e-6) / depth)[:, :2]
        steel = shapes.polar(depth, space + side * (half + 7e-6) / depth)[:, :2]
        assert not covered(spline, free).any()
        assert covered(spline, steel).all()
    # Where the teeth mesh.
    slots = 2 * np.pi / 40 * np.array([-3, -2, -1, 0, 1, 2, 3, 18, 19, 20, 21, 22])
    radius = g.radius(slots) + 0.4 * g.tooth_height
    for side in (-1, 1):
        brass = shapes.polar(radius, g.place(slots) + side * (half - 3e-6) / radius)[:, :2]
        free = shapes.polar(radius, g.place(slots) + side * (half + 3e-6) / radius)[:, :2]
        assert covered(ring, brass).all()
        assert not covered(ring, free).any()


def test_engaged_teeth_are_coloured_by_their_force(log):
    teeth = drive_run().tables["teeth"]
    g = scene.geometry_of(drive_run())
    assert g.largest_force_n == pytest.approx(np.abs(teeth["normal_force"]).max(), rel=0.34)
    for log_time, update in messages(log, panels.SCENE)[::20]:
        k = int(np.flatnonzero(naming.to_ns(teeth.time) == log_time)[0])
        share = teeth["normal_force"][k] / g.largest_force_n
        engaged = share > 1e-3
        (entity,) = update.entities
        assert (entity.frame_id, entity.frame_locked) == ("flexspline_teeth", True)
        if not engaged.any():
            assert not entity.lines
            continue
        (line,) = entity.lines
        assert len(line.points) == len(line.colors) == 2 * engaged.sum()
        found = np.array([[c.r, c.g, c.b, c.a] for c in line.colors])[::2]
        np.testing.assert_allclose(found, shapes.force_colours(share[engaged]))
        # Each bar is on the tooth that is drawn nearest to where the loaded one is.
        bars = points_of(entity)[1::2]
        wanted = teeth["angle"][k][engaged]
        off = np.arctan2(bars[:, 1], bars[:, 0]) - g.place(wanted)
        assert np.abs(np.remainder(off + math.pi, 2 * math.pi) - math.pi).max() < 0.55 * 2 * math.pi / 200
    low, high = shapes.force_colours(np.array([0.0, 1.0]))
    assert low[2] > low[0]
    assert high[0] > high[2]


def test_bodies_and_legend_are_sent_once_on_a_topic_of_their_own(log):
    ((log_time, update),) = messages(log, panels.SCENE_STATIC)
    assert log_time == naming.EPOCH_NS
    frames = {e.id: e.frame_id for e in update.entities}
    assert frames == {
        "circular spline": "circular_spline",
        "flexspline": "flexspline_teeth",
        "wave generator": "wave_generator",
        "output": "output",
        "error pointer": "error_pointer",
        "legend": "world",
    }
    texts = " ".join(t.text for e in update.entities for t in e.texts)
    assert "drawn larger: deflection x6" in texts
    assert "error of the output x1000" in texts
    assert "tooth force 0 N" in texts
    assert "30 N" in texts
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
    for topic in (panels.SCENE, scene.TRANSFORM_TOPIC):
        assert messages(path, topic) == messages(log, topic)


def test_without_tooth_forces_the_teeth_are_drawn_all_the_same(tmp_path):
    run = drive_run(duration=1.0)
    del run.tables["teeth"]
    del run.tables["state"].columns["ring_angle"]
    path = write_log(run, tmp_path / "a.mcap")
    assert not messages(path, panels.SCENE)
    ((_, update),) = messages(path, panels.SCENE_STATIC)
    assert not any("tooth force" in t.text for e in update.entities for t in e.texts)
    assert "flexspline_teeth" in {e.frame_id for e in update.entities}
    for _, frame in messages(path, scene.TRANSFORM_TOPIC)[::50]:
        by_name = {t.child_frame_id: turned(t) for t in frame.transforms}
        assert (
            apart(by_name["flexspline_teeth"], by_name["wave_generator"], math.pi) < 0.51 * 2 * math.pi / 202
        )


def test_geometry_comes_from_the_metadata(tmp_path):
    metadata = {"geometry": '{"pitch_radius_m": 0.05, "circular_spline_fixed": false, "other": 1}'}
    run = drive_run()
    run.metadata.update(metadata)
    g = scene.geometry_of(run)
    assert (g.pitch_radius_m, g.circular_spline_fixed, g.flexspline_teeth) == (0.05, False, 200)
    frames = messages(write_log(run, tmp_path / "a.mcap"), scene.TRANSFORM_TOPIC)
    by_name = {t.child_frame_id: t for t in frames[50][1].transforms}
    assert turned(by_name["circular_spline"]) == turned(by_name["output"]) != 0
    run.metadata["geometry"] = "[1"
    with pytest.raises(InputError, match="is no drive geometry"):
        scene.geometry_of(run)


def test_a_minute_at_a_kilohertz_with_teeth_and_scene_stays_small(tmp_path):
    run = drive_run(duration=60.0, rate=1000.0, teeth_every=20)
    path = write_log(run, tmp_path / "a.mcap")
    assert path.stat().st_size < 40e6
    assert len(messages(path, panels.SCENE)) == pytest.approx(1800, abs=2)


def test_half_an_hour_is_drawn_in_at_most_3600_frames():
    assert scene_frames.frames_per_second(1800.0) * 1800.0 <= 3600
    assert scene_frames.frames_per_second(0.02) == pytest.approx(3000.0)


def test_a_comparison_shows_the_measured_machine_beside_the_model(tmp_path):
    run = drive_run(duration=1.0)
    state = run.tables["state"]
    measured = Table(state.time, {name: state.columns[name] for name in ("motor_angle", "output_angle")})
    off = Column(state["output_angle"] - 1e-4, "rad")
    model = {"output_angle": off, "transmission_error": Column(state["transmission_error"] - 1e-4, "rad")}
    recording = Recording({"measured": measured, "after": Table(state.time, model)})
    path = write_log(recording, tmp_path / "a.mcap")
    ((_, update),) = messages(path, panels.SCENE_STATIC)
    assert "measured_pointer" in {e.frame_id for e in update.entities}
    factor = float(info_log(path).metadata["hdsim.scene"]["error_factor"])
    for at, frame in messages(path, scene.TRANSFORM_TOPIC)[::40]:
        k = int(np.flatnonzero(naming.to_ns(run.time) == at)[0])
        by_name = {t.child_frame_id: turned(t) for t in frame.transforms}
        assert same_angle(by_name["output"], off.values[k])
        assert same_angle(by_name["measured_pointer"] - by_name["error_pointer"], factor * 1e-4)
