import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from engine_cases import SCENARIO

from hdsim.scenario import Scenario
from hdsim.simulation.simulate import simulate
from hdsim.studies.engine.budget import error_budget
from hdsim.studies.engine.budget_plot import plot_budget
from hdsim.studies.engine.causes import causes
from hdsim.studies.engine.definition import Base, Study, ValueList
from hdsim.studies.engine.reading import plan
from hdsim.studies.engine.study import run_study

SCENARIOS = Path(__file__).parents[2] / "scenarios"
ARCSEC = math.degrees(1) * 3600
TORQUE, STIFFNESS, ORDER, AMPLITUDE, DISTANCE = 10.0, 2e4, 1.0, 0.3, math.radians(10)

#: A lumped drive whose spring is one straight line: the causes add up, and each is known.
LINEAR = {
    "name": "linear",
    "drive": {
        "preset": "seed-2021",
        "mesh": {"model": "lumped"},
        "torsion": {
            "stiffness_k1_nm_per_rad": STIFFNESS,
            "stiffness_k2_nm_per_rad": STIFFNESS,
            "stiffness_k3_nm_per_rad": STIFFNESS,
            "damping_nm_s_per_rad": 60.0,
        },
        "friction": {"coulomb_nm": 0, "viscous_nm_s_per_rad": 1e-3, "load_coefficient": 0},
    },
    "effects": {"kinematic_error": {"components": [{"order": ORDER, "amplitude_arcmin": AMPLITUDE}]}},
    "command": {
        "motor": {
            "type": "position",
            "at": "output",
            "trajectory": {
                "type": "trapezoid",
                "distance_deg": 10,
                "maximum_velocity_deg_per_s": 120,
                "maximum_acceleration_deg_per_s2": 900,
            },
            "controller": {"type": "cascade", "position_gain_per_s": 40, "velocity_gain_nm_s_per_rad": 0.025},
        }
    },
    "load": {"inertia_kg_m2": 0.3, "torque": {"type": "hold", "torque_nm": TORQUE}},
    "run": {"duration_s": 1.0, "sample_rate_hz": 1000},
}


def test_parts_of_a_linear_drive_are_the_analytic_ones_and_add_up():
    found = error_budget(Scenario.model_validate(LINEAR))
    parts = {part.cause.name: part for part in found.parts}
    wind_up = ARCSEC * TORQUE / STIFFNESS
    # A controller without integral part gives way to the load's torque on the motor by T / (i^2 k_p k_v).
    sag = ARCSEC * TORQUE / (100**2 * 40 * 0.025)
    # The kinematic error is A sin(n theta_motor) where the motor rests.
    error = 60 * AMPLITUDE * math.sin(ORDER * -100 * DISTANCE)
    assert found.whole == pytest.approx(wind_up + sag + error, rel=0.01)
    assert parts["wind_up"].alone == pytest.approx(wind_up, rel=0.005)
    assert parts["kinematic_error"].alone == pytest.approx(error, rel=0.005)
    assert parts["friction_and_control"].alone == pytest.approx(0, abs=0.5)
    # The sag needs both the load and the controller: each takes it away, and the interaction counts it once.
    assert parts["wind_up"].removed == pytest.approx(wind_up + sag, rel=0.01)
    assert parts["friction_and_control"].removed == pytest.approx(sag, rel=0.02)
    assert found.interaction == pytest.approx(-sag, rel=0.02)
    assert found.interaction_alone == pytest.approx(sag, rel=0.02)
    total = sum(part.removed for part in found.parts)
    assert found.whole == pytest.approx(found.rest + total + found.interaction, abs=1e-9)
    assert abs(found.rest) < 0.01
    assert found.swing_arcsec == 0.0
    # The sag needs both: Shapley gives each half of it, and nothing is left over.
    assert parts["wind_up"].share.value == pytest.approx(wind_up + sag / 2, rel=0.01)
    assert parts["friction_and_control"].share.value == pytest.approx(sag / 2, rel=0.05)
    assert found.rest + sum(part.share.value for part in found.parts) == pytest.approx(found.whole, abs=1e-9)


def test_a_budget_on_an_executor_is_the_budget_in_this_process():
    scenario, told = Scenario.model_validate(LINEAR), []
    alone = error_budget(scenario, shares=False)
    with ThreadPoolExecutor(2) as pool:
        there = error_budget(
            scenario, shares=False, pool=pool, width=2, on_progress=lambda *done: told.append(done)
        )
    numbers = [[(p.cause.name, p.removed, p.alone) for p in found.parts] for found in (alone, there)]
    assert numbers[0] == numbers[1]
    assert (there.whole, there.rest) == (alone.whole, alone.rest)
    assert told == [(k, alone.runs) for k in range(2, alone.runs + 1)]


def test_backlash_is_the_gap_when_a_load_closes_it():
    scenario = Scenario.from_yaml(SCENARIOS / "seed_move.yaml")
    data = scenario.model_dump(mode="json")
    half_gap = 2e-6
    data["drive"]["mesh"]["half_gap_m"] = half_gap
    for name in ("kinematic_error", "torsional_hysteresis_maxwell"):
        data["effects"][name] = None
    found = error_budget(Scenario.model_validate(data), shares=False)
    backlash = next(part for part in found.parts if part.cause.name == "backlash")
    mesh, geometry = scenario.drive.mesh, scenario.drive.geometry
    assert mesh.model == "teeth"
    lever = geometry.pitch_radius_m * math.cos(math.radians(geometry.pressure_angle_deg))
    # The load of -20 N m pushes the output back by the half-gap over the lever.
    assert backlash.removed == pytest.approx(-ARCSEC * half_gap / lever, rel=0.02)


def test_run_budget_and_study_have_one_error_to_the_last_bit(tmp_path):
    data = LINEAR | {"run": {"duration_s": 0.6, "seed": 11}}
    scenario = Scenario.model_validate(data)
    own = simulate(scenario).metrics()["positioning_error"].value
    assert abs(error_budget(scenario, shares=False).whole) == own
    given = Study(
        base=Base(scenario=data),
        parameters={"load.inertia_kg_m2": ValueList(type="list", values=[0.3, 0.4])},
        metrics=["positioning_error"],
    )
    table = run_study(plan(given), tmp_path).table
    assert table.values("positioning_error")[0] == own
    assert table.columns["seed"].values == [11, 11]


def test_scenario_without_dwells_splits_its_transmission_error():
    found = error_budget(Scenario.model_validate(SCENARIO))
    (part,) = found.parts
    assert found.error == "transmission_error_peak_to_peak"
    assert part.removed == part.alone == part.share.value == pytest.approx(60, rel=1e-3)
    assert (found.rest, found.interaction) == pytest.approx((0, 0), abs=1e-6)


def test_causes_of_the_example_are_named_and_the_picture_is_drawn(tmp_path):
    scenario = Scenario.from_yaml(SCENARIOS / "move_and_settle.yaml")
    assert {cause.name for cause in causes(scenario)} == {
        "backlash", "kinematic_error", "hysteresis", "friction_and_control", "encoder",
    }  # fmt: skip
    found = error_budget(Scenario.model_validate(LINEAR))
    plot_budget(found).savefig(tmp_path / "budget.png")
    text = found.write_csv(tmp_path / "budget.csv").read_text()
    assert "interaction" in text
    assert "removed [arcsec]" in text
