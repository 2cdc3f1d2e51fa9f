"""A kinematic error that has its name, seen by the motor alone, with multiples of its orders.

An encoder of the output shows them in its order spectrum. Without one the motor's torque has them only
through the load's inertia: of a rigid drive by Newton's law, T = J_m w' + J_l (1/i + e') d/dt((1/i + e') w).
"""

from typing import Any

import numpy as np
import pytest
from diagnose_bench import beyond, motion, scenario, with_effects

from hdsim.diagnosis.finer import _begins, refined
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import state_of

ARCMIN = np.radians(1 / 60)
RATIO, MOTOR_KG_M2, LOAD_KG_M2 = -100.0, 6.93e-5, 0.50002
#: Orders per turn of the wave generator, amplitudes in arcmin and phases of what is hidden.
THREE = ((2.0, 0.5, 0.3), (4.0, 0.2, 2.0))
MORE = (*THREE, (6.0, 0.15, 1.1))


def record(components: tuple[tuple[float, float, float], ...], noise: float = 5e-4) -> Record:
    """The motor's log of a rigid drive with a kinematic error."""
    t, angle, velocity, acceleration = motion(20.0)
    gear, bend = np.full(len(t), 1.0 / RATIO), np.zeros(len(t))
    for order, size, phase in components:
        gear += size * ARCMIN * order * np.cos(order * angle + phase)
        bend -= size * ARCMIN * order**2 * np.sin(order * angle + phase)
    torque = MOTOR_KG_M2 * acceleration + LOAD_KG_M2 * gear * (gear * acceleration + bend * velocity**2)
    torque += 0.03 * np.tanh(velocity / 0.5) + 3.5e-4 * velocity
    torque += noise * np.random.default_rng(0).standard_normal(len(t))
    return Record("bench", t, {"motor_angle": angle, "motor_torque": torque})


def named(tmp_path: Any, components: tuple[tuple[float, float, float], ...]) -> tuple[Bench, Fit, Fit]:
    """The log's bench, the base re-fitted, and that with the plain effect."""
    base = scenario(tmp_path)
    bench = bench_for([record(components)], [], base, None)
    found = refit(bench, state_of(base)).fit
    plain, *_ = starts("kinematic_error", catalogue()["kinematic_error"].fittings[0], (), {})
    return bench, found, with_effects(bench, found, plain)


def test_a_multiple_of_an_order_is_found_without_an_encoder_of_the_output(tmp_path: Any) -> None:
    bench, base, plain = named(tmp_path, MORE)
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, plain) > 1.0
    assert beyond(bench, found) < 0.05
    sixth = found.state.added[0].settings()["components"][3]
    assert sixth["order"] == 6
    assert sixth["amplitude_arcmin"] == pytest.approx(0.15, rel=0.05)
    assert np.radians(sixth["phase_deg"]) == pytest.approx(1.1, abs=0.05)


def test_an_error_of_the_plain_orders_stays_one(tmp_path: Any) -> None:
    bench, base, plain = named(tmp_path, THREE)
    assert beyond(bench, plain) < 0.05
    assert refined(bench, base, plain, lambda _: None) is plain


def test_where_the_output_has_an_encoder_its_spectrum_tells_the_orders(tmp_path: Any) -> None:
    _, _, plain = named(tmp_path, THREE)
    for seen in (False, True):
        one = record(THREE)
        if seen:
            one.channels["output_angle"] = one.channels["motor_angle"] / RATIO
            one.trusted["output_angle"] = np.ones(len(one.time), dtype=bool)
        bench = bench_for([one], [], scenario(tmp_path), None)
        assert bool(list(_begins(bench, plain, plain.state.added[0]))) is not seen
