"""Events of runs, and of made-up blocks whose events are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim.drive.ratings import ratings
from hdsim.recording import Column, Event, Table
from hdsim.scenario.model import Scenario
from hdsim.simulation.events import EventDetector
from hdsim.simulation.limit_cycle import ARCSEC, RestWatch, limit_cycle
from hdsim.simulation.limits import Bearing
from hdsim.simulation.quota import BURST, MOST, Quota
from hdsim.simulation.setup import build_model, build_run
from hdsim.simulation.solvers import Statistics
from hdsim.simulation.watches import Flanks, Watch
from hdsim.validate import play

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


def scenario(**load: object) -> Scenario:
    return Scenario.model_validate(
        {
            "drive": {"preset": "csg-20-100"},
            "command": {"motor": {"type": "locked"}},
            "load": {"inertia_kg_m2": 0.05, **load},
            "run": {"duration_s": 1.0, "teeth_rate_hz": 0},
        }
    )


def test_a_threshold_is_told_once_each_way_however_the_samples_are_cut():
    time = np.arange(2000) * 1e-3
    value = np.sin(2 * np.pi * time)
    whole = list(Watch("x", "warning", "up", "down", 0.5, 0.4).feed(time, value))
    assert [event.message for event in whole] == ["up", "down", "up", "down"]
    # sin crosses 0.5 upwards at 1/12 of a turn, and 0.4 downwards after half a turn less asin 0.4.
    assert whole[0].time == pytest.approx(1 / 12, abs=1e-6)
    assert whole[1].time == pytest.approx(0.5 - np.arcsin(0.4) / (2 * np.pi), abs=1e-6)
    watch = Watch("x", "warning", "up", "down", 0.5, 0.4)
    pieces = [e for k in range(0, 2000, 7) for e in watch.feed(time[k : k + 7], value[k : k + 7])]
    assert pieces == whole


def test_gap_crossings_are_told_however_the_samples_are_cut():
    time = np.arange(3000) * 1e-3
    torque = 10 * np.sin(2 * np.pi * time)
    whole = list(Flanks(1.0).feed(time, torque))
    assert [round(event.time, 1) for event in whole] == [0.5, 1.0, 1.5, 2.0, 2.5]
    assert "from the positive to the negative" in whole[0].message
    # The torque is below a tenth of its amplitude for 2 asin(0.1) / 2 pi s.
    assert float(whole[0].message.split()[-2]) == pytest.approx(1e3 * 2 * np.arcsin(0.1) / (2 * np.pi), abs=2)
    flanks = Flanks(1.0)
    pieces = [e for k in range(0, 3000, 11) for e in flanks.feed(time[k : k + 11], torque[k : k + 11])]
    assert [e.message for e in pieces] == [e.message for e in whole]


def test_rated_and_momentary_torque_are_told_of_a_catalogue_drive():
    run = build_run(scenario(torque={"type": "triangle", "amplitude_nm": 200, "frequency_hz": 1}))
    recording = run.record()
    told = {e.message: e for e in recording.events if e.source == "drive"}
    exceeded = [m for m in told if "exceeded" in m]
    assert any("rated" in m for m in exceeded)
    assert any("momentary peak" in m for m in exceeded)
    rated = run.model.rated_torque_nm
    at = next(e.time for m, e in told.items() if "rated" in m and "exceeded" in m)
    assert abs(np.interp(at, recording.time, recording["output_torque"])) == pytest.approx(rated, rel=5e-3)


def test_a_torque_at_which_teeth_skip_is_told():
    run = build_run(scenario(torque={"type": "triangle", "amplitude_nm": 2000, "frequency_hz": 1}))
    told = [e for e in run.record().events if e.source == "drive" and "ratcheting torque" in e.message]
    assert told
    assert told[0].level == "error"
    assert "330 N m exceeded" in told[0].message


def test_a_torque_at_which_the_flexspline_folds_is_told_once_each_way_by_its_whole_name():
    run = build_run(scenario(torque={"type": "triangle", "amplitude_nm": 2000, "frequency_hz": 1}))
    told = [e.message for e in run.record().events if e.source == "drive" and "buckling" in e.message]
    why = "at which the flexspline of a real drive folds and never here"
    assert told[0] == f"buckling torque, {why}, of 800 N m exceeded"
    assert told[1] == "torque below the buckling torque again"
    # The triangle passes the limit upwards once on either side of zero.
    assert len(told) == 4


def at_one_speed(rpm: float, torque_nm: float, preset: str = "csg-20-100") -> Scenario:
    return Scenario.model_validate(
        {
            "drive": {"preset": preset, "mesh": {"model": "lumped"}},
            "command": {"motor": {"type": "motion", "trajectory": {"type": "ramp", "velocity_rpm": -rpm}}},
            "load": {"inertia_kg_m2": 0.05, "torque": {"type": "hold", "torque_nm": -torque_nm}},
            "run": {"duration_s": 2.0},
        }
    )


def test_an_input_speed_beyond_the_gears_is_told():
    events = build_run(at_one_speed(7000, 0.0)).record().events
    assert any(e.message == "maximum input speed of 6500 rpm exceeded" for e in events)
    assert not any("input speed" in e.message for e in build_run(at_one_speed(6400, 0.0)).record().events)


def test_a_bearing_that_lives_shorter_than_rated_is_told_with_the_cubic_law():
    # Twice the rated 52 N m at the rated speed: an eighth of 10,000 h.
    (told,) = [e for e in build_run(at_one_speed(2000, 104.0)).record().events if "bearing life" in e.message]
    assert float(told.message.split()[3]) == pytest.approx(1250, rel=0.02)
    assert told.level == "warning"
    calm = build_run(at_one_speed(2000, 50.0)).record().events
    assert not [e for e in calm if "bearing life" in e.message]


def test_the_life_of_a_bearing_does_not_depend_on_how_the_samples_are_cut():
    rng = np.random.default_rng(1)
    time, torque, speed = np.arange(1000) * 1e-3, 60 * rng.normal(size=1000), 200 * rng.normal(size=1000)
    gear = ratings("csg-20-100")
    whole, pieces = Bearing(gear), Bearing(gear)
    whole.feed(time, torque, speed)
    for k in range(0, 1000, 7):
        pieces.feed(time[k : k + 7], torque[k : k + 7], speed[k : k + 7])
    assert pieces.life_h == pytest.approx(whole.life_h, rel=1e-9)


def test_moves_and_rests_of_the_command_are_told():
    run = build_run(hdsim.load_scenario(SCENARIOS / "seed_move.yaml"))
    events = [e for e in run.record().events if e.source == "command"]
    assert [e.message for e in events] == [
        "command rests at 0 deg",
        "command moves at 0 deg",
        "command rests at 60 deg",
    ]
    assert events[1].time < events[2].time < run.duration_s


def test_saturation_is_told():
    made = scenario().model_dump(mode="json", exclude_unset=True)
    made["command"] = {
        "motor": {
            "type": "position",
            "torque_limit_nm": 0.2,
            "trajectory": {"type": "step", "start_time_s": 0.1, "height_deg": 20},
            "controller": {
                "type": "cascade",
                "position_gain_per_s": 20,
                "velocity_gain_nm_s_per_rad": 0.02,
                "velocity_integral_gain_nm_per_rad": 0.1,
            },
        }
    }
    messages = [e.message for e in build_run(Scenario.model_validate(made)).record().events]
    assert "torque at its limit of 0.2 N m" in messages
    assert "torque below its limit again" in messages


def block(time: np.ndarray, **channels: np.ndarray) -> dict[str, Table]:
    zero = np.zeros(len(time))
    names = ("motor_angle", "output_torque", "motor_torque", "energy_residual")
    columns = dict.fromkeys(names, zero) | channels
    return {"state": Table(time, {name: Column(values, "1") for name, values in columns.items()})}


def crossing_run(block_size: int) -> list[Event]:
    """100 s of a torque that changes its sign twice a second, the first 40 s and in the last of them."""
    detector = EventDetector(build_model(scenario()), 100.0)
    time = np.arange(100_000) * 1e-3
    torque = np.where((time < 40) | (time > 98.8), 5 * np.sin(2 * np.pi * time), -5.0)
    events: list[Event] = []
    for k in range(0, len(time), block_size):
        rows = slice(k, k + block_size)
        events += detector.feed(block(time[rows], output_torque=torque[rows]), 1.0, Statistics())
    return events + detector.finish(100.0, None)


def test_many_events_of_a_kind_are_spread_over_the_run_and_counted():
    events = crossing_run(1000)
    assert [e.time for e in events] == sorted(e.time for e in events)
    single = [e for e in events if e.message.startswith("gap crossed")]
    counted = [e for e in events if e.message.endswith("s: gap crossed")]
    # At once what comes at once, then one each eighth of the run; after a quiet time again, to the last.
    assert [round(e.time, 1) for e in single] == [0.5, 1.0, 1.5, 2.0, 13.0, 25.5, 38.0, 99.0, 99.5]
    assert len(single) <= MOST
    assert [int(e.message.split()[0]) for e in counted] == [21, 24, 24, 3]
    until = [float(e.message.split(" until ")[1].split()[0]) for e in counted]
    np.testing.assert_allclose(until, [12.5, 25.0, 37.5, 39.5], atol=0.01)
    # As soon as the next one is told, or it has been quiet for an eighth of the run.
    assert [round(e.time, 1) for e in counted] == [13.0, 25.5, 38.0, 52.0]
    # Each crossing is told or counted.
    assert len(single) + sum(int(e.message.split()[0]) for e in counted) == 81


@pytest.mark.parametrize("block_size", [17, 100_000])
def test_what_is_told_of_many_events_does_not_depend_on_how_the_samples_are_cut(block_size):
    whole = [(round(e.time, 6), e.message) for e in crossing_run(1000)]
    assert [(round(e.time, 6), e.message) for e in crossing_run(block_size)] == whole


def test_an_end_is_told_if_its_beginning_was():
    quota = Quota("up", 80.0, "down")
    told = []
    for k in range(400):
        pair = [Event(0.2 * k, "warning", "x", "up"), Event(0.2 * k + 0.1, "info", "x", "down")]
        told += quota.feed(pair, 0.2 * (k + 1) - 1e-9)
    told += quota.finish(80.0)
    singles = [e.message for e in told if "more" not in e.message]
    assert singles == ["up", "down"] * (len(singles) // 2)
    assert BURST < len(singles) // 2 <= MOST
    assert len(singles) // 2 + sum(int(e.message.split()[0]) for e in told if "more" in e.message) == 400
    assert {e.level for e in told if "more" in e.message} == {"warning"}
    assert told[-1].message.endswith("more times until 79.9 s: up")


def test_the_chatter_of_a_whole_run_is_told_to_its_end():
    run = build_run(hdsim.load_scenario(SCENARIOS / "constant_speed.yaml"))
    events = run.record().events
    told = [e for e in events if e.source == "mesh"]
    # Hundreds of times the teeth leave contact; in each quarter of the run something is said of it.
    quarters = np.histogram([e.time for e in told], 4, (0, run.duration_s))[0]
    assert (quarters >= 4).all()
    assert len(told) < 6 * MOST


def test_a_swing_at_rest_is_told_however_the_samples_are_cut():
    time = np.arange(4001) / 1000
    rests = time > 1.0
    swing = np.where(rests, 5e-5 * np.sin(2 * np.pi * 7 * time), 0.0)

    def told(cuts: list[int]) -> list[Event]:
        watch = RestWatch()
        parts = zip(*(np.split(x, cuts) for x in (time, swing, rests)), strict=True)
        return [event for part in parts for event in watch.feed(*part)] + list(watch.end())

    (event,) = told([])
    assert told([500, 1001, 1002, 3000]) == [event]
    assert (event.time, event.level) == (4.0, "warning")
    assert "swings by 10.3 arcsec (-10.3 to 10.3 off its command) at 7 Hz" in event.message
    assert told([])[0].message.endswith("rests since 1.001 s")


def test_a_ringing_that_dies_while_the_output_drifts_is_no_limit_cycle():
    time = np.arange(0.0, 0.3, 5e-4)
    drift = 3e-4 * np.clip(time - 0.27, 0.0, None)
    for damping in (0.004, 0.008, 0.015):
        swing = 2e-5 * np.exp(-damping * 260.0 * time) * np.sin(260.0 * time)
        assert limit_cycle(time, swing + drift) is None
    assert limit_cycle(time, 2e-5 * np.sin(260.0 * time)) is not None


def test_the_limit_cycle_of_a_loop_over_play_is_the_one_of_an_ode_of_its_own():
    time, angle = play.with_hdsim()
    found = limit_cycle(time, angle - play.REFERENCE)
    # SciPy's LSODA on the loop written down again (row of README.md): 327.5 arcsec, 13.18 Hz.
    assert found is not None
    assert (found.amplitude_rad * ARCSEC, found.frequency_hz) == pytest.approx((327.5, 13.18), rel=1e-3)


def test_doubts_about_the_solution_are_told():
    detector = EventDetector(build_model(scenario()), 1.0)
    time = np.arange(10) * 0.1
    found = detector.feed(
        block(time, energy_residual=np.where(time > 0.45, 0.01, 0.0)), 1.0, Statistics(steps=50, rejected=300)
    )
    assert {e.message.split(" of the")[0] for e in found if e.source == "solver"} == {
        "hard to integrate: 300 steps refused, 50 taken up to 0.9 s",
        "energy audit off by 1.0e-02",
    }


def test_a_force_beyond_the_contact_table_is_told():
    model = build_model(scenario())
    assert model.teeth is not None
    detector = EventDetector(model, 1.0)
    time = np.arange(4) * 0.1
    force = np.zeros((4, 3))
    force[2, 1] = -21 * model.teeth.rated_tooth_force_n
    tables = block(time) | {"teeth": Table(time, {"normal_force": Column(force, "N")})}
    found = [e for e in detector.feed(tables, 1.0, Statistics()) if e.source == "contact"]
    assert len(found) == 1
    assert "beyond the contact table" in found[0].message
    assert 0.1 < found[0].time <= 0.2
