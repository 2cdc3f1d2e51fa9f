import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdsim.errors import InputError
from hdsim.surface import Flank, random_phases, structure_function, wm_profile
from hdsim.surface.profile import frequency_index

L = 2.1e-3
X = np.linspace(0.0, 1.3 * L, 57)


def literal_sum(x, D, G, phases, gamma=1.5):
    """The full sum, term by term, one profile."""
    total = np.zeros_like(x)
    for n, phi in enumerate(phases):
        total += gamma ** ((D - 3) * n) * (math.cos(phi) - np.cos(2 * math.pi * gamma**n * x / L - phi))
    return L * (G / L) ** (D - 2) * math.sqrt(math.log(gamma)) * total


@given(D=st.floats(2.05, 2.95), log_g=st.floats(-15, -8), seed=st.integers(0, 2**31))
def test_the_vectorised_sum_is_the_literal_one(D, log_g, seed):
    phases = random_phases(3, seed)
    found = wm_profile(X, D, 10.0**log_g, phases=phases, length_m=L)
    expected = np.array([literal_sum(X, D, 10.0**log_g, row) for row in phases])
    assert found.shape == (3, 57)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


@given(D=st.floats(2.05, 2.95), n=st.integers(0, 12), phi=st.floats(0, 6.28))
def test_the_single_wave_is_the_term_of_the_sum_at_its_own_frequency(D, n, phi):
    phases = np.full(n + 1, phi)
    term = wm_profile(X, D, 1e-10, phases=phases, length_m=L)
    if n:
        term = term - wm_profile(X, D, 1e-10, phases=phases[:-1], length_m=L)
    single = wm_profile(X, D, 1e-10, phases=phi, reading="single", truncated_diameter_m=L / 1.5**n)
    np.testing.assert_allclose(single, term, atol=1e-10 * np.abs(term).max() + 1e-20)
    assert frequency_index(L, 0.999 * L / 1.5**n) == n


def test_a_profile_starts_at_zero_and_its_seed_repeats_it():
    first = wm_profile(X, 2.4, 1e-10, phases=random_phases(5, 7), length_m=L)
    again = wm_profile(X, 2.4, 1e-10, phases=random_phases(5, 7), length_m=L)
    other = wm_profile(X, 2.4, 1e-10, phases=random_phases(5, 8), length_m=L)
    assert (first == again).all()
    assert not np.allclose(first, other)
    assert (first[:, 0] == 0.0).all()
    assert wm_profile(0.5 * L, 2.4, 1e-10, phases=random_phases(1, 7)[0]).shape == (1,)


@pytest.mark.parametrize("flank", [Flank(2.4272, 1.245e-10), Flank(2.5, 1e-11), Flank(2.643, 1.8648e-10)])
def test_the_increments_of_the_sum_have_the_corrected_structure_function(flank):
    lags = np.geomspace(1e-6, 3e-5, 6)
    x = np.linspace(0.0, L, 400, endpoint=False)
    phases = random_phases(300, 3, 40)
    at = [wm_profile(x + lag, flank.D, flank.G_m, phases=phases, length_m=L) for lag in (0.0, *lags)]
    measured = np.array([np.mean((moved - at[0]) ** 2) for moved in at[1:]])
    np.testing.assert_allclose(measured, structure_function(lags, flank), rtol=0.1)
    assert abs(np.mean(np.log(measured / structure_function(lags, flank)))) < 0.04
    printed = structure_function(lags, flank, "printed")
    assert (measured > 1.5 * printed).all()


def test_what_is_no_profile_is_refused():
    phases = random_phases(2, 1)
    for change in (
        {"D": 3.0},
        {"G_m": 0.0},
        {"gamma": 1.0},
        {"reading": "both"},
        {"reading": "single"},
        {"phases": np.zeros((2, 0))},
    ):
        arguments = {"x_m": X, "D": 2.5, "G_m": 1e-10, "phases": phases} | change
        with pytest.raises(InputError):
            wm_profile(**arguments)


@pytest.mark.parametrize(("first", "points"), [(0.0, 4001), (2.0e-4, 17), (-3.0e-4, 400), (0.0, 1)])
@pytest.mark.parametrize("bent", [0.0, 1e-9])
def test_evenly_spaced_places_have_the_heights_of_any_others(first, points, bent):
    x = first + 1.3e-6 * np.arange(points)
    x = x + bent * np.sin(np.arange(points))
    phases = random_phases(1, 1)[0]
    expected = literal_sum(x, 2.4, 1e-10, phases)
    found = wm_profile(x, 2.4, 1e-10, phases=phases, length_m=L)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_no_places_have_no_heights():
    assert wm_profile([], 2.4, 1e-10, phases=random_phases(2, 1)).shape == (2, 0)
