"""A sample of the blind matrix; ``make blind`` runs the whole and writes docs/blind.md."""

import pytest
from cases import trials
from judging import attempt

SAMPLE = ("null/nothing#1/0",)


@pytest.mark.slow
@pytest.mark.parametrize("key", SAMPLE)
def test_blind(key):
    trial = next(t for t in trials([int(key.rpartition("/")[2])]) if t.key == key)
    result = attempt(trial)
    assert result["right"], result
