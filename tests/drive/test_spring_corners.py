"""The torsion spring at the corners of its stiffness: against the catalogue's three straight segments."""

import numpy as np
import pytest

from hdsim.drive import _quartic, spring
from hdsim.drive.parameters import Drive

REACH_NM = 100.0


def torsion(**changed):
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "lumped"}})
    return drive.resolved().torsion.model_copy(update=changed)


def compiled(torsion, twist, scale=1.0):
    """Energy, torque and stiffness of the compiled spring, shape (3, n)."""
    corners = [torsion.torque_t1_nm, torsion.torque_t2_nm]
    wind_ups = [lambda torque: spring.catalogue_wind_up(torsion, torque)]
    step, numbers = spring.spring_numbers(wind_ups, corners, REACH_NM, scale=scale)
    return np.array([_quartic.spring(numbers, 0, step, spring.CELLS, x, 0.0) for x in twist]).T


def segments(torsion):
    """Twist (rad) of both corners."""
    first = torsion.torque_t1_nm / torsion.stiffness_k1_nm_per_rad
    return first, first + (torsion.torque_t2_nm - torsion.torque_t1_nm) / torsion.stiffness_k2_nm_per_rad


def closed_form(torsion, twist):
    k1, k2, k3 = (getattr(torsion, f"stiffness_k{k}_nm_per_rad") for k in (1, 2, 3))
    first, second = segments(torsion)
    size = np.abs(twist)
    torque = np.minimum(size, first) * k1
    torque += np.clip(size - first, 0.0, second - first) * k2 + np.maximum(size - second, 0.0) * k3
    return np.sign(twist) * torque


@pytest.mark.parametrize("scale", [1.0, 1.02])
def test_torque_and_stiffness_are_exact_beside_a_corner(scale):
    given = torsion()
    ends = np.array(segments(given))
    beside = np.concatenate([end + np.linspace(-3e-6, 3e-6, 61) for end in ends])
    twist = np.concatenate([beside, -beside, np.linspace(-4e-3, 4e-3, 101)])
    _, torque, stiffness = compiled(given, scale * twist, scale)
    wanted = closed_form(given, twist)
    assert np.max(np.abs(scale * torque - wanted)) < 1e-9 * np.max(np.abs(wanted))
    k1, k2, k3 = (getattr(given, f"stiffness_k{k}_nm_per_rad") for k in (1, 2, 3))
    size = np.abs(twist)
    away = np.min(np.abs(size[:, None] - ends), axis=1) > 1e-9
    slopes = np.where(size < ends[0], k1, np.where(size < ends[1], k2, k3))
    np.testing.assert_allclose(scale**2 * stiffness[away], slopes[away], rtol=1e-6)


def test_energy_is_the_torque_integrated():
    given = torsion()
    twist = np.linspace(0.0, 4e-3, 4001)
    energy, _, _ = compiled(given, twist)
    torque = closed_form(given, twist)
    wanted = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(twist))])
    assert np.max(np.abs(energy - wanted)) < 1e-7 * wanted[-1]


def test_torque_changes_with_the_first_stiffness_as_the_segments_say():
    given = torsion()
    k1, step = given.stiffness_k1_nm_per_rad, 1e-5 * given.stiffness_k1_nm_per_rad
    first, second = segments(given)
    beside = np.concatenate([-np.geomspace(3e-6, 3e-8, 20), np.geomspace(3e-8, 3e-6, 20)])
    twist = np.concatenate([first + beside, second + beside])
    _, here, _ = compiled(given, twist)
    _, there, _ = compiled(torsion(stiffness_k1_nm_per_rad=k1 + step), twist)
    _, k2, k3 = (getattr(given, f"stiffness_k{k}_nm_per_rad") for k in (1, 2, 3))
    # dT/dK1 at a given twist: each later segment begins earlier by T1 / K1^2.
    earlier = given.torque_t1_nm / k1**2
    wanted = np.where(twist < first, twist, np.where(twist < second, k2 * earlier, k3 * earlier))
    # Both corners move by up to a part 1e-5 of their twist.
    told = np.min(np.abs(twist[:, None] - [first, second]), axis=1) > 2e-5 * twist
    assert told.sum() > 60
    np.testing.assert_allclose(((there - here) / step)[told], wanted[told], rtol=1e-3)


def test_a_rounded_corner_stays_rounded():
    given = torsion(corner_smoothing_nm=1.0)
    torque = np.linspace(0.1, 30.0, 300)
    _, found, _ = compiled(given, spring.catalogue_wind_up(given, torque))
    np.testing.assert_allclose(found, torque, rtol=1e-5)
