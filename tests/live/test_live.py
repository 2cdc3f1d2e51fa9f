"""A run and a log, watched by a plain websocket client."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import hdsim
from hdsim.errors import InputError
from hdsim.log import naming, verify_log
from hdsim.scenario.model import Scenario
from hdsim.simulation.simulate import simulate_to_log

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
pytest.importorskip("websockets", reason="websockets is not installed")

from live_client import Client

from hdsim.live.session import LiveReplay, LiveRun

HERE = Path(__file__).parent
VIEW = "/hd/state_view"


def scenario(duration: float = 2.0, **live: object) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "live",
            "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
            "command": {
                "motor": {
                    "type": "position",
                    "at": "output",
                    "trajectory": {"type": "sine", "amplitude_deg": 5, "frequency_hz": 1},
                    "controller": {
                        "type": "cascade",
                        "position_gain_per_s": 20,
                        "velocity_gain_nm_s_per_rad": 0.02,
                        "velocity_integral_gain_nm_per_rad": 0.1,
                    },
                }
            },
            "load": {"inertia_kg_m2": 0.1, "torque": {"type": "hold", "torque_nm": 1.0}},
            "run": {"duration_s": duration, "sample_rate_hz": 500},
            "live": live,
        }
    )


@contextmanager
def running(made: Scenario, path: Path, speed: float) -> Iterator[SimpleNamespace]:
    """The scenario running in a thread, and a client that has seen its first samples."""
    live = LiveRun(made, speed=speed, port=0)
    found = SimpleNamespace(live=live, run=None)

    def work() -> None:
        found.run = simulate_to_log(made, path, live=live)

    found.thread = threading.Thread(target=work)
    found.thread.start()
    found.client = Client(live.address)
    try:
        assert found.client.take(60, lambda: len(found.client.times(VIEW)) > 3)
        yield found
    finally:
        live.player.set_speed(1e4)
        live.player.pause(False)
        found.thread.join(60)
        live.close()


def test_a_client_receives_pauses_changes_speed_and_seeks_and_the_log_sees_nothing_of_it(tmp_path):
    path = tmp_path / "a.mcap"
    made = scenario(3.0)
    with running(made, path, 0.5) as it:
        client = it.client
        assert client.info["capabilities"].count("playbackControl") == 1
        assert client.take(5, lambda: len(client.times("/joint_states")) > 20)
        # Paused: nothing more comes, and the simulation waits.
        client.set(paused=True)
        assert client.take(5, lambda: client.parameters.get("paused") is True)
        client.take(0.3)
        count, reached = len(client.times(VIEW)), it.live.player.state.time
        client.take(0.5)
        assert len(client.times(VIEW)) == count
        assert it.live.player.state.time == reached
        # Faster: twice the speed, by the state that the server tells.
        client.set(paused=False, speed=1.0)
        assert client.take(5, lambda: bool(client.playback) and client.playback[-1][2] == 1.0)
        began, at = time.monotonic(), it.live.player.state.time
        client.take(0.6)
        rate = (it.live.player.state.time - at) * 1e-9 / (time.monotonic() - began)
        assert rate == pytest.approx(1.0, rel=0.3)
        # Back to the start by playback control, and what was computed comes once more.
        client.control(pause=True, speed=1.0, seek=naming.EPOCH_NS + 100_000_000, id="back")
        assert client.take(5, lambda: any(p[4] == "back" and p[3] for p in client.playback))
        assert it.live.player.state.time == naming.EPOCH_NS + 100_000_000
        client.take(0.2)
        # Messages come after time has gone back, the static ones too: viewers throw away what came before.
        assert client.clock == naming.EPOCH_NS + 100_000_000
        assert client.after_seek >= {VIEW, "/hd/scene_static", "/hd/transforms"}
        assert naming.EPOCH_NS + 90_000_000 < client.times(VIEW)[-1] <= naming.EPOCH_NS + 100_000_000
        client.control(pause=False, speed=50.0)
        end = naming.EPOCH_NS + 3_000_000_000
        assert client.take(20, lambda: client.times("/hd/events")[-1:] == [end])
    assert verify_log(path).problems == []
    back = hdsim.open_log(path)
    np.testing.assert_allclose(back.time, np.arange(1501) / 500, atol=1e-12)
    # Apart from the shorter spans the run is the same as one that nobody watched.
    alone = hdsim.simulate(made)
    np.testing.assert_allclose(back["output_angle"], alone["output_angle"], atol=2e-6)


def test_a_client_changes_load_and_gain_and_sees_the_change(tmp_path):
    load, gain = "load.torque.torque_nm", "command.motor.controller.position_gain_per_s"
    path = tmp_path / "a.mcap"
    with running(scenario(4.0, parameters=[load, gain]), path, 1.0) as it:
        client = it.client
        client.send({"op": "getParameters", "parameterNames": [], "id": "all"})
        assert client.take(5, lambda: load in client.parameters)
        client.send({"op": "subscribeParameterUpdates", "parameterNames": [load, gain]})
        assert client.parameters[load] == 1.0
        client.set(**{load.replace(".", "__"): -7.5, gain.replace(".", "__"): 25.0})
        assert client.take(10, lambda: client.parameters.get(load) == -7.5)
        assert client.take(
            10, lambda: any(b"load.torque" in body for _, body in client.messages["/hd/events"])
        )
        # What may not be changed is refused, with the reason.
        client.set(speed=-1.0)
        client.set(drive__rated_torque_nm=3.0)
        client.set(**{gain.replace(".", "__"): -1.0})
        assert client.take(10, lambda: len(client.status) >= 3)
        assert "greater than 0" in client.status[0]
        assert "the scenario marks: " + load in client.status[1]
        assert "position_gain_per_s" in client.status[2]
    back = hdsim.open_log(path)
    before, after = back["load_torque"][0], back["load_torque"][-1]
    assert (before, after) == (1.0, -7.5)
    changed = [e for e in back.events if e.source == "live"]
    assert sorted(e.message for e in changed) == [f"{gain}: 20 -> 25", f"{load}: 1 -> -7.5"]
    # The last sample of the span before: at the time of the change, but for rounding.
    at = np.searchsorted(back.time, changed[0].time - 1e-9)
    assert back.time[at] == pytest.approx(changed[0].time, abs=1e-9)
    assert (back["load_torque"][: at + 1] == 1.0).all()
    assert (back["load_torque"][at + 1 :] == -7.5).all()
    # A changed load is work, not an error: the audit of energy still closes.
    assert np.abs(back["energy_residual"]).max() < 1e-5
    assert verify_log(path).problems == []


def test_a_scenario_marks_only_what_a_run_can_stand():
    for name, text in (
        ("drive.rated_torque_nm", "may not be changed while it runs"),
        ("load.torque.nothing", "is no number that this scenario states"),
        ("load.torque.type", "is no number"),
    ):
        with pytest.raises(ValueError, match=text):
            scenario(parameters=[name])


def test_a_client_that_comes_late_gets_what_was_told_once(tmp_path):
    with running(scenario(3.0), tmp_path / "a.mcap", 0.5) as it:
        late = Client(it.live.address)
        assert late.take(5, lambda: len(late.times(VIEW)) > 0)
        assert late.take(5, lambda: "/hd/scene_static" in late.messages)
        assert late.times("/hd/scene_static") == [naming.EPOCH_NS]
        late.socket.close()


def test_a_dying_or_sleeping_client_does_not_slow_the_run(tmp_path):
    script = f"""
import sys, time
sys.path.insert(0, {str(HERE)!r})
from live_client import Client
client = Client(sys.argv[1])
client.take(60, lambda: len(client.times({VIEW!r})) > 3)
print("seen", flush=True)
time.sleep(60)
"""
    made = scenario(3.0)
    live = LiveRun(made, speed=1.0, port=0)
    thread = threading.Thread(target=simulate_to_log, args=(made, tmp_path / "a.mcap"), kwargs={"live": live})
    process = subprocess.Popen(
        [sys.executable, "-c", script, live.address], stdout=subprocess.PIPE, text=True
    )
    thread.start()
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "seen"
    # It sleeps with all topics subscribed, then it is killed.
    began, at = time.monotonic(), live.player.state.time
    time.sleep(0.5)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    thread.join(60)
    assert not thread.is_alive()
    left = 3.0 - (at - naming.EPOCH_NS) * 1e-9
    assert time.monotonic() - began < left + 0.5
    deadline = time.monotonic() + 5
    while live.server.viewers and time.monotonic() < deadline:
        time.sleep(0.05)
    assert live.server.viewers == 0
    live.close()
    assert verify_log(tmp_path / "a.mcap").problems == []


def test_the_last_client_that_leaves_a_paused_run_lets_it_go_on(tmp_path):
    with running(scenario(2.0), tmp_path / "a.mcap", 2.0) as it:
        it.client.set(paused=True)
        assert it.client.take(5, lambda: it.client.parameters.get("paused") is True)
        it.client.socket.close()
        it.thread.join(20)
        assert not it.thread.is_alive()


def test_a_finished_log_is_served_the_same_way(tmp_path):
    path = tmp_path / "a.mcap"
    simulate_to_log(scenario(1.0), path)
    content = path.read_bytes()
    live = LiveReplay(path, speed=0.5, port=0)
    try:
        client = Client(live.address)
        assert client.take(10, lambda: len(client.times(VIEW)) > 20)
        assert "/hd/scene_static" in client.messages
        client.set(seek_s=0.9, speed=0.1)
        assert client.take(5, lambda: client.playback[-1][1] >= naming.EPOCH_NS + 900_000_000)
        client.set(speed=10.0)
        assert client.take(5, lambda: client.playback[-1][0] == 3)
        assert client.take(5, lambda: client.times(VIEW)[-1] == naming.EPOCH_NS + 1_000_000_000)
        client.control(pause=False, speed=1.0, seek=naming.EPOCH_NS)
        assert client.take(5, lambda: client.playback[-1][0] == 0)
    finally:
        live.close()
    assert path.read_bytes() == content


@pytest.mark.slow
def test_commands_serve_and_end_on_interrupt(tmp_path):
    source = tmp_path / "a.yaml"
    source.write_text(scenario(1.0).to_yaml())
    log = tmp_path / "a.mcap"
    common = [sys.executable, "-m", "hdsim.cli"]
    done = subprocess.run(
        [*common, "run", str(source), "-o", str(log), "--live", "--speed", "5", "--port", "0", "--no-plot"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "live     ws://127.0.0.1:" in done.stdout
    assert "verified yes" in done.stdout
    process = subprocess.Popen(
        [*common, "replay", str(log), "--live", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        # Jobs in the background are born deaf to Ctrl-C, and so would be their children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    client = Client(line.split()[1].rstrip(","))
    assert client.take(10, lambda: len(client.times(VIEW)) > 0)
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 130
    process.stdout.close()


def test_what_cannot_be_served_is_told(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"nonsense")
    with pytest.raises(InputError):
        LiveReplay(tmp_path / "a.mcap")
    made = scenario(1.0)
    first = LiveRun(made, port=0)
    with pytest.raises(InputError, match="cannot listen at"):
        LiveRun(made, port=int(first.address.rsplit(":", 1)[1]))
    first.close()


def test_without_the_sdk_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(InputError, match=r"pip install 'hdsim\[live\]'"):
        LiveRun(scenario(1.0), port=0)
