import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from hdsim.errors import InputError
from hdsim.surface import (
    Flank,
    corrected_flank,
    equivalent_surface,
    structure_function,
    structure_function_constant,
)
from hdsim.surface.flank import flank_from_power_law
from hdsim.surface.sampled import measured_structure_function, synthetic_profiles

CS = Flank(2.4272, 1.245e-10)
FS = Flank(2.643, 1.8648e-10)


def spectrum_integral(D):
    """S of the sum over all frequencies, with the sum as an integral: int w^(2D-7) (1 - cos 2 pi w) dw."""
    p = 7.0 - 2.0 * D
    split = 1.0
    near = quad(lambda w: w ** (2 - p) * 2.0 * (math.pi * np.sinc(w)) ** 2, 0.0, split, limit=400)[0]
    tail = split ** (1 - p) / (p - 1)
    wave = quad(lambda w: w**-p, split, np.inf, weight="cos", wvar=2 * math.pi, limit=400)[0]
    return near + tail - wave


@pytest.mark.parametrize("D", [2.1, 2.4272, 2.49, 2.5, 2.51, 2.643, 2.9])
def test_the_corrected_constant_is_the_integral_of_the_spectrum(D):
    assert structure_function_constant(D) == pytest.approx(spectrum_integral(D), rel=1e-6)


@pytest.mark.parametrize("D", [2.1, 2.4, 2.6, 2.9])
def test_the_printed_constant_is_eq_18(D):
    Ds = D - 1
    eq_18 = math.gamma(2 * Ds - 3) * math.sin((2 * Ds - 3) * math.pi / 2) / (2 - Ds)
    assert structure_function_constant(D, "printed") == pytest.approx(eq_18, rel=1e-12)


def test_the_singularity_at_ds_1_5_is_removed():
    assert structure_function_constant(2.5, "printed") == pytest.approx(math.pi, rel=1e-12)
    around = [structure_function_constant(2.5 + d, "printed") for d in (-1e-7, 0.0, 1e-7)]
    assert np.ptp(around) < 1e-5


@given(D=st.floats(2.01, 2.99), log_g=st.floats(-18, -6), constant=st.sampled_from(["printed", "corrected"]))
def test_a_flank_survives_its_own_structure_function(D, log_g, constant):
    flank = Flank(D, 10.0**log_g)
    S = structure_function([1.0, math.e], flank, constant)
    back = flank_from_power_law(math.log(S[1] / S[0]), S[0], constant)
    assert pytest.approx(D, abs=1e-9) == back.D
    assert math.log(back.G_m) == pytest.approx(math.log(flank.G_m), rel=1e-6)


def test_the_pair_of_the_paper():
    summed = equivalent_surface(CS, FS, constant="printed")
    assert pytest.approx(2.430, abs=5e-4) == summed.D
    assert summed.G_m == pytest.approx(1.36e-10, abs=1e-12)
    averaged = equivalent_surface(CS, FS, "averaged")
    assert pytest.approx(2.5351, abs=1e-12) == averaged.D
    assert averaged.G_m == pytest.approx(1.55e-10, abs=1e-12)


@pytest.mark.parametrize(("flank", "times"), [(CS, 5.22), (FS, 1.62)])
def test_a_corrected_flank_has_the_heights_that_were_measured(flank, times):
    corrected = corrected_flank(flank)
    assert pytest.approx(flank.D, abs=1e-12) == corrected.D
    Ds = flank.D - 1
    shift = 0.5 * (2 * math.pi) ** (4 - 2 * Ds)  # of the constants
    assert flank.G_m / corrected.G_m == pytest.approx(shift ** (1 / (2 * (Ds - 1))), rel=1e-9)
    assert flank.G_m / corrected.G_m == pytest.approx(times, rel=2e-3)
    # Eq. 1 with the corrected G, sampled, gives the structure function that Eq. 18's G was read from.
    steps = np.array([1, 3, 10, 30, 100])
    z = np.concatenate([synthetic_profiles(corrected, 25, 2001, 1e-6, [seed, 7]) for seed in range(8)])
    sampled = measured_structure_function(z, steps).mean(axis=0)
    np.testing.assert_allclose(sampled, structure_function(steps * 1e-6, flank, "printed"), rtol=0.1)


def test_correcting_and_summing_may_be_done_in_either_order():
    first = equivalent_surface(corrected_flank(CS), corrected_flank(FS))
    last = corrected_flank(equivalent_surface(CS, FS, constant="printed"))
    assert pytest.approx(last.D, abs=1e-9) == first.D
    assert first.G_m == pytest.approx(last.G_m, rel=1e-6)


@pytest.mark.parametrize("constant", ["printed", "corrected"])
def test_the_summed_surface_has_the_summed_structure_function(constant):
    lags = np.geomspace(1e-6, 1e-3, 50)
    total = structure_function(lags, CS, constant) + structure_function(lags, FS, constant)
    fitted = structure_function(lags, equivalent_surface(CS, FS, constant=constant), constant)
    np.testing.assert_allclose(fitted, total, rtol=0.02)


def test_two_like_flanks_double_the_structure_function():
    twice = equivalent_surface(CS, CS)
    assert pytest.approx(CS.D, abs=1e-12) == twice.D
    assert twice.G_m == pytest.approx(CS.G_m * 2 ** (1 / (2 * (CS.D - 2))), rel=1e-9)


def test_what_is_no_flank_is_refused():
    for D, G in ((2.0, 1e-10), (3.0, 1e-10), (math.nan, 1e-10), (2.5, 0.0), (2.5, math.inf)):
        with pytest.raises(InputError):
            Flank(D, G)
    with pytest.raises(InputError, match="not fractal"):
        flank_from_power_law(2.1, 1e-12)
    with pytest.raises(InputError):
        equivalent_surface(CS, FS, "multiplied")
    with pytest.raises(InputError):
        structure_function_constant(2.5, "guessed")
