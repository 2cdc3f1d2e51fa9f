"""The log as the JavaScript MCAP packages see it, which share no code with what wrote it."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from driving import drive_run

from hdsim.log import write_log
from hdsim.recording import Column, Recording, Table

HERE = Path(__file__).parent / "js"
FILES = ("package.json", "package-lock.json", "read.mjs")


@pytest.fixture(scope="session")
def reader(request: pytest.FixtureRequest) -> Path:
    """Folder with the script and its packages, installed once and kept in pytest's cache."""
    if not shutil.which("node") or not shutil.which("npm"):
        pytest.skip("node and npm are not installed")
    digest = hashlib.sha256(b"".join((HERE / name).read_bytes() for name in FILES)).hexdigest()[:16]
    if hasattr(request.config, "cache") and request.config.cache is not None:
        folder = request.config.cache.mkdir("log-javascript-reader") / digest
    else:
        folder = request.getfixturevalue("tmp_path_factory").mktemp("js") / digest
    if not folder.exists():
        # Installed elsewhere and renamed, because test runs in parallel want the same folder.
        fresh = folder.with_name(f"{digest}-{os.getpid()}")
        fresh.mkdir(parents=True)
        for name in FILES:
            shutil.copy(HERE / name, fresh)
        done = subprocess.run(
            ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"],
            cwd=fresh,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        if done.returncode:
            shutil.rmtree(fresh)
            pytest.skip(f"npm could not install the reader's packages: {done.stderr.strip()[-300:]}")
        try:
            fresh.rename(folder)
        except OSError:
            shutil.rmtree(fresh)
    return folder


def read(reader: Path, log: Path) -> subprocess.CompletedProcess[str]:
    command = ["node", str(reader / "read.mjs"), str(log)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def sha256(values: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(values, "<f8").tobytes()).hexdigest()


def test_javascript_reads_every_message_to_the_bit(reader, recording, tmp_path):
    path = write_log(recording, tmp_path / "a.mcap")
    done = read(reader, path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    counts = {topic: about["indexed"] for topic, about in found["topics"].items()}
    assert counts == {topic: about["streamed"] for topic, about in found["topics"].items()}
    assert sum(counts.values()) == found["messages"]
    views = counts.pop("/hd/state_view")
    assert 19_000 < views <= 20_002
    assert 18_000 < counts.pop("/joint_states") <= 20_001
    assert counts == {
        "/hd/state": 30_000,
        "/hd/teeth": 300,
        "/hd/static": 1,
        "/hd/static_view": 1,
        "/hd/events": 3,
    }
    assert found["attachments"]["scenario.yaml"] == recording.metadata["scenario"]
    assert found["metadata"][0] == "hdsim.run"
    state, teeth = found["topics"]["/hd/state"], found["topics"]["/hd/teeth"]
    assert state["schema"] == "hdsim.State"
    assert state["sha256"]["time"] == sha256(recording.time)
    assert state["sha256"]["motor_angle"] == sha256(recording["motor_angle"])
    assert state["sha256"]["output_torque"] == sha256(recording["output torque"])
    assert teeth["sha256"]["normal_force"] == sha256(recording.tables["teeth"]["normal_force"])
    joints = found["topics"]["/joint_states"]
    assert joints["schema"] == "sensor_msgs/msg/JointState"
    assert found["topics"]["/hd/events"]["schema"] == "foxglove.Log"
    assert found["topics"]["/hd/events"]["sha256"]["time"] == sha256(
        np.array([e.time for e in recording.events])
    )


def test_javascript_reads_the_joint_states_to_the_bit(reader, tmp_path):
    run = drive_run()
    done = read(reader, write_log(run, tmp_path / "a.mcap"))
    assert done.returncode == 0, done.stderr
    joints = json.loads(done.stdout)["topics"]["/joint_states"]
    assert joints["indexed"] == len(run.time)
    for field, channel in (("position", "angle"), ("velocity", "velocity"), ("effort", "torque")):
        both = np.column_stack([run[f"motor_{channel}"], run[f"output_{channel}"]])
        assert joints["sha256"][field] == sha256(both)


def test_javascript_refuses_a_flipped_byte(reader, tmp_path):
    table = Table(np.arange(1000.0), {"a": Column(np.random.default_rng(0).standard_normal(1000), "1")})
    path = write_log(Recording({"state": table}), tmp_path / "a.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    assert read(reader, path).returncode != 0
