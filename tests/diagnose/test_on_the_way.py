"""Fits that are on their way: carried on where they promise more, or from where an earlier search was."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import bent, rigid_record, scenario, with_effects

from hdsim.diagnosis import finer
from hdsim.diagnosis.point import from_where_it_was
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate import refit as refitting
from hdsim.estimate.fit import fit, sharpened
from hdsim.estimate.opening import bench_for
from hdsim.estimate.orders import Line
from hdsim.estimate.refit import as_far_as_promised, refit, with_delays
from hdsim.estimate.state import number_at, state_of
from hdsim.estimate.vector import Vector, sensitivities

RIPPLE, INERTIA = "motor_torque_ripple", "drive.inertia.motor_kg_m2"


def ripple(angle, velocity):
    return 0.02 * np.sin(2.0 * angle + 0.4)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    base = scenario(tmp_path_factory.mktemp("bench"), "rigid")
    bench = bench_for([rigid_record(extra=ripple)], [], base, None)
    return bench, refit(bench, state_of(base)).fit


@pytest.fixture(scope="module")
def with_ripple(fitted):
    """The model with a ripple of order 2, fitted."""
    bench, base = fitted
    line = Line("motor_torque", 2.0, 100.0, 1e-9)
    added, *_ = starts(RIPPLE, catalogue()[RIPPLE].fittings[0], [line], bench.ranges(base.state))
    return with_effects(bench, base, added)


def test_an_effect_is_fitted_on_from_where_it_was_whatever_has_bent_the_base(fitted, with_ripple):
    bench, base = fitted
    gone = bent(bench, base, {INERTIA: 5.0})
    ((name, (found, whole)),) = from_where_it_was(bench, gone, with_ripple).items()
    assert name == RIPPLE
    assert whole
    assert number_at(found.state, INERTIA) == pytest.approx(number_at(with_ripple.state, INERTIA), rel=0.01)
    assert bench.power(found.predictions) == pytest.approx(bench.power(with_ripple.predictions), rel=0.01)
    # Its numbers are the bent base's, moved: what was given is where it was.
    theta = dict(zip([free.name for free in found.frees], found.theta, strict=True))
    assert theta[INERTIA] == pytest.approx(np.log(0.2), abs=0.05)


def test_nothing_is_known_without_an_earlier_effect(fitted):
    bench, base = fitted
    assert from_where_it_was(bench, base, None) == {}
    assert from_where_it_was(bench, base, base) == {}


def test_a_fit_short_of_its_end_is_carried_on_and_one_at_its_end_is_not(fitted, with_ripple, monkeypatch):
    bench, _ = fitted
    (added,) = with_ripple.state.added
    weaker = replace(added, coefficients=tuple(0.2 * np.array(added.coefficients)))
    state = replace(with_ripple.state, added=(weaker,))
    short = replace(with_ripple, state=state, predictions=bench.predict(state))
    calls = []

    def counted(*args, **options):
        calls.append(args)
        return fit(*args, **options)

    monkeypatch.setattr(refitting, "fit", counted)
    found = as_far_as_promised(bench, short)
    assert bench.power(short.predictions) > 2.0 * bench.power(with_ripple.predictions)
    assert bench.power(found.predictions) == pytest.approx(bench.power(with_ripple.predictions), rel=0.01)
    assert len(calls) == 1
    assert as_far_as_promised(bench, with_ripple) is with_ripple
    assert len(calls) == 1


def test_delays_are_fitted_from_the_sensitivities_that_are_there(fitted, with_ripple, monkeypatch):
    bench, _ = fitted
    found, calls = sharpened(bench, with_ripple), []

    def asked(*args, **options):
        calls.append((args, options))
        return fit(*args, **options)

    monkeypatch.setattr(refitting, "fit", asked)
    late = with_delays(bench, found, rough=True)
    (((_, state, frees), options),) = calls
    vector = Vector(state, tuple(frees), 0)
    made = sensitivities(bench, vector, vector.start(), found.predictions)
    known, _ = options["known"]
    assert [free.delay_of for free in frees if free.delay_of] == ["motor_torque"]
    assert known.shape == made.shape
    size = np.linalg.norm(made, axis=0)
    np.testing.assert_allclose(np.linalg.norm(known - made, axis=0) / size, 0.0, atol=0.05)
    assert bench.power(late.predictions) <= bench.power(found.predictions)


class Powers:
    """A bench whose predictions are the power that they leave."""

    noise_power = 1.0

    def power(self, predictions):
        return predictions

    def coarse(self):
        return contextlib.nullcontext()

    def residuals(self, predictions):
        return np.full(400, np.sqrt(predictions / 400.0))

    def stacked(self, residuals):
        return residuals

    def stacked_blocks(self):
        return np.repeat(np.arange(40), 10)

    def sample_power(self, rest):
        return 0.01


def left(power):
    """A fit of which only what it leaves matters."""
    added = SimpleNamespace(effect="kinematic_error", freedom=2)
    return SimpleNamespace(predictions=power, state=SimpleNamespace(added=[added]), frees=[], theta=[])


@pytest.mark.parametrize(("came_to", "taken"), [(2.0, True), (29.0, False)])
def test_a_plain_formula_that_has_come_on_is_kept_where_no_finer_one_is_better(came_to, taken, monkeypatch):
    current, plain = left(30.0), left(came_to)
    monkeypatch.setattr(finer, "_begins", lambda *_: ["begun"])
    monkeypatch.setattr(finer, "_in_finer", lambda *_: [left(came_to)])
    monkeypatch.setattr(finer, "_at_their_ends", lambda *_: [plain])
    monkeypatch.setattr(finer, "sharpened", lambda _, found: found)
    found = finer.refined(Powers(), left(100.0), current, lambda _: None)
    assert found is (plain if taken else current)
