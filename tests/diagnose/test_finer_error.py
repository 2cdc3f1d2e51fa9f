"""A kinematic error that has its name, with multiples of its orders and with lobes of the output.

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
from hdsim.estimate.orders import Line
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


def test_lobes_of_the_output_are_asked_of_records_that_have_its_encoder(tmp_path: Any) -> None:
    _, _, plain = named(tmp_path, THREE)
    for seen in (False, True):
        one = record(THREE)
        if seen:
            one.channels["output_angle"] = one.channels["motor_angle"] / RATIO
            one.trusted["output_angle"] = np.ones(len(one.time), dtype=bool)
        bench = bench_for([one], [], scenario(tmp_path), None)
        begun = [each.settings()["components"] for each in _begins(bench, plain, plain.state.added[0])]
        assert begun
        assert any(c["per"] == "output_turn" for components in begun for c in components) is seen


#: What both encoders of a plant show: orders of the wave generator's turn, one that no formula fixes, and
#: three lobes of the output.
FURTHER = (*THREE, (6.0, 0.1, 1.1))
LOBES_ARCMIN, LOBES_RAD = 0.12, 0.9


def both_encoders(lobes: int) -> Record:
    """Both angles of a rigid drive whose kinematic error has an order of the output's turn too."""
    t, angle, _, _ = motion(20.0)
    # More than a turn of the output: its orders are told apart.
    angle = 6.0 * angle
    output = angle / RATIO
    error = sum(size * ARCMIN * np.sin(order * angle + phase) for order, size, phase in FURTHER)
    error = error + LOBES_ARCMIN * ARCMIN * np.sin(lobes * output + LOBES_RAD)
    read = output + error + 1e-6 * np.random.default_rng(0).standard_normal(len(t))
    return Record("bench", t, {"motor_angle": angle, "output_angle": read})


def named_by_both(tmp_path: Any, lobes: int, *, seen: bool = True) -> tuple[Bench, Fit, Fit]:
    """The log's bench, the base re-fitted, and that with the plain effect and the order, if seen."""
    base = scenario(tmp_path)
    bench = bench_for([both_encoders(lobes)], [], base, None)
    found = refit(bench, state_of(base)).fit
    lines = [Line("output_angle", 6.0, 1.0, 1.0)] if seen else []
    plain, *_ = starts("kinematic_error", catalogue()["kinematic_error"].fittings[0], lines, {})
    assert plain.orders == ((6.0,) if seen else ())
    return bench, found, with_effects(bench, found, plain)


@pytest.mark.parametrize("seen", [True, False])
def test_lobes_of_the_output_are_found_beside_multiples_of_the_orders(tmp_path: Any, seen: bool) -> None:
    bench, base, plain = named_by_both(tmp_path, 3, seen=seen)
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, plain) > 1.0
    assert beyond(bench, found) < 0.05
    told = {(c["order"], c["per"]): c for c in found.state.added[0].settings()["components"]}
    lobes, sixth = told[3, "output_turn"], told[6, "wave_generator_turn"]
    assert lobes["amplitude_arcmin"] == pytest.approx(LOBES_ARCMIN, rel=0.02)
    assert np.radians(lobes["phase_deg"]) == pytest.approx(LOBES_RAD, abs=0.02)
    assert sixth["amplitude_arcmin"] == pytest.approx(0.1, rel=0.02)


def test_once_a_turn_of_the_output_is_left_to_what_is_eccentric(tmp_path: Any) -> None:
    bench, base, plain = named_by_both(tmp_path, 1)
    left = beyond(bench, plain)
    assert left > 1.0
    assert beyond(bench, refined(bench, base, plain, lambda _: None)) > 0.5 * left


def test_a_finer_formula_begins_with_what_the_plain_one_has_wherever_it_stands(tmp_path: Any) -> None:
    bench, _, plain = named_by_both(tmp_path, 3)
    begun = list(_begins(bench, plain, plain.state.added[0]))[-1]
    own = {(c["order"], c["per"]): c for c in plain.state.added[0].settings()["components"]}
    further = {(c["order"], c["per"]): c for c in begun.settings()["components"]}
    for key, component in own.items():
        assert further.pop(key)["amplitude_arcmin"] == pytest.approx(component["amplitude_arcmin"])
    assert {c["amplitude_arcmin"] for c in further.values()} == {0.0}
    assert set(further) == {(4, "relative_turn"), (2, "output_turn"), (3, "output_turn")}
