import numpy as np
import pytest
from engine_cases import AMPLITUDE, study
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy import stats

from hdsim.studies.engine.definition import Variation
from hdsim.studies.engine.design import quantile, run_seed, runs, sampled

INERTIA, STIFFNESS = "load.inertia_kg_m2", "drive.torsion.damping_nm_s_per_rad"


def variation(**given):
    return TypeAdapter(Variation).validate_python(given)


def test_design_is_values_times_samples_times_replicates_first_parameter_slowest():
    found = runs(
        study(
            parameters={
                INERTIA: {"type": "list", "values": [0.1, 0.2]},
                AMPLITUDE: {"type": "uniform", "low": 0.1, "high": 0.9},
                STIFFNESS: {"type": "grid", "start": 1, "stop": 3, "points": 3},
            },
            sampling={"type": "random", "samples": 4},
            replicates=5,
        )
    )
    assert len(found) == 2 * 3 * 4 * 5
    assert [run.index for run in found] == list(range(120))
    assert [run.values[0] for run in found[::60]] == [0.1, 0.2]
    assert [run.values[2] for run in found[:60:20]] == [1.0, 2.0, 3.0]
    samples = {run.point: [] for run in found}
    for run in found:
        if run.replicate == 0:
            samples[run.point].append(run.values[1])
    assert all(values == samples[0] for values in samples.values())  # every point meets the same samples
    assert len(set(samples[0])) == 4


def test_logarithmic_grid_has_equal_ratios():
    found = runs(
        study(
            parameters={
                INERTIA: {"type": "grid", "start": 1, "stop": 1000, "points": 4, "spacing": "logarithmic"}
            }
        )
    )
    assert [run.values[0] for run in found] == pytest.approx([1, 10, 100, 1000])


@given(st.floats(0.001, 0.999))
def test_distributions_have_the_quantiles_of_their_closed_forms(share):
    u = np.array([share])
    one = lambda **given: float(quantile(variation(**given), u)[0])  # noqa: E731
    z = stats.norm.ppf(share)
    assert one(type="uniform", low=-1, high=3) == pytest.approx(-1 + 4 * share)
    assert one(type="loguniform", low=1, high=100) == pytest.approx(100**share)
    assert one(type="normal", mean=2, standard_deviation=0.5) == pytest.approx(2 + 0.5 * z, abs=1e-9)
    assert one(type="lognormal", median=3, geometric_standard_deviation=2) == pytest.approx(3 * 2**z)
    rising = one(type="triangular", low=0, mode=1, high=1)
    assert rising == pytest.approx(np.sqrt(share))


def test_cut_normal_stays_within_its_ends():
    found = quantile(
        variation(type="normal", mean=0, standard_deviation=1, low=0, high=0.5), np.linspace(0, 1, 50)
    )
    assert found.min() >= 0
    assert found.max() <= 0.5


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol_sequence"])
def test_stratified_samples_meet_every_slice_once(kind):
    found = sampled(
        study(
            parameters={
                AMPLITUDE: {"type": "uniform", "low": 0, "high": 1},
                INERTIA: {"type": "uniform", "low": 0, "high": 1},
            },
            sampling={"type": kind, "samples": 64},
        )
    )
    for column in found.T:
        assert sorted(np.floor(column * 64).astype(int)) == list(range(64))


def test_seeds_depend_on_study_and_run_only_and_differ():
    seeds = [run.seed for run in runs(study(replicates=1000, seed=7))]
    assert seeds == [run_seed(7, k) for k in range(1000)]
    assert len(set(seeds)) == 1000
    assert max(seeds) < 2**63
    assert not set(seeds) & {run.seed for run in runs(study(replicates=1000, seed=8))}


def test_common_surfaces_repeat_the_seeds_at_every_point():
    found = runs(
        study(parameters={INERTIA: {"type": "list", "values": [0.1, 0.2]}}, replicates=3, surfaces="common")
    )
    seeds = [run.seed for run in found]
    assert seeds[:3] == seeds[3:]
    assert len(set(seeds[:3])) == 3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"parameters": {AMPLITUDE: {"type": "uniform", "low": 0, "high": 1}}}, "needs sampling"),
        ({"sampling": {"type": "random", "samples": 3}}, "no parameter has a distribution"),
        ({"parameters": {AMPLITUDE: {"type": "uniform", "low": 1, "high": 1}}}, "low must lie below high"),
        (
            {
                "parameters": {
                    AMPLITUDE: {"type": "grid", "start": 0, "stop": 1, "points": 3, "spacing": "logarithmic"}
                }
            },
            "above 0",
        ),
        ({"metrics": ["a", "a"]}, "twice"),
        (
            {
                "parameters": {
                    AMPLITUDE: {"type": "uniform", "low": 0, "high": 1},
                    INERTIA: {"type": "list", "values": [1]},
                },
                "sampling": {"type": "morris"},
            },
            "distribution for every parameter",
        ),
    ],
)
def test_impossible_designs_are_refused(given, message):
    with pytest.raises(ValidationError, match=message):
        study(**given)
