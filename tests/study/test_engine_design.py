import numpy as np
import pytest
from engine_cases import AMPLITUDE, study
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy import stats

from hdsim.studies.engine.definition import Variation
from hdsim.studies.engine.design import drive_seed, quantile, runs, sampled

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


def test_the_first_drive_is_the_scenarios_own_and_the_others_differ():
    seeds = [run.seed for run in runs(study(replicates=1000, seed=7), own_seed=42)]
    assert seeds[0] == 42
    assert seeds[1:] == [drive_seed(42, 7, k) for k in range(1, 1000)]
    assert len(set(seeds)) == 1000
    assert max(seeds) < 2**63
    assert not set(seeds[1:]) & {run.seed for run in runs(study(replicates=1000, seed=8))}


STATED = {INERTIA: {"type": "list", "values": [0.1, 0.2]}}
SAMPLED = {AMPLITUDE: {"type": "uniform", "low": 0, "high": 1}}
TWO = {"type": "random", "samples": 2}


@pytest.mark.parametrize(
    ("given", "drives"),
    [
        # Stated values meet the same drives unless they are to be independent.
        ({"parameters": STATED}, "012 012"),
        ({"parameters": STATED, "surfaces": "independent"}, "012 345"),
        # Samples of a distribution stand for drives of a series, but in a sensitivity analysis.
        ({"parameters": STATED | SAMPLED, "sampling": TWO}, "012345 012345"),
        ({"parameters": STATED | SAMPLED, "sampling": TWO, "surfaces": "common"}, "012012 012012"),
        ({"parameters": SAMPLED, "sampling": {"type": "morris", "trajectories": 2}}, "012012012012"),
    ],
)
def test_which_runs_have_the_same_drive(given, drives):
    found = [run.seed for run in runs(study(replicates=3, **given), own_seed=5)]
    assert found == [drive_seed(5, 0, int(k)) for k in drives.replace(" ", "")]


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
