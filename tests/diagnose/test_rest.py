"""What holds a shaft at rest is not one more effect; an effect that is there is found beside a rest."""

import pytest
from moves import NOISE, SWINGING
from noisy import noisy

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.scenario import Scenario


def diagnosed(effects):
    plant = SWINGING | {"effects": effects}
    record = noisy(hdsim.simulate(Scenario.model_validate(plant)), NOISE, seed=3)
    return diagnose([record], Scenario.model_validate(SWINGING)).verdict


@pytest.mark.slow
def test_a_drive_that_only_sticks_at_its_reversals_lacks_nothing():
    """Seen without the hypothesis of a rest: "unbalance", 81 % sure."""
    verdict = diagnosed({})
    assert verdict.verdict == "nothing"
    assert all(gap.after < 1.1 * gap.noise for gap in verdict.gap.values())


@pytest.mark.slow
@pytest.mark.study
def test_an_effect_is_named_alone_beside_a_rest():
    """Seen without: an eccentricity and an unbalance as well, and a torque of 1.06 times its noise left.

    Seen without look-alikes from where the best led: Maxwell slip for Duhem's.
    """
    verdict = diagnosed({"torsional_hysteresis_duhem": {"saturation_torque_nm": 1.0}})
    (named,) = verdict.effects
    assert named.name == "torsional_hysteresis_duhem"
    assert not named.indistinguishable_from
    assert all(gap.after < 1.03 * gap.noise for gap in verdict.gap.values())
