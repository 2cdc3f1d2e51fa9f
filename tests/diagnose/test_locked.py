"""Drives with a locked side: what the output's channels alone tell."""

import numpy as np
import pytest

import hdsim
from hdsim.diagnosis.following import next_experiment
from hdsim.diagnosis.workflow import diagnose
from hdsim.errors import InputError
from hdsim.estimate.records import Record
from hdsim.tell.words import title_of

LOCKED = """
name: torsion
drive: {preset: csg-20-100, mesh: {model: lumped}}
command: COMMAND
load:
  inertia_kg_m2: 0.05
  torque: {type: triangle, amplitude_nm: 52, frequency_hz: 0.25}
run: {duration_s: 16.0, sample_rate_hz: 200}
"""
MOTOR = "{motor: {type: locked}}"
OUTPUT = "{motor: {type: free}, output: {type: locked}}"
HYSTERESIS = {"torsional_hysteresis_maxwell", "torsional_hysteresis_duhem"}


def scenario(tmp_path, command: str, more: str = ""):
    path = tmp_path / "base.yaml"
    path.write_text(LOCKED.replace("COMMAND", command) + more, encoding="utf-8")
    return hdsim.load_scenario(path)


@pytest.fixture(scope="module")
def twisted(tmp_path_factory) -> dict[str, np.ndarray]:
    """What the output's sensors read of a drive with hysteresis whose motor is locked."""
    folder = tmp_path_factory.mktemp("locked")
    got = hdsim.simulate(scenario(folder, MOTOR, "effects: {torsional_hysteresis_maxwell: {}}\n"))
    rng = np.random.default_rng(0)
    n = len(got.time)
    return {
        "time": np.asarray(got.time),
        "output_angle": np.asarray(got["output_angle"]) + 4e-6 * rng.standard_normal(n),
        "output_torque": np.asarray(got["output_torque"]) + 0.1 * rng.standard_normal(n),
    }


@pytest.mark.slow
@pytest.mark.parametrize("command", [MOTOR, OUTPUT])
def test_hysteresis_is_named_from_torque_and_angle_alone(tmp_path, twisted, command):
    """The output twisted against a locked motor, or the other way round: one torque is measured."""
    channels = {"output_torque": twisted["output_torque"]}
    if command == MOTOR:
        channels["output_angle"] = twisted["output_angle"]
    else:
        channels["motor_angle"] = 100.0 * twisted["output_angle"]
    base = scenario(tmp_path, command)
    found = diagnose([Record("loop", twisted["time"], channels)], base)
    assert found.verdict.effects
    first = found.verdict.effects[0]
    assert {first.name, *first.indistinguishable_from} & HYSTERESIS
    gap = found.verdict.gap["output_torque"]
    assert gap.after < 0.2 * gap.refit
    # What tells two laws apart is proposed; an experiment without a compared channel ends nothing.
    assert next_experiment(found, tmp_path / "base.yaml", tmp_path, title_of) is not None


def test_a_locked_motor_without_the_outputs_torque_says_what_is_missing(tmp_path, twisted):
    record = Record("loop", twisted["time"], {"output_angle": twisted["output_angle"]})
    with pytest.raises(InputError, match="with the motor locked, output_angle and output_torque are needed"):
        diagnose([record], scenario(tmp_path, MOTOR))
