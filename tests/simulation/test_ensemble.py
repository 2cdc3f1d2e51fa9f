"""Runs side by side: bit for bit the runs alone, on any executor."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import hdsim
from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.ensemble import InProcess, as_completed, in_order, in_threads, record_at_once
from hdsim.simulation.run import RunFailed
from hdsim.simulation.setup import build_run

TRAJECTORY = {"type": "ramp", "velocity_rpm": 300}
CONTROLLER = {"type": "cascade", "position_gain_per_s": 40.0, "velocity_gain_nm_s_per_rad": 0.025}
SENSORS = {"output_angle": {"delay_s": 0.0007}}


def scenario(mesh="lumped", seed=0, sample_period_s=None, **run):
    return Scenario.model_validate({
        "drive": {"preset": "seed-2021", "mesh": {"model": mesh}},
        "effects": {"kinematic_error": {}, "sensors": SENSORS},
        "command": {
            "motor": {
                "type": "position",
                "trajectory": TRAJECTORY,
                "controller": CONTROLLER,
                "sample_period_s": sample_period_s,
            }
        },
        # A jump of the torque is a cut.
        "load": {"inertia_kg_m2": 0.05, "torque": {"type": "step", "height_nm": 5.0, "start_time_s": 0.007}},
        "run": {"duration_s": 0.02, "sample_rate_hz": 2000, "teeth_rate_hz": 500, "seed": seed} | run,
    })  # fmt: skip


CASES = {
    "lumped": {},
    "teeth": {"mesh": "teeth"},
    "rigid": {"mesh": "rigid"},
    "sampled controller": {"sample_period_s": 1e-3},
    "another method": {"method": "Radau"},
}


@pytest.mark.parametrize("case", CASES)
def test_a_run_at_once_is_the_run_to_the_last_bit(case):
    wanted = build_run(scenario(**CASES[case])).record()
    found = record_at_once(build_run(scenario(**CASES[case])))
    # Angles and velocities first, which are computed apart from the others.
    for channel in ("motor_angle", "output_velocity", "transmission_error"):
        assert channel in found
        assert np.array_equal(found[channel], wanted[channel]), channel
    assert found.tables.keys() == wanted.tables.keys()
    for name, table in wanted.tables.items():
        assert np.array_equal(found.tables[name].time, table.time)
        assert list(found.tables[name].columns) == list(table.columns)
        for channel in table.columns:
            assert np.array_equal(found.tables[name][channel], table[channel]), channel
    assert found.static.keys() == wanted.static.keys()
    assert found.events == wanted.events


def test_blocks_of_samples_are_those_of_the_run():
    runs = [build_run(scenario()) for _ in range(2)]
    for run in runs:
        run.block = 7  # blocks, and spans, end between the samples' end and the torque's jump
    wanted, found = runs[0].record(), record_at_once(runs[1])
    for channel in wanted.channels:
        assert np.array_equal(found[channel], wanted[channel]), channel


def test_runs_in_threads_are_the_runs_alone():
    scenarios = [scenario("teeth", seed, duration_s=0.008) for seed in range(2)]
    channels = ["output_angle", "output_torque"]
    alone = [hdsim.simulate(one) for one in scenarios]
    with ThreadPoolExecutor(2) as pool:
        several = [
            hdsim.simulate_all(scenarios, channels, threads=1),
            hdsim.simulate_all(scenarios, channels, threads=2),
            hdsim.simulate_all(scenarios, channels, pool=pool),
        ]
    for found in several:
        for one, wanted in zip(found, alone, strict=True):
            assert list(one) == channels
            assert all(np.array_equal(one[c], wanted[c]) for c in channels)
    assert not np.array_equal(alone[0]["output_torque"], alone[1]["output_torque"])


def test_a_channel_that_is_not_there_is_named():
    with pytest.raises(InputError, match="'torque'"):
        hdsim.simulate_all([scenario()], ["torque"])


def test_a_run_that_stops_early_says_what_the_run_alone_says(monkeypatch):
    from hdsim.simulation import failures

    monkeypatch.setattr(failures, "FASTEST", 1.0)
    run = build_run(scenario(duration_s=0.1))
    recording = run.record()
    with pytest.raises(RunFailed) as raised:
        record_at_once(build_run(scenario(duration_s=0.1)))
    assert str(raised.value) == run.failure
    assert len(raised.value.recording.time) == len(recording.time) > 0


def test_no_more_is_handed_out_than_there_is_room_for():
    started, free = [], threading.Event()

    def slow(item):
        free.wait(5.0)
        return item

    def items():
        for k in range(10):
            started.append(k)
            yield k

    with ThreadPoolExecutor(2) as pool:
        results = as_completed(slow, items(), pool, 2)
        timer = threading.Timer(0.05, free.set)
        timer.start()
        next(results)
        assert len(started) == 4
        assert len(dict(results)) == 9


def test_order_is_kept_and_errors_are_raised():
    assert in_order(lambda k: k * k, range(20), threads=3) == [k * k for k in range(20)]
    assert in_order(str, []) == []
    with pytest.raises(ZeroDivisionError):
        list(as_completed(lambda k: 1 / k, [1, 0, 2], InProcess(), 1))


def test_as_many_threads_work_as_are_said():
    def here(_):
        time.sleep(0.01)
        return threading.get_ident()

    with in_threads(1):
        assert set(in_order(here, range(6))) == {threading.get_ident()}
    with in_threads(3):
        found = set(in_order(here, range(12)))
        assert 1 < len(found) <= 3
        assert threading.get_ident() not in found
