import math
from dataclasses import replace
from typing import Annotated

import numpy as np
import pytest
from pydantic import Field

import hdsim
import hdsim.parts
from hdsim import number
from hdsim.effects import catalogue
from hdsim.effects._fitting import Amplitude, Fitting, Harmonic, Inverse, Periodic, Shape
from hdsim.effects._sizes import SIZE_20_100, sized_defaults
from hdsim.estimate.found import ParameterEstimate
from hdsim.estimate.numbers import Free, base_freedoms, scaled, undeclared
from hdsim.estimate.state import Added, number_at, state_of
from hdsim.estimate.vector import Vector
from hdsim.number import FIXED, Number
from hdsim.scenario.fields import split_unit
from hdsim.tell.tables import numbers_table
from hdsim.testing.alone import Alone

BASE = """
name: base
drive:
  rated_torque_nm: 52
  torsion: {stiffness_k1_nm_per_rad: 1.6e4, stiffness_k2_nm_per_rad: 2.5e4, stiffness_k3_nm_per_rad: 2.9e4,
            torque_t1_nm: 7, torque_t2_nm: 25, damping_nm_s_per_rad: 8.0}
  friction: {coulomb_nm: 0.03, viscous_nm_s_per_rad: 3.5e-4}
  mesh: {model: MESH}
EFFECTS
command:
  motor: {type: free}
load: {inertia_kg_m2: 0.5, gravity: {mass_kg: 4, centre_of_mass_m: 0.3}}
run: {duration_s: 1.0}
"""

#: Units by the last part of a fitted field's path, by hand from what its docstring says.
UNITS = {
    "amplitude_arcmin": "arcmin",
    "amplitude_arcsec": "arcsec",
    "amplitude_nm": "N m",
    "back_driving_coefficient": "",
    "backlash_arcmin": "arcmin",
    "ball_to_pitch_diameter": "",
    "coefficient": "",
    "coefficient_per_nm": "1/(N m)",
    "cogging_nm": "N m",
    "coulomb_nm": "N m",
    "cubic_nm_per_rad3": "N m/rad³",
    "delay_s": "s",
    "drag_nm": "N m",
    "eccentricity_arcmin": "arcmin",
    "eccentricity_phase_deg": "deg",
    "eccentricity_um": "µm",
    "exponent": "",
    "share_exponent": "",
    "extra_static_nm": "N m",
    "friction_nm": "N m",
    "gap_spread": "",
    "film_share": "",
    "heat_capacity_j_per_k": "J/K",
    "growth": "",
    "interference_arcmin": "arcmin",
    "load_exponent": "",
    "motor_kg_m": "kg m",
    "motor_phase_deg": "deg",
    "natural_frequency_hz": "Hz",
    "order": "",
    "output_kg_m": "kg m",
    "output_phase_deg": "deg",
    "phase_deg": "deg",
    "position_deg": "deg",
    "relative_amplitude": "",
    "saturation_torque_nm": "N m",
    "saturation_twist_mrad": "mrad",
    "shift_um": "µm",
    "uptake_torque_nm": "N m",
    "slip_torque_nm": "N m",
    "slip_twist_scale": "",
    "static_nm": "N m",
    "stiffness_coefficient_per_k": "1/K",
    "stiffness_nm_per_rad": "N m/rad",
    "speed_exponent": "",
    "stribeck_exponent": "",
    "stribeck_velocity_rad_per_s": "rad/s",
    "tooth": "",
    "viscosity_coefficient_per_k": "1/K",
    "viscous_nm_s_per_rad": "N m s/rad",
    "width_deg": "deg",
}


def state(tmp_path, effects: str = "", mesh: str = "lumped"):
    path = tmp_path / "base.yaml"
    path.write_text(BASE.replace("MESH", mesh).replace("EFFECTS", effects), encoding="utf-8")
    return state_of(hdsim.load_scenario(path))


def at_unit(name: str, fitting: Fitting, orders=(2.0, 12.0)) -> Added:
    shapes = tuple(shape.starts[0] for shape in fitting.shapes)
    return Added(name, fitting, (1.0,) * fitting.count(orders), shapes, orders)


ALL = [(name, fitting) for name, kind in catalogue().items() for fitting in (*kind.fittings, *kind.finer)]


@pytest.mark.parametrize(("name", "fitting"), ALL, ids=[f"{n} {f.label}".strip() for n, f in ALL])
def test_every_fitted_field_is_told_in_its_unit(name, fitting):
    added = at_unit(name, fitting)
    p, s = len(added.coefficients), len(added.shapes)
    told = fitting.report(added.coefficients, np.eye(p), added.shapes, np.ones(s), added.orders)
    assert told
    for path, one in told.items():
        last = path.rpartition(".")[2]
        assert last in UNITS, f"add the unit of {name}.{path} to this test, from its docstring"
        row = numbers_table({path: ParameterEstimate(value=one.value)}).replace("μ", "µ")
        assert f"<td class='u'>{UNITS[last]}</td>" in row, path
        assert math.isnan(one.low) or one.low <= one.value <= one.high


@pytest.mark.parametrize(("name", "fitting"), ALL, ids=[f"{n} {f.label}".strip() for n, f in ALL])
def test_what_a_fit_writes_is_the_same_effect_on_a_drive_of_another_size(name, fitting):
    """A scenario fills what is left open with what fits its drive; a fit has it as it is."""
    kind, written = catalogue()[name], at_unit(name, fitting).settings()
    larger = replace(SIZE_20_100, rated_torque_nm=216.0, ratio=-80.0, stiffness_k1_nm_per_rad=7e4)
    filled = sized_defaults(kind, written, larger)
    fitted, read = Alone(kind(**written)), Alone(kind(**written | filled))
    rng = np.random.default_rng(0)
    for _ in range(5):
        inputs = fitted.initial + rng.standard_normal(len(fitted.initial))
        assert np.array_equal(fitted(inputs)[0], read(inputs)[0], equal_nan=True)


def test_numbers_are_found_at_their_fields_with_unit_and_bounds(tmp_path):
    frees = {f.name: f for f in base_freedoms(state(tmp_path), ["motor_torque", "output_angle"])}
    assert {name: free.unit for name, free in frees.items()} == {
        "drive.torsion.stiffness_k1_nm_per_rad": "N m/rad",
        "drive.torsion.torque_t1_nm": "N m",
        "drive.torsion.damping_nm_s_per_rad": "N m s/rad",
        "drive.inertia.motor_kg_m2": "kg m^2",
        "drive.friction.coulomb_nm": "N m",
        "drive.friction.viscous_nm_s_per_rad": "N m s/rad",
        "load.inertia_kg_m2": "kg m^2",
        "load.gravity.mass_kg": "kg",
        "motor_torque_gain": "",
    }
    stiffness = frees["drive.torsion.stiffness_k1_nm_per_rad"]
    assert stiffness.compliance
    assert len(stiffness.paths) == 3
    assert [name for name, free in frees.items() if free.reading] == ["motor_torque_gain"]
    rigid = {f.name for f in base_freedoms(state(tmp_path, mesh="rigid"), ["motor_torque"])}
    assert not any("torsion" in name for name in rigid)


def test_the_first_stiffness_can_move_alone(tmp_path):
    base, k1 = state(tmp_path), "drive.torsion.stiffness_k1_nm_per_rad"
    frees = {f.name: f for f in base_freedoms(base, ["motor_torque"], apart=[k1])}
    assert frees[k1].paths == (k1,)
    others = frees["drive.torsion.stiffness_k2_nm_per_rad"]
    assert [path.rpartition(".")[2][:12] for path in others.paths] == ["stiffness_k2", "stiffness_k3"]
    moved = scaled(base, [frees[k1]], [math.log(2.0)])
    assert number_at(moved, k1) == pytest.approx(3.2e4)
    assert number_at(moved, others.name) == 2.5e4


def test_a_fit_leaves_what_is_fixed_and_keeps_within_the_fields_bounds(tmp_path):
    effects = """effects:
  thermal_friction: {viscosity_coefficient_per_k: 0.1}
  unbalance: {output_kg_m: 0.1, output_phase_deg: 30}"""
    base = state(tmp_path, effects)
    frees = {f.name: f for f in base_freedoms(base, ["motor_torque"]) if f.name.startswith("effects")}
    assert set(frees) == {
        "effects.thermal_friction.heat_capacity_j_per_k",
        "effects.thermal_friction.thermal_resistance_k_per_w",
        "effects.thermal_friction.viscosity_coefficient_per_k",
        "effects.thermal_friction.coulomb_coefficient_per_k",
        "effects.unbalance.output_kg_m",
    }
    bounded = frees["effects.thermal_friction.viscosity_coefficient_per_k"]
    assert bounded.bounds[1] == pytest.approx(math.log(2.0))  # its field ends at 0.2
    assert frees["effects.thermal_friction.heat_capacity_j_per_k"].bounds == (-3.0, 3.0)
    told = undeclared(base, "load.gravity.centre_of_mass_m", 0.5)
    assert told.unit == "m"
    assert told.value == 0.3
    assert undeclared(base, "load.gravity.nothing", 0.5) is None


def test_a_stiffness_of_an_effect_is_a_compliance_where_it_is_fitted_as_one(tmp_path):
    effects = "effects: {base_flexibility: {}, lugre_friction: {}}"
    found = base_freedoms(state(tmp_path, effects), ["motor_torque"])
    frees = {f.name: f.compliance for f in found}
    assert frees["effects.base_flexibility.stiffness_nm_per_rad"]
    assert not frees["effects.lugre_friction.stiffness_nm_per_rad"]


def test_a_damaged_tooth_as_wide_as_its_field_allows_stands_at_its_limit():
    fitting = next(f for f in catalogue()["damaged_tooth"].fittings if not f.label)
    for width, at_limit in ((12.0, False), (59.8, True)):
        added = Added("damaged_tooth", fitting, (0.5,), (45.0, width))
        assert added.at_limit is at_limit
    # Nor does a fit leave what the field allows.
    base = replace(_empty(), added=(Added("damaged_tooth", fitting, (0.5,), (45.0, 40.0)),))
    vector = Vector(base, (), 0)
    _, upper = vector.bounds()
    most = vector.state(np.array([0.5, 1.5, upper[2]])).added[0]
    assert most.at_limit
    catalogue()["damaged_tooth"](**most.settings())


def test_a_number_outside_of_its_range_stands_at_its_limit():
    shape = Shape("x", (2.0, 5.0))
    ranges = {"x": (1.0, 10.0)}
    assert [shape.at_end(v, ranges.__getitem__) for v in (0.9, 5.0, 9.9)] == [True, False, True]
    # The weak end of a strength means only that there is little of it.
    amplitude = Amplitude({"x": 2.0})
    assert [amplitude.at_end([c], ranges.__getitem__) for c in (0.01, 2.0, 4.95)] == [False, False, True]
    assert Inverse("x", 20.0).at_end([20.0], ranges.__getitem__)
    assert not Inverse("x", 20.0).at_end([1.0], ranges.__getitem__)
    assert Harmonic("x", "phase", 1.0).at_end([8.0, 7.0], ranges.__getitem__)


def test_a_position_of_zero_is_a_number_like_any_other():
    fitting = next(f for f in catalogue()["damaged_tooth"].fittings if not f.label)
    base = replace(_empty(), added=(Added("damaged_tooth", fitting, (0.5,), (0.0, 12.0)),))
    vector = Vector(base, (), 0)
    x = vector.start()
    assert x[1] == 0.0
    x[1] -= 0.5  # half of the distance of two starts, 30 degrees
    assert vector.state(x).added[0].shapes[0] == pytest.approx(-15.0)
    lower, upper = vector.bounds()
    assert lower[1] < -1.0
    assert upper[1] > 1.0
    told = fitting.report((0.5,), np.eye(1), (0.0, 12.0), (0.1, 0.1), ())
    assert told["position_deg"] == (0.0, -6.0, 6.0)


def test_a_term_rescaled_says_the_same_with_other_coefficients():
    for term, c in (
        (Amplitude({"a": 2.0, "b": 3.0}), [1.5]),
        (Inverse("k", 100.0), [0.5]),
        (Harmonic("a", "p", 0.1), [1.0, -2.0]),
        (Periodic("items", "a", 0.1, "motor_torque"), [1.0, -2.0, 0.3, 0.4]),
    ):
        one, other = {}, {}
        term.write(one, c, (2.0, 4.0), {})
        term.rescaled(5.0).write(other, [v / 5.0 for v in c], (2.0, 4.0), {})
        assert _flat(one) == pytest.approx(_flat(other))
        assert term.count((2.0, 4.0)) == len(c)


def test_terms_of_one_field_add_up():
    (fitting,) = catalogue()["lugre_friction"].fittings
    settings = fitting.written((2.0, 3.0), (5.0, 6.0), ())
    assert settings["coulomb_nm"] == pytest.approx(0.04)
    assert settings["static_nm"] == pytest.approx(2 * 0.0201 + 3 * 0.02)
    told = fitting.report((2.0, 3.0), np.diag([0.0, 0.25]), (5.0, 6.0), (0.0, 0.0), ())
    assert told["static_nm"] == pytest.approx((0.1002, 0.0802, 0.1202))


def test_a_sum_is_as_unsure_as_all_of_its_terms():
    (fitting,) = catalogue()["lugre_friction"].fittings
    covariance = np.array([[0.25, -0.05], [-0.05, 0.04]])
    told = fitting.report((2.0, 3.0), covariance, (5.0, 6.0), (0.0, 0.0), ())
    drawn = np.random.default_rng(5).multivariate_normal([2.0, 3.0], covariance, 2000)
    statics = [fitting.written(tuple(c), (5.0, 6.0), ())["static_nm"] for c in drawn if c[0] > 0 and c[1] > 0]
    low, high = told["static_nm"][1:]
    assert np.std(statics) == pytest.approx((high - low) / 4, rel=0.05)


def test_a_field_declares_its_number():
    class Model(hdsim.parts.Parameters):
        moved_nm: Annotated[float, Number(0.3)] = Field(1.0, gt=0)
        fixed_s: Annotated[float, FIXED] = 1.0

    fields = Model.model_fields
    assert number.declared(fields["moved_nm"].metadata).prior == 0.3
    assert number.declared(fields["fixed_s"].metadata).prior == 0.0
    assert split_unit("moved_nm")[1] == "N m"
    assert Free("x", ("x",), 0.3, 1.0, least=0.5).bounds[0] == pytest.approx(math.log(0.5))


def _flat(data, path=""):
    if isinstance(data, dict):
        return {k: v for key, item in data.items() for k, v in _flat(item, f"{path}.{key}").items()}
    if isinstance(data, list):
        return {k: v for n, item in enumerate(data) for k, v in _flat(item, f"{path}.{n}").items()}
    return {path: data}


def _empty():
    from hdsim.estimate.state import State

    return State(None, None, {})


@pytest.mark.parametrize("name", list(catalogue()))
def test_whatever_a_fits_bounds_allow_is_a_legal_effect(name):
    for fitting in catalogue()[name].fittings:
        if any(shape.over_range for shape in fitting.shapes) or any(term.of_range for term in fitting.terms):
            pitches = {"flexspline_pitch_deg": 1.8, "circular_spline_pitch_deg": 1.78}
            torques = {"torque_nm": 50.0, "motor_side_torque_nm": 0.5}
            fitting = fitting.within(torques | pitches | {"twist_arcmin": 5.0})
        periodic = any(isinstance(term, Periodic) for term in fitting.terms)
        orders = (1.0, 2.0) if periodic else ()
        units = (1.0,) * fitting.count(orders)
        added = Added(name, fitting, units, tuple(s.starts[0] for s in fitting.shapes), orders)
        ends = np.array(fitting.bounds(added.limits, orders))
        for side in (0, 1):
            corner = np.where(np.isfinite(ends[:, side]), ends[:, side], (-1e7, 1e7)[side])
            effect = replace(added, coefficients=tuple(np.where(corner == 0.0, 1e-6, corner)))
            catalogue()[name].model_validate(effect.settings())


def test_a_term_reads_back_what_it_has_written() -> None:
    term, data = Amplitude({"a_nm": 0.5, "inner.b": 2.0}), {"inner": {}}
    term.write(data, [3.0], (), {})
    assert term.read(data, ()) == [3.0]
    assert term.read({"inner": {"b": 6.0}}, ()) == [0.0]
    wave, turned = Harmonic("waves.0.a_nm", "waves.0.phase_deg", 0.5), {"waves": [{}]}
    wave.write(turned, [3.0, -4.0], (), {})
    assert wave.read(turned, ()) == pytest.approx([3.0, -4.0])
    assert wave.read({"waves": []}, ()) == [0.0, 0.0]
    orders = Periodic("waves", "a_nm", 0.5, "motor_torque", settings={"per": "output_turn"})
    orders.write(turned, [1.0, 2.0, -3.0, 0.5], (6.0, 7.0), {})
    assert orders.read(turned, (7.0, 6.0, 8.0)) == pytest.approx([-3.0, 0.5, 1.0, 2.0, 0.0, 0.0])


def test_a_way_of_fitting_reads_what_another_wrote_wherever_it_stands() -> None:
    def way(*orders: int) -> Fitting:
        settings = {"components": [{"order": order} for order in orders]}
        return Fitting(Harmonic.components("a_nm", 0.5, len(orders)), settings=settings)

    written = way(4, 2, 2).written([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (), ())
    assert way(2, 3, 4, 2).read(written, ()) == pytest.approx([3.0, 4.0, 0.0, 0.0, 1.0, 2.0, 5.0, 6.0])
