"""What a valid scenario hardly means is said in one line at check and at run, and nothing else is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from hdsim.effects.wave_generator_eccentricity import WaveGeneratorEccentricity
from hdsim.scenario import Scenario
from hdsim.scenario.commands import check
from hdsim.scenario.doubts import doubts

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SERVO: dict[str, Any] = {
    "type": "position",
    "trajectory": {"type": "hold", "angle_deg": 1},
    "controller": {"type": "pd", "proportional_nm_per_rad": 1.0, "derivative_nm_s_per_rad": 0.01},
}


def told(effects: dict[str, Any], motor: dict[str, Any] | None = None, **run: Any) -> list[str]:
    drive = run.pop("drive", {"preset": "csg-20-100"})
    return doubts(
        Scenario.model_validate(
            {
                "drive": drive,
                "effects": effects,
                "command": {"motor": motor or {"type": "free"}},
                "load": {"inertia_kg_m2": 0.1},
                "run": {"duration_s": 1.0, "sample_rate_hz": 2000} | run,
            }
        )
    )


def test_a_continuous_controller_does_not_read_the_sensors() -> None:
    sensors = {"sensors": {"output_angle": {"counts_per_turn": 16, "delay_s": 0.01}}}
    (line,) = told(sensors, SERVO)
    assert line.startswith("effects.sensors: found output_angle")
    assert "command.motor.sample_period_s" in line
    assert told(sensors, SERVO | {"sample_period_s": 1e-3}) == []
    assert told(sensors) == []


def test_a_speed_window_within_a_sample() -> None:
    sensors = {"sensors": {"motor_velocity": {"method": "differenced", "window_s": 0.001}}}
    (line,) = told(sensors, sample_rate_hz=100)
    assert line.startswith("effects.sensors.motor_velocity.window_s: found 0.001 s")
    assert "at least 1000 Hz" in line
    assert told(sensors, sample_rate_hz=1000) == []


@pytest.mark.parametrize("name", ["input_coulomb_viscous", "lugre_friction"])
def test_friction_that_counts_twice(name: str) -> None:
    (line,) = told({name: {}})
    assert line.startswith(f"effects.{name}.coulomb_nm: found 0.032 on top of the 0.0")
    assert told({name: {}}, drive={"preset": "csg-20-100", "friction": {"coulomb_nm": 0.0}}) == []


MOVE: dict[str, Any] = {
    "type": "position",
    "at": "output",
    "trajectory": {
        "type": "trapezoid",
        "distance_deg": 90,
        "maximum_velocity_deg_per_s": 300,
        "maximum_acceleration_deg_per_s2": 1500,
    },
    "controller": {"type": "pd", "proportional_nm_per_rad": 1.0, "derivative_nm_s_per_rad": 0.01},
}


@pytest.mark.parametrize(
    ("trajectory", "load", "said"),
    [
        ({}, {}, []),
        # 28 kg m^2 at 1500 deg/s^2 is 733 N m, and the gear's momentary peak 113.
        ({}, {"inertia_kg_m2": 28}, ["found up to 733 N m", "154 times that of motor and wave generator"]),
        ({"maximum_velocity_deg_per_s": 72000, "distance_deg": 4e6}, {}, ["12,000 rpm at the output"]),
        ({}, {"torque": {"type": "sine", "amplitude_nm": 200, "frequency_hz": 3}}, ["found up to 207.9 N m"]),
        ({}, {"gravity": {"mass_kg": 30, "centre_of_mass_m": 0.5}}, ["load.gravity: found up to 155 N m"]),
    ],
)
def test_what_no_gear_of_that_size_carries(
    trajectory: dict[str, Any], load: dict[str, Any], said: list[str]
) -> None:
    found = doubts(
        Scenario.model_validate(
            {
                "drive": {"preset": "csg-17-80"},
                "command": {"motor": MOVE | {"trajectory": MOVE["trajectory"] | trajectory}},
                "load": {"inertia_kg_m2": 0.3} | load,
                "run": {"duration_s": 100.0},
            }
        )
    )
    assert len(found) == len(said)
    assert all(text in line for text, line in zip(said, found, strict=True)), found


def test_check_says_it_and_the_scenario_is_fine(tmp_path: Path) -> None:
    path = tmp_path / "double.yaml"
    path.write_text(f"extends: {SCENARIOS / 'seed_move.yaml'}\neffects: {{lugre_friction: {{}}}}\n")
    done = CliRunner().invoke(check, [str(path)])
    assert done.exit_code == 0
    assert f"{path}: warning: effects.lugre_friction.coulomb_nm: found" in done.output


def test_the_shipped_scenarios_raise_no_doubt() -> None:
    for path in sorted(SCENARIOS.glob("*.yaml")):
        assert doubts(Scenario.from_yaml(path)) == [], path


def test_an_eccentricity_is_by_default_what_its_source_says() -> None:
    assert WaveGeneratorEccentricity.model_fields["eccentricity_um"].default == 10.0
