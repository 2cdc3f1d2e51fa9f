"""Additions from another package: used like hdsim's own; what is wrong with one takes nothing else down."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

CODE = '''
from typing import ClassVar, Literal

from pydantic import Field

from hdsim.actuation.controllers import Controller, PositionPD
from hdsim.contact.constant import ConstantStiffness
from hdsim.parts import Parameters
from hdsim.studies.registry import metric


class Soft(Parameters):
    """A tenth of steel."""

    law: Literal["soft"]

    def build(self, surface):
        return ConstantStiffness(4e7)


class Gentle(Controller):
    """A derivative and little else."""

    commands: ClassVar = ("position",)
    type: Literal["gentle"]
    derivative_gain_nm_s_per_rad: float = Field(0.01, gt=0)
    """Gain."""

    def system(self, loop):
        gain = self.derivative_gain_nm_s_per_rad
        return PositionPD(type="pd", proportional_nm_per_rad=1, derivative_nm_s_per_rad=gain).system(loop)


def joint():
    from hdsim.drive.presets import preset

    return preset("csg-20-100") | {"rated_torque_nm": 33.0}


@metric("top_speed", "rad/s", "largest speed of the motor", "arithmetic")
def top_speed(recording, scenario):
    return float(abs(recording["motor_velocity"]).max())
'''

GOOD = """
[hdsim.effects]
eddy_current_brake = my_drives.brake:EddyCurrentBrake
[hdsim.contact_laws]
soft = my_drives:Soft
[hdsim.controllers]
gentle = my_drives:Gentle
[hdsim.presets]
my-joint = my_drives:joint
[hdsim.metrics]
top_speed = my_drives:top_speed
"""

BAD = """
[hdsim.effects]
lugre_friction = my_drives.brake:EddyCurrentBrake
eddy_current_brake = my_drives.brake:EddyCurrentBrake
absent = my_drives.nothing:Absent
no_effect = my_drives:Soft
[hdsim.contact_laws]
soft_as_well = my_drives:Soft
[hdsim.presets]
csg-20-100 = my_drives:joint
"""


def install(folder: Path, name: str, entry_points: str) -> None:
    """What an installer leaves beside a package."""
    home = folder / f"{name.replace('-', '_')}-1.2.dist-info"
    home.mkdir()
    (home / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (home / "entry_points.txt").write_text(entry_points)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    package = tmp_path / "my_drives"
    package.mkdir()
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    brake = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]
    (package / "brake.py").write_text(brake, encoding="utf-8")
    (package / "__init__.py").write_text(CODE, encoding="utf-8")
    install(tmp_path, "my-drives", GOOD)
    return tmp_path


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    where = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, env=where, capture_output=True, text=True, check=False)


SCENARIO = """
name: all from outside
drive: {preset: my-joint, mesh: {model: lumped}}
effects: {eddy_current_brake: {damping_nm_s_per_rad: 0.3}}
command:
  motor:
    type: position
    at: output
    trajectory: {type: step, height_deg: 1}
    controller: {type: gentle}
load: {inertia_kg_m2: 0.5}
run: {duration_s: 0.05}
"""


@pytest.mark.slow
def test_a_scenario_takes_all_of_them(folder: Path) -> None:
    (folder / "all.yaml").write_text(SCENARIO)
    code = """
import hdsim
from hdsim.drive.parameters import Drive
from hdsim.scenario import Scenario, json_schema
scenario = hdsim.load_scenario("all.yaml")
assert scenario.drive.rated_torque_nm == 33
assert hdsim.simulate(scenario).metrics()["top_speed"].value > 0
schema = str(json_schema(Scenario))
assert all(name in schema for name in ("eddy_current_brake", "soft", "gentle"))
assert Drive.model_validate({"preset": "my-joint", "mesh": {"model": "teeth", "contact": {"law": "soft"}}})
"""
    done = run(folder, "-W", "error::UserWarning", "-c", code)
    assert done.returncode == 0, done.stderr


def test_the_lists_say_where_they_come_from(folder: Path) -> None:
    done = run(folder, "-m", "hdsim", "effects")
    (line,) = [line for line in done.stdout.splitlines() if "eddy_current" in line]
    assert "my-drives" in done.stdout
    assert "eddy-current brake" in line
    done = run(folder, "-m", "hdsim", "presets")
    assert (done.returncode, done.stderr) == (0, "")
    assert "my-joint (my-drives 1.2)" in done.stdout


def test_what_cannot_be_used_is_left_out_with_a_line_each(folder: Path) -> None:
    install(folder, "your-drives", BAD)
    done = run(folder, "-m", "hdsim", "effects")
    assert done.returncode == 0
    assert "lugre_friction" in done.stdout
    assert "eddy_current_brake" in done.stdout
    lines = done.stderr.splitlines()
    assert all(line.startswith("warning: your-drives 1.2: hdsim.") for line in lines)
    expected = [
        "absent is left out: my_drives.nothing:Absent cannot be imported: ModuleNotFoundError",
        "eddy_current_brake is left out: my-drives 1.2 has one of this name already",
        "lugre_friction is left out: hdsim has one of this name already",
        "no_effect is left out: found <class 'my_drives.Soft'>, expected a subclass of hdsim.parts.Effect",
    ]
    said = "\n".join(sorted(lines))
    assert all(part in said for part in expected), said
    done = run(folder, "-m", "hdsim", "presets")
    assert "csg-20-100 is left out: hdsim has one of this name already" in done.stderr
    assert 'soft_as_well is left out: expected its field law: Literal["soft_as_well"]' in done.stderr
    assert done.returncode == 0
