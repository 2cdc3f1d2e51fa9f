import math

import numpy as np
import pytest

from hdsim.contact import TableLaw
from hdsim.contact.boundary_element import isotropic_surface, press
from hdsim.surface import Flank, structure_function

FLANK = Flank(2.43, 1.3e-10)


def test_the_surface_has_the_flanks_structure_function():
    z = isotropic_surface(FLANK, 256, 0.5e-3, 1)
    assert z.mean() == pytest.approx(0.0, abs=1e-12)
    for steps in (4, 8, 16):
        S = np.mean([np.mean((np.roll(z, steps, axis) - z) ** 2) for axis in (0, 1)])
        assert pytest.approx(float(structure_function(steps * 0.5e-3 / 256, FLANK)), rel=0.25) == S


def test_a_wave_is_pressed_as_westergaard_says():
    pytest.importorskip("tamaas")
    nodes, length, height, modulus = 128, 1e-3, 1e-6, 1e11
    wave = height * np.cos(2 * math.pi * np.arange(nodes) / nodes)[:, None] * np.ones(nodes)
    full = math.pi * modulus * height / length
    share = np.array([0.2, 0.5, 0.8])
    pressed = press(wave, length, modulus, share * full)
    # Westergaard (1939): contact width over wavelength = 2/pi asin(sqrt(p/p*)).
    np.testing.assert_allclose(
        pressed.contact_fraction, 2 / math.pi * np.arcsin(np.sqrt(share)), atol=1.5 / nodes
    )
    # Johnson (1985), Eq. 13.9 ff.: the mean gap is h (1 - x + x ln x) with x = p/p*.
    gap = height * (1 - share + share * np.log(share))
    np.testing.assert_allclose(height - pressed.approach_m, gap, rtol=0.03)


def test_the_curve_becomes_a_contact_law(tmp_path):
    pytest.importorskip("tamaas")
    force, area = np.geomspace(5.0, 100.0, 5), 5e-6
    pressed = press(isotropic_surface(FLANK, 64, 0.5e-3, 1), 0.5e-3, 1.15e11, force / area)
    np.testing.assert_allclose(pressed.law(area).force(pressed.approach_m), force, rtol=1e-9)
    pressed.write_csv(tmp_path / "contact.csv", area)
    read = TableLaw.from_csv(tmp_path / "contact.csv")
    np.testing.assert_allclose(read.force(pressed.approach_m), force, rtol=1e-6)
