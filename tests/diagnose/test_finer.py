"""A play that has its name, in the formula of many teeth where the data tell it, and only there."""

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnose_bench import beyond, servo_with_arm, with_effects
from noisy import noisy

import hdsim
from hdsim.diagnosis import finer
from hdsim.diagnosis.finer import each_refined, refined
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import Added, state_of
from hdsim.scenario import Scenario

PLAY = "output_backlash"
NOISE = {"motor_angle": 2e-5, "output_angle": 2e-6, "motor_torque": 6e-3}
MANY = {
    "backlash_arcmin": 1.0, "gap_spread": 0.5, "uptake_torque_nm": 4.0,
    "components": [{"order": 2, "amplitude_arcmin": 0.08, "phase_deg": 40.0}],
}  # fmt: skip
LUMPED = {"model": "lumped"}
#: Every tooth a contact of its own, with the gap of its own flanks.
TOOTHED = {"model": "teeth", "ring": "static", "gap_factor": 3.0}


def scenario(mesh: dict[str, Any], effects: dict[str, Any]) -> Scenario:
    return servo_with_arm(mesh, effects, frequency_hz=0.5, teeth_rate_hz=0.0)


def with_play(
    mesh: dict[str, Any], effects: dict[str, Any], label: str = "", beside: tuple[str, ...] = ()
) -> tuple[Bench, Fit, Fit]:
    """A log of a drive, the lumped base re-fitted to it, and that with a plain play and others beside it."""
    run = hdsim.simulate(scenario(mesh, effects))
    base = scenario(LUMPED, {})
    # How the load swings in before it is driven, nobody could know from the log.
    bench = bench_for([noisy(run, NOISE, seed=0, begins_s=2.0)], [], base, None)
    found = refit(bench, state_of(base)).fit
    plain = next(f for f in catalogue()[PLAY].fittings if f.play and f.label == label)
    added, *_ = starts(PLAY, plain, (), bench.ranges(found.state))
    added = replace(added, coefficients=(0.5 / added.settings()["backlash_arcmin"],))
    others = [starts(one, catalogue()[one].fittings[0], (), {})[0] for one in beside]
    return bench, found, with_effects(bench, found, added, *others)


@pytest.mark.slow
def test_the_play_of_many_teeth_is_found_again() -> None:
    bench, base, plain = with_play(LUMPED, {PLAY: MANY})
    found = together(bench, refined(bench, base, plain, lambda _: None))
    own = found.state.added[0].settings()
    assert beyond(bench, found) < 0.1
    # The first tooth's gap is told, and how the twist rises beyond it, with the root of the torque. When the
    # last tooth bears is hardly told from the stiffness beyond; with it goes the mean of the gaps.
    mean, spread, uptake = (own[k] for k in ("backlash_arcmin", "gap_spread", "uptake_torque_nm"))
    assert mean * (1.0 - spread) == pytest.approx(0.5, rel=0.1)
    assert mean * spread / math.sqrt(uptake) == pytest.approx(0.25, rel=0.2)
    assert 2.0 < uptake < 20.0
    assert 0.6 < mean < 1.8
    second, fourth = own["components"]
    assert second["amplitude_arcmin"] == pytest.approx(0.08, rel=0.15)
    assert second["phase_deg"] == pytest.approx(40.0, abs=8.0)
    assert fourth["amplitude_arcmin"] < 0.02


@pytest.mark.slow
def test_of_a_drive_with_every_tooth_it_leaves_less_than_half_of_what_a_plain_play_does() -> None:
    bench, base, plain = with_play(TOOTHED, {})
    found = refined(bench, base, plain, lambda _: None)
    assert beyond(bench, plain) < 0.5 * beyond(bench, base)
    assert beyond(bench, found) < 0.5 * beyond(bench, plain)
    assert found.state.added[0].fitting.label == "of many teeth"


@pytest.mark.slow
def test_a_sharp_play_stays_as_it_is() -> None:
    bench, base, plain = with_play(LUMPED, {PLAY: {"backlash_arcmin": 1.0}})
    assert beyond(bench, plain) < 0.2
    assert refined(bench, base, plain, lambda _: None) is plain


@pytest.mark.slow
def test_of_a_play_full_of_grease_the_damper_acts_in_the_gap() -> None:
    bench, base, plain = with_play(LUMPED, {PLAY: {"backlash_arcmin": 1.0, "film_share": 1.0}})
    found = refined(bench, base, plain, lambda _: None)
    assert beyond(bench, plain) > 1.0
    assert beyond(bench, found) < 0.1
    own = found.state.added[0].settings()
    assert own["film_share"] == pytest.approx(1.0, abs=0.1)
    assert own["backlash_arcmin"] == pytest.approx(1.0, rel=0.02)


@pytest.mark.slow
def test_gaps_that_differ_are_told_where_their_waves_are_none() -> None:
    gaps = {"backlash_arcmin": 1.2, "gap_spread": 0.9, "uptake_torque_nm": 8.0}
    bench, base, plain = with_play(LUMPED, {PLAY: gaps}, label="taken up gradually")
    found = refined(bench, base, plain, lambda _: None)
    assert beyond(bench, plain) > 2.0
    assert beyond(bench, found) < 0.1
    assert found.state.added[0].fitting.label == "of gaps that differ"
    assert found.state.added[0].settings()["gap_spread"] == pytest.approx(0.9, abs=0.05)


@pytest.mark.slow
def test_gaps_that_differ_are_asked_from_where_many_teeth_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def stuck(bench: Bench, ways: Sequence[tuple[Fit, list[Added]]]) -> list[Fit]:
        """Where one with waves begins, too, the formulas with fewer numbers come to nothing."""
        ends, waves = to_their_ends(bench, ways), any(added[-1].fitting.turns for _, added in ways)
        return [end for end in ends if not waves or end.state.added[-1].fitting.turns]

    to_their_ends = finer._at_their_ends
    monkeypatch.setattr(finer, "_at_their_ends", stuck)
    gaps = {"backlash_arcmin": 1.2, "gap_spread": 0.9, "uptake_torque_nm": 8.0}
    found = refined(*with_play(LUMPED, {PLAY: gaps}, label="taken up gradually"), lambda _: None)
    assert found.state.added[0].fitting.label == "of gaps that differ"


@pytest.mark.slow
def test_a_play_beside_another_effect_is_refined_though_it_is_not_the_newest() -> None:
    other = "load_side_friction"
    bench, base, plain = with_play(LUMPED, {PLAY: MANY, other: {"coulomb_nm": 3.0}}, beside=(other,))
    found = each_refined(bench, base, plain, lambda _: None, [True, True])
    assert [one.effect for one in plain.state.added] == [PLAY, other]
    assert [one.effect for one in found.state.added] == [PLAY, other]
    assert [one.fitting.label for one in found.state.added] == ["of many teeth", ""]
    assert beyond(bench, found) < 0.1 < 1.0 < beyond(bench, plain)


@pytest.mark.parametrize(("falls", "fits"), [((5.0, 5.0), 3), ((0.5, 5.0), 2)])
def test_a_fit_that_has_come_to_its_end_is_not_carried_on_again(falls, fits, monkeypatch):
    """An independent sample of what is left is worth 1 here."""
    powers = iter(100.0 - np.cumsum([0.0, *falls]))
    made = []

    def fitted(*args, **options):
        made.append(SimpleNamespace(predictions=next(powers), state=SimpleNamespace(added=())))
        return made[-1]

    monkeypatch.setattr(finer, "_fitted", fitted)
    bench = SimpleNamespace(
        power=lambda left: left, residuals=lambda _: [], stacked=lambda _: [], sample_power=lambda _: 1.0
    )
    assert finer._at_their_ends(bench, [(None, [])]) == [made[-1]]
    assert len(made) == fits


def test_only_effects_that_are_worth_it_are_asked_for_a_finer_formula(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = ["kinematic_error", PLAY, "stribeck_friction"]
    asked: list[str] = []

    class Ordered:
        """A fit of which only the order of its effects matters."""

        def __init__(self, effects: Sequence[str]) -> None:
            self.state = SimpleNamespace(added=list(effects))

        def ordered(self, effects: Sequence[int]) -> Any:
            return Ordered([self.state.added[k] for k in effects])

    def once(bench: object, base: object, current: Ordered, tell: object) -> Ordered:
        asked.append(current.state.added[-1])
        return current

    monkeypatch.setattr(finer, "refined", once)
    found = each_refined(None, None, Ordered(names), lambda _: None, [True, False, True])
    assert found.state.added == names
    assert sorted(asked) == ["kinematic_error", "stribeck_friction"]
