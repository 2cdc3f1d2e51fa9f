"""A hysteresis that has its name, in the formula of its own loop where the data tell it, and only there."""

from dataclasses import replace
from typing import Any

import pytest
from diagnose_bench import beyond, with_effects
from moves import SWELL, positioned
from noisy import noisy

import hdsim
from hdsim.diagnosis.finer import refined
from hdsim.diagnosis.starts import starts
from hdsim.diagnosis.workflow import diagnose
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

DUHEM, MAXWELL = "torsional_hysteresis_duhem", "torsional_hysteresis_maxwell"
NOISE = {"motor_angle": 1e-5, "output_angle": 1e-6, "output_torque": 0.05}


def scenario(effects: dict[str, Any]) -> Scenario:
    """Loads that swell and ebb twist a drive that turns slowly: loops in loops."""
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects,
        "command": positioned({"type": "sine", "amplitude_deg": 2.0, "frequency_hz": 0.1}),
        "load": {
            "inertia_kg_m2": 0.05,
            "torque": SWELL,
        },
        "run": {"duration_s": 12.0, "sample_rate_hz": 200.0},
    })  # fmt: skip


def logged(effect: str, truth: dict[str, Any]) -> tuple[Bench, Fit]:
    """A log of a drive with an effect, and the base re-fitted to it."""
    base = scenario({})
    record = noisy(hdsim.simulate(scenario({effect: truth})), NOISE, seed=0)
    bench = bench_for([record], [], base, "output_torque")
    return bench, refit(bench, state_of(base)).fit


def plain_of(bench: Bench, base: Fit, effect: str) -> Fit:
    """The base with an effect in its plain formula."""
    added, *_ = starts(effect, catalogue()[effect].fittings[0], (), bench.ranges(base.state))
    return with_effects(bench, base, replace(added, coefficients=(2.0,)))


@pytest.mark.slow
def test_how_suddenly_a_branch_saturates_is_found_again() -> None:
    truth = {"saturation_torque_nm": 3.0, "saturation_twist_mrad": 0.3, "exponent": 2.5}
    bench, base = logged(DUHEM, truth)
    plain = plain_of(bench, base, DUHEM)
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, plain) > 0.1
    assert beyond(bench, found) < 0.02
    own = found.state.added[0].settings()
    for field, value in truth.items():
        assert own[field] == pytest.approx(value, rel=0.1)


@pytest.mark.slow
def test_an_exponential_branch_stays_as_it_is() -> None:
    bench, base = logged(DUHEM, {"saturation_torque_nm": 3.0, "saturation_twist_mrad": 0.3})
    plain = plain_of(bench, base, DUHEM)
    assert beyond(bench, plain) < 0.05
    assert refined(bench, base, plain, lambda _: None) is plain


def growing(torque_nm: float, twist_mrad: float, count: int = 12) -> dict[str, Any]:
    """Ideal sliders whose torques and twists grow linearly: a virgin curve that is a parabola."""
    torques = [torque_nm * 2.0 * k / (count * (count + 1)) for k in range(1, count + 1)]
    twists = [1e-3 * twist_mrad * k / count for k in range(1, count + 1)]
    return {
        "elements": [
            {"stiffness_nm_per_rad": torque / twist, "slip_torque_nm": torque}
            for torque, twist in zip(torques, twists, strict=True)
        ]
    }


@pytest.mark.slow
@pytest.mark.parametrize("named", [MAXWELL, DUHEM])
def test_sliders_that_no_plain_formula_has_are_found_whichever_was_named(named: str) -> None:
    bench, base = logged(MAXWELL, growing(4.0, 0.8))
    plains = {effect: plain_of(bench, base, effect) for effect in (MAXWELL, DUHEM)}
    rivals = [plains[effect] for effect in plains if effect != named]
    found = together(bench, refined(bench, base, plains[named], lambda _: None, rivals))
    assert min(beyond(bench, plain) for plain in plains.values()) > 0.3
    assert beyond(bench, found) < 0.05
    added = found.state.added[0]
    own = added.settings()
    assert added.effect == MAXWELL
    assert own["slip_torque_nm"] == pytest.approx(4.0, rel=0.1)
    # Where twists are a geometric series, shares that grow with the twist are in proportion to its square.
    assert own["share_exponent"] == pytest.approx(2.0, abs=0.3)


@pytest.mark.slow
@pytest.mark.study
def test_a_name_gives_way_to_a_look_alike_that_explains_the_rest() -> None:
    """Of the plain formulas the exponential branch comes nearest."""
    record = noisy(hdsim.simulate(scenario({MAXWELL: growing(4.0, 0.8)})), NOISE, seed=0)
    found = diagnose([record], scenario({}))
    plain = found.evidence.stages[0].candidates
    assert [one.name for one in plain[:2]] == [DUHEM, MAXWELL]
    effect = found.verdict.effects[0]
    assert effect.name == MAXWELL
    assert "many twists" in effect.title
    # The loop explains 98 % of it, and stays in sight.
    assert effect.indistinguishable_from == [DUHEM]
    gap = found.verdict.gap["output_angle"]
    assert gap.after < 4.0 * gap.noise < 0.05 * gap.refit
    # What nine sliders leave of twelve is asked for in vain, and not in turns.
    asked = [stage.candidates[0].name for stage in found.evidence.stages if stage.candidates]
    assert len(asked) == len(set(asked))


@pytest.mark.slow
def test_no_look_alike_takes_the_place_of_what_explains_all() -> None:
    bench, base = logged(DUHEM, {"saturation_torque_nm": 3.0, "saturation_twist_mrad": 0.3, "exponent": 2.5})
    rival = plain_of(bench, base, MAXWELL)
    found = refined(bench, base, plain_of(bench, base, DUHEM), lambda _: None, [rival])
    assert found.state.added[0].effect == DUHEM
