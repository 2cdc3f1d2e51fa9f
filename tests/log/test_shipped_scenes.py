"""The scenes of the shipped scenarios show the drive as it stands, at every instant that is shown."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from viewing import apart, major_axis, points_of, views

import hdsim
from hdsim.log import naming, read_attachments
from hdsim.log.facts import SPEEDS
from hdsim.log.info import info_log

ROOT = Path(__file__).resolve().parents[2]
MOVING = ("constant_speed", "sine_tracking", "gravity_arm", "move_and_settle", "seed_move")


def scenario(name):
    return ROOT / "scenarios" / f"{name}.yaml"


@pytest.mark.parametrize("name", MOVING)
def test_the_toothed_ellipse_follows_the_wave_generator_at_every_transform(log_of, name):
    log = log_of(scenario(name))
    run = hdsim.open_log(log)
    pitch = 2 * math.pi / 202
    axes = {}
    worst, between = 0.0, 0
    sampled = set(naming.to_ns(run.tables["teeth"].time).tolist())
    motor = dict(zip(naming.to_ns(run.time).tolist(), run["motor_angle"].tolist(), strict=True))
    for at, shown, frames in views(log):
        (ring,) = (e for e in shown.values() if e.id in ("flexspline", "teeth"))
        if id(ring) not in axes:
            axes = {id(ring): (ring, major_axis(points_of(ring)))}
        drawn = axes[id(ring)][1] + frames[ring.frame_id]
        worst = max(worst, apart(drawn, motor[at], math.pi))
        between += at not in sampled
    assert between > 50
    # The toothing is drawn in the nearest of the positions in which it looks the same.
    assert worst < 0.55 * pitch


@pytest.mark.parametrize("name", MOVING)
def test_loads_stay_where_they_are_on_the_ellipse_between_two_samples(log_of, name):
    log = log_of(scenario(name))
    teeth = hdsim.open_log(log).tables["teeth"]
    times = naming.to_ns(teeth.time)
    checked = 0
    for at, shown, frames in list(views(log))[::7]:
        bars = points_of(shown["tooth forces"])
        sample = int(np.searchsorted(times, at, side="right")) - 1
        # The forces are drawn at most at the rate of the transforms, so the sample may be an older one.
        loaded = np.abs(teeth["normal_force"][max(0, sample - 5) : sample + 1]).max(axis=0) > 0
        if not len(bars) or not loaded.any():
            continue
        around = np.arctan2(bars[:, 1], bars[:, 0]) + frames[shown["tooth forces"].frame_id]
        from_axis = np.abs(
            np.remainder(around - frames["wave_generator"] + math.pi / 2, math.pi) - math.pi / 2
        )
        assert from_axis.max() < math.radians(50)
        checked += 1
    assert checked > 10 or name == "constant_speed"


@pytest.mark.parametrize("name", MOVING)
def test_the_motor_turns_little_from_one_transform_to_the_next(log_of, name):
    log = log_of(scenario(name))
    run = hdsim.open_log(log)
    times = np.array([at for at, *_ in views(log)])
    motor = np.interp(times, naming.to_ns(run.time), run["motor_angle"])
    step = float(np.abs(np.diff(run["motor_angle"])).max())
    assert np.abs(np.diff(motor)).max() <= math.radians(15) + 2 * step


def test_a_loaded_tooth_touches_the_flank_that_it_presses(log_of):
    """Seed move takes up 20 N m before it moves: the teeth are pressed to a flank a few micrometres away."""
    log = log_of(scenario("seed_move"))
    about, run = info_log(log), hdsim.open_log(log)
    record = about.metadata["hdsim.scene"]
    gap, radius = float(record["half_gap_m"]), float(record["pitch_radius_m"])
    assert 1e-7 < gap < 1e-4
    pitch = 2 * math.pi / 202
    moved = {}
    for at, _, frames in views(log):
        space = math.remainder(frames["flexspline_teeth"] - frames["circular_spline"], pitch)
        moved[(at - naming.EPOCH_NS) / 1e9] = radius * space
    held = [value for t, value in moved.items() if 0.15 < t < 0.24]
    twist = run["output_torque"][(run.time > 0.15) & (run.time < 0.24)].mean()
    assert held
    assert all(np.sign(value) == -np.sign(twist) for value in held)
    # Pressed into the flank by what the contact yields, and its share of the teeth's pitch errors.
    assert all(0.9 * gap < abs(value) < gap + 5e-6 for value in held)


def test_the_arm_is_drawn_lowest_where_its_energy_is_lowest(log_of):
    log = log_of(scenario("gravity_arm"))
    run = hdsim.open_log(log)
    gravity = hdsim.load_scenario(scenario("gravity_arm")).load.gravity
    moment = gravity.mass_kg * gravity.gravity_m_per_s2 * gravity.centre_of_mass_m
    heights, angles = [], []
    for at, shown, frames in views(log):
        ((load,), turn) = (shown["output"].spheres, frames[shown["output"].frame_id])
        p = load.pose.position
        heights.append((p.x * math.sin(turn) + p.y * math.cos(turn)) / math.hypot(p.x, p.y))
        angles.append(run["output_angle"][np.searchsorted(naming.to_ns(run.time), at)])
    # The model's own energy of gravity, m g l (1 - cos), is its moment times the height that is drawn.
    hanging = math.radians(gravity.hanging_angle_deg)
    energy = moment * (1 - np.cos(np.array(angles) - hanging))
    np.testing.assert_allclose(moment * (1 + np.array(heights)), energy, atol=1e-6 * moment)
    assert np.ptp(angles) > math.radians(20)
    assert heights[0] == pytest.approx(-1, abs=1e-4)
    bodies = [body for body in shown["output"].triangles if abs(body.pose.position.y) > 1e-3]
    pointing = [2 * math.atan2(body.pose.orientation.z, body.pose.orientation.w) for body in bodies]
    assert np.degrees(pointing) == pytest.approx([-90])


@pytest.mark.parametrize("hanging_deg", [0.0, -90.0, 30.0])
def test_any_hanging_angle_points_down(hanging_deg):
    from hdsim.log.scene_geometry import SceneGeometry
    from hdsim.simulation.simulate import provenance

    data = hdsim.load_scenario(scenario("gravity_arm")).model_dump()
    data["load"]["gravity"]["hanging_angle_deg"] = hanging_deg
    g = SceneGeometry.from_metadata(provenance(hdsim.scenario.Scenario.model_validate(data)))
    assert math.sin(g.arm_angle_rad + math.radians(hanging_deg)) == pytest.approx(-1)


@pytest.mark.parametrize("name", [*MOVING, "warm_up", "back_driving", "resonance_sweep", "torsion_cycle"])
def test_no_layout_with_a_drive_plays_faster_than_the_eye_can_follow(log_of, name):
    log = log_of(scenario(name))
    run = hdsim.open_log(log)
    turns_per_s = float(np.abs(run["motor_velocity"]).max()) / (2 * math.pi)
    shown = 0
    for attachment, text in read_attachments(log).items():
        built = json.loads(text) if attachment.startswith("layout-") else {"configById": {}}
        if any(panel.startswith("3D!") for panel in built["configById"]):
            speed = built["playbackConfig"]["speed"]
            assert turns_per_s * speed <= 4.0 * 1.01 or speed == min(SPEEDS)
            assert 360 * turns_per_s * speed / 30 < 90
            shown += 1
    assert shown
