"""Means of how many readings a diagnosis looks at is known before a re-fit is carried to its end."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.diagnosis import base as few
from hdsim.errors import InputError
from hdsim.estimate.predict import PredictionError


class Opened:
    """Records by means of so many readings, of which a first look and a re-fit leave that much."""

    def __init__(self, readings, first=0.0, last=0.0):
        self.readings, self.first, self.last = readings, first, last
        self.channels, self.looked = ("motor_torque",), False
        self.predictors, self.training = [SimpleNamespace(record=SimpleNamespace(name="run"))], 1

    def beyond_noise(self, predictions):
        return {"motor_torque": float(predictions[0])}


@pytest.fixture
def fits(monkeypatch):
    """Every re-fit, by the readings that it was of."""
    done: list[int] = []

    def refit(bench, start, begun):
        # What a first look has done is not done again.
        assert begun is None or begun[1].predictions[0] == bench.first
        assert (begun is None) == (bench.readings == 4 or not bench.looked)
        done.append(bench.readings)
        return SimpleNamespace(fit=SimpleNamespace(predictions=[np.array(bench.last)]))

    monkeypatch.setattr(few, "refit", refit)

    def first_look(bench, start):
        bench.looked = True
        return [], SimpleNamespace(predictions=[np.array(bench.first)])

    monkeypatch.setattr(few, "first_look", first_look)
    return done


def allowed(left):
    """One reading where little is left, four where much is."""
    return 4 if left.get("motor_torque", 0.0) > 1.0 else 1


@pytest.mark.parametrize(
    ("first", "last", "last_of_few", "taken", "expected"),
    [
        (9.0, 9.0, 9.0, 4, [4]),  # a first look says it
        (9.0, 0.0, 0.0, 1, [4, 1]),  # it was only far from the end
        (0.0, 0.0, 0.0, 1, [1]),
        (0.0, 9.0, 9.0, 4, [1, 4]),  # only the end says it
    ],
)
def test_a_re_fit_is_carried_to_its_end_on_the_readings_that_are_taken(
    fits, first, last, last_of_few, taken, expected
):
    many, less = Opened(1, first, last), Opened(4, first, last_of_few)
    bench, base, readings = few.on_few_readings(many, None, 1, allowed, {1: many, 4: less}.__getitem__)
    assert readings == bench.readings == taken
    assert base.fit.predictions[0] == (last if taken == 1 else last_of_few)
    assert fits == expected


def test_where_no_more_readings_could_be_taken_nothing_is_looked_at(fits, monkeypatch):
    monkeypatch.setattr(few, "first_look", lambda *_: pytest.fail("a first look"))
    few.on_few_readings(Opened(1), None, 1, lambda _: 1, lambda _: pytest.fail("another bench"))
    assert fits == [1]


def test_a_model_that_cannot_follow_the_motion_is_one_clear_error(monkeypatch):
    def fails(*_, **__):
        raise PredictionError("the run became unstable at 0.2 s")

    monkeypatch.setattr(few, "refit", fails)
    monkeypatch.setattr(few, "first_look", fails)
    with pytest.raises(InputError, match="run: the model cannot follow the measured motion: the run became"):
        few.on_few_readings(Opened(1), None, 1, allowed, Opened)
