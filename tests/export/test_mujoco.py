"""The joint in MuJoCo itself: alone, and with the rest of hdsim as its callback."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import hdsim
from hdsim import cli
from hdsim.effects import catalogue
from hdsim.errors import InputError
from hdsim.export.mujoco import Rest, mjcf
from hdsim.export.mujoco_spring import straight_spring
from hdsim.scenario import Scenario
from hdsim.simulation.simulate import simulate

from importing import SCENARIOS, SHIPPED, MujocoJoint, deviation, loaded  # isort: skip

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


def torque_deviation(one: Scenario, *, callback: bool) -> float:
    """Deviation (rms) of the drive's torque in MuJoCo from hdsim's, over the rms of that."""
    return deviation(MujocoJoint(one, callback=callback).torque(), simulate(one)["output_torque"])


def test_what_the_format_can_say_has_the_torque_of_the_run() -> None:
    assert torque_deviation(scenario(friction=STEADY), callback=False) < 0.002
    # Friction that grows with the load is that of the mean torque in the file: without it 8 %.
    assert torque_deviation(scenario(), callback=False) < 0.05


def test_a_play_full_of_grease_is_mujocos_tendon_with_a_dead_band() -> None:
    """Another simulator, whose damper bridges the dead band."""

    def worn(share: float) -> Scenario:
        play = {"backlash_arcmin": 20.0, "film_share": share}
        damped = {"damping_nm_s_per_rad": 20.0}
        return scenario({"output_backlash": play}, friction=STEADY, torsion=damped)

    def lost(share: float) -> bool:
        return any("damping" in each.what for each in mjcf(worn(share))[1])

    assert torque_deviation(worn(1.0), callback=False) < 0.005
    assert torque_deviation(worn(0.0), callback=False) > 0.1
    assert lost(0.0)
    assert not lost(1.0)


def test_the_callback_brings_the_rest_back() -> None:
    assert torque_deviation(scenario(friction=STEADY), callback=True) < 0.002
    one = scenario({"kinematic_error": {}, "torsional_hysteresis_maxwell": {}})
    assert torque_deviation(one, callback=False) > 0.05
    assert torque_deviation(one, callback=True) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue())
def test_the_callback_brings_every_effect_back(name: str) -> None:
    toothed = {"mesh": {"model": "teeth"}} if name == "damaged_tooth" else {}
    assert torque_deviation(scenario({name: {}}, **toothed), callback=True) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_scenario_has_its_torque(path: Path) -> None:
    one = loaded(path)
    ours = simulate(one)["output_torque"]
    found = MujocoJoint(one, callback=True).torque()
    assert deviation(found, ours) < 0.05


def test_the_callback_brings_teeth_back() -> None:
    assert torque_deviation(scenario(mesh={"model": "teeth"}), callback=True) < 0.05


def test_straight_segments_are_the_catalogues() -> None:
    one = scenario()
    torsion = one.drive.torsion
    spring = straight_spring(one)
    stiffnesses = np.cumsum([stiffness for _, stiffness in spring.bands])
    printed = [getattr(torsion, f"stiffness_k{k}_nm_per_rad") for k in (1, 2, 3)]
    assert stiffnesses[[0, -1]] == pytest.approx([printed[0], printed[2]], rel=0.01)
    assert spring.error < 2e-3
    twist = torsion.torque_t1_nm / printed[0]
    assert min(abs(band - twist) for band, _ in spring.bands) < 0.03 * twist


def test_a_mass_on_a_lever_without_room_for_its_inertia_keeps_moment_and_inertia() -> None:
    """16 kg at 0.6 m are more than the load's 1.5 kg m^2: a lighter lever has the same torque."""
    one = hdsim.load_scenario(SCENARIOS / "bases" / "lara8_lumped.yaml")
    arm = one.load.gravity
    assert arm is not None
    assert arm.mass_kg * arm.centre_of_mass_m**2 > one.load.inertia_kg_m2
    text, lost = mjcf(one)
    assert any("more inertia than the load" in each.what for each in lost)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mass = np.zeros((2, 2))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    assert mass[1, 1] == pytest.approx(one.load.inertia_kg_m2, rel=1e-9)
    moment = arm.mass_kg * arm.gravity_m_per_s2 * arm.centre_of_mass_m
    wanted = -moment * math.sin(-math.radians(arm.hanging_angle_deg))
    assert -data.qfrc_bias[1] == pytest.approx(wanted, rel=1e-9)


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
    spring = straight_spring(one)
    assert 2 * spring.half_gap_rad == pytest.approx(width, rel=1e-3)
    assert 'springlength="-' in mjcf(one)[0]
    assert straight_spring(scenario()).half_gap_rad == 0.0


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
    for lost in (
        "effect kinematic_error",
        "friction that grows with the load",
        "load torque over time",
    ):
        assert lost in text
        assert lost in printed
    share = re.search(r"effect kinematic_error.*torque differs by (\S+) %", text)
    assert share is not None
    assert 1.0 < float(share[1]) < 50.0
    assert f"{share[1]} %" in printed
    assert mujoco.MjModel.from_xml_path(str(out)).nu == 2
    with pytest.raises(SystemExit) as stopped:
        cli.main(["export", str(source), str(source / "arm.xml")])
    assert stopped.value.code == 2
    assert "cannot be written" in capsys.readouterr().err
