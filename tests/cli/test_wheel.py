"""What a wheel holds is enough to begin with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_a_wheel_has_its_scenarios_and_starts_from_an_empty_folder(tmp_path: Path) -> None:
    target, work = tmp_path / "target", tmp_path / "work"
    work.mkdir()
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    wheel = ["wheel", "--no-deps", "--no-build-isolation", "-w", tmp_path, ROOT]
    subprocess.run([*pip, *wheel], check=True, capture_output=True)
    (built,) = tmp_path.glob("hdsim-*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--target", target, built], check=True, capture_output=True)

    def hdsim(*arguments: str) -> str:
        command = [sys.executable, "-m", "hdsim", *arguments]
        where = os.environ | {"PYTHONPATH": str(target)}
        done = subprocess.run(command, cwd=work, env=where, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    code = "import hdsim.scenario.examples as e; print(e.folder())"
    where = os.environ | {"PYTHONPATH": str(target)}
    told = subprocess.run([sys.executable, "-c", code], cwd=work, env=where, capture_output=True, text=True)
    assert told.stdout.strip() == str(target / "hdsim" / "examples")
    assert "seed_move" in hdsim("examples")
    assert "wrote seed_move.yaml" in hdsim("new", "seed_move")
    assert "seed_move.yaml: OK" in hdsim("check", "seed_move.yaml")
    assert (target / "hdsim" / "examples" / "studies" / "seed_stiffness.yaml").exists()
    assert {path.name for path in work.iterdir()} == {"seed_move.yaml", "scenario.schema.json"}
