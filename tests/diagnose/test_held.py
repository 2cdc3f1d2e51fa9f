"""Whether a search goes on with a further name: what held-out data say of it at once."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario, with_effects

from hdsim.diagnosis.held import hopeless
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of

RIPPLE, FADING = "motor_torque_ripple", "stribeck_friction"


def ripple(angle, velocity):
    return 0.02 * np.sin(2.0 * angle + 0.4)


def fading(angle, velocity):
    return ripple(angle, velocity) + 0.02 * np.exp(-((velocity / 6.0) ** 2)) * np.tanh(velocity / 0.5)


@pytest.mark.parametrize(("held_out", "is_hopeless"), [(fading, False), (ripple, True)])
def test_a_name_is_given_up_where_held_out_data_know_nothing_of_it(tmp_path, held_out, is_hopeless):
    base = scenario(tmp_path)
    learnt, held = rigid_record(12.0, extra=fading), rigid_record(12.0, extra=held_out, seed=5)
    bench = bench_for([learnt], [held], base)
    found = refit(bench, state_of(base)).fit
    line = SimpleNamespace(channel="motor_torque", order=2.0)
    ranges = bench.ranges(found.state)
    (first, *_) = starts(RIPPLE, catalogue()[RIPPLE].fittings[0], [line], ranges)
    ways = starts(FADING, catalogue()[FADING].fittings[0], (), ranges)
    both = with_effects(bench, found, first, ways[len(ways) // 2])
    newest = SimpleNamespace(name=FADING, chance=0.005, confidence=1.0, gain=0.5, of_lines=0.0)
    assert hopeless(bench, both, newest) == is_hopeless
