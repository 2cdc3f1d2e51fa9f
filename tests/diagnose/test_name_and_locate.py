import json
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

import hdsim
from hdsim.diagnosis.name import simplest_first
from hdsim.diagnosis.verdict import Verdict
from hdsim.diagnosis.workflow import diagnose
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.numbers import GAIN_PRIORS
from hdsim.estimate.orders import order_lines
from hdsim.estimate.predict import predictors
from hdsim.estimate.prove import borne_out
from hdsim.estimate.records import Record
from hdsim.tell.save import save


def test_orders_2_and_2_02_are_told_apart_by_a_record_that_is_long_enough(tmp_path):
    t = np.arange(20000) / 500.0
    angle = 2 * np.pi * 2.5 * t + 8 * np.sin(0.5 * t)  # 100 turns
    rng = np.random.default_rng(0)
    torque = 0.01 * np.sin(2 * angle) + 0.006 * np.sin(2.02 * angle + 1) + 0.002 * rng.standard_normal(len(t))
    bench = Bench(predictors([Record("r", t, {"motor_angle": angle, "motor_torque": torque})], -100.0))
    lines = order_lines(bench, [torque], "motor_torque")
    assert [line.order for line in lines[:2]] == pytest.approx([2.0, 2.02], abs=0.004)
    assert lines[0].amplitude == pytest.approx(0.01, rel=0.25)


def test_lines_that_are_close_do_not_pull_at_one_another(tmp_path):
    """Orders 2 and 1.98 over 70 turns, 1.4 lines' widths apart, the weaker beside the stronger's skirt."""
    t = np.arange(1800) / 250.0
    angle = 2 * np.pi * (10.0 * t + 0.3 * np.sin(t))
    rng = np.random.default_rng(1)
    error = 3.5 * np.sin(2 * angle) + 2.5 * np.sin(1.98 * angle + 2.0) + 5.0 * rng.standard_normal(len(t))
    record = Record("r", t, {"motor_angle": angle, "motor_torque": error})
    lines = order_lines(Bench(predictors([record], 101.0)), [error], "motor_torque")
    found = sorted(line.order for line in lines[:2])
    assert found == pytest.approx([1.98, 2.0], abs=0.006)


def stribeck(angle, velocity):
    """Hess and Soom's curve, not the catalogue's Gaussian."""
    return 0.05 * velocity / np.sqrt(velocity**2 + 0.1) / (1 + (velocity / 6) ** 2)


def ripple(angle, velocity):
    return 0.006 * np.sin(5 * angle + 0.4)


def position_bump(angle, velocity):
    """Outside the catalogue: a catch at one position of the motor, wherever it is in its turn."""
    return 0.03 * np.exp(-(((angle - 70) / 6) ** 2))


def test_nothing_is_said_of_data_that_the_model_explains(tmp_path):
    found = diagnose([rigid_record(seed=4)], scenario(tmp_path)).verdict
    assert found.verdict == "nothing"
    assert found.effects == []
    assert found.gap["motor_torque"].after == pytest.approx(2e-3, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "name"), [(stribeck, "stribeck_friction"), (ripple, "motor_torque_ripple")]
)
def test_a_hidden_effect_is_named_added_and_closes_the_gap(tmp_path, hidden, name):
    base = scenario(tmp_path)
    found = diagnose([rigid_record(extra=hidden, seed=2)], base)
    verdict = found.verdict
    assert verdict.verdict == "effect"
    assert name in [verdict.effects[0].name, *verdict.effects[0].indistinguishable_from]
    assert len(verdict.effects) == 1
    gap = verdict.gap["motor_torque"]
    assert gap.refit > 1.4 * gap.noise
    closed = (gap.refit**2 - gap.after**2) / (gap.refit**2 - gap.noise**2)
    assert closed > 0.9

    report = save(found, tmp_path / "rigid.yaml", tmp_path / "out")
    assert report.read_text(encoding="utf-8").count("data:image/png;base64") == len(
        list((tmp_path / "out").glob("*.png"))
    )
    written = Verdict.model_validate(json.loads((tmp_path / "out" / "verdict.json").read_text()))
    assert written.version == 2
    assert written.confidence == pytest.approx(verdict.effects[0].confidence)
    assert [reason.rule for reason in written.because] == [reason.rule for reason in verdict.because] != []
    again = hdsim.load_scenario(written.scenario)
    assert name in again.effects.active()
    # The scenario that was written leaves nothing of the same record to name.
    second = diagnose([rigid_record(extra=hidden, seed=2)], again).verdict
    assert second.effects == []
    assert second.gap["motor_torque"].before < 1.1 * gap.after


def test_what_the_catalogue_does_not_hold_is_unknown(tmp_path):
    found = diagnose([rigid_record(12.0, extra=position_bump, seed=1)], scenario(tmp_path)).verdict
    assert found.verdict == "unknown"
    assert found.effects == []
    assert found.located[0].coordinate in ("output_angle", "time")


def test_what_happens_once_is_said_with_its_time(tmp_path):
    # Nothing of it repeats, so no block of time foretells another; yet it is plainly no noise.
    record = rigid_record(12.0, seed=5)
    once = (record.time > 2.2) & (record.time < 2.5)
    record.channels["motor_torque"][once] += 0.02 * np.sin(np.pi * (record.time[once] - 2.2) / 0.3)
    found = diagnose([record], scenario(tmp_path)).verdict
    assert found.verdict == "unknown"
    left = found.remainder
    assert left is not None
    assert left.times_noise > 3
    assert (left.start_s, left.end_s) == pytest.approx((2.2, 2.5), abs=0.3)


@pytest.mark.slow
def test_a_cable_is_no_unbalance_though_that_explains_most_of_it(tmp_path):
    # A weight's torque is a cosine of the output's angle, by statics; what is left there is not its error.
    def cable(angle, velocity):
        return 0.02 * np.tanh((angle / -100.0 + 0.3) / 0.25) ** 3

    found = diagnose([rigid_record(12.0, extra=cable, seed=3)], scenario(tmp_path)).verdict
    assert found.verdict == "unknown"
    assert "unbalance" in found.suspects

    def weight(angle, velocity):
        return 0.02 * np.cos(angle / -100.0 + 0.4)

    found = diagnose([rigid_record(12.0, extra=weight, seed=3)], scenario(tmp_path)).verdict
    assert [effect.name for effect in found.effects] == ["unbalance"]


@pytest.mark.parametrize("there", [1.0, 0.5, 0.0, -0.2])
def test_held_out_data_bear_out_the_part_of_a_change_that_is_there(tmp_path, there):
    bench = Bench(predictors([rigid_record(8.0, noise=0.0)], -100.0))
    (series,) = bench.series
    wave = np.sin(np.arange(len(series.measured)))
    prediction = series.measured + 3.0
    slope, spread = borne_out(bench, [prediction - there * wave], [prediction + (1.0 - there) * wave])
    assert slope == pytest.approx(there, abs=0.01)
    assert spread < 0.01


def test_held_out_data_say_how_surely_they_bear_a_change_out(tmp_path):
    bench = Bench(predictors([rigid_record(30.0, noise=0.0)], -100.0))
    (series,) = bench.series
    rng = np.random.default_rng(8)
    samples = len(series.measured)
    wave = np.sin(np.arange(samples))
    slopes, spreads = [], []
    for _ in range(200):
        prediction = series.measured + 2.0 * rng.standard_normal(samples)
        slope, spread = borne_out(bench, [prediction - wave], [prediction])
        slopes.append(slope)
        spreads.append(spread)
    assert np.mean(slopes) == pytest.approx(1.0, abs=4 * np.std(slopes) / np.sqrt(200))
    assert np.mean(spreads) == pytest.approx(np.std(slopes), rel=0.2)
    assert borne_out(bench, [series.measured], [series.measured]) == (1.0, np.inf)


def test_of_two_that_explain_the_same_the_simpler_one_has_the_name():
    def result(name, free, losses):
        added = SimpleNamespace(freedom=free)
        return name, SimpleNamespace(state=SimpleNamespace(added=[added])), np.array(losses)

    free, simple = result("free", 2, [1.0, 2.0, 1.0, 2.0]), result("simple", 1, [1.5, 1.6, 1.6, 1.4])
    worse = result("worse", 1, [2.0, 3.0, 2.0, 3.0])
    assert [r[0] for r in simplest_first([free, simple, worse], 0.2)] == ["simple", "free", "worse"]
    assert [r[0] for r in simplest_first([free, simple, worse], 0.05)] == ["free", "simple", "worse"]
    assert [r[0] for r in simplest_first([free, worse], 0.2)] == ["free", "worse"]


def test_missing_friction_is_named_where_the_base_has_none(tmp_path):
    base = scenario(tmp_path, friction={"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0})
    verdict = diagnose([rigid_record(seed=3)], base).verdict
    assert verdict.effects[0].name == "input_coulomb_viscous"
    numbers = verdict.effects[0].parameters
    for field, truth in (("coulomb_nm", 0.03), ("viscous_nm_s_per_rad", 3.5e-4)):
        low, high = numbers[field].interval
        assert low <= truth <= high
        # Nothing but the sensor ties torques to an absolute scale, and its constant is known to 15 %.
        assert high - low < 4.5 * GAIN_PRIORS["motor_torque"] * truth


def test_suspect_data_stop_a_diagnosis_with_the_reason(tmp_path):
    record = rigid_record()
    degrees = record.channels["motor_angle"] / -100.0 * 180 / np.pi
    bad = Record("r", record.time, {**record.channels, "output_angle": degrees})
    with pytest.raises(InputError, match=r"57\.3 times motor_angle / -100 .*: one of them is in degrees"):
        diagnose([bad], scenario(tmp_path, "lumped"))
