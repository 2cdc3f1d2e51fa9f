import csv
import json

import numpy as np
import pytest
from engine_cases import AMPLITUDE, METRIC, SCENARIO, TOOTHED, study
from scipy import stats

from hdsim.studies.engine.plots import study_figures, swings
from hdsim.studies.engine.reading import plan
from hdsim.studies.engine.sensitivity import indices
from hdsim.studies.engine.study import run_study, write_results
from hdsim.studies.engine.summary import mean_interval, quantile_interval, summarise

INERTIA, SECOND = "load.inertia_kg_m2", "effects.kinematic_error.components[1].amplitude_arcmin"
TWO = {
    **SCENARIO,
    "effects": {
        "kinematic_error": {
            "components": [{"order": 2, "amplitude_arcmin": 0.5}, {"order": 2, "amplitude_arcmin": 0.1}]
        }
    },
}


def test_intervals_agree_with_closed_forms():
    values = np.random.default_rng(3).normal(10, 2, 400)
    found = mean_interval(values, 0.95)
    # t_{0.975, 399} = 1.9659 (tables)
    half = 1.9659 * values.std(ddof=1) / 20
    assert (found.low, found.value, found.high) == pytest.approx(
        (values.mean() - half, values.mean(), values.mean() + half), rel=1e-5
    )
    upper = quantile_interval(values, 0.95, 0.95)
    assert upper.low < upper.value < upper.high
    assert upper.low < 10 + 1.645 * 2 < upper.high
    assert np.isnan(mean_interval(values[:1], 0.95).low)


def test_differences_are_paired_over_the_same_drives(tmp_path):
    values = {"type": "list", "values": [2e-6, 4e-6, 6e-6]}
    given = study(TOOTHED, parameters={"drive.mesh.pitch_error_m": values}, replicates=5, confidence=0.9)
    result = run_study(plan(given), tmp_path)
    first, second, third = summarise(result.plan, result.table)
    measured = result.table.values(METRIC).reshape(3, 5)
    assert (first.pairs, second.pairs) == (0, 5)
    assert np.isnan(first.difference.value)
    for found, row in ((second, measured[1]), (third, measured[2])):
        expected = stats.ttest_rel(row, measured[0]).confidence_interval(0.9)
        interval = found.difference
        assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high))
        # What the drives have in common is no part of the difference.
        assert interval.high - interval.low < found.mean.high - found.mean.low
    apart = run_study(plan(given.model_copy(update={"surfaces": "independent"})), tmp_path / "apart")
    assert [s.pairs for s in summarise(apart.plan, apart.table)] == [0, 0, 0]


def test_a_time_that_never_comes_is_in_the_summary():
    values = np.array([0.1, 0.2, np.inf])
    assert mean_interval(values, 0.95).value == np.inf
    assert np.isnan(mean_interval(values, 0.95).low)
    assert (quantile_interval(values, 0.5, 0.95).value, quantile_interval(values, 0.95, 0.95).value) == (
        0.2,
        np.inf,
    )


def test_mean_interval_covers_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(0)
    hits = sum(
        found.low <= 5 <= found.high
        for found in (mean_interval(rng.normal(5, 1, 8), 0.9) for _ in range(2000))
    )
    assert hits / 2000 == pytest.approx(0.9, abs=0.02)


def test_table_files_hold_units_provenance_and_every_digit(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    result = run_study(
        plan(
            study(
                parameters={AMPLITUDE: {"type": "uniform", "low": 0.1, "high": 1}},
                sampling={"type": "random", "samples": 6},
            )
        ),
        tmp_path,
    )
    write_results(result, tmp_path)
    with (tmp_path / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert f"{AMPLITUDE} [arcmin]" in rows[0]
    assert [float(row[f"{METRIC} [arcsec]"]) for row in rows] == list(result.table.values(METRIC))
    table = parquet.read_table(tmp_path / "results.parquet")
    assert table.column(METRIC).to_pylist() == list(result.table.values(METRIC))
    assert table.schema.field(METRIC).metadata[b"unit"] == b"arcsec"
    assert table.schema.field(AMPLITUDE).metadata[b"role"] == b"parameter"
    assert (
        table.schema.metadata[b"key"].decode()
        == json.loads((tmp_path / "provenance.json").read_text())["key"]
    )
    assert "transmission_error" in table.schema.metadata[b"study"].decode()


def test_summary_is_taken_at_every_combination_of_stated_values(tmp_path):
    checked = plan(study(parameters={AMPLITUDE: {"type": "list", "values": [0.5, 1.0]}}, replicates=3))
    found = summarise(checked, run_study(checked, tmp_path).table)
    assert [s.point[AMPLITUDE] for s in found] == [0.5, 1.0]
    assert [s.runs for s in found] == [3, 3]
    assert [s.mean.value for s in found] == pytest.approx([60, 120], rel=2e-4)
    assert found[0].standard_deviation == pytest.approx(0, abs=1e-9)  # a rigid drive has no rough teeth


def test_tornado_ranks_by_what_each_parameter_does(tmp_path):
    checked = plan(
        study(
            TWO,
            parameters={
                SECOND: {"type": "uniform", "low": 0.1, "high": 0.2},
                INERTIA: {"type": "uniform", "low": 0.05, "high": 0.1},
                AMPLITUDE: {"type": "uniform", "low": 0.2, "high": 0.8},
            },
            sampling={"type": "latin_hypercube", "samples": 40},
        )
    )
    table = run_study(checked, tmp_path).table
    found = swings(checked, METRIC, table)
    assert [entry[0] for entry in found] == [AMPLITUDE, SECOND, INERTIA]
    # The error is 2 (A1 + A2): 120 arcsec an arcmin, over 90 % of the width.
    assert found[0][2] - found[0][1] == pytest.approx(120 * (found[0][4] - found[0][3]), rel=1e-3)
    assert abs(found[2][2] - found[2][1]) < 1e-3


@pytest.mark.parametrize("method", ["sobol_indices", "morris"])
def test_sensitivity_of_a_sum_is_its_analytic_one(tmp_path, method):
    pytest.importorskip("SALib")
    sampling = {"sobol_indices": {"base_samples": 64}, "morris": {"trajectories": 8}}[method]
    checked = plan(
        study(
            TWO,
            parameters={
                AMPLITUDE: {"type": "uniform", "low": 0.2, "high": 0.8},
                SECOND: {"type": "uniform", "low": 0.1, "high": 0.4},
                INERTIA: {"type": "uniform", "low": 0.05, "high": 0.1},
            },
            sampling={"type": method, **sampling},
        )
    )
    big, small, none = indices(checked, run_study(checked, tmp_path).table)
    if method == "sobol_indices":
        # Variances of 120 A: widths 72 and 36 arcsec, squares over 12: shares 0.8 and 0.2.
        assert big.total == pytest.approx(0.8, abs=0.1)
        assert small.total == pytest.approx(0.2, abs=0.05)
        assert big.cost == pytest.approx(72 / 12**0.5, rel=0.1)
    else:
        assert big.cost == pytest.approx(72, rel=0.01)
        assert small.cost == pytest.approx(36, rel=0.01)
        assert big.first == pytest.approx(0, abs=0.5)  # no interaction, no curvature
    assert none.cost < 0.02


def test_failed_run_is_said_where_indices_need_it(tmp_path):
    pytest.importorskip("SALib")
    checked = plan(
        study(
            metrics=[METRIC],
            parameters={
                "drive.torsion.torque_t1_nm": {"type": "uniform", "low": 7, "high": 24},
                "drive.torsion.torque_t2_nm": {"type": "uniform", "low": 8, "high": 30},
            },
            sampling={"type": "sobol_indices", "base_samples": 4},
        )
    )
    written, troubles = write_results(run_study(checked, tmp_path), tmp_path)
    assert "sensitivity indices need them all" in troubles[0]
    assert tmp_path / "results.csv" in written


@pytest.mark.parametrize(
    ("parameters", "extra", "kinds"),
    [
        ({AMPLITUDE: {"type": "grid", "start": 0.1, "stop": 1, "points": 3}}, {}, ["curve"]),
        (
            {
                AMPLITUDE: {"type": "grid", "start": 0.1, "stop": 1, "points": 3},
                INERTIA: {"type": "grid", "start": 0.1, "stop": 1, "points": 4},
            },
            {},
            ["map"],
        ),
        ({"effects.kinematic_error": {"type": "list", "values": [None, {}]}}, {"replicates": 2}, ["bars"]),
        (
            {AMPLITUDE: {"type": "uniform", "low": 0.1, "high": 1}},
            {"sampling": {"type": "random", "samples": 8}},
            ["histogram", "tornado"],
        ),
        ({}, {"replicates": 4}, ["histogram"]),
        ({}, {}, []),
    ],
)
def test_pictures_fit_the_design(tmp_path, parameters, extra, kinds):
    checked = plan(study(parameters=parameters, **extra))
    table = run_study(checked, tmp_path).table
    figures = study_figures(checked, table, summarise(checked, table))
    assert sorted(figures) == [f"{METRIC}-{kind}" for kind in kinds]
    for figure in figures.values():
        figure.savefig(tmp_path / "picture.png")
