import pytest
from engine_cases import AMPLITUDE, METRIC, SCENARIO, TOOTHED

from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.studies.engine.definition import Base
from hdsim.studies.engine.tolerance import find_tolerance, plot_tolerance


def find(scenario=SCENARIO, **given):
    fields = {"metric": METRIC, "limit": 90.0, "parameter": AMPLITUDE, "replicates": 3}
    return find_tolerance(Scenario.model_validate(scenario), **(fields | given))


def test_largest_amplitude_of_a_known_error_is_found(tmp_path):
    found = find()
    # Peak to peak 2 A <= 90 arcsec: A = 0.75 arcmin, from below.
    assert 0.75 * 0.99 <= found.value <= 0.7502
    assert not found.whole_range
    plot_tolerance(found).savefig(tmp_path / "tolerance.png")
    assert found.write_csv(tmp_path / "t.csv").read_text().count("\n") == len(found.probes) + 1


def test_yield_bound_is_the_exact_one():
    # With n of n drives within: low = (1 - confidence)^(1/n) (Clopper and Pearson 1934).
    assert find(replicates=5).yield_low == pytest.approx(0.05 ** (1 / 5), rel=1e-9)


def test_no_value_and_whole_range_are_told_apart():
    assert find(limit=0.01).value is None
    found = find(limit=1e6)
    assert found.whole_range
    assert found.value == pytest.approx(50)


def test_every_value_is_tried_on_the_same_drives_and_the_worst_count():
    found = find(
        TOOTHED,
        parameter="drive.mesh.pitch_error_m",
        metric=METRIC,
        limit=1e9,
        low=1e-7,
        high=1e-6,
        replicates=8,
    )
    low, high = found.probes
    assert len(set(low.metric)) == 8
    assert low.quantile == max(low.metric)  # of 8 drives, 95 % is all
    half = find(
        TOOTHED,
        parameter="drive.mesh.pitch_error_m",
        limit=1e9,
        low=1e-7,
        high=1e-6,
        replicates=8,
        confidence=0.5,
    )
    assert list(half.probes[0].metric) == list(low.metric)
    assert half.probes[0].quantile == sorted(low.metric)[4]
    assert high.value == 1e-6


def test_a_metric_that_no_run_gives_is_said_with_the_test_that_does():
    with pytest.raises(InputError, match=r"needs a locked motor.*a bench procedure that does: torsion"):
        find(metric="lost_motion", low=0.1, high=0.2)


def test_a_bench_procedure_is_a_base():
    # A lumped drive's lost motion is 2 T / K1 with T = 3 % of 52 N m, whatever its surfaces.
    drive = {"preset": "csg-20-100", "mesh": {"model": "lumped"}}
    base = Base(procedure="torsion", drive=drive, options={"period_s": 1.0}, run={"rtol": 1e-4})
    found = find_tolerance(
        base, metric="lost_motion", limit=60.0, parameter="drive.torsion.stiffness_k1_nm_per_rad",
        low=8e3, high=16e3, replicates=2,
    )  # fmt: skip
    assert found.value == pytest.approx(2 * 0.03 * 52 / (60 / 206265), rel=0.02)
    assert all(not probe.reasons for probe in found.probes)


def test_drives_that_fail_are_counted_with_their_reason():
    # Gaps of 20 um alone are softer than the catalogue's whole drive.
    base = Base(procedure="torsion", drive={"preset": "csg-20-100"}, options={"period_s": 1.0})
    found = find_tolerance(
        base, metric="lost_motion", limit=1e6, parameter="drive.mesh.half_gap_m", low=1e-7, high=2e-5,
        replicates=2, precision=10.0,
    )  # fmt: skip
    assert found.value == 1e-7
    ((reason, count),) = found.probes[-1].reasons
    assert (found.probes[-1].given, count) == (0, 2)
    assert "soft" in reason or "stiff" in reason


def test_range_and_names_are_checked():
    with pytest.raises(InputError, match=r"pitch_error_m is 0\.0 in the scenario: give the range"):
        find(TOOTHED, parameter="drive.mesh.pitch_error_m")
    with pytest.raises(InputError, match="less than 3"):
        find(TOOTHED, parameter="drive.mesh.flanks.flexspline.fractal_dimension", low=2.5, high=3.5)
    with pytest.raises(InputError, match="unknown parameter"):
        find(parameter="load.inertias", low=1, high=2)
    with pytest.raises(InputError, match="unknown metric"):
        find(metric="backlashes")
