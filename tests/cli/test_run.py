"""``hdsim run`` as a user meets it: a log, a picture, and nothing lost when it is stopped."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hdsim
from hdsim.cli import main

SHORT = """
drive:
  preset: seed-2021
command:
  motor:
    type: {motor}
load:
  inertia_kg_m2: 0.5
  torque: {{type: step, height_nm: 5}}
run:
  duration_s: {duration}
  sample_rate_hz: {rate}
"""
UNSTABLE = """
drive:
  preset: seed-2021
  friction: {smoothing_velocity_rad_per_s: 0.5}
command:
  motor:
    type: position
    trajectory: {type: step, height_deg: 1}
    controller: {type: state_space, inputs: [motor_angle], D: [10.0]}
load:
  inertia_kg_m2: 0.5
run:
  duration_s: 50
  sample_rate_hz: 2000
  start: {motor_velocity_rad_per_s: 1.0}
"""


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as exit_:
        main(["run", *map(str, arguments)])
    return int(exit_.value.code or 0)


def test_run_writes_a_verified_log_and_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "free.yaml"
    scenario.write_text(SHORT.format(motor="free", duration=0.1, rate=500))
    assert run(scenario, "-o", tmp_path / "out" / "free.mcap") == 0
    printed = capsys.readouterr()
    assert "verified yes" in printed.out
    assert "\nreplay   hdsim replay " in printed.out
    assert "energy audit" in printed.out
    assert printed.err == ""
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["free.mcap", "free.png"]
    recording = hdsim.open_log(tmp_path / "out" / "free.mcap")
    assert len(recording.time) == 51
    assert recording.metadata["seed"] == "0"


def test_log_read_back_is_bit_identical_to_the_run(tmp_path: Path) -> None:
    scenario = tmp_path / "free.yaml"
    scenario.write_text(SHORT.format(motor="locked", duration=0.05, rate=2000))
    run(scenario, "-o", tmp_path / "x.mcap", "--no-plot")
    result = hdsim.simulate(hdsim.load_scenario(scenario))
    read = hdsim.open_log(tmp_path / "x.mcap")
    for name, table in result.tables.items():
        assert read.tables[name].time.tobytes() == table.time.tobytes()
        for column in table.columns:
            assert read.tables[name][column].tobytes() == table[column].tobytes()


def test_a_run_that_fails_keeps_what_it_computed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "unstable.yaml"
    scenario.write_text(UNSTABLE)
    assert run(scenario, "-o", tmp_path / "u.mcap", "--no-plot") == 1
    error = capsys.readouterr().err
    assert "stopped early" in error
    assert "t = " in error
    assert "runs away" in error
    assert "Traceback" not in error
    recording = hdsim.open_log(tmp_path / "u.mcap")
    assert len(recording.time) > 10
    assert any(event.level == "error" for event in recording.events)


def test_a_run_that_fails_before_its_first_sample_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = tmp_path / "free.yaml"
    text = SHORT.format(motor="free", duration=0.05, rate=1000)
    # Legal, and its torque is beyond any number.
    text += "effects: {nonlinear_viscous_friction: {reference_speed_rad_per_s: 1.0e-300}}\n"
    scenario.write_text(text)
    assert run(scenario, "-o", tmp_path / "u.mcap") == 1
    printed = capsys.readouterr()
    assert "stopped early" in printed.err
    assert "t = 0 s" in printed.err
    assert "Traceback" not in printed.err
    assert "simulated 0 of 0.05 s" in printed.out
    with pytest.raises(hdsim.InputError, match="before its first"):
        print(hdsim.open_log(tmp_path / "u.mcap").time)


@pytest.mark.slow
def test_kill_in_mid_run_leaves_a_log_that_can_be_recovered(tmp_path: Path) -> None:
    scenario = tmp_path / "long.yaml"
    scenario.write_text(SHORT.format(motor="free", duration=100000, rate=2000))
    partial = tmp_path / "long.mcap.partial"
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "hdsim.cli",
            "run",
            str(scenario),
            "-o",
            str(tmp_path / "long.mcap"),
            "--no-plot",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 120
    while (
        process.poll() is None
        and time.monotonic() < deadline
        and (not partial.exists() or partial.stat().st_size < 3_000_000)
    ):
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "long.mcap").exists()
    with pytest.raises(SystemExit) as exit_:
        main(["recover", str(partial), str(tmp_path / "saved.mcap")])
    assert not exit_.value.code
    recording = hdsim.open_log(tmp_path / "saved.mcap")
    assert len(recording.time) >= 4000
    assert recording.metadata["scenario_name"] == "long"
