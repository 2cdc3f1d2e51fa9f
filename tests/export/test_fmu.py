"""The joint as an FMU: accepted by FMPy without complaint, and on the same way as in hdsim."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from hdsim import cli
from hdsim.actuation.command import PositionCommand
from hdsim.errors import InputError
from hdsim.export.fmu import export_fmu
from hdsim.recording import Recording
from hdsim.scenario import Scenario
from hdsim.simulation.simulate import simulate

from importing import SHIPPED, deviation, loaded  # isort: skip

STEP = 1e-3
#: Scenarios that take longest.
LONG = ("sine_tracking", "move_and_settle")
#: 20 rad/s^2 at the output until 2 rad/s: corners at 0.1 s and 0.2 s, on the grid of the communication.
MOVE = {
    "type": "trapezoid",
    "distance_deg": math.degrees(0.4),
    "maximum_velocity_deg_per_s": math.degrees(2.0),
    "maximum_acceleration_deg_per_s2": math.degrees(20.0),
}
GAINS = {
    "position_gain_per_s": 40,
    "velocity_gain_nm_s_per_rad": 0.025,
    "velocity_integral_gain_nm_per_rad": 0.5,
}
SERVO = {"type": "position", "at": "output", "trajectory": MOVE, "controller": {"type": "cascade", **GAINS}}
SCENARIO = {
    "name": "a joint",
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "effects": {"kinematic_error": {}, "torsional_hysteresis_maxwell": {}},
    "command": {"motor": SERVO},
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 0.2, "sample_rate_hz": 1000},
}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return Scenario.model_validate(SCENARIO)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_importer_finds_the_trajectory_of_the_run(fmi: int, scenario: Scenario, tmp_path: Path) -> None:
    out = export_fmu(scenario, tmp_path / f"joint {fmi}.fmu", fmi=fmi)
    assert [path.name for path in tmp_path.iterdir()] == [out.name]
    assert validate_fmu(str(out)) == []
    whole = simulate(scenario)
    times = whole.time
    wanted = scenario.command.motor.signal.data.values(times, times + 1e-9)  # type: ignore[union-attr]
    names = ["time", "commanded_angle", "commanded_velocity", "commanded_acceleration"]
    signals = np.rec.fromarrays([times, *wanted[:3]], names=names)
    # FMPy draws straight lines between values, and looks a little ahead of them: no corner may be crossed.
    options = {"stop_time": 0.2, "step_size": STEP, "output_interval": STEP, "input": signals}
    found, again = (fmpy.simulate_fmu(str(out), **options) for _ in range(2))
    assert np.array_equal(found, again)
    assert len(found) == len(times)
    for name in ("motor_angle", "motor_velocity", "output_angle", "output_torque"):
        largest = np.abs(whole[name]).max()
        assert np.abs(found[name] - whole[name]).max() < 1e-5 * largest, name
    description = fmpy.read_model_description(str(out))
    about = {variable.name: variable for variable in description.modelVariables}
    assert about["output_torque"].unit == "N m"
    assert about["commanded_angle"].description == "commanded angle, at the output"


def inputs(one: Scenario, whole: Recording) -> tuple[dict[str, Any], np.recarray]:
    """What an importer hands to a scenario's joint: its choice of inputs, and their values over time.

    A sampled controller is the importer's: its torque is the run's.
    """
    times, command, ratio = whole.time, one.command.motor, one.drive.ratio
    values: dict[str, Any] = {"time": times}
    choice: dict[str, Any] = {}
    if isinstance(command, PositionCommand) and command.sample_period_s is None:
        names = ("commanded_angle", "commanded_velocity", "commanded_acceleration")
        values |= dict(zip(names, command.signal.data.values(times, times + 1e-9), strict=False))
    elif isinstance(command, PositionCommand):
        choice["motor"] = "torque"
        # A sample at which it jumps has the torque that was held until then.
        values["motor_torque"] = np.append(whole["motor_torque"][1:], 0.0)
    for motion in one.command.motions(ratio):
        names = tuple(f"prescribed_{motion.axis}_{what}" for what in ("angle", "velocity", "acceleration"))
        values |= dict(zip(names, motion.signal.values(times, times + 1e-9), strict=False))
    if one.load.torque is not None:
        # Held over a step: that of its middle.
        values["load_torque"] = one.load.torque.data.values(times + STEP / 2)[0]
    return choice, np.rec.fromarrays(list(values.values()), names=list(values))


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(p, marks=pytest.mark.study, id=p.stem) if p.stem in LONG else pytest.param(p, id=p.stem)
        for p in SHIPPED
    ],
)
def test_every_shipped_scenario_has_its_torque(path: Path, tmp_path: Path) -> None:
    one = loaded(path)
    if (sampled := getattr(one.command.motor, "sample_period_s", None)) is not None:
        one = one.with_({"run.sample_rate_hz": 1 / sampled})
    whole = simulate(one)
    choice, signals = inputs(one, whole)
    out = export_fmu(one, tmp_path / "joint.fmu", **choice)
    step = float(whole.time[1])
    options = {"stop_time": whole.time[-1], "step_size": step, "output_interval": step, "input": signals}
    found = fmpy.simulate_fmu(str(out), **options)
    assert deviation(found["output_torque"], whole["output_torque"]) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("fmi", "kind"), [(2, FMU2Slave), (3, FMU3Slave)])
def test_a_state_that_is_set_again_goes_on_bit_for_bit(
    fmi: int, kind: Any, scenario: Scenario, tmp_path: Path
) -> None:
    out = export_fmu(scenario, tmp_path / f"again{fmi}.fmu", fmi=fmi, motor="torque")
    description = fmpy.read_model_description(str(out))
    at = {variable.name: variable.valueReference for variable in description.modelVariables}
    unzipped = fmpy.extract(str(out), str(tmp_path / "unzipped"))
    name = description.coSimulation.modelIdentifier
    slave = kind(guid=description.guid, unzipDirectory=unzipped, modelIdentifier=name, instanceName="one")
    put, get = (slave.setReal, slave.getReal) if fmi == 2 else (slave.setFloat64, slave.getFloat64)
    save, back = (
        (slave.getFMUstate, slave.setFMUstate) if fmi == 2 else (slave.getFMUState, slave.setFMUState)
    )
    slave.instantiate()
    if fmi == 2:
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    put([at["motor_torque"]], [0.2])
    slave.exitInitializationMode()
    slave.doStep(0.0, STEP)
    state = save()
    ways = []
    for _ in range(2):
        for k in range(1, 4):
            slave.doStep(k * STEP, STEP)
        ways.append(get([at["motor_angle"], at["output_torque"]]))
        back(state)
    (slave.freeFMUstate if fmi == 2 else slave.freeFMUState)(state)
    assert ways[0] == ways[1]
    assert ways[0][0] > 0
    slave.terminate()
    slave.freeInstance()


def test_mistakes_are_said(
    scenario: Scenario, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(scenario.to_yaml(), encoding="utf-8")
    for arguments, said in [
        ([path, tmp_path / "a.fmu", "--motor", "velocity"], "found the motor command 'position'"),
        ([path, tmp_path / "a.csv", "--fmi", "3"], "--fmi belongs to .fmu"),
        ([path, tmp_path / "a.txt"], "allowed: .csv, .parquet, .mcap, .fmu, .xml"),
        ([path, path / "a.fmu"], "cannot be written"),
    ]:
        with pytest.raises(SystemExit) as stopped:
            cli.main(["export", *map(str, arguments)])
        err = capsys.readouterr().err
        assert (stopped.value.code, err.count("\n")) == (2, 1)
        assert said in err
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs pythonfmu: pip install 'hdsim\[fmi\]'"):
        export_fmu(scenario, tmp_path / "a.fmu")
    assert [one.name for one in tmp_path.iterdir()] == ["a.yaml"]
