"""The joint in MuJoCo itself: alone, and with the rest of hdsim as its callback."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from hdsim import cli
from hdsim.errors import InputError
from hdsim.export.mujoco import TIMESTEP_S, Rest, fitted_spring, mjcf
from hdsim.scenario import Scenario
from hdsim.simulation.simulate import simulate

#: Friction that the format can say.
STEADY = {"coulomb_nm": 0.03, "viscous_nm_s_per_rad": 3e-4, "load_coefficient": 0.0}


def scenario(effects: dict[str, Any] | None = None, **drive: Any) -> Scenario:
    """An arm that is pulled up by the motor, and more and more by the load torque the other way."""
    return Scenario.model_validate(
        {
            "name": "arm",
            "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}} | drive,
            "effects": effects or {},
            "command": {
                "motor": {
                    "type": "torque",
                    "torque": {"type": "ramp", "rate_nm_per_s": 2.0, "duration_s": 0.15},
                }
            },
            "load": {
                "inertia_kg_m2": 5.0,
                "gravity": {"mass_kg": 4, "centre_of_mass_m": 0.3, "hanging_angle_deg": 60},
                "torque": {"type": "ramp", "rate_nm_per_s": -60, "duration_s": 0.2},
            },
            "run": {"duration_s": 0.3, "sample_rate_hz": 1000},
        }
    )


def deviation(one: Scenario, *, callback: bool) -> float:
    """Deviation (rms) of the drive's torque in MuJoCo from hdsim's, over the rms of that."""
    model = mujoco.MjModel.from_xml_string(mjcf(one)[0])
    data = mujoco.MjData(model)
    rest = Rest(one, model) if callback else None
    times = np.arange(round(one.run.duration_s / TIMESTEP_S) + 1) * TIMESTEP_S
    controls = np.column_stack(
        [
            signal.values(times + TIMESTEP_S / 2)[0]
            for signal in (one.command.motor.torque.data, one.load.torque.data)  # type: ignore[union-attr]
        ]
    )
    found = []
    mujoco.set_mjcb_passive(rest)
    try:
        for k, control in enumerate(controls):
            data.ctrl[:] = control
            if k % 10 == 0:
                mujoco.mj_forward(model, data)
                found.append(data.qfrc_passive[1] if rest is None else rest.output_torque_nm)
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_passive(None)
    ours = simulate(one)["output_torque"]
    return float(np.linalg.norm(np.array(found) - ours) / np.linalg.norm(ours))


def test_what_the_format_can_say_has_the_torque_of_the_run() -> None:
    assert deviation(scenario(friction=STEADY), callback=False) < 0.05


def test_the_callback_brings_the_rest_back() -> None:
    assert deviation(scenario(friction=STEADY), callback=True) < 0.002
    one = scenario({"kinematic_error": {}, "torsional_hysteresis_maxwell": {}})
    assert deviation(one, callback=False) > 0.1
    assert deviation(one, callback=True) < 0.02


@pytest.mark.slow
def test_the_callback_brings_teeth_and_play_back() -> None:
    assert deviation(scenario(mesh={"model": "teeth"}), callback=True) < 0.05
    assert deviation(scenario({"output_backlash": {}}), callback=True) < 0.05


def test_an_arm_hangs_where_it_hangs_in_the_scenario() -> None:
    one = scenario()
    model = mujoco.MjModel.from_xml_string(mjcf(one)[0])
    data = mujoco.MjData(model)
    arm = one.load.gravity
    assert arm is not None
    moment = arm.mass_kg * arm.gravity_m_per_s2 * arm.centre_of_mass_m
    for angle in (-1.0, 0.0, 0.4, 2.0):
        data.qpos[:] = one.drive.ratio * angle, angle
        mujoco.mj_forward(model, data)
        torque = -moment * math.sin(angle - math.radians(60))
        assert -data.qfrc_bias[1] == pytest.approx(torque, abs=1e-9)
    mass = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, mass)
    drive = one.drive.inertia
    assert mass[0, 0] == pytest.approx(drive.motor_kg_m2 + drive.wave_generator_kg_m2)
    assert mass[1, 1] == pytest.approx(5.0 + drive.ring_kg_m2)


def test_play_is_a_dead_band_of_its_own_width() -> None:
    one = scenario({"output_backlash": {}})
    play = one.effects.active()["output_backlash"]
    width = math.radians(play.backlash_arcmin / 60)  # type: ignore[attr-defined]
    spring = fitted_spring(one)
    assert 2 * spring.half_gap_rad == pytest.approx(width, rel=1e-3)
    assert 'springlength="-' in mjcf(one)[0]
    assert fitted_spring(scenario()).half_gap_rad == 0.0


def test_a_rigid_drive_is_an_equality_and_has_no_rest() -> None:
    one = scenario(mesh={"model": "rigid"})
    model = mujoco.MjModel.from_xml_string(mjcf(one)[0])
    assert (model.neq, model.ntendon) == (1, 0)
    with pytest.raises(InputError, match="rigid mesh has no torque of its own"):
        Rest(one, model)


def test_the_command_tells_what_is_lost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = tmp_path / "arm.yaml", tmp_path / "arm.xml"
    source.write_text(scenario({"kinematic_error": {}}).to_yaml(), encoding="utf-8")
    with pytest.raises(SystemExit) as stopped:
        cli.main(["export", str(source), str(out)])
    assert stopped.value.code == 0
    text, printed = out.read_text(encoding="utf-8"), capsys.readouterr().out
    for lost in ("effect kinematic_error", "friction that grows with the load", "load torque over time"):
        assert lost in text
        assert lost in printed
    assert mujoco.MjModel.from_xml_path(str(out)).nu == 2
    with pytest.raises(SystemExit) as stopped:
        cli.main(["export", str(source), str(source / "arm.xml")])
    assert stopped.value.code == 2
    assert "cannot be written" in capsys.readouterr().err
