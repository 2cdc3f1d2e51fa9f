"""``Scenario.with_``: checked copies with other values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim.scenario import Scenario, ScenarioError

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def base() -> Scenario:
    return hdsim.load_scenario(ROOT / "scenarios" / "seed_move.yaml")


def test_values_are_set_by_dotted_names_and_the_rest_stays(base: Scenario) -> None:
    found = base.with_({"load.inertia_kg_m2": np.float64(0.3), "run.seed": np.int64(7)}, name="other")
    assert (found.load.inertia_kg_m2, found.run.seed, found.name) == (0.3, 7, "other")
    again = found.with_({"load.inertia_kg_m2": base.load.inertia_kg_m2, "run.seed": 0}, name=base.name)
    assert again == base


def test_nothing_to_change_gives_an_equal_scenario(base: Scenario) -> None:
    assert base.with_() == base


def test_effects_go_on_and_off(base: Scenario) -> None:
    found = base.with_({"effects.output_backlash": {}, "effects.kinematic_error": None})
    assert found.effects.active().keys() == {"output_backlash", "torsional_hysteresis_maxwell"}
    part = base.effects.active()["kinematic_error"]
    assert found.with_({"effects.kinematic_error": part}).effects.active()["kinematic_error"] == part


def test_a_choice_drops_the_other_choices_numbers_in_whatever_order_they_come(base: Scenario) -> None:
    changes = {"drive.mesh.twist_nodes": 100, "drive.mesh.model": "tabulated"}
    for one in (changes, dict(reversed(changes.items()))):
        mesh = base.with_(one).drive.mesh
        assert (mesh.model, mesh.twist_nodes) == ("tabulated", 100)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("load.inertia", 1.0, "load.inertia: found an unknown parameter, expected 'load.inertia_kg_m2'"),
        ("laod.inertia_kg_m2", 1.0, "expected 'load.inertia_kg_m2'"),
        ("effects.backlash", {}, "expected 'effects.output_backlash'"),
        ("effects.lugre_friction.bristle", 1.0, "effects.lugre_friction is off; turn it on first"),
        ("load.inertia_kg_m2", -1.0, "found -1.0 (number), expected a number at least 0"),
        ("load.inertia_kg_m2", "1", "load.inertia_kg_m2: found '1' (text), expected a number"),
        ("drive.preset", "csg-20-50", "'drive': {'preset': 'csg-20-50'}"),
        ("drive", {"preset": "csg-20-51"}, "unknown preset 'csg-20-51'"),
        ("a b", 1.0, "'a b' is no name of a parameter"),
    ],
)
def test_what_is_wrong_is_named_with_the_nearest_that_there_is(
    base: Scenario, name: str, value: object, said: str
) -> None:
    with pytest.raises(hdsim.InputError) as caught:
        base.with_({name: value})
    assert said in str(caught.value)


def test_a_section_is_replaced_before_its_fields_are_set(base: Scenario) -> None:
    found = base.with_({"drive.friction.coulomb_nm": 0.1, "drive": {"preset": "csg-20-50"}})
    assert (found.drive.ratio, found.drive.friction.coulomb_nm) == (-50.0, 0.1)
    assert found.drive.friction.viscous_nm_s_per_rad > 0.0  # the preset's


def test_every_mistake_is_told(base: Scenario) -> None:
    with pytest.raises(ScenarioError) as caught:
        base.with_({"load.inertia": 1.0, "run.duration": 1.0})
    assert [problem.field for problem in caught.value.problems] == ["load.inertia", "run.duration"]
