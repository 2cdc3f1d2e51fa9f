"""A drive engineer's afternoon, at the command line alone, from an empty folder.

Size 17, ratio 80, 0.3 kg m^2, 90 degrees in half a second: how far off, how soon at rest, why, what twice the
backlash would do, and how rough the flanks may be for a lost motion of one arcmin.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

SCENARIO = """
name: joint move
description: 90 degrees in half a second with 0.3 kg m^2.
drive: {preset: csg-17-80}
effects: {set: catalogue}
command:
  motor:
    type: position
    at: output
    trajectory:
      type: sequence
      moves:
        - type: trapezoid
          distance_deg: 90
          maximum_velocity_deg_per_s: 300
          maximum_acceleration_deg_per_s2: 1500
        - {type: hold, duration_s: 0.25}
    controller:
      type: cascade
      position_gain_per_s: 60
      velocity_gain_nm_s_per_rad: 0.02
      velocity_integral_gain_nm_per_rad: 0.4
load: {inertia_kg_m2: 0.3}
run: {duration_s: 0.75, seed: 7, rtol: 1.0e-4}
"""
STUDY = """
base: {scenario: joint.yaml}
parameters:
  drive.mesh.gap_factor: {type: list, values: [1, 2]}
replicates: %d
metrics: [positioning_error, settling_time]
"""


def hdsim(folder: Path, *arguments: str) -> str:
    """Output of a command that has to succeed."""
    command = [str(Path(sys.executable).with_name("hdsim")), *arguments]
    if not Path(command[0]).exists():
        command = [sys.executable, "-m", "hdsim.cli", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def told(text: str, name: str) -> float:
    """The number in the row of a table that begins with a name."""
    cells = [[cell.strip() for cell in line.split("│")] for line in text.splitlines() if "│" in line]
    (value,) = [row[2] for row in cells if row[1] == name]
    return float(value)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("engineer")
    (place / "joint.yaml").write_text(SCENARIO)
    return place


def test_check_says_what_is_simulated(folder: Path) -> None:
    text = hdsim(folder, "check", "joint.yaml")
    # Accuracy 1 arcmin instead of size 20's 0.8; K1 10 instead of 16 kN m/rad (docs/presets.md).
    assert "order 2, amplitude_arcmin 0.25, per wave_generator_turn" in " ".join(text.split())
    assert "slip_torque_nm 1.25" in text


@pytest.mark.slow
def test_run_budget_and_study_say_the_same(folder: Path) -> None:
    run = hdsim(folder, "run", "joint.yaml", "--no-plot", "--no-verify")
    script = "import hdsim, json; m = hdsim.open_log('logs/joint.mcap').metrics(); print(json.dumps("
    script += "[m[k].value for k in ('positioning_error', 'settling_time')]))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True
    )
    error, settling = json.loads(done.stdout)
    assert told(run, "positioning error") == pytest.approx(error, rel=1e-3)
    assert told(run, "settling time") == pytest.approx(settling, rel=1e-3)

    hdsim(folder, "budget", "joint.yaml")
    budget = {row["cause"]: row for row in rows(folder / "results" / "joint-budget.csv")}
    assert abs(float(budget["whole"]["share [arcsec]"])) == error
    causes = [
        float(row["share [arcsec]"]) for name, row in budget.items() if name not in ("whole", "interaction")
    ]
    assert sum(causes) == pytest.approx(float(budget["whole"]["share [arcsec]"]), abs=1e-9)
    dominating = next(iter(budget))
    assert abs(float(budget[dominating]["share [arcsec]"])) == max(map(abs, causes))

    (folder / "doubled.yaml").write_text(STUDY % 3)
    hdsim(folder, "study", "doubled.yaml")
    first = rows(folder / "results" / "doubled" / "results.csv")[0]
    assert first["seed"] == "7"
    assert float(first["positioning_error [arcsec]"]) == error
    assert float(first["settling_time [s]"]) == settling
    summary = rows(folder / "results" / "doubled" / "summary.csv")
    (doubled,) = [r for r in summary if r["metric"] == "settling_time" and r["drive.mesh.gap_factor"] == "2"]
    low, middle, high = (
        float(doubled[name]) for name in ("difference_low_95", "difference", "difference_high_95")
    )
    assert low < middle < high
    assert doubled["pairs"] == "3"


@pytest.mark.slow
def test_the_largest_roughness_for_a_lost_motion_of_an_arcmin(folder: Path) -> None:
    arguments = ["--procedure", "torsion", "--metric", "lost_motion", "--limit", "60", "--replicates", "2"]
    name = "drive.mesh.flanks.circular_spline.fractal_roughness_m"
    text = hdsim(
        folder, "tolerance", "joint.yaml", *arguments, "--parameter", name, "--low", "1e-10", "--high", "1e-9"
    )
    (line,) = [line for line in text.splitlines() if line.startswith(f"{name} = ")]
    largest = float(line.split()[2])
    assert 1e-10 < largest < 1e-9
    probes = rows(folder / "results" / "joint-tolerance.csv")
    beyond = [row for row in probes if float(row[f"{name} [m]"]) > 1.02 * largest]
    assert beyond
    assert all(float(row["quantile [arcsec]"]) > 60 for row in beyond)


@pytest.mark.slow
def test_a_metric_of_another_test_is_an_error_of_one_line(folder: Path) -> None:
    arguments = ["--metric", "lost_motion", "--limit", "60", "--replicates", "1"]
    place = ["--parameter", "drive.mesh.gap_factor", "--low", "1", "--high", "2"]
    done = subprocess.run(
        [sys.executable, "-m", "hdsim.cli", "tolerance", "joint.yaml", *arguments, *place],
        cwd=folder, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("error: no run of 'joint move' gives lost_motion: a torsion cycle needs")
    assert "Traceback" not in done.stdout + done.stderr
