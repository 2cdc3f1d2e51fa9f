"""Every example of the gallery runs, draws what can be read, and agrees with physics or its own arrays."""

from __future__ import annotations

import math
import re
import runpy
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot as plt

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
ARCSEC = math.radians(1 / 3600)

Space = dict[str, Any]


def step_response(space: Space) -> None:
    for result in space["results"].values():
        error = np.abs(result["output_angle"] - math.radians(1.0))
        outside = np.flatnonzero(error > 30 * ARCSEC)[-1]
        settled = result.time[outside : outside + 2] - space["START_S"]
        assert settled[0] <= result.metrics()["settling_time"].value <= settled[1]
    slow, fast = (result.metrics() for result in space["results"].values())
    assert fast["settling_time"].value < slow["settling_time"].value
    assert fast["overshoot"].value > 30 > slow["overshoot"].value


def transmission_error(space: Space) -> None:
    components = space["bench"].effects.kinematic_error.components
    (fourth,) = [one for one in components if one.per == "wave_generator_turn" and one.order == 4]
    near = np.abs(space["orders"] - 4) < 0.1
    assert space["amplitudes"][near].max() == pytest.approx(60 * fourth.amplitude_arcmin * ARCSEC, rel=0.05)


def hysteresis(space: Space) -> None:
    torque, twist = space["torque_nm"], space["twist_arcmin"]
    crossings = [
        np.interp(0.0, *zip(*sorted([(torque[k], twist[k]), (torque[k + 1], twist[k + 1])]), strict=True))
        for k in np.flatnonzero(torque[1:-1] * torque[2:] < 0) + 1
    ]
    height_arcsec = 60 * (max(crossings) - min(crossings))
    assert space["numbers"]["hysteresis_loss"].value == pytest.approx(height_arcsec, rel=0.02)
    torsion = space["bench"].drive.torsion
    slope = np.polyfit(*(values[torque > 1.1 * torsion.torque_t2_nm] for values in (twist, torque)), 1)[0]
    assert slope * 60 / ARCSEC / 3600 == pytest.approx(torsion.stiffness_k3_nm_per_rad, rel=0.1)


def rough_flanks(space: Space) -> None:
    none, one, three = (space["backlash_arcsec"][factor] for factor in (0, 1, 3))
    assert none < 0.1 < one
    assert three == pytest.approx(3 * one, rel=0.2)


def bode(space: Space) -> None:
    # Two masses on a spring: w^2 = K (1/J_l + 1/(i^2 J_m)), K the third stiffness at 26 N m.
    drive, load = space["joint"].drive, space["joint"].load.inertia_kg_m2
    motor = drive.ratio**2 * (drive.inertia.motor_kg_m2 + drive.inertia.wave_generator_kg_m2)
    assert drive.torsion.torque_t2_nm < 26
    expected = math.sqrt(drive.torsion.stiffness_k3_nm_per_rad * (1 / load + 1 / motor)) / (2 * math.pi)
    assert space["resonance"].frequency_hz == pytest.approx(expected, rel=0.02)


def effect(space: Space) -> None:
    plain, stribeck = space["plain"], space["stribeck"]
    speed = plain["motor_velocity"]
    more = np.sign(speed) * (stribeck["motor_torque"] - plain["motor_torque"])
    slow, fast = np.abs(np.abs(speed) - 1.0) < 0.3, np.abs(speed) > 15
    assert 0.5 * 0.02 < more[slow].mean() < 0.02  # what static friction adds, falling with the speed
    assert np.abs(more[fast]).max() < 0.05 * 0.02


def fit_friction(space: Space) -> None:
    coulomb, viscous, load = space["found"].intervals
    for one in (coulomb, viscous):
        assert one.determined
        assert one.low < space["truth"][one.name] < one.high
        assert not one.low < one.start < one.high
    assert not load.determined


def log(space: Space) -> None:
    assert space["same"]
    assert not space["path"].exists()
    assert dict(space["again"].metadata) == dict(space["result"].metadata)


CHECKS: dict[str, Callable[[Space], None]] = {
    "plot_1_step_response": step_response,
    "plot_2_transmission_error": transmission_error,
    "plot_3_hysteresis": hysteresis,
    "plot_4_rough_flanks": rough_flanks,
    "plot_5_bode": bode,
    "plot_6_effect": effect,
    "plot_7_fit_friction": fit_friction,
    "plot_8_log": log,
}


@pytest.fixture(autouse=True)
def no_windows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    backend = matplotlib.get_backend()
    plt.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)  # nothing depends on where an example is started
    yield
    plt.close("all")
    plt.switch_backend(backend)


def test_every_example_is_checked() -> None:
    assert sorted(path.stem for path in GALLERY.glob("*.py")) == sorted(CHECKS)


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
def test_an_example_shows_what_it_says(name: str) -> None:
    space = runpy.run_path(str(GALLERY / f"{name}.py"))
    CHECKS[name](space)
    figure = space["figure"]
    drawn = [axes for axes in figure.axes if axes.has_data()]
    assert drawn
    for axes in drawn:
        curves = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines])
        assert np.isfinite(curves).any()
        labels = [
            axes.get_ylabel(),
            axes.get_xlabel() or figure.axes[-1].get_xlabel(),
        ]  # the last one's is shared
        assert all(re.search(r"\[.+\]", label) for label in labels), labels
