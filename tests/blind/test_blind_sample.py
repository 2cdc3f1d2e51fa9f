"""A sample of the blind matrix; ``python tests/blind SEEDS`` runs the whole and prints it."""

import numpy as np
import plants
import pytest
from cases import Trial, accepted, sized, trials
from judging import judge, outcome, run
from plants import Case


def trial(group: str, name: str, strength: float) -> Trial:
    return Trial(group, Case(name, sized(name, strength), seconds=8.0, seed=5), (accepted(name),))


def test_the_plant_conserves_what_it_must():
    """At the turning points of a swing the output's torque is that of its weight and its acceleration."""
    log = plants.truth(Case("nothing", {"damping": 8.0}))
    motor, _, output, torque = log.T
    acceleration = np.gradient(np.gradient(output, 1e-3), 1e-3)
    wanted = 0.5 * acceleration + 12.0 * np.sin(output)
    assert np.std((torque - wanted)[500:-5]) < 0.02 * np.std(torque)
    assert np.max(np.abs(output - motor / plants.RATIO)) < 2e-3


def test_a_wrong_inertia_is_not_sold_as_an_effect():
    case = Trial("parameter", Case("load inertia", {"load_inertia": 0.6}, seconds=8.0, seed=5))
    found = run(case).verdict
    assert found.verdict == "parameter"
    number = found.parameters["load.inertia_kg_m2"]
    assert number.interval[0] <= 0.6 <= number.interval[1]
    assert number.interval[1] - number.interval[0] < 0.03


def test_a_hidden_stribeck_bump_is_named():
    case = trial("clear", "stribeck_friction", 5.0)
    assert judge(case, outcome(case))


@pytest.mark.slow
@pytest.mark.parametrize("case", list(trials(1)), ids=lambda t: f"{t.group}-{t.case.truth}")
def test_blind(case):
    if case.group in ("fair", "faint"):
        pytest.skip("rates, not single cases, are the measure there")
    assert judge(case, outcome(case))
