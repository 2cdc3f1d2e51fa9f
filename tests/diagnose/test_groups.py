"""Names that these data cannot tell from an effect's: as good within the error over blocks of time."""

import contextlib
from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.diagnosis.name import name_effect

#: Whitened power of each block of time before: one of them holds nearly all.
BEFORE = np.array([1000.0, *np.ones(19)])


def left_in_the_first(power):
    return np.array([power, *np.ones(19)])


def effect(name, share=0.5, shapes=()):
    fitting = SimpleNamespace(in_series=False, play=False, shapes=shapes, label="")
    added = SimpleNamespace(effect=name, fitting=fitting, freedom=2, at_limit=False)
    return SimpleNamespace(name=name, share=SimpleNamespace(share=share), added=added)


@pytest.mark.parametrize(("left", "alike"), [(400.0, True), (600.0, False), (850.0, False)])
def test_another_name_explains_at_least_half_of_what_the_best_does(monkeypatch, left, alike):
    """With all in one block two standard errors over blocks are more than all of the difference."""
    best, other = effect("wave_generator_eccentricity"), effect("unbalance")

    def fitted(one):
        return SimpleNamespace(state=SimpleNamespace(added=[one.added]))

    results = [
        (best.name, fitted(best), left_in_the_first(1.0)),
        (other.name, fitted(other), left_in_the_first(left)),
    ]
    difference = results[1][2] - results[0][2]
    assert difference.sum() < 2.0 * np.sqrt(20) * difference.std()
    monkeypatch.setattr("hdsim.diagnosis.name.contest", lambda *_: list(results))
    monkeypatch.setattr("hdsim.diagnosis.name.against_priors", lambda _, found: found)
    monkeypatch.setattr("hdsim.diagnosis.name.beside", lambda *_: False)
    bench = SimpleNamespace(
        coarse=contextlib.nullcontext,
        block_powers=lambda predictions: predictions,
        noise_power=10.0,
    )
    base = SimpleNamespace(predictions=BEFORE, frees=[], theta=[])
    screening = SimpleNamespace(ranked=[best, other], chance=0.005)
    found = name_effect(bench, base, screening, None)
    assert found.name == best.name
    assert list(found.group) == ([other.name] if alike else [])


def test_what_looks_like_the_screens_best_is_fitted_whatever_its_own_trace_explains(monkeypatch):
    """The base explains nearly all of an unbalance's trace, and what is left of it is the simulation's."""
    best, alike = effect("output_eccentricity"), effect("unbalance", -0.0002)
    other, bent = effect("thermal_friction", 0.01), effect("kinematic_error", 0.01, shapes=("phase",))
    asked = []

    def contest(bench, base, shortlist, *_):
        asked.extend(one.name for one in shortlist)
        return []

    monkeypatch.setattr("hdsim.diagnosis.name.contest", contest)
    screening = SimpleNamespace(ranked=[best, other, bent, alike], chance=0.005)
    base = SimpleNamespace(frees=[], theta=[])
    assert name_effect(SimpleNamespace(coarse=contextlib.nullcontext), base, screening, None) is None
    assert asked == [best.name, alike.name]
