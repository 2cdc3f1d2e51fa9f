"""A load that is set free in the middle of a run, against the free oscillation of a damped spring."""

import math

import numpy as np
import pytest

from hdsim.actuation.shapes import Hold
from hdsim.actuation.signal_data import SignalData
from hdsim.drive.model import Model
from hdsim.scenario import Scenario
from hdsim.simulation.run import RunFailed
from hdsim.simulation.sample import SetFree, sample, samples_beside

STIFFNESS, DAMPING, INERTIA, FREE_S = 3.0e3, 8.0, 2.0, 0.3
ANGLE, SPEED, SMALL = 2e-4, -1.5e-2, 1e-9
TIMES = np.linspace(0.0, 1.5, 601)


def model() -> Model:
    """A load on the spring of a drive whose motor is held."""
    scenario = Scenario.model_validate({
        "drive": {
            "preset": "csg-20-100",
            "mesh": {"model": "lumped"},
            "torsion": {
                "stiffness_k1_nm_per_rad": STIFFNESS, "stiffness_k2_nm_per_rad": STIFFNESS,
                "stiffness_k3_nm_per_rad": STIFFNESS, "damping_nm_s_per_rad": DAMPING,
            },
        },
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": INERTIA},
        "run": {"duration_s": 1.5},
    })  # fmt: skip
    return Model(
        scenario.drive,
        [],
        load_inertia_kg_m2=INERTIA,
        motions={"motor": SignalData(Hold().move())},
        audited=False,
    )


def free(model: Model, angle: float, speed: float) -> np.ndarray:
    """Angle of the output by the solution of a damped oscillation that begins at ``FREE_S``."""
    inertia = model.inertias[2]
    decay = DAMPING / (2.0 * inertia)
    rate = math.sqrt(STIFFNESS / inertia - decay**2)
    t = np.maximum(TIMES - FREE_S, 0.0)
    swing = angle * np.cos(rate * t) + (speed + decay * angle) / rate * np.sin(rate * t)
    return np.where(TIMES < FREE_S, 0.0, np.exp(-decay * t) * swing)


def jumps(model: Model, *swings: tuple[float, float]) -> SetFree:
    found = np.zeros((len(swings), model.system.size))
    at = model.place_of["output"]
    found[:, at : at + 2] = swings
    return SetFree(FREE_S, found)


def test_a_load_that_is_set_free_swings_as_a_damped_oscillator():
    one = model()
    steps: list[int] = []
    (found,) = samples_beside(
        one, (), TIMES, ["output_angle"], rtol=1e-9, steps=steps, set_free=jumps(one, (ANGLE, SPEED))
    )
    assert found["output_angle"] == pytest.approx(free(one, ANGLE, SPEED), abs=1e-6 * ANGLE)
    # Those before count too.
    late: list[int] = []
    samples_beside(
        one, (), TIMES[TIMES >= FREE_S], ["output_angle"], rtol=1e-9, steps=late,
        set_free=jumps(one, (ANGLE, SPEED)),
    )  # fmt: skip
    assert steps == late
    assert steps[0] > 0


def test_what_more_of_a_swing_would_do_is_integrated_beside_it():
    one = model()
    free_beside = jumps(one, (ANGLE, SPEED), (ANGLE + SMALL, SPEED), (ANGLE, SPEED + SMALL))
    here, *there = samples_beside(one, [one, one], TIMES, ["output_angle"], rtol=1e-9, set_free=free_beside)
    for found, unit in zip(there, ((1.0, 0.0), (0.0, 1.0)), strict=True):
        slope = (found["output_angle"] - here["output_angle"]) / SMALL
        assert slope == pytest.approx(free(one, *unit), abs=1e-4 * np.abs(free(one, *unit)).max())


def test_a_load_that_is_not_thrown_moves_as_without():
    one = model()
    (found,) = samples_beside(one, (), TIMES, ["output_angle"], set_free=jumps(one, (0.0, 0.0)))
    assert found["output_angle"] == pytest.approx(sample(one, TIMES, ["output_angle"])["output_angle"])


def test_a_load_that_flies_away_fails():
    one = model()
    with pytest.raises(RunFailed):
        samples_beside(one, (), TIMES, ["output_angle"], set_free=jumps(one, (0.0, 1e9)))
