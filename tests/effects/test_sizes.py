"""Defaults of effects fit the drive: size 20 has the effects' own numbers, another preset its catalogue's."""

from typing import Any

import pytest

from hdsim.drive.presets import catalogue_figures, preset_names
from hdsim.effects import catalogue
from hdsim.errors import HdsimError
from hdsim.scenario import Scenario

ALL: dict[str, Any] = {name: {} for name in catalogue() if name != "table"}
ARCSEC = 206264.806


def scenario(drive: dict[str, Any], effects: dict[str, Any]) -> Scenario:
    rest = {"command": {"motor": {"type": "free"}}, "load": {"inertia_kg_m2": 0.1}, "run": {"duration_s": 1}}
    return Scenario.model_validate({"drive": drive, "effects": effects} | rest)


@pytest.mark.parametrize("preset", ["seed-2021", "csg-20-100"])
def test_at_size_20_they_are_the_fields_own(preset: str) -> None:
    for name, effect in scenario({"preset": preset}, ALL).effects.active().items():
        assert effect == catalogue()[name](), name


def test_elsewhere_they_grow_with_what_they_are_multiples_of() -> None:
    found = scenario({"preset": "csg-14-50"}, ALL).effects
    # T_N/i is 7/50 N m instead of 52/100, K1 3400 N m/rad instead of 16,000, accuracy 1.2 arcmin for 0.8.
    assert found.stribeck_friction.extra_static_nm == pytest.approx(0.008 * (7 / 50) / (52 / 100))
    assert found.position_dependent_friction.components[0].amplitude_nm == pytest.approx(
        0.004 * (7 / 50) / (52 / 100)
    )
    assert found.base_flexibility.stiffness_nm_per_rad == pytest.approx(5e5 * 3400 / 16000)
    assert found.torsional_hysteresis_maxwell.slip_torque_nm == pytest.approx(2 * 3400 / 16000)
    assert found.torsional_hysteresis_duhem.saturation_torque_nm == pytest.approx(2 * 3400 / 16000)
    assert found.kinematic_error.components[0].amplitude_arcmin == pytest.approx(0.2 * 1.2 / 0.8)


def test_what_a_scenario_states_stays() -> None:
    given = {"torsional_hysteresis_maxwell": {"slip_torque_nm": 1.25}, "kinematic_error": {"components": [
        {"order": 2, "amplitude_arcmin": 0.5}]}}  # fmt: skip
    found = scenario({"preset": "csg-14-50"}, given).effects
    assert found.torsional_hysteresis_maxwell.slip_torque_nm == 1.25
    assert [c.amplitude_arcmin for c in found.kinematic_error.components] == [0.5]


@pytest.mark.parametrize("preset", preset_names())
def test_the_catalogue_set_is_as_wide_as_the_catalogue_says(preset: str) -> None:
    found = scenario({"preset": preset}, {"set": "catalogue"})
    printed = catalogue_figures(preset)
    maxwell = found.effects.torsional_hysteresis_maxwell
    # Fully slipped, the elements hold the output by W/K1 on either side of the elastic line.
    width = 2 * maxwell.slip_torque_nm / printed.stiffness_k1.value
    assert 0.8 * printed.hysteresis_loss.value < width < printed.hysteresis_loss.value
    worst = 2 * sum(c.amplitude for c in found.effects.kinematic_error.components)
    assert 0.9 * printed.accuracy.value < worst < 1.4 * printed.accuracy.value
    assert Scenario.from_text(found.to_yaml()) == found


def test_beside_the_set_effects_have_their_own_say() -> None:
    given = {"set": "catalogue", "kinematic_error": None, "output_backlash": {}}
    found = scenario({"preset": "csg-17-80"}, given).effects
    assert list(found.active()) == ["output_backlash", "torsional_hysteresis_maxwell"]
    assert "slip_torque_nm 1.25" in scenario({"preset": "csg-17-80"}, given).summary()


def test_a_drive_without_a_catalogue_has_no_set() -> None:
    drive = scenario({"preset": "csg-17-80"}, {}).drive.model_dump() | {"preset": None}
    with pytest.raises((HdsimError, ValueError), match="set: catalogue needs a drive with a preset"):
        scenario(drive, {"set": "catalogue"})
