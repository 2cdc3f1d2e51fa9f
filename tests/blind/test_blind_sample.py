"""A sample of the blind matrix; ``make blind`` runs the whole and writes docs/blind.md."""

import pytest
from cases import trials
from judging import attempt

#: Short records of several drives, one or more of each kind of answer.
SAMPLE = (
    "null/nothing#4/0",
    "parameter/load-dependent loss/0",
    "clear/output encoder delay/0",
    "clear/unbalance/0",
    "missing/load_side_friction, no motor angle/0",
    "pair/unbalance + input_coulomb_viscous/0",
    "outside/drifting torque/0",
    # A name that fits well and makes held-out data worse.
    "outside/cable/600",
)


@pytest.mark.slow
@pytest.mark.parametrize("key", SAMPLE)
def test_blind(key):
    trial = next(t for t in trials([int(key.rpartition("/")[2])]) if t.key == key)
    result = attempt(trial)
    assert result["right"], result
