"""Friction that has its name, in a finer formula where the data tell it: over an angle, speed or load.

Friction that is tight over a part of the turn is no sine of it. Of an exponential of a sine every multiple is
known (Jacobi and Anger): exp(sin u) = I0(1) + 2 I1(1) sin u - 2 I2(1) cos 2u - 2 I3(1) sin 3u + ...
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnose_bench import beyond, rigid_record, scenario, with_effects
from scipy.special import iv

from hdsim.diagnosis.finer import _begins, refined
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import state_of

SIZE_NM = 0.006
#: Effect, field of a component's amplitude, order of what is hidden, and places of its multiples.
KINDS = {
    "two lobes": ("position_dependent_friction", "amplitude_nm", 2.0, (1, 3, 4)),
    "a larger ball": ("wave_generator_bearing", "friction_nm", 1.095, (0, 1, 2)),
}


def plainly_named(tmp_path: Any, kind: str, law: Any) -> tuple[Bench, Fit, Fit]:
    """A rigid drive's log with friction of a law hidden, the base re-fitted, and with the plain effect."""
    effect, _, order, _ = KINDS[kind]
    record = rigid_record(
        20.0,
        noise=5e-4,
        extra=lambda angle, velocity: SIZE_NM * law(order * angle + 0.4) * np.tanh(velocity / 0.5),
    )
    base = scenario(tmp_path)
    bench = bench_for([record], [], base, None)
    found = refit(bench, state_of(base)).fit
    ways = starts(effect, catalogue()[effect].fittings[0], (), bench.ranges(found.state))
    added = ways[len(ways) // 2]
    return bench, found, with_effects(bench, found, added)


@pytest.mark.parametrize("kind", list(KINDS))
def test_multiples_of_an_order_are_found_with_their_sizes_and_phases(tmp_path: Any, kind: str) -> None:
    bench, base, plain = plainly_named(tmp_path, kind, lambda u: np.exp(np.sin(u)))
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, plain) > 1.0
    assert beyond(bench, found) < 0.05
    _, field, _, places = KINDS[kind]
    components = found.state.added[0].settings()["components"]
    for multiple, place in enumerate(places, start=1):
        one = components[place]
        truth = SIZE_NM * 2.0 * iv(multiple, 1.0) * np.exp(1j * (multiple * 0.4 - (multiple - 1) * np.pi / 2))
        told = one[field] * np.exp(1j * np.radians(one["phase_deg"]))
        assert abs(told - truth) < 0.05 * SIZE_NM


@pytest.mark.parametrize(
    "plain",
    catalogue()["position_dependent_friction"].fittings,
    ids=lambda way: way.label or "of the wave generator",
)
def test_a_finer_formula_begins_as_the_plain_one_of_the_same_turn_is(plain: Fitting) -> None:
    bench = SimpleNamespace(turns=100.0, measured=set(), channels=(), ranges=lambda state: {})
    current = SimpleNamespace(state=SimpleNamespace(toothed=False))
    added, *_ = starts("position_dependent_friction", plain, (), {})
    added = replace(added, coefficients=tuple(0.5 * k - 1.1 for k in range(len(added.coefficients))))
    [begun] = _begins(bench, current, added)  # type: ignore[arg-type]
    own, further = added.settings()["components"], begun.settings()["components"]
    for one, other in zip(own, further, strict=False):
        assert other["per"] == one["per"]
        assert [other[k] for k in ("order", "amplitude_nm", "phase_deg")] == pytest.approx(
            [one[k] for k in ("order", "amplitude_nm", "phase_deg")]
        )
    assert all(other["amplitude_nm"] == 0.0 for other in further[len(own) :])


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_sine_of_the_angle_stays_one(tmp_path: Any, kind: str) -> None:
    bench, base, plain = plainly_named(tmp_path, kind, lambda u: 1.0 + np.sin(u))
    assert beyond(bench, plain) < 0.05
    assert refined(bench, base, plain, lambda _: None) is plain


#: How the extra friction fades, over the speed by the Stribeck speed: not the Gaussian of the plain formula.
FADING = {
    "Tustin": lambda x: np.exp(-np.abs(x)),
    "Hess and Soom": lambda x: 1.0 / (1.0 + x * x),
    "Gaussian": lambda x: np.exp(-x * x),
}


def stribeck_named(tmp_path: Any, law: Any) -> tuple[Bench, Fit, Fit]:
    """A rigid drive's log with static friction that fades, the base, and that with the plain effect."""
    record = rigid_record(
        20.0,
        noise=5e-4,
        extra=lambda angle, velocity: 0.02 * law(velocity / 5.0) * np.tanh(velocity / 0.5),
    )
    base = scenario(tmp_path)
    bench = bench_for([record], [], base, None)
    found = refit(bench, state_of(base)).fit
    [plain] = catalogue()["stribeck_friction"].fittings
    added = min(starts("stribeck_friction", plain, (), {}), key=lambda one: abs(one.shapes[0] - 5.0))
    return bench, found, with_effects(bench, found, added)


def test_the_exponent_of_a_fading_static_friction_is_told(tmp_path: Any) -> None:
    bench, base, plain = stribeck_named(tmp_path, FADING["Tustin"])
    found = together(bench, refined(bench, base, plain, lambda _: None))
    own = found.state.added[0].settings()
    assert beyond(bench, plain) > 0.2
    assert beyond(bench, found) < 0.02
    assert own["stribeck_exponent"] == pytest.approx(1.0, rel=0.1)
    assert own["stribeck_velocity_rad_per_s"] == pytest.approx(5.0, rel=0.1)
    assert own["extra_static_nm"] == pytest.approx(0.02, rel=0.1)


def test_a_law_that_is_no_exponential_is_met_more_closely_by_another_exponent(tmp_path: Any) -> None:
    bench, base, plain = stribeck_named(tmp_path, FADING["Hess and Soom"])
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, found) < 0.25 * beyond(bench, plain)
    assert found.state.added[0].settings()["stribeck_exponent"] < 1.7


def test_a_gaussian_stays_one(tmp_path: Any) -> None:
    bench, base, plain = stribeck_named(tmp_path, FADING["Gaussian"])
    assert beyond(bench, plain) < 0.05
    assert refined(bench, base, plain, lambda _: None) is plain
