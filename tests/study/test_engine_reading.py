from pathlib import Path

import pytest
from engine_cases import AMPLITUDE, METRIC, study

from hdsim.scenario import Scenario, ScenarioError
from hdsim.studies.engine.names import check, known_names, parse, set_value, unit
from hdsim.studies.engine.reading import load_study, plan

SCENARIOS = Path(__file__).parents[2] / "scenarios"

HEAD = f"""\
base:
  scenario: {SCENARIOS / "seed_move.yaml"}
metrics: [{METRIC}]
parameters:
"""


def problems(tmp_path, text):
    path = tmp_path / "study.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_study(path)
    return str(caught.value).replace(str(path), "study.yaml").split("\n")


@pytest.mark.parametrize("path", sorted((SCENARIOS / "studies").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_example_is_a_valid_study(path):
    assert load_study(path).runs


def test_unknown_parameter_is_refused_at_its_line_with_the_nearest_name(tmp_path):
    (line,) = problems(
        tmp_path, HEAD + "  drive.mesh.flanks.flexspline.fractal_dimensions: {type: list, values: [2.5]}\n"
    )
    assert line.startswith("study.yaml:5: parameters: drive.mesh.flanks.flexspline.fractal_dimensions: ")
    assert "'drive.mesh.flanks.flexspline.fractal_dimension'" in line


def test_name_without_its_path_suggests_the_whole_name(tmp_path):
    (line,) = problems(tmp_path, HEAD + "  inertia_kg_m2: {type: list, values: [0.5]}\n")
    assert "expected 'load.inertia_kg_m2'" in line


def test_bounds_are_checked_before_the_first_run(tmp_path):
    lines = problems(
        tmp_path,
        HEAD
        + "  load.inertia_kg_m2: {type: list, values: [0.5, -0.1]}\n"
        + "  drive.mesh.flanks.flexspline.fractal_dimension: {type: uniform, low: 2.5, high: 3.5}\n"
        + "sampling: {type: random, samples: 50}\n",
    )
    assert len(lines) == 2
    assert lines[0].startswith("study.yaml:5: parameters: load.inertia_kg_m2: found -0.1 (number), expected")
    assert lines[1].startswith("study.yaml:6: ")
    assert "less than 3" in lines[1]


def test_types_are_checked_before_the_first_run(tmp_path):
    (line,) = problems(tmp_path, HEAD + "  run.method: {type: list, values: [rodas4, rodas]}\n")
    assert "study.yaml:5" in line
    assert "did you mean 'rodas4'" in line
    (line,) = problems(tmp_path, HEAD + '  load.inertia_kg_m2: {type: list, values: ["0.5"]}\n')
    assert "found '0.5' (text), expected a number" in line


def test_effect_that_is_off_is_named(tmp_path):
    (line,) = problems(
        tmp_path, HEAD + "  effects.stribeck_friction.extra_static_nm: {type: list, values: [0.1]}\n"
    )
    assert "effects.stribeck_friction is off in the base" in line


def test_unknown_metric_and_procedure_are_refused(tmp_path):
    (line,) = problems(tmp_path, HEAD.replace(METRIC, "hysteresis_los") + "  {}\n")
    assert line.startswith("study.yaml:3: metrics[0]: ")
    assert "'hysteresis_loss'" in line
    (line,) = problems(
        tmp_path, f"base: {{procedure: torsion_cycles, drive: {{preset: seed-2021}}}}\nmetrics: [{METRIC}]\n"
    )
    assert line.startswith("study.yaml:1: base.procedure: unknown procedure")


def test_mistake_inside_the_base_has_its_own_file_and_line(tmp_path):
    lines = problems(
        tmp_path,
        f"base:\n  scenario:\n    extends: {SCENARIOS / 'seed_move.yaml'}\n    run: {{duration_s: -1}}\n"
        f"metrics: [{METRIC}]\n",
    )
    assert lines[0].startswith("study.yaml:4: run.duration_s: found -1")
    lines = problems(
        tmp_path,
        f"base:\n  procedure: transmission_error\n  drive: {{preset: seed-2012}}\nmetrics: [{METRIC}]\n",
    )
    assert "study.yaml:3" in lines[0]


def test_base_may_extend_a_scenario(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(
        f"base:\n  scenario:\n    extends: {SCENARIOS / 'seed_move.yaml'}\n    run: {{duration_s: 0.1}}\n"
        f"metrics: {METRIC}\nreplicates: 2\n"
    )
    found = load_study(path)
    assert found.scenario.run.duration_s == 0.1
    assert found.scenario.load.inertia_kg_m2 == 0.5
    assert found.study.name == "study"


def test_an_effect_can_be_switched_and_a_preset_exchanged():
    found = plan(
        study(
            parameters={
                "effects.kinematic_error": {"type": "list", "values": [None, {}]},
                "drive.preset": {"type": "list", "values": ["seed-2021", "csg-20-50"]},
            }
        )
    )
    made = [found.recipe.scenario(run.values, run.seed) for run in found.runs]
    assert [scenario.effects.kinematic_error is None for scenario in made] == [True, True, False, False]
    one, other = Scenario.model_validate(made[0].model_dump()), made[1]
    assert one.drive.preset == "seed-2021"
    assert (one.drive.ratio, other.drive.ratio) == (-100, -50)
    assert other.drive.mesh.model == "rigid"  # what the base says over its preset is kept
    assert [scenario.run.seed for scenario in made] == [run.seed for run in found.runs]


def test_options_of_a_procedure_are_parameters():
    found = plan(
        study(
            base={"procedure": "transmission_error", "drive": {"preset": "seed-2021"}},
            parameters={"options.motor_rpm": {"type": "list", "values": [300.0, 600.0]}},
        )
    )
    slow, fast = (found.recipe.scenario(run.values, run.seed) for run in found.runs)
    assert slow.run.duration_s > 1.8 * fast.run.duration_s
    with pytest.raises(ScenarioError, match="motor_rpms"):
        plan(
            study(
                base={"procedure": "transmission_error", "drive": {"preset": "seed-2021"}},
                parameters={"options.motor_rpms": {"type": "list", "values": [300.0]}},
            )
        )


def test_every_known_name_can_be_checked_set_and_has_a_unit():
    scenario = Scenario.from_yaml(SCENARIOS / "move_and_settle.yaml")
    data = scenario.model_dump(mode="json")
    names = known_names(data, Scenario)
    assert AMPLITUDE in names
    for name in names:
        check(name, data, Scenario)
        value = data
        for item in parse(name):
            value = value[item]
        set_value(data, name, value)
    assert Scenario.model_validate(data) == scenario
    assert unit("drive.inertia.motor_kg_m2") == "kg m^2"
    assert unit("load.torque.torque_nm") == "N m"
    assert unit("drive.mesh.flanks.flexspline.fractal_dimension") == "1"
