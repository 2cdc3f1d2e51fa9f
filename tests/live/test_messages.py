"""What goes over the wire: how often playback is told, the full rate, and answers to what comes too late."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
pytest.importorskip("websockets", reason="websockets is not installed")

from live_client import Client
from mcap.records import Channel, Schema
from test_live import VIEW, running, scenario

import hdsim
from hdsim.live.parameters import LiveParameters
from hdsim.live.session import LiveReplay
from hdsim.live.store import MOST_AT_ONCE, MessageStore
from hdsim.log import naming
from hdsim.simulation.simulate import simulate_to_log

STATE = "/hd/state"
PLAYING, PAUSED, ENDED = 0, 1, 3


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("live") / "a.mcap"
    simulate_to_log(scenario(1.0), path)
    return path


@pytest.fixture
def served(log):
    live = LiveReplay(log, speed=0.5, port=0)
    yield live
    live.close()


def test_playback_state_is_told_when_it_changes_and_not_with_every_tick(served):
    client = Client(served.address)
    assert client.take(10, lambda: client.clocks > 60)
    # That it plays, and before it began that it waited for a viewer; time is told all along.
    assert [p[0] for p in client.playback][-1:] == [PLAYING]
    assert len(client.playback) <= 3
    told = len(client.playback)
    client.set(paused=True)
    assert client.take(5, lambda: client.playback[-1][0] == PAUSED)
    client.take(0.4)
    assert len(client.playback) == told + 1
    client.set(speed=4.0)
    assert client.take(5, lambda: client.playback[-1][2] == 4.0)
    client.set(paused=False)
    assert client.take(5, lambda: client.playback[-1][0] == ENDED)
    client.take(0.4)
    assert [p[0] for p in client.playback[told:]] == [PAUSED, PAUSED, PLAYING, ENDED]


def test_a_viewer_that_comes_late_is_told_the_playback_state(served):
    first = Client(served.address)
    assert first.take(10, lambda: len(first.times(VIEW)) > 3)
    first.set(paused=True)
    assert first.take(5, lambda: first.playback[-1][0] == PAUSED)
    late = Client(served.address)
    assert late.take(5, lambda: len(late.playback) > 0)
    assert late.playback[-1][0] == PAUSED


def test_a_request_without_a_seek_is_answered_without_one(served):
    client = Client(served.address)
    assert client.take(10, lambda: len(client.times(VIEW)) > 3)
    client.control(pause=True, speed=0.5, id="stop")
    assert client.take(5, lambda: any(p[4] == "stop" for p in client.playback))
    assert [p[3] for p in client.playback if p[4] == "stop"] == [False]


def test_a_run_tells_no_more_than_its_changes_while_blocks_come_in_bursts(tmp_path):
    with running(scenario(2.0), tmp_path / "a.mcap", 1.0) as it:
        before = len(it.client.playback)
        it.client.take(1.0)
        assert len(it.client.playback) - before <= 1


def test_the_full_rate_is_served_of_a_finished_log(served, log):
    client = Client(served.address)
    assert client.take(10, lambda: client.times(STATE)[-1:] == [naming.EPOCH_NS + 1_000_000_000])
    found = np.unique(client.times(STATE))
    # What was before the viewer came is not sent again.
    whole = naming.to_ns(hdsim.open_log(log).time)
    np.testing.assert_array_equal(found, whole[whole >= found[0]])
    assert found[0] < naming.EPOCH_NS + 100_000_000


def test_the_full_rate_is_served_of_a_run(tmp_path):
    with running(scenario(1.0), tmp_path / "a.mcap", 0.5) as it:
        assert it.client.take(10, lambda: len(it.client.times(STATE)) > 100)
    step = np.diff(np.unique(it.client.times(STATE)))
    np.testing.assert_array_equal(step, 2_000_000)


def test_a_store_of_many_messages_takes_little_memory_and_delivers_what_a_queue_holds():
    schema = Schema(id=1, name="hdsim.State", encoding="protobuf", data=b"")
    channel = Channel(id=1, topic=STATE, message_encoding="protobuf", schema_id=1, metadata={})
    bodies = [bytes(200)] * 2000
    store = MessageStore()
    tracemalloc.start()
    try:
        for block in range(100):
            store.add(schema, channel, range(2000 * block, 2000 * (block + 1)), bodies)
        seen: dict[str, int] = {}
        found = [time for time, _, _ in store.following(seen, 150_000)]
        # 40 MB of messages, of which one block's times and one delivery are in memory.
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
    assert seen == {STATE: 150_001}
    assert MOST_AT_ONCE // 2 < len(found) <= MOST_AT_ONCE
    assert found[-1] == 150_000
    assert len(set(np.diff(found))) == 1
    assert [time for time, _, _ in store.following(seen, 150_100)] == list(range(150_001, 150_101))
    assert [time for time, _, _ in store.latest(1999)] == [1999]
    assert [time for time, _, _ in store.latest(2000)] == [2000]
    assert store.latest(-1) == []
    assert store.following(seen, 200_000, lambda topic: False) == []
    store.close()


LOAD = "load.torque.torque_nm"


def test_a_parameter_that_is_set_after_the_end_is_answered(tmp_path):
    with running(scenario(1.0, parameters=[LOAD]), tmp_path / "a.mcap", 4.0) as it:
        client = it.client
        assert client.take(20, lambda: client.playback[-1][0] == ENDED)
        it.thread.join(20)
        client.parameters.clear()
        client.set(**{LOAD.replace(".", "__"): -7.5})
        assert client.take(5, lambda: len(client.status) > 0)
        assert client.status == [
            f"{LOAD}: -7.5 comes too late, the run is simulated to its end at 1 s; it stays 1"
        ]
        assert client.take(5, lambda: client.parameters.get(LOAD) == 1.0)


def test_a_change_that_waits_when_the_run_ends_is_answered():
    parameters = LiveParameters(scenario(1.0, parameters=[LOAD]))
    parameters.request(LOAD, 2.0)
    parameters.end(1.0)
    (told,) = parameters.refusals()
    assert told.startswith(f"{LOAD}: 2 comes too late")
    assert parameters.refusals() == []


def test_what_is_no_value_of_a_parameter_is_answered(served):
    client = Client(served.address)
    assert client.take(10, lambda: len(client.times(VIEW)) > 3)
    client.set(speed="fast", paused="no", seek_s=True, load__inertia_kg_m2=1.0)
    assert client.take(5, lambda: len(client.status) >= 4)
    assert client.status[:3] == [
        "speed: found 'fast', expected a number",
        "paused: found 'no', expected true or false",
        "seek_s: found True, expected a number",
    ]
    assert "cannot be changed" in client.status[3]
