"""What other flanks would do: heard as noise, no more than is left, and never for a mesh that draws none."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hdsim
from hdsim.estimate.flanks import (
    DRAWS,
    drawn_anew,
    hear_flanks,
    nothing_but_flanks,
    of_other_flanks,
    only_flanks,
)
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import State, state_of
from hdsim.scenario import Scenario


def scenario(mesh: dict[str, Any], seed: int = 0) -> Scenario:
    return Scenario.model_validate(
        {
            "drive": {
                "preset": "seed-2021",
                "mesh": {"model": "tabulated", "ring": "static", "pitch_error_m": 4e-7} | mesh,
                "torsion": {"damping_nm_s_per_rad": 40.0},
            },
            "command": {
                "motor": {
                    "type": "motion",
                    "trajectory": {"type": "sine", "amplitude_deg": 800, "frequency_hz": 0.5},
                }
            },
            "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 8.0, "centre_of_mass_m": 0.4}},
            "run": {"duration_s": 3.1, "sample_rate_hz": 200, "teeth_rate_hz": 0, "seed": seed},
        }
    )


def record(plant: Scenario) -> Record:
    run, rng = hdsim.simulate(plant), np.random.default_rng(0)
    late = run.time >= 0.6 - 1e-9
    time = run.time[late] - 0.6
    noise = {"motor_angle": 1e-6, "output_angle": 2e-7, "motor_torque": 2e-3}
    return Record("r", time, {c: run[c][late] + s * rng.standard_normal(len(time)) for c, s in noise.items()})


def state(mesh: dict[str, Any]) -> State:
    return state_of(scenario(mesh))


@pytest.mark.parametrize(
    ("mesh", "draws"),
    [
        ({}, DRAWS),
        ({"half_gap_m": 1e-6}, DRAWS),
        ({"half_gap_m": 1e-6, "pitch_error_m": 0.0}, 0),
        ({"flanks": {"backlash": "single"}, "pitch_error_m": 0.0}, 0),
    ],
)
def test_only_what_is_drawn_is_drawn_anew(mesh: dict[str, Any], draws: int) -> None:
    others = drawn_anew(state(mesh))
    assert len(others) == draws
    assert len({one.seed for one in others}) == draws
    assert all(one.drive.mesh.flanks.seed is None for one in others)


def test_engagements_are_drawn_from_what_is_believed_of_them() -> None:
    own = state({})
    shares, edges = [], []
    for seed in range(40):
        plain, others = (drawn_anew(replace(own, seed=seed), engaged=engaged) for engaged in (False, True))
        assert [one.seed for one in plain] == [one.seed for one in others]
        assert {one.drive.mesh.engagement for one in plain} == {own.drive.mesh.engagement}
        shares += [one.drive.mesh.engagement.share for one in others]
        edges += [one.drive.mesh.engagement.edge_teeth for one in others]
    engagement = own.drive.mesh.engagement
    for drawn, nominal, prior in ((shares, engagement.share, 0.3), (edges, engagement.edge_teeth, 0.5)):
        logs = np.log(np.array(drawn) / nominal)
        assert abs(logs.mean()) < 3 * prior / np.sqrt(len(logs))
        assert abs(logs.std() / prior - 1) < 0.15
    assert max(shares) <= 0.9


def test_a_drive_with_its_own_flanks_differs_by_what_other_flanks_do() -> None:
    base = scenario({})
    bench = bench_for([record(scenario({}, seed=77))], [], base, None)
    before = [series.noise for series in bench.series]
    own = state_of(base)
    predicted = bench.predict(own)
    left = bench.residuals(predicted)
    bench.weigh(left)
    hear_flanks(bench, own)
    assert len(bench.redrawn) == 1 + DRAWS
    (angle,) = (k for k, series in enumerate(bench.series) if series.channel == "output_angle")
    size = float(np.std(left[angle][bench.series[angle].train]))
    # The encoder is far finer than the flanks are known: what is left is theirs, and now called noise.
    assert size > 3 * before[angle]
    assert 0.4 * size < bench.series[angle].noise < 1.6 * size
    whitened = bench.stacked(left)

    def as_it_is(values: np.ndarray) -> np.ndarray:
        return values

    most = of_other_flanks(bench, as_it_is)
    assert most > 0
    assert only_flanks(bench, 0.9 * most, as_it_is)
    assert not only_flanks(bench, 1.1 * most, as_it_is)
    power = float(whitened @ whitened)
    assert power < 1.5 * most, "another drive's flanks are no effect"
    changes = [bench.trace(bench.redrawn[0], one) for one in bench.redrawn[1:]]
    largest = max(changes, key=lambda change: float(change @ change))
    other = np.random.default_rng(1).standard_normal((len(largest), 2))
    assert of_other_flanks(bench, as_it_is, [other]) < 0.1 * most, "such a trace takes little of theirs"
    assert of_other_flanks(bench, as_it_is, [other, largest[:, None]]) == pytest.approx(most)
    noise = bench.noise_power
    assert nothing_but_flanks(bench, noise + 0.9 * most, as_it_is)
    assert not nothing_but_flanks(bench, noise + 1.1 * most, as_it_is)


def test_what_is_not_left_is_no_noise() -> None:
    base = scenario({})
    bench = bench_for([record(base)], [], base, None)
    before = [series.noise for series in bench.series]
    hear_flanks(bench, state_of(base))
    for series, noise in zip(bench.series, before, strict=True):
        assert series.noise < 1.6 * noise
    lumped = scenario({})
    plain = Scenario.model_validate(
        lumped.model_dump(mode="json") | {"drive": {"preset": "seed-2021", "mesh": {"model": "lumped"}}}
    )
    bench = bench_for([record(plain)], [], plain, None)
    hear_flanks(bench, state_of(plain))
    assert bench.redrawn == []
    assert not only_flanks(bench, 0.0, lambda values: values)
    assert not nothing_but_flanks(bench, 0.0, lambda values: values)
