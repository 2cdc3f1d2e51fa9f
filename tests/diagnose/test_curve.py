"""The curve of an unnamed effect against the curve that was hidden."""

import math
from dataclasses import replace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

import hdsim
from hdsim.diagnosis.curve import fit_curve
from hdsim.diagnosis.curve_fit import effect, unit_traces
from hdsim.diagnosis.curve_kinds import Kind
from hdsim.diagnosis.locate import Location, locate
from hdsim.diagnosis.penalised import penalised, roughness
from hdsim.diagnosis.screen import Residual
from hdsim.effects.table import Table
from hdsim.estimate.bench import Bench
from hdsim.estimate.numbers import scaled
from hdsim.estimate.predict import predictors
from hdsim.estimate.prove import gaps
from hdsim.estimate.records import Record
from hdsim.estimate.refit import Refit, refit
from hdsim.estimate.state import state_of
from hdsim.estimate.write import scenario_text
from hdsim.scenario.model import Scenario


def prepared(record: Record, base: Scenario) -> tuple[Bench, Refit, Location]:
    bench = Bench(predictors([record], base.drive.ratio))
    fitted = refit(bench, state_of(base))
    residuals = bench.residuals(fitted.fit.predictions)
    numbers = bench.stacked_series()
    offsets = (numbers[:, None] == np.unique(numbers)[None, :]).astype(float)
    left = Residual(
        bench.stacked(residuals), np.hstack([fitted.fit.columns, offsets]), bench.stacked_blocks()
    )
    return bench, fitted, locate(bench, left, residuals, {})


def catch(angle, velocity):
    """A spring catch at one position, pushing the output back: a torque that the motor has to make."""
    return 0.03 * np.exp(-(((angle - 70) / 8) ** 2))


@pytest.mark.slow
def test_a_hidden_catch_is_drawn_and_closes_the_gap_on_data_that_no_fit_has_seen(tmp_path):
    base = scenario(tmp_path)
    bench, fitted, location = prepared(rigid_record(12.0, extra=catch, seed=1), base)
    found = fit_curve(bench, fitted.fit, location)
    assert found is not None
    assert found.kind.coordinate == "output_angle"
    assert found.share > 0.8
    start = state_of(base)
    gap = gaps(bench, {"before": start, "refit": fitted.fit.state, "after": found.fit.state})[0][
        "motor_torque"
    ]
    assert gap.refit > 2.5 * gap.noise
    assert gap.after < 1.1 * gap.noise
    # The curve is the catch, seen from the body that it acts on: at the output 100 times as large.
    scale = -1.0 if found.kind.acts_on == "motor_torque" else -base.drive.ratio
    truth = scale * catch(found.at * base.drive.ratio, 0.0)
    inside = (found.low <= truth) & (truth <= found.high)
    assert inside.mean() >= 0.7
    assert found.values == pytest.approx(truth, abs=0.05 * np.ptp(truth))

    written = tmp_path / "found.yaml"
    text = scenario_text(tmp_path / "rigid.yaml", found.fit.state, fitted.freedoms, start, tmp_path)
    written.write_text(text, encoding="utf-8")
    again = hdsim.load_scenario(written)
    curve = again.effects.active()["table"].curves[0]
    assert curve.values == pytest.approx(found.values.tolist(), rel=1e-4, abs=1e-9)
    second = prepared(rigid_record(12.0, extra=catch, seed=2), again)
    assert second[2].structured < 0.1
    assert len(found.found().at) == len(found.found().intervals) == len(found.at)


def drift(t):
    return 0.02 * np.sin(2 * np.pi * t / 6.3)


@pytest.mark.slow
def test_a_drift_is_a_curve_over_time_that_begins_with_the_record(tmp_path):
    base = scenario(tmp_path)
    record = rigid_record(12.0, seed=3)
    record.channels["motor_torque"] = record.channels["motor_torque"] + drift(record.time)
    bench, fitted, location = prepared(record, base)
    found = fit_curve(bench, fitted.fit, location)
    assert found is not None
    assert found.kind == Kind("time", "motor_torque")
    truth = -drift(found.at)
    assert found.values - found.values.mean() == pytest.approx(truth - truth.mean(), abs=5e-3)
    states = {"before": state_of(base), "refit": fitted.fit.state, "after": found.fit.state}
    gap = gaps(bench, states)[0]["motor_torque"]
    assert gap.after < 0.25 * gap.refit


@pytest.mark.slow
def test_noise_draws_no_curve(tmp_path):
    bench, fitted, location = prepared(rigid_record(8.0, seed=5), scenario(tmp_path))
    assert fit_curve(bench, fitted.fit, location) is None


@pytest.mark.parametrize(
    "kind",
    [
        Kind("output_angle", "motor_torque"),
        Kind("output_angle", "motor_torque", times_direction=True),
        Kind("motor_velocity", "motor_torque"),
        Kind("motor_angle", "motor_torque", period=math.pi),
        Kind("time", "motor_torque"),
    ],
    ids=lambda kind: kind.words,
)
def test_traces_of_torques_on_the_motor_are_those_of_the_simulation(tmp_path, kind):
    bench, fitted, _ = prepared(rigid_record(6.0), scenario(tmp_path))
    reach = {"time": (0.0, 6.0), "motor_velocity": (-150.0, 150.0), "motor_angle": (0.0, 2.5)}
    low, high = reach.get(kind.coordinate, (-1.3, 0.1))
    at = np.linspace(low, high, 5)
    residuals = bench.residuals(fitted.fit.predictions)
    added = effect(fitted.fit.state, kind, at)
    columns = unit_traces(bench, fitted.fit, kind, at, added, residuals)
    for k in range(len(at)):
        values = [0.0] * len(at)
        values[k] = 0.01 * 52.0 / 100.0
        curve = Table(curves=(kind.curve(at, np.array(values)),))
        state = fitted.fit.state
        (simulated,) = bench.predict(replace(state, effects={**state.effects, "table": curve}))
        series = bench.series[0]
        change = ((simulated - fitted.fit.predictions[0]) / series.sigma)[series.train]
        assert columns[:, k] == pytest.approx(change - change.mean(), abs=2e-3 * np.ptp(change) + 1e-4)


def test_a_base_that_has_a_curve_keeps_it_beside_the_new_one(tmp_path):
    base = scenario(tmp_path)
    text = (tmp_path / "rigid.yaml").read_text(encoding="utf-8")
    own = "{coordinate: twist, acts_on: twist_torque, at: [-1, 1], values_nm: [2, -2]}"
    (tmp_path / "with.yaml").write_text(
        f"{text}\neffects: {{table: {{curves: [{own}]}}}}\n", encoding="utf-8"
    )
    base = hdsim.load_scenario(tmp_path / "with.yaml")
    start = state_of(base)
    kind = Kind("output_angle", "output_torque")
    new = replace(effect(start, kind, np.array([0.0, 1.0])), coefficients=(1.0, -1.0))
    found = replace(start, added=(new,))
    assert [curve.coordinate for curve in found.candidate().effects["table"].curves] == [
        "twist",
        "output_angle",
    ]
    written = tmp_path / "found.yaml"
    written.write_text(scenario_text(tmp_path / "with.yaml", found, [], start, tmp_path), encoding="utf-8")
    curves = hdsim.load_scenario(written).effects.active()["table"].curves
    assert [curve.values for curve in curves] == [(2, -2), (0.52, -0.52)]


def test_the_penalty_is_large_for_noise_and_small_for_a_sharp_curve():
    rng = np.random.default_rng(0)
    x = rng.uniform(0, 1, 3000)
    corners = np.linspace(0, 1, 20)
    columns = np.maximum(0.0, 1.0 - np.abs(x[:, None] - corners) / (corners[1] - corners[0]))
    blocks = np.arange(3000) // 60
    noise = 0.1 * rng.standard_normal(3000)
    rough = roughness(20)
    sharp = penalised(columns, np.sin(20 * x) + noise, blocks, rough)
    flat = penalised(columns, noise, blocks, rough)
    assert sharp.share > 0.95
    assert np.abs(sharp.values - np.sin(20 * corners)).max() < 0.2
    assert flat.share < 0.01
    assert np.trace(flat.penalty) > 1e3 * np.trace(sharp.penalty)
    assert np.ptp(flat.values) < 0.03


def test_numbers_that_the_data_cannot_tell_apart_stay_by_their_priors_beside_a_curve(tmp_path):
    """Two that do almost the same: only far apart would they fit a little more of the noise."""
    bench, fitted, location = prepared(rigid_record(12.0, extra=catch, seed=1), scenario(tmp_path))
    columns = fitted.fit.columns.copy()
    columns[:, 1] = columns[:, 0] + 1e-5 * np.random.default_rng(0).standard_normal(len(columns))
    alike = replace(fitted.fit, columns=columns)
    found = fit_curve(bench, alike, location)
    assert found is not None
    for free, before, after in zip(alike.frees[:2], alike.theta, found.fit.theta, strict=False):
        assert abs(after - before) < free.prior, free.name


def test_a_curve_that_leaves_more_than_the_model_without_is_none(tmp_path, monkeypatch):
    """Traces of the other sign make all worse."""
    bench, fitted, location = prepared(rigid_record(12.0, extra=catch, seed=1), scenario(tmp_path))
    assert fit_curve(bench, fitted.fit, location) is not None
    monkeypatch.setattr("hdsim.diagnosis.curve.unit_traces", lambda *given: -unit_traces(*given))
    assert fit_curve(bench, fitted.fit, location) is None


def test_a_curve_that_carries_numbers_beyond_all_bounds_is_none(tmp_path, monkeypatch):
    bench, fitted, location = prepared(rigid_record(12.0, extra=catch, seed=1), scenario(tmp_path))

    def beyond(state, frees, theta):
        return scaled(state, frees, [1e6] * len(theta))

    monkeypatch.setattr("hdsim.diagnosis.curve_fit.scaled", beyond)
    assert fit_curve(bench, fitted.fit, location) is None
