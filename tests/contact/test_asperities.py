import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from hdsim.contact.asperities import Asperities, domain_extension_factor
from hdsim.errors import InputError

STEEL = {"reduced_modulus_pa": 1.154e11, "hardness_pa": 3.0e9, "poisson_ratio": 0.3}
DIMENSIONS = [2.3, 2.4272, 2.4999999, 2.5, 2.5000001, 2.5351, 2.643, 2.8]


def model(D, G=1.55e-10, **change):
    return Asperities(D, G, **(STEEL | change))


def over_sizes(function, low, high):
    """Integral over truncated areas, in logarithmic size."""
    return quad(
        lambda u: math.exp(u) * float(function(math.exp(u))), math.log(low), math.log(high), epsrel=1e-11
    )[0]


@pytest.mark.parametrize("D", [2.001, 2.2, 2.5, 2.8, 2.999, 2.999999])
def test_psi_is_the_root_of_eq_7(D):
    psi = domain_extension_factor(D)
    left = psi ** ((3 - D) / 2) - (1 + psi ** ((1 - D) / 2)) ** (-(3 - D) / (D - 1))
    assert left / ((3 - D) / (D - 1)) == pytest.approx(1.0, abs=1e-9)


def test_psi_at_its_two_ends():
    golden = (1 + math.sqrt(5)) / 2
    assert domain_extension_factor(2.0 + 1e-9) == pytest.approx(golden**2, rel=1e-7)
    assert domain_extension_factor(3.0 - 1e-9) == pytest.approx(math.e - 1, rel=1e-7)


@pytest.mark.parametrize("D", DIMENSIONS)
def test_eq_2_and_3_agree_on_the_truncated_circle(D):
    m, a = model(D), np.geomspace(1e-16, 1e-6, 11)
    np.testing.assert_allclose(a / math.pi, 2 * m.curvature_radius(a) * m.deformation(a), rtol=1e-12)


@pytest.mark.parametrize("D", DIMENSIONS)
def test_the_critical_area_is_where_eq_3_meets_eq_4(D):
    m = model(D)
    assert m.deformation(m.critical_area) == pytest.approx(m.critical_deformation(m.critical_area), rel=1e-9)
    # Smaller asperities are the plastic ones.
    small = 0.5 * m.critical_area
    assert m.deformation(small) > m.critical_deformation(small)


@pytest.mark.parametrize("D", DIMENSIONS)
@pytest.mark.parametrize("growth", [1.001, 2.0, 1e4])
def test_eq_8_is_the_integral_of_elastic_asperities(D, growth):
    m = model(D)
    a_l = growth * m.critical_area
    direct = over_sizes(lambda a: m.asperity_elastic_force(a) * m.distribution(a, a_l), m.critical_area, a_l)
    assert m.elastic_load(a_l) == pytest.approx(direct, rel=1e-9)


@pytest.mark.parametrize("D", DIMENSIONS)
@pytest.mark.parametrize("growth", [0.01, 0.9, 1.0, 50.0])
def test_eq_9_is_the_integral_of_plastic_asperities_up_to_the_smaller_limit(D, growth):
    m = model(D)
    a_l = growth * m.critical_area
    limit = min(a_l, m.critical_area)
    # The integrand falls as a^((3-D)/2): start where it holds 1e-12 of the whole.
    start = limit * 1e-12 ** (2 / (3 - D))
    direct = over_sizes(lambda a: m.asperity_plastic_force(a) * m.distribution(a, a_l), start, limit)
    assert m.plastic_load(a_l) == pytest.approx(direct, rel=1e-8)


@pytest.mark.parametrize("D", DIMENSIONS)
@pytest.mark.parametrize("factor", ["printed", "fixed-asperity"])
def test_eq_12_is_the_integral_of_asperity_stiffness(D, factor):
    m = model(D, asperity_stiffness=factor)
    a_l = 300.0 * m.critical_area
    direct = over_sizes(
        lambda a: m.asperity_contact_stiffness(a) * m.distribution(a, a_l), m.critical_area, a_l
    )
    assert m.stiffness(a_l) == pytest.approx(direct, rel=1e-9)
    assert m.stiffness(0.99 * m.critical_area) == 0.0


@pytest.mark.parametrize("D", DIMENSIONS)
def test_eq_11_is_the_derivative_along_the_asperitys_size(D):
    m, a, h = model(D), 1e-11, 1e-4
    force = m.asperity_elastic_force([a * (1 - h), a * (1 + h)])
    delta = m.deformation([a * (1 - h), a * (1 + h)])
    assert m.asperity_contact_stiffness(a) == pytest.approx(np.diff(force)[0] / np.diff(delta)[0], rel=1e-6)


@pytest.mark.parametrize("D", DIMENSIONS)
def test_a_fixed_asperity_has_the_stiffness_of_hertz(D):
    m, a = model(D, asperity_stiffness="fixed-asperity"), 1e-11
    R, delta = float(m.curvature_radius(a)), float(m.deformation(a))
    hertz = 2.0 * STEEL["reduced_modulus_pa"] * math.sqrt(R * delta)
    assert m.asperity_contact_stiffness(a) == pytest.approx(hertz, rel=1e-12)


def test_eq_8_at_2_5_is_the_printed_logarithm():
    m = model(2.5)
    for a_l in np.array([1.5, 10.0, 1e4]) * m.critical_area:
        printed = (
            2
            * math.pi**-0.75
            * math.sqrt(math.log(1.5))
            * math.sqrt(m.G_m)
            * m.reduced_modulus_pa
            * m.psi**0.25
            * a_l**0.75
            * math.log(a_l / m.critical_area)
        )
        assert m.elastic_load(a_l) / printed == pytest.approx(1.0, rel=1e-9)


def test_eq_8_passes_smoothly_through_2_5():
    a_l = 1e-9
    loads = np.array([float(model(2.5 + d).elastic_load(a_l)) for d in (-1e-6, 0.0, 1e-6)])
    assert abs(loads[0] - 2 * loads[1] + loads[2]) < 1e-8 * loads[1]
    assert np.ptp(loads) < 1e-3 * loads[1]


def test_eq_10_as_printed_is_too_large_below_the_all_plastic_limit():
    m = model(2.3)
    a_l = 0.1 * m.critical_area
    printed = STEEL["hardness_pa"] * (2.3 - 1) / 0.7 * m.psi**0.35 * a_l**0.65 * m.critical_area**0.35
    assert printed / m.plastic_load(a_l) == pytest.approx(10.0**0.35, rel=1e-9)


@settings(deadline=None, max_examples=40)
@given(D=st.floats(2.15, 2.95), log_g=st.floats(-15, -8.5), growth=st.floats(1.01, 1e5))
def test_load_slope_and_area_by_other_ways(D, log_g, growth):
    m = model(D, 10.0**log_g)
    a_l = growth * m.critical_area
    h = 1e-5
    slope = (m.load(a_l * math.exp(h)) - m.load(a_l * math.exp(-h))) / (2 * h)
    assert m.load_slope(a_l) == pytest.approx(float(slope), rel=1e-6)
    # Total area: a_l sets where n counts one asperity less than itself, so the sum of areas is linear in it.
    q = (D - 1) / 2
    assert m.truncated_area(a_l) == pytest.approx(q / (1 - q) * m.psi ** ((3 - D) / 2) * a_l, rel=1e-9)


def test_what_is_no_material_is_refused():
    for change in ({"D": 2.0}, {"G": -1.0}, {"hardness_pa": 0.0}, {"poisson_ratio": 0.6}, {"gamma": 1.0}):
        D, G = change.pop("D", 2.5), change.pop("G", 1e-10)
        with pytest.raises(InputError):
            model(D, G, **change)
    with pytest.raises(InputError, match="fixed-asperity"):
        model(2.5, asperity_stiffness="guess")
    with pytest.raises(InputError, match="critical area"):
        _ = model(2.0001).critical_area
