"""What a search keeps of what it has found when samples count no more."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

from hdsim.diagnosis import anew
from hdsim.diagnosis import search as searching
from hdsim.diagnosis.anew import begun_anew, gone_on_with
from hdsim.diagnosis.passes import Search, Stage
from hdsim.diagnosis.traces import Screening
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.series import Counted
from hdsim.estimate.state import state_of

#: A name of an effect, of which nothing else is asked here.
NAME = SimpleNamespace(name="motor_torque_ripple", alternatives={})


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A model that explains its record to the noise."""
    base = scenario(tmp_path_factory.mktemp("bench"), "rigid")
    bench = bench_for([rigid_record()], [], base, None)
    return bench, refit(bench, state_of(base)).fit


def a_search(bench, found) -> Search:
    seen = Screening(chance=0.01, skipped={"churning": "the model has it"}, seen={("a", "b", ()): None})
    stage = Stage("refit", SimpleNamespace(), 1.0, screening=seen, over_given=[])
    return Search(found, SimpleNamespace(), [stage, Stage("with a", SimpleNamespace(), 1.0)], [NAME])


def test_a_model_that_explains_what_is_left_is_kept_with_its_names(fitted):
    bench, found = fitted
    search = begun_anew(bench, a_search(bench, found), (found, []), (found, [NAME]))
    assert search.anew
    assert search.kept
    assert search.named == [NAME]
    assert bench.power(search.fit.predictions) < 1.05 * bench.noise_power


def test_of_two_the_one_with_fewer_names_is_kept_where_it_does(fitted):
    bench, found = fitted
    search = begun_anew(bench, a_search(bench, found), (found, [NAME]), (found, [NAME, NAME]))
    assert search.named == [NAME]


def test_a_model_that_leaves_more_than_the_noise_is_not(fitted, monkeypatch):
    bench, found = fitted
    monkeypatch.setattr(bench, "power", lambda _: 2.1 * bench.noise_power)
    search = begun_anew(bench, a_search(bench, found), (found, [NAME]))
    assert search.anew
    assert not search.kept
    assert search.fit is found


def test_nor_one_that_bends_the_base(fitted, monkeypatch):
    bench, found = fitted
    monkeypatch.setattr(anew, "strain", lambda _: 1.1 * anew.AT_STAKE)
    assert not begun_anew(bench, a_search(bench, found), (found, [NAME])).kept


def test_one_that_comes_near_the_noise_once_a_load_may_swing_is(fitted, monkeypatch):
    bench, found = fitted
    other = replace(found)
    monkeypatch.setattr(anew, "let_swing", lambda *_: other)
    monkeypatch.setattr(anew, "_near", lambda _, on: on is other)
    search = begun_anew(bench, a_search(bench, found), (found, [NAME]))
    assert search.kept
    assert search.fit is other


@pytest.mark.parametrize(("factor", "behind"), [(1.0, 1.0), (3.0, 1.0), (1.0, 4.0)])
def test_a_name_is_kept_where_no_law_that_was_tried_in_its_place_does_as_well(
    fitted, monkeypatch, factor, behind
):
    """Nor is one asked again that was far behind."""
    bench, found = fitted
    other = replace(found, predictions=[s.measured - behind * (s.measured - p) for s, p in zip(
        bench.series, found.predictions, strict=True
    )])  # fmt: skip
    name = SimpleNamespace(name=NAME.name, alternatives={"another": other}, fit=found)
    monkeypatch.setattr(anew, "together", lambda bench, fit, **_: fit)
    monkeypatch.setattr(anew, "sharpened", lambda bench, fit: fit)
    monkeypatch.setattr(anew, "as_far_as_promised", lambda bench, fit: fit)
    monkeypatch.setattr(anew, "unlikelihood", lambda _, fit, __: 5.0 * factor if fit is other else 0.0)
    search = begun_anew(bench, a_search(bench, found), (found, [name]))
    assert search.kept is (5.0 * factor >= anew.AT_STAKE or behind**2 > anew.FAR_LEFT_IN)


def test_a_search_goes_on_with_what_was_kept_and_without_what_was_seen_beside_the_others(fitted):
    bench, found = fitted
    kept, counted = a_search(bench, found), Counted(bench.series)
    for series in bench.series:
        series.train = series.train & (np.arange(len(series.train)) > 200)
    search = gone_on_with(bench, kept)
    assert search.fit.columns.shape[0] == sum(int(series.train.sum()) for series in bench.series)
    assert search.fit.columns.shape[0] < found.columns.shape[0]
    first, second = search.stages
    assert (first.screening.chance, first.screening.skipped) == (0.01, {"churning": "the model has it"})
    assert first.screening.seen == {}
    assert first.over_given is None
    assert second.screening is None
    counted.put_back()


def test_what_was_kept_is_not_sought_again(fitted, monkeypatch):
    bench, found = fitted
    kept = begun_anew(bench, a_search(bench, found), (found, [NAME]))
    monkeypatch.setattr(searching, "heard", lambda *_: False)
    monkeypatch.setattr(searching, "_next", lambda *_: None)
    monkeypatch.setattr(searching, "with_delays", lambda *_, **__: None)
    monkeypatch.setattr(searching, "_settled", lambda bench, base, search, during: search)
    search = searching.search(bench, found, lambda *_: lambda _: None, earlier=kept)
    assert search.named == [NAME]
    assert not search.anew
    # Once: names that are needless after all would be kept for ever.
    assert searching.search(bench, found, lambda *_: lambda _: None, earlier=kept).named == []


def test_a_beginning_is_asked_before_a_finer_formula_and_a_rest_after_it(fitted, monkeypatch):
    """No formula explains a swing of the load; a finer law may explain what looks like a rest."""
    bench, found = fitted
    named, finer, calls = SimpleNamespace(name=NAME.name), replace(found), []

    def heard(bench, before, now, *, beginnings=True, rests=True):
        calls.append((now is finer, beginnings, rests))
        return False

    def finished(*_):
        calls.append("finer")
        return formula

    monkeypatch.setattr(searching, "_one_more", lambda *_: named)
    monkeypatch.setattr(searching, "_near_its_end", lambda *_: found)
    monkeypatch.setattr(searching, "_finished", finished)
    monkeypatch.setattr(searching, "heard", heard)
    monkeypatch.setattr(searching, "is_all", lambda *_: False)
    monkeypatch.setattr(searching, "nothing_but_flanks", lambda *_: False)
    for formula, again in ((finer, True), (found, False)):
        calls.clear()
        search = Search(found, searching.left_of(bench, found))
        assert searching._next(bench, found, search, lambda *_: lambda _: None) is formula
        assert search.asked is formula
        assert calls == [(False, True, False), "finer", (formula is finer, again, True)]
