"""A damping is told where the measured motion resolves the resonance, and taken back where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from noisy import noisy
from scipy.interpolate import CubicSpline

import hdsim
from hdsim.estimate.estimation import estimate
from hdsim.estimate.records import Record
from hdsim.estimate.resolved import DAMPING, lost
from hdsim.scenario import Scenario

DRIVE = {
    "drive": {"preset": "seed-2021", "mesh": {"model": "lumped"}},
    "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
    "command": {
        "motor": {
            "type": "position",
            "at": "output",
            "trajectory": {
                "type": "chirp",
                "amplitude_deg": 2.0,
                "start_frequency_hz": 0.2,
                "end_frequency_hz": 10.0,
                "duration_s": 20.0,
            },
            "controller": {
                "type": "cascade",
                "position_gain_per_s": 30,
                "velocity_gain_nm_s_per_rad": 0.025,
                "velocity_integral_gain_nm_per_rad": 0.5,
            },
        }
    },
    "run": {"duration_s": 20.0, "sample_rate_hz": 500.0},
}
NOISE = {"motor_angle": 2e-5, "output_angle": 3e-6, "motor_torque": 3e-3}


@pytest.mark.parametrize("cycles", [0.05, 0.125, 0.25, 0.4])
def test_what_a_cubic_spline_keeps_of_a_sine_is_that_of_scipys(cycles):
    # 400 knots, a whole number of periods: the spline's first Fourier coefficient is what it keeps.
    knots = np.arange(401)
    values = np.sin(2 * np.pi * cycles * knots)
    values[-1] = values[0]  # to the last digit
    spline = CubicSpline(knots, values, bc_type="periodic")
    fine = np.arange(400 * 32) / 32
    kept = 2.0 * np.mean(spline(fine) * np.sin(2 * np.pi * cycles * fine))
    assert lost(cycles) == pytest.approx(1.0 - kept, abs=2e-4)


def test_beyond_half_a_period_a_knot_all_is_lost():
    assert lost(0.5) == lost(3.0) == 1.0
    assert lost(0.0) == pytest.approx(0.0, abs=1e-12)


@pytest.fixture(scope="module")
def run():
    return hdsim.simulate(Scenario.model_validate(DRIVE))


def every(run, count):
    """What sensors read of a run at so many times its period."""
    whole = noisy(run, NOISE, seed=3)
    return Record("run", whole.time[::count], {c: values[::count] for c, values in whole.channels.items()})


@pytest.mark.parametrize(("count", "told"), [(2, True), (5, False)])
def test_a_damping_has_an_interval_only_where_the_motion_resolves_the_resonance(run, count, told):
    base = Scenario.model_validate(DRIVE)
    found = estimate([every(run, count)], base)
    (one,) = [interval for interval in found.intervals if interval.name == DAMPING]
    warned = [problem.message for problem in found.problems if problem.kind == "resonance"]
    assert bool(one.determined) is told
    if told:
        assert one.low <= one.start <= one.high
        assert not warned
    else:
        # What the spline loses is made up for by twice the damping and more.
        assert one.value > 2.0 * one.start
        assert not one.moved
        (message,) = warned
        assert "resonance near 28" in message
        assert "not determined" in message


def test_a_rigid_drive_has_no_resonance_to_resolve(run):
    rigid = Scenario.model_validate(DRIVE | {"drive": {"preset": "seed-2021", "mesh": {"model": "rigid"}}})
    found = estimate([every(run, 5)], rigid)
    assert not [problem for problem in found.problems if problem.kind == "resonance"]
