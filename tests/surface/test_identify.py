import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.errors import InputError
from hdsim.surface import Flank, structure_function
from hdsim.surface._power_law import fit_power_laws
from hdsim.surface.commands import surface
from hdsim.surface.files import read_heights
from hdsim.surface.identify import identify, implied_heights
from hdsim.surface.sampled import detrended, measured_structure_function, synthetic_profiles

PAIR = Flank(2.5351, 1.55e-10)
CS = Flank(2.4272, 1.245e-10)
LAGS = np.geomspace(1e-6, 4e-4, 24)


def profile(flank=PAIR, count=1, noise=0.0, seed=1):
    return synthetic_profiles(flank, count, 4001, 1e-6, seed, noise_rms_m=noise)


@given(D=st.floats(2.1, 2.9), log_g=st.floats(-13, -8), noise=st.floats(0.0, 2.0))
def test_a_perfect_curve_gives_its_own_numbers(D, log_g, noise):
    S = structure_function(LAGS, Flank(D, 10.0**log_g))
    sigma = noise * math.sqrt(S[0])
    curve = (S + 2 * sigma**2)[None, :]
    for mode in [sigma, "fit"] if sigma else ["none", "fit", 0.0]:
        fit = fit_power_laws(LAGS, curve, mode)
        # Where a given noise leaves less than 2 % the curve can't be told from it.
        if mode == "fit" or S[0] > 0.03 * curve[0, 0]:
            assert 3 - fit.exponent[0] / 2 == pytest.approx(D, abs=2e-3)


def test_the_structure_function_of_known_heights():
    z = np.array([0.0, 1.0, 3.0, np.nan, 2.0, 2.0])
    assert measured_structure_function(z, [1, 2]).tolist() == [5 / 3, (9 + 1) / 2]
    line = 3.0 * np.arange(50.0) + 7.0
    np.testing.assert_allclose(measured_structure_function(line, [1, 4]), [9.0, 144.0])
    np.testing.assert_allclose(detrended(line), 0.0, atol=1e-12)
    gap = np.where(np.arange(50) == 9, np.nan, line)
    assert np.nanmax(np.abs(detrended(gap))) < 1e-12
    assert np.isnan(detrended(gap)[9])
    assert detrended(line, "mean").mean() == pytest.approx(0.0, abs=1e-12)
    assert (detrended(line, "none") == line).all()


@pytest.mark.parametrize("flank", [PAIR, CS, Flank(2.643, 1.8648e-10)])
def test_a_clean_profile_gives_back_its_flank(flank):
    found = [identify(profile(flank, seed=s), 1e-6, surrogates=40) for s in range(12)]
    errors = np.array([f.D - flank.D for f in found])
    assert np.median(np.abs(errors)) < 0.02
    assert abs(np.median([math.log(f.G_m / flank.G_m) for f in found])) < 0.25
    assert sum(f.D_interval[0] < flank.D < f.D_interval[1] for f in found) >= 9
    assert sum(f.G_interval_m[0] < flank.G_m < f.G_interval_m[1] for f in found) >= 9


def test_the_printed_constant_overestimates_g():
    found = identify(profile(count=20), 1e-6, surrogates=20)
    assert found.G_printed_m / found.G_m == pytest.approx(2.6, rel=0.05)


def test_the_surface_parameters_are_those_of_the_heights():
    z = 1e-6 * np.sin(2 * math.pi * np.arange(4000) / 40.0) + 1e-8 * profile()[0, :4000] / 1e-7
    found = identify(z, 1e-6, detrend="mean", surrogates=20)
    assert found.Sq_m == pytest.approx(1e-6 / math.sqrt(2), rel=0.02)
    assert found.Sa_m == pytest.approx(2e-6 / math.pi, rel=0.02)
    assert any("not fractal" in w for w in found.warnings)


def test_noise_is_corrected_or_told():
    for s in range(6):
        z = profile(noise=58e-9, seed=s)
        plain = identify(z, 1e-6, surrogates=20)
        assert plain.D > PAIR.D + 0.1
        assert any("noise floor" in w for w in plain.warnings)
        for mode in ("fit", 58e-9):
            found = identify(z, 1e-6, noise=mode, surrogates=40)
            assert abs(found.D - PAIR.D) < 0.05 or found.warnings
            assert found.noise_rms_m == pytest.approx(58e-9, rel=0.1)


def test_a_clean_profile_gives_no_warning():
    assert identify(profile(), 1e-6, surrogates=20).warnings == ()


def test_more_profiles_narrow_the_interval_and_copies_do_not():
    one = identify(profile(), 1e-6, surrogates=60)
    many = identify(profile(count=16), 1e-6, surrogates=60)
    copies = identify(np.repeat(profile(), 16, axis=0), 1e-6, surrogates=60)

    def width(found):
        return found.D_interval[1] - found.D_interval[0]

    assert many.effective_profiles > 12
    assert width(many) < 0.4 * width(one)
    assert copies.effective_profiles == 1.0
    assert width(copies) == pytest.approx(width(one), rel=0.01)
    assert any("alike" in w for w in copies.warnings)


def test_what_the_instrument_cannot_see_is_told():
    found = identify(profile(), 1e-6, lateral_resolution_m=5e-6, height_resolution_m=200e-9, surrogates=20)
    assert any("lateral resolution" in w for w in found.warnings)
    assert any("height resolution" in w for w in found.warnings)
    short = identify(profile(), 1e-6, lags_m=(2e-6, 8e-6), surrogates=20)
    assert any("too few" in w for w in short.warnings)
    long = identify(profile(), 1e-6, lags_m=(1e-6, 1e-3), surrogates=20)
    assert any("form removal" in w for w in long.warnings)
    # The paper's own pair is all below its instrument's 200 nm up to a lag of a tenth of a millimetre.
    assert (implied_heights(PAIR, [1e-6, 1e-5, 3e-5]) < 200e-9).all()


def test_missing_heights_do_not_matter_much():
    z = profile(CS)[0].copy()
    full = identify(z, 1e-6, surrogates=20)
    z[np.random.default_rng(0).uniform(size=z.size) < 0.05] = np.nan
    holed = identify(z, 1e-6, surrogates=20)
    assert pytest.approx(full.D, abs=0.01) == holed.D


@pytest.mark.parametrize(
    ("heights", "spacing", "words"),
    [
        (np.zeros(4000), 1e-6, "no height differences"),
        (np.arange(30.0), 1e-6, "at least 64"),
        (np.cumsum(np.cumsum(np.random.default_rng(1).normal(size=4000))), 1e-6, "white noise"),
        (np.random.default_rng(1).normal(size=4000), -1.0, "spacing"),
        (np.full(4000, np.nan), 1e-6, "known heights"),
    ],
)
def test_what_is_no_rough_profile_is_refused(heights, spacing, words):
    with pytest.raises(InputError, match=words):
        identify(heights, spacing, surrogates=20)
    with pytest.raises(InputError, match="nothing to fit"):
        identify(profile(), 1e-6, lags_m=(1e-6, 1.2e-6))


@settings(max_examples=10, deadline=None)
@given(unit=st.sampled_from(["m", "mm", "um", "nm"]))
def test_text_files_in_every_unit_and_shape(tmp_path_factory, unit):
    scale = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}[unit]
    folder = tmp_path_factory.mktemp("text")
    z = profile(count=3)[:, :200]
    x = 1e-6 * np.arange(200)
    np.savetxt(folder / "pairs.csv", np.column_stack([x, z[0]]) / scale, header="x, z", delimiter=",")
    np.savetxt(folder / "one.txt", z[0] / scale)
    np.savetxt(folder / "map.dat", z / scale)
    np.savetxt(folder / "tilted.tsv", z.T / scale, delimiter="\t")
    for name, options, expected in (
        ("pairs.csv", {}, z[:1]),
        ("one.txt", {"spacing_m": 1e-6}, z[:1]),
        ("map.dat", {"spacing_m": 1e-6}, z),
        ("tilted.tsv", {"spacing_m": 1e-6, "columns": True}, z),
    ):
        data = read_heights(folder / name, unit=unit, **options)
        np.testing.assert_allclose(data.heights_m, expected, atol=1e-18)
        assert data.spacing_m == pytest.approx(1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1\n2\nthree\n", ":3: expected numbers, found 'three'"),
        ("1 2\n3\n", ":2: expected 2 numbers"),
        ("", "no numbers"),
        ("1\n2\n3\n", "spacing of points must be given"),
        ("0 1\n1 2\n5 3\n6 1\n7 1\n", "rise evenly"),
    ],
)
def test_text_that_is_no_profile_is_refused(tmp_path, text, words):
    path = tmp_path / "heights.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_heights(path)


def test_files_that_are_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_heights(tmp_path / "absent.txt")
    with pytest.raises(InputError, match="directory"):
        read_heights(tmp_path)
    with pytest.raises(InputError, match="unit"):
        read_heights(tmp_path, unit="inch")
    junk = tmp_path / "junk.sur"
    junk.write_bytes(b"no surface at all")
    with pytest.raises(InputError, match="SurfaceTopography"):
        read_heights(junk)


def test_an_instruments_file_is_read(tmp_path):
    library = pytest.importorskip("SurfaceTopography")
    z = profile(CS, count=12)[:, :400]
    topography = library.Topography(z.T * 1e6, (400.0, 12.0), unit="um")
    path = tmp_path / "flank.nc"
    topography.to_netcdf(str(path))
    data = read_heights(path)
    np.testing.assert_allclose(data.heights_m, z, atol=1e-15)
    assert data.spacing_m == pytest.approx(1e-6)
    assert read_heights(path, columns=True).heights_m.shape == (400, 12)


def test_the_command(tmp_path):
    path = tmp_path / "flank.txt"
    np.savetxt(path, profile()[0] * 1e6)
    arguments = [str(path), "--spacing-um", "1"]
    result = CliRunner().invoke(surface, [*arguments, "--json", "--figure", str(tmp_path / "fit.png")])
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert report["D"] == pytest.approx(PAIR.D, abs=0.03)
    assert (tmp_path / "fit.png").stat().st_size > 10000
    table = CliRunner().invoke(surface, [*arguments, "--noise", "58"])
    assert "fractal dimension D" in table.output
    wrong = CliRunner().invoke(surface, [*arguments, "--noise", "loud"])
    assert isinstance(wrong.exception, InputError)


def test_an_estimate_outside_its_own_interval_is_explained():
    z = synthetic_profiles(Flank(2.5351, 1.55e-10), 64, 1024, 1e-6, 9)
    found = identify(z, 1e-6)
    low, high = found.D_interval
    outside = not low <= found.D <= high
    assert outside
    assert any(w.startswith("bias") for w in found.warnings)
    one = identify(z[0], 1e-6)
    assert one.D_interval[0] <= one.D <= one.D_interval[1]
    assert not any(w.startswith("bias") for w in one.warnings)
