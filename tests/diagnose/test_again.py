"""Names that are asked again beside the others: which of two stays that take each other's place."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.diagnosis.again import again, as_good

FRICTION, OVER_ANGLE, RIPPLE = "input_coulomb_viscous", "position_dependent_friction", "motor_torque_ripple"
#: Blocks of time of a model with neither name, what the newest leaves in them alone, and its uncertainty.
NEITHER, NEWEST = np.full(100, 50.0), np.tile([1.0, 3.0], 50)


def model(*effects, powers=NEWEST):
    added = [SimpleNamespace(effect=effect, freedom=freedom) for effect, freedom in effects]
    return SimpleNamespace(state=SimpleNamespace(added=added), predictions=powers)


@pytest.mark.parametrize(
    ("first", "newest", "alone", "stays"),
    [
        # It leaves 0.3 more a block of the 48 that either explains, by chance: 2 x 0.2.
        ((FRICTION, 2), (OVER_ANGLE, 6), NEWEST + np.tile([2.3, -1.7], 50), True),
        # The same on average, in every block alike: not by chance.
        ((FRICTION, 2), (OVER_ANGLE, 6), NEWEST + 0.3, False),
        # By chance as far as blocks can tell, but more than 2 % of what either explains.
        ((FRICTION, 2), (OVER_ANGLE, 6), NEWEST + np.tile([22.2, -19.8], 50), False),
        # The newest has no more freedom: where it explains all, it has the name.
        ((OVER_ANGLE, 6), (FRICTION, 2), NEWEST, False),
        # Nobody takes the two for one another.
        ((FRICTION, 2), (RIPPLE, 6), NEWEST, False),
    ],
)
def test_the_simpler_of_two_that_explain_each_other_stays(monkeypatch, first, newest, alone, stays):
    current, rest = model(first, newest), model(newest)

    def without(_, whole, k):
        return model(first, powers=alone) if whole is current else model(powers=NEITHER)

    monkeypatch.setattr("hdsim.diagnosis.again.without", without)
    bench = SimpleNamespace(block_powers=lambda powers: powers)
    found = as_good(bench, current, 0, rest)
    assert (found is not None) == stays
    assert found is None or [one.effect for one in found.state.added] == [first[0]]


@pytest.mark.parametrize(("rough", "at_its_end"), [(90.0, 80.0), (90.0, 5.0), (5.0, math.nan)])
def test_a_fit_without_one_name_that_leaves_more_than_no_name_has_failed(monkeypatch, rough, at_its_end):
    """The others alone leave 80 times the noise where no name at all leaves 5: nothing is told by that.

    A rough fit that leaves so much is carried on first.
    """
    asked, failed = [], at_its_end > 5.0

    def without(*_):
        return SimpleNamespace(state=None, predictions=rough)

    def settled(_, found):
        assert found.predictions > 5.0
        return SimpleNamespace(state=None, predictions=at_its_end)

    def left_of(*_):
        asked.append(True)
        raise StopIteration

    monkeypatch.setattr("hdsim.diagnosis.again.without", without)
    monkeypatch.setattr("hdsim.diagnosis.revise.settled", settled)
    monkeypatch.setattr("hdsim.diagnosis.again.left_of", left_of)
    added = [SimpleNamespace(effect=name, at_limit=False) for name in (FRICTION, RIPPLE)]
    current = SimpleNamespace(state=SimpleNamespace(added=added), predictions=1.0)
    names = [SimpleNamespace(name=one.effect) for one in added]
    bench = SimpleNamespace(power=lambda predictions: predictions)
    base = SimpleNamespace(predictions=5.0)
    monkeypatch.setattr("hdsim.diagnosis.again._reads", lambda *_: False)
    if failed:
        assert again(bench, base, current, names, str, every=True) is current
        assert not asked
        assert [one.name for one in names] == [FRICTION, RIPPLE]
    else:
        with pytest.raises(StopIteration):
            again(bench, base, current, names, str, every=True)


def test_the_only_name_left_is_asked_over_the_base_where_the_fit_without_it_has_failed(monkeypatch):
    class AskedError(Exception):
        pass

    base, sharp = SimpleNamespace(predictions=5.0), SimpleNamespace(predictions=5.0)

    def left_of(_, rest):
        assert rest is sharp
        raise AskedError

    monkeypatch.setattr("hdsim.diagnosis.again.without", lambda *_: SimpleNamespace(predictions=90.0))
    monkeypatch.setattr("hdsim.diagnosis.again.sharpened", lambda _, found: sharp if found is base else None)
    monkeypatch.setattr("hdsim.diagnosis.again.left_of", left_of)
    monkeypatch.setattr("hdsim.diagnosis.again._reads", lambda *_: False)
    added = [SimpleNamespace(effect=RIPPLE, at_limit=False)]
    current = SimpleNamespace(state=SimpleNamespace(added=added), predictions=1.0)
    bench = SimpleNamespace(power=lambda predictions: predictions)
    with pytest.raises(AskedError):
        again(bench, base, current, [SimpleNamespace(name=RIPPLE)], str, every=True)
