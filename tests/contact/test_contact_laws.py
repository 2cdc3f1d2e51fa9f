import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from hdsim.contact import (
    ConstantStiffness,
    HertzLine,
    MajumdarBhushan,
    SeriesLaw,
    TableLaw,
    ValidityWarning,
    tabulate,
)
from hdsim.contact.law import ContactLaw
from hdsim.contact.parameters import MajumdarBhushanParameters, Materials
from hdsim.errors import InputError
from hdsim.surface.parameters import RoughFlanks

SUMMED = {"D": 2.430, "G_m": 1.364e-10, "reduced_modulus_pa": 1.154e11, "poisson_ratio": 0.3}
AVERAGED = SUMMED | {"D": 2.5351, "G_m": 1.55e-10}


def laws() -> dict[str, ContactLaw]:
    f = np.linspace(0.0, 3e-6, 12)
    fractal = MajumdarBhushan(**SUMMED, hardness_pa=3e9)
    return {
        "summed": fractal,
        "averaged": MajumdarBhushan(**AVERAGED, hardness_pa=3e9, floor_force_n=0.35),
        "hertz-asperities": MajumdarBhushan(**SUMMED, hardness_pa=3e9, asperity_stiffness="fixed-asperity"),
        "D = 2.5": MajumdarBhushan(**(SUMMED | {"D": 2.5}), hardness_pa=3e9),
        "constant": ConstantStiffness(6e7),
        "line": HertzLine(0.010, 0.001, 1.154e11),
        "table": TableLaw(f, 3e7 * f + 1e13 * f**2),
        "bent": SeriesLaw(fractal, 1.4e8),
        "bent line": SeriesLaw(HertzLine(0.010, 0.001, 1.154e11), 1.4e8),
    }


LAWS = laws()
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
forces = st.floats(1e-6, 400.0)


@every_law
@settings(deadline=None, max_examples=30)
@given(force=forces)
def test_force_and_penetration_are_inverse(law, force):
    assert law.force(law.penetration(force)) == pytest.approx(force, rel=1e-9)


@every_law
@settings(deadline=None, max_examples=25)
@given(force=forces)
def test_stiffness_is_the_derivative_of_force(law, force):
    f = float(law.penetration(force))
    h = 1e-5 * f
    slope = (law.force(f + h) - law.force(f - h)) / (2 * h)
    assert law.stiffness(f) == pytest.approx(float(slope), rel=2e-4)
    assert law.stiffness_at_force(force) == pytest.approx(float(law.stiffness(f)), rel=1e-8)


def law_nodes(law, f):
    """Penetrations below f where a piecewise law changes its polynomial."""
    return [p for p in law.penetration_m if p < f] if isinstance(law, TableLaw) else []


@every_law
@settings(deadline=None, max_examples=15)
@given(force=st.floats(0.01, 400.0))
def test_energy_is_the_integral_of_force(law, force):
    f = float(law.penetration(force))
    # Where a law changes its piece the integrand has a corner in its slope.
    corners = [float(law.penetration(law.floor_force_n))] if isinstance(law, MajumdarBhushan) else []
    edges = np.unique([0.0, *(p for p in corners if p < f), *np.linspace(0.0, f, 20), *law_nodes(law, f)])
    points, weights = np.polynomial.legendre.leggauss(10)
    half = np.diff(edges)[:, None] / 2
    at = edges[:-1, None] + half * (1 + points)
    integral = np.sum(law.force(at) * half * weights)
    assert law.energy(f) == pytest.approx(integral, rel=1e-6)
    assert law.energy_at_force(force) == pytest.approx(integral, rel=1e-6)


@every_law
def test_contact_never_pulls_and_keeps_the_shape(law):
    f = np.array([[-1.0, -1e-9, 0.0], [1e-10, 1e-9, 1e-7]])
    for method in (law.force, law.stiffness, law.energy):
        values = method(f)
        assert values.shape == (2, 3)
        assert (values[0] == 0.0).all()
        assert (values[1] > 0.0).all()
    assert (law.penetration([-3.0, 0.0]) == 0.0).all()
    assert np.isnan(law.force(math.nan))
    assert law.force(1e-7).shape == ()


@every_law
def test_the_initial_stiffness_is_the_limit_at_zero(law):
    tiny = 1e-13
    assert law.force(tiny) / tiny == pytest.approx(law.initial_stiffness_n_per_m, rel=1e-4, abs=3e8)
    if law.initial_stiffness_n_per_m:
        assert law.force(tiny) / tiny == pytest.approx(law.initial_stiffness_n_per_m, rel=1e-4)


@every_law
def test_the_kernel_table_follows_the_law(law):
    table = tabulate(law, 300.0)
    f = np.linspace(0.0, table.end_m, 5003)[1:]
    scale = np.maximum(law.force(f), 3.0)
    measured = np.max(np.abs(table.force(f) - law.force(f)) / scale)
    assert measured <= 1.02 * table.relative_force_error + 1e-12
    assert table.relative_force_error < (1e-5 if law.initial_stiffness_n_per_m else 0.02)
    # U' = F exactly, by the coefficients alone; U continuous over nodes; F and F' exact at them.
    c, h = table.coefficients, table.step_m
    end_energy = c[:, 4] + h * (c[:, 0] + h * (c[:, 1] / 2 + h * (c[:, 2] / 3 + h * c[:, 3] / 4)))
    np.testing.assert_allclose(end_energy[:-1], c[1:, 4], rtol=1e-13)
    np.testing.assert_allclose(c[1:, 0], law.force(h * np.arange(1, table.count)), rtol=1e-12)
    np.testing.assert_allclose(c[1:, 1], law.stiffness(h * np.arange(1, table.count)), rtol=1e-10)
    assert c.shape == (1023, 5)
    assert c.flags.c_contiguous
    assert (c[0, 0], c[0, 4]) == (0.0, 0.0)
    assert c[0, 1] == law.initial_stiffness_n_per_m
    assert (table.stiffness(f) > 0.0).all()


def test_beyond_its_end_the_table_goes_on_straight():
    table = tabulate(LAWS["summed"], 100.0, nodes=64)
    f = table.end_m + np.array([1e-7, 2e-7])
    assert np.diff(table.force(f))[0] == pytest.approx(1e-7 * table.end_stiffness_n_per_m, rel=1e-9)
    work = quad(lambda x: float(table.force(x)), table.end_m, f[1], epsrel=1e-12)[0]
    assert table.energy(f[1]) - table.end_energy_j == pytest.approx(work, rel=1e-9)
    assert table.force(-1.0) == table.stiffness(-1.0) == table.energy(-1.0) == 0.0


@pytest.mark.parametrize(("hardness", "low", "high"), [(2.8e9, 0.73e9, 0.76e9), (4.0e9, 0.99e9, 1.03e9)])
def test_the_averaged_pair_is_an_order_stiffer_than_the_paper_prints(hardness, low, high):
    law = MajumdarBhushan(**AVERAGED, hardness_pa=hardness)
    assert low < law.stiffness_at_force(34.67) < high


@pytest.mark.parametrize(("hardness", "low", "high"), [(2.5e9, 5.4e7, 5.6e7), (2.8e9, 6.8e7, 7.0e7)])
def test_the_summed_pair_reaches_the_printed_stiffness(hardness, low, high):
    law = MajumdarBhushan(**SUMMED, hardness_pa=hardness, floor_force_n=7.0)
    assert low < law.stiffness_at_force(34.67) < high


@pytest.mark.parametrize(("hardness", "stiffness"), [(2.5e9, 3.7e8), (3.0e9, 4.7e8), (4.0e9, 6.7e8)])
def test_the_default_pair_is_stiffer_than_the_paper_prints(hardness, stiffness):
    # docs/contact.md; the measured heights with the G of Eq. 1.
    surface, steels = RoughFlanks().equivalent(), Materials()
    law = MajumdarBhushan(
        surface.D, surface.G_m, steels.reduced_modulus_pa, hardness, steels.softer.poisson_ratio
    )
    assert law.stiffness_at_force(34.67) == pytest.approx(stiffness, rel=0.01)
    default = MajumdarBhushanParameters().build(surface)
    assert isinstance(default, MajumdarBhushan)
    assert default.stiffness_at_force(34.67) == pytest.approx(4.7e8, rel=0.01)
    assert default.all_plastic_force_n == pytest.approx(0.075, rel=0.02)
    assert default.area_bound_force_n == pytest.approx(950, rel=0.02)


@pytest.mark.parametrize("name", ["summed", "averaged", "hertz-asperities", "D = 2.5"])
def test_the_penetration_is_the_integral_of_compliance(name):
    law = LAWS[name]
    assert isinstance(law, MajumdarBhushan)
    compliance = quad(
        lambda u: math.exp(u) / float(law.unfloored_stiffness(math.exp(u))),
        math.log(law.floor_force_n),
        math.log(100.0),
        epsrel=1e-11,
    )[0]
    start = law.floor_force_n / float(law.unfloored_stiffness(law.floor_force_n))
    assert law.penetration(100.0) == pytest.approx(start + compliance, rel=1e-9)


@settings(deadline=None, max_examples=30)
@given(D=st.floats(2.2, 2.9), log_g=st.floats(-14, -9), force=st.floats(1e-3, 1e3))
def test_the_largest_contact_carries_the_force(D, log_g, force):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        law = MajumdarBhushan(D, 10.0**log_g, 1.154e11, 3e9, 0.3)
        assert law.equations.load(law.a_l(force)) == pytest.approx(force, rel=1e-9)
        assert law.force(law.penetration(force)) == pytest.approx(force, rel=1e-9)
    assert law.floor_force_n > law.all_plastic_force_n
    assert law.initial_stiffness_n_per_m > 0.0


def test_the_floor_keeps_clear_of_the_all_plastic_limit():
    with pytest.warns(ValidityWarning, match="every asperity is plastic"):
        law = MajumdarBhushan(**SUMMED, hardness_pa=3e9, floor_force_n=0.35)
    assert law.floor_force_n > law.all_plastic_force_n > 0.35
    assert law.unfloored_stiffness(law.all_plastic_force_n) == 0.0
    assert law.a_l(law.floor_force_n) == pytest.approx(2 * law.critical_area, rel=1e-9)
    below = law.stiffness_at_force([1e-3, 0.5 * law.floor_force_n, law.floor_force_n * (1 + 1e-9)])
    np.testing.assert_allclose(below, law.initial_stiffness_n_per_m, rtol=1e-7)


def test_the_area_bound_is_told():
    law = MajumdarBhushan(**AVERAGED, hardness_pa=3.6e9, nominal_area_m2=5.5e-8)
    assert law.area_bound_force_n == pytest.approx(30.0, rel=0.1)
    assert law.truncated_area(law.area_bound_force_n) == pytest.approx(5.5e-8, rel=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        law.stiffness_at_force(0.9 * law.area_bound_force_n)
        SeriesLaw(law, 1.4e8).force(1e-7)
    with pytest.warns(ValidityWarning, match="no longer fit"):
        law.stiffness_at_force(1.1 * law.area_bound_force_n)
    with pytest.warns(ValidityWarning, match="no longer fit"):
        tabulate(SeriesLaw(law, 1.4e8), 50.0, nodes=16)


def test_the_law_goes_on_straight_beyond_a_meganewton():
    law = MajumdarBhushan(**SUMMED, hardness_pa=3e9, nominal_area_m2=1.0)
    f = law.penetration(np.array([1.5e6, 2.5e6]))
    assert np.diff(law.force(f)) == pytest.approx(1e6, rel=1e-9)
    assert law.stiffness_at_force(3e6) == pytest.approx(1e6 / np.diff(f)[0], rel=1e-9)


def test_a_series_adds_the_compliances():
    contact, bent = LAWS["summed"], LAWS["bent"]
    F = np.array([0.1, 3.0, 30.0, 300.0])
    np.testing.assert_allclose(bent.penetration(F), contact.penetration(F) + F / 1.4e8, rtol=1e-12)
    np.testing.assert_allclose(1 / bent.stiffness_at_force(F), 1 / contact.stiffness_at_force(F) + 1 / 1.4e8)


def test_the_line_contact_is_the_half_spaces_displacement_under_a_hertz_strip():
    length, radius, modulus, force = 0.010, 0.001, 1.15e11, 34.67
    law = HertzLine(length, radius, modulus)
    b = law.half_width(force)
    assert b == pytest.approx(6.2e-6, rel=0.01)

    # Boussinesq at the middle of the strip: p = p0 sqrt(1 - x^2/b^2), w = 1/(pi E*) int p dx dy / r.
    def line(t):  # x = b t^2 on one side; the integral over y along the strip is 2 asinh(l / 2x)
        x = b * t * t
        return math.sqrt(max(0.0, 1 - t**4)) * 2 * math.asinh(length / (2 * x)) * 2 * b * t if x else 0.0

    p0 = 2 * force / (math.pi * b * length)
    w = 2 * p0 * quad(line, 0.0, 1.0, epsrel=1e-12)[0] / (math.pi * modulus)
    assert law.penetration(force) == pytest.approx(w, rel=1e-6)


def test_the_line_contact_tells_where_its_formula_ends():
    law = HertzLine(0.010, 0.5, 1.15e11)
    assert law.half_width(law.limit_force_n) == pytest.approx(0.010 / 4, rel=1e-12)
    F = law.limit_force_n * np.array([0.999999, 1.000001])
    with pytest.warns(ValidityWarning, match="wider"):
        f = law.penetration(F)
    assert np.diff(F)[0] / np.diff(f)[0] == pytest.approx(float(law.stiffness_at_force(F[0])), rel=1e-4)
    with pytest.warns(ValidityWarning):
        np.testing.assert_allclose(law.force(law.penetration(F * 3)), F * 3, rtol=1e-10)


def test_no_law_from_a_negative_number():
    for make in (
        lambda: ConstantStiffness(0.0),
        lambda: HertzLine(0.01, -1.0, 1e11),
        lambda: SeriesLaw(ConstantStiffness(1.0), 0.0),
        lambda: MajumdarBhushan(**SUMMED, hardness_pa=3e9, floor_force_n=0.0),
        lambda: tabulate(ConstantStiffness(1.0), 0.0),
        lambda: tabulate(ConstantStiffness(1.0), 1.0, nodes=2),
    ):
        with pytest.raises(InputError):
            make()
