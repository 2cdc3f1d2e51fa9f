"""A mount as soft as the drive itself: no linear fit leads to it, and stiffening laws stand in for it."""

from typing import Any

import pytest
from diagnose_bench import with_effects, with_stiffness
from moves import NOISE, positioned, to_and_fro
from noisy import noisy

import hdsim
from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.finer import refined
from hdsim.diagnosis.name import name_effect
from hdsim.diagnosis.starts import starts
from hdsim.diagnosis.traces import screen
from hdsim.diagnosis.workflow import diagnose
from hdsim.effects import catalogue
from hdsim.estimate.opening import bench_for
from hdsim.estimate.orders import lines_of
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

#: Stiffness of the mount, half of the drive's K1, N m/rad.
MOUNT = 8e3
#: Weight of the arm, kg; its inertia, kg m^2; how it moves.
HEAVY = 6.0, 1.5, to_and_fro((60, -90, 45), 70, 60, 600)
LIGHT = 3.0, 0.6, to_and_fro((60, -90, 45), 90, 500, 8000)


def arm(
    mass_kg: float, inertia_kg_m2: float, trajectory: dict[str, Any], effects: dict[str, Any]
) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects,
        "command": positioned(trajectory),
        "load": {"inertia_kg_m2": inertia_kg_m2, "gravity": {"mass_kg": mass_kg, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": 6.0, "sample_rate_hz": 500.0},
    })  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "moved",
    [
        pytest.param(HEAVY, id="beyond the first corner of the spring: otherwise a nonlinear stiffness"),
        pytest.param(
            LIGHT, id="hardly beyond it, and all is taken for the drive's: otherwise a damaged tooth"
        ),
    ],
)
def test_a_mount_softer_than_the_drive_is_named(moved: tuple[float, float, dict[str, Any]]) -> None:
    run = hdsim.simulate(arm(*moved, {"base_flexibility": {"stiffness_nm_per_rad": MOUNT}}))
    base = arm(*moved, {})
    bench = bench_for([noisy(run, NOISE, seed=1)], [], base, None)
    found = refit(bench, state_of(base)).fit
    lines = lines_of(bench, bench.residuals(found.predictions, drift=True), found.state.delays)
    left = left_of(bench, found)
    named = name_effect(bench, found, screen(bench, found.state, left, lines), left)
    assert named is not None
    assert named.name == "base_flexibility"
    assert bench.power(named.fit.predictions) < 1.05 * bench.noise_power
    mount = named.fit.state.added[-1].settings()["stiffness_nm_per_rad"]
    assert mount == pytest.approx(MOUNT, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("rings", [True, False])
def test_a_mount_that_has_its_name_rings_where_the_data_tell_it(rings: bool) -> None:
    """An effect once named is asked for its housing's inertia, of which a contest of all says too little."""
    truth = {"stiffness_nm_per_rad": 5e4} | ({"natural_frequency_hz": 25.0} if rings else {})
    run = hdsim.simulate(arm(*LIGHT, {"base_flexibility": truth}))
    base = arm(*LIGHT, {})
    bench = bench_for([noisy(run, NOISE, seed=1)], [], base, None)
    found = refit(bench, state_of(base)).fit
    way = catalogue()["base_flexibility"].fittings[0]
    plain = with_effects(bench, found, *starts("base_flexibility", way, (), bench.ranges(found.state)))
    own = refined(bench, found, plain, lambda _: None).state.added[0]
    assert own.fitting.label == ("with housing inertia" if rings else "")
    if rings:
        assert own.settings()["natural_frequency_hz"] == pytest.approx(25.0, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "said"),
    [
        pytest.param(1.0 / 3.0, True, id="a third of the stiffness: a mount of half of it looks the same"),
        pytest.param(0.75, False, id="three quarters: as catalogues scatter"),
    ],
)
def test_a_spring_softer_than_is_likely_may_be_a_compliance_in_series(stiffness: float, said: bool) -> None:
    """Below the first corner of the spring the mount is a softer spring, to the last digit."""
    base = arm(0.5, 0.1, to_and_fro((60, -90, 45), 70, 60, 600), {})
    run = hdsim.simulate(with_stiffness(base, stiffness))
    found = diagnose([noisy(run, NOISE, seed=1)], base).verdict
    assert found.verdict == "parameter"
    assert ("in series would look the same: base flexibility" in found.sentence) is said
