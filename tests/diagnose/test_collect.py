"""What is left counts against an effect only where the effect shows."""

from dataclasses import replace

import pytest
from diagnose_bench import scenario
from test_small_names import hidden

from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.collect import _fell, collect
from hdsim.diagnosis.decide import decide
from hdsim.diagnosis.locate import SHARP, locate
from hdsim.diagnosis.passes import Search, Stage
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.found import Gap
from hdsim.estimate.refit import together


@pytest.mark.slow
def test_an_error_of_the_outputs_encoder_is_nothing_that_a_motors_unbalance_leaves(tmp_path):
    """Both turn with the wave generator; a rotor's weight shows in the motor's torque alone."""
    base = scenario(tmp_path, "lumped")
    effects = {
        "unbalance": {"motor_kg_m": 0.002, "motor_phase_deg": 30.0},
        "sensors": {"output_angle": {"ripple": [{"order": 2, "amplitude_arcsec": 10.0, "phase_deg": 30.0}]}},
    }
    whole = diagnose([hidden(base, effects)], base)
    bench = whole.bench
    (k,) = (k for k, one in enumerate(whole.named) if one.name in ("unbalance", "motor_torque_ripple"))
    # The other one is not found: nearly all that is left is of the wave generator's angle, in the output's.
    fit = together(bench, whole.final, replace(whole.final.state, added=(whole.final.state.added[k],)))
    left = left_of(bench, fit)
    location = locate(bench, left, bench.residuals(fit.predictions, drift=True), {})
    assert location.places[0].coordinate == SHARP
    assert location.places[0].channel == "output_angle"
    found = Search(fit, left, [Stage("with it", location, left.power)], [whole.named[k]])
    before = whole.refit.fit.predictions
    gap, predictions = whole.verdict.gap, {"before": before, "refit": before, "after": fit.predictions}
    evidence = collect(bench, whole.refit, found, gap, predictions)
    (law,) = evidence.laws
    assert law.own_left < 0.01
    assert law.own_first is False or evidence.left_chance > 0.02
    (seen,) = (r.seen for r in decide(evidence).because if r.rule.endswith("own coordinate that it leaves"))
    assert seen == pytest.approx(law.own_left)


@pytest.mark.parametrize(
    ("angle", "fell"),
    [
        (1.21, 0.03),
        # A torque that falls by a hair beside an angle that doubles is no better model.
        (2.55, 0.0),
    ],
)
def test_a_re_fit_closes_a_gap_where_all_channels_together_are_better_for_it(angle, fell):
    same = {"after": 0.0, "variation": 9.0, "unit": "N m"}
    gaps = {
        "motor_torque": Gap(before=1.62, refit=0.97 * 1.62, noise=1.0, **same),
        "output_angle": Gap(before=1.21e-5, refit=angle * 1e-5, noise=1e-5, **same),
    }
    assert _fell(gaps) == pytest.approx(fell)
