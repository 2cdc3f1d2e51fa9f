"""Where candidates begin: what they share with the model's own numbers and with the effects before them."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.candidate_fits import Point, linear_fit
from hdsim.diagnosis.contest import _look_alikes, contest
from hdsim.diagnosis.traces import screen
from hdsim.estimate.fit import sharpened
from hdsim.estimate.opening import bench_for
from hdsim.estimate.orders import lines_of
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import state_of

RATIO, WEIGHT = 100.0, 30.0
DUHEM, MAXWELL = "torsional_hysteresis_duhem", "torsional_hysteresis_maxwell"
#: A weight that the base's own arm (along the sine) can make up for in part only, N m at 60 degrees to it.
HIDDEN, AHEAD = 8.0, math.radians(60.0)


def arms(angle, velocity):
    """Torque on the motor of the arm that the base has, of the weight beside it, of a ripple."""
    own = WEIGHT * np.sin(angle / RATIO) + HIDDEN * np.sin(angle / RATIO + AHEAD)
    return own / RATIO + 0.03 * np.sin(6 * angle + 0.4)


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    base = scenario(tmp_path_factory.mktemp("contest"))
    gravity = type(base.load).model_validate(
        {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": WEIGHT / 9.80665 / 0.4, "centre_of_mass_m": 0.4}}
    )
    base = base.model_copy(update={"load": gravity})
    bench = bench_for([rigid_record(extra=arms)], [], base, None)
    return bench, refit(bench, state_of(base)).fit


def candidate(bench, fit, name):
    left, residuals = left_of(bench, fit), bench.residuals(fit.predictions)
    screening = screen(bench, fit.state, left, lines_of(bench, residuals, fit.state.delays))
    return left, next(one for one in screening.ranked if one.name == name)


def test_what_numbers_of_the_base_can_say_is_held_by_what_was_believed_of_them(opened):
    bench, base = opened
    _, one = candidate(bench, base, "unbalance")
    rest = bench.stacked(bench.residuals(base.predictions))
    point = Point(np.zeros(len(base.frees)), base.state, base.predictions, base.columns, rest)
    # Mass and weight are three numbers for two directions; a trace is as exact as its simulation.
    rng = np.random.default_rng(1)
    size = np.sqrt(np.mean(one.columns**2))
    columns = one.columns + 1e-3 * size * rng.standard_normal(one.columns.shape)
    moves, coefficients = linear_fit(base, point, one.added, columns, float(np.mean(rest**2)))
    mass = [free.name for free in base.frees].index("load.gravity.mass_kg")
    theta = base.theta[mass] + moves[mass]
    assert abs(theta) < 0.3
    found = replace(one.added, coefficients=tuple(coefficients)).settings()
    beside = 9.80665 * found["output_kg_m"] * np.exp(1j * math.radians(found["output_phase_deg"] + 90.0))
    # The output turns against the motor.
    whole = WEIGHT * math.exp(theta) + np.conj(beside)
    assert abs(whole - (WEIGHT + HIDDEN * np.exp(1j * AHEAD))) < 0.03 * WEIGHT


@pytest.mark.slow
def test_effects_that_are_there_move_along(opened):
    bench, base = opened
    _, ripple = candidate(bench, base, "motor_torque_ripple")
    # One that took too much: the next candidate shows only where it gives that back.
    wrong = replace(ripple.added, coefficients=tuple(1.5 * c for c in ripple.added.coefficients))
    stuck = replace(base, state=replace(base.state, added=(wrong,)))
    stuck.predictions = bench.predict(stuck.state)
    stuck = sharpened(bench, stuck)
    left, one = candidate(bench, stuck, "unbalance")
    ((_, found, _),) = contest(bench, stuck, [one], left, None)
    best = together(bench, found)
    assert bench.power(found.predictions) < 1.05 * bench.power(best.predictions)


@pytest.mark.parametrize(
    ("left", "in_full", "share", "rivals"),
    [
        (2.4, True, 0.93, [MAXWELL]),  # its trace explains more, and its own fit has not come as far
        (2.4, True, 0.91, []),
        (2.4, False, 0.93, []),  # where the best led is not known well
        (1.04, True, 0.93, []),  # the best has reached the noise
    ],
)
def test_what_the_screen_ranks_above_the_best_is_fitted_from_where_that_led(
    monkeypatch, left, in_full, share, rivals
):
    asked = []
    monkeypatch.setattr(
        "hdsim.diagnosis.contest._from_elsewhere",
        lambda _bench, _base, _theta, _where, those, *_: asked.extend(one.name for one in those),
    )
    linear = SimpleNamespace(fitting=SimpleNamespace(in_series=False))
    on_screen = {MAXWELL: share, "stribeck_friction": 0.99}  # the latter looks like neither
    shortlist = [
        SimpleNamespace(name=name, share=SimpleNamespace(share=part), added=linear)
        for name, part in on_screen.items()
    ]
    best = {DUHEM: (left, SimpleNamespace(theta=np.zeros(0))), MAXWELL: (8.0, None)}
    full = [DUHEM] if in_full else []
    shares = on_screen | {DUHEM: 0.92}
    bench, base = SimpleNamespace(noise_power=1.0), SimpleNamespace(frees=[])
    _look_alikes(bench, base, shortlist, best, full, shares, None, None)
    assert asked == rivals


def test_what_was_fitted_before_is_fitted_from_where_another_leads(opened, monkeypatch):
    """Seen without: Maxwell slip for Duhem's law, which had been fitted while a rest counted."""
    bench, base = opened
    asked = []
    monkeypatch.setattr(
        "hdsim.diagnosis.contest._from_elsewhere",
        lambda _bench, _base, _theta, where, those, *_: asked.extend((one.name, where) for one in those),
    )
    linear = SimpleNamespace(fitting=SimpleNamespace(in_series=False), coefficients=(0.0,))
    shortlist = [
        SimpleNamespace(name=name, share=SimpleNamespace(share=0.9), added=linear, columns=None, others=())
        for name in (DUHEM, MAXWELL)
    ]
    behind = replace(base, predictions=[2.0 * each for each in base.predictions])
    monkeypatch.setattr("hdsim.diagnosis.contest.designs", lambda *_: [np.zeros((1, 1))])
    monkeypatch.setattr("hdsim.diagnosis.contest.rough_fits", lambda *_: [base])
    monkeypatch.setattr("hdsim.diagnosis.contest.full_fits", lambda *_: [base])
    monkeypatch.setattr("hdsim.diagnosis.contest.fits_at_next_minima", lambda *_: [])
    known = {DUHEM: (behind, True)}
    left = left_of(bench, base)
    residual = SimpleNamespace(values=left.values, project=lambda _: left.values[:, None])
    contest(bench, base, shortlist, residual, None, known)
    assert asked == [(DUHEM, f"where {MAXWELL} led")]
    contest(bench, base, shortlist, residual, None, known)  # over the same base once more: it has been
    assert len(asked) == 1
