"""A record whose temperature is measured is predicted with it."""

import numpy as np
import pytest

from hdsim.actuation.loads import Load
from hdsim.drive.parameters import Drive
from hdsim.effects.thermal_friction import ThermalFriction
from hdsim.estimate.predict import Candidate, Predictor, plan_for
from hdsim.estimate.records import Record

SPEED, BETA, BETA_C, REFERENCE = 200.0, 0.04, 0.012, 20.0
TIME = np.arange(0.0, 4.0, 1 / 400.0)
WARM = 33.0 + 12.0 * np.sin(2 * np.pi * 0.4 * TIME)
NOISE_K = 0.2


def record(**channels: np.ndarray) -> Record:
    """A motor at constant speed; its torque is not what is asked about."""
    torque = 0.1 + 0.01 * np.sin(TIME)
    return Record("soak", TIME, {"motor_angle": SPEED * TIME, "motor_torque": torque} | channels)


def predicted(given: Record, mesh: str) -> tuple[np.ndarray, Drive]:
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": mesh}})
    # The whole Coulomb friction changes; the node would not move from the reference temperature.
    effect = ThermalFriction(
        viscosity_coefficient_per_k=BETA,
        coulomb_nm=1.0,
        coulomb_coefficient_per_k=BETA_C,
        reference_degc=REFERENCE,
        ambient_degc=REFERENCE,
        heat_capacity_j_per_k=1e9,
    )
    candidate = Candidate(drive, {"thermal_friction": effect}, Load(inertia_kg_m2=0.1))
    return Predictor(given, plan_for(given), drive.ratio).predict(candidate)["motor_torque"], drive


def friction_of(drive: Drive, temperature_degc: np.ndarray | float) -> np.ndarray:
    """b exp(-beta (T - T_0)) w + T_c exp(-beta_c (T - T_0)), N m."""
    above = np.asarray(temperature_degc) - REFERENCE
    own = drive.friction
    viscous = own.viscous_nm_s_per_rad * np.exp(-BETA * above) * SPEED
    return viscous + own.coulomb_nm * np.exp(-BETA_C * above)


# Before, an elastic drive still rings from its start.
SETTLED = TIME > 1.0


@pytest.mark.parametrize("mesh", ["rigid", "lumped"])
def test_friction_is_that_of_the_measured_temperature(mesh: str) -> None:
    rng = np.random.default_rng(4)
    reading = WARM + NOISE_K * rng.standard_normal(len(TIME))
    reading[700:760] = np.nan  # the sensor was silent
    torque, drive = predicted(record(temperature=reading), mesh)
    wanted = friction_of(drive, WARM)
    assert np.ptp(wanted[SETTLED]) > 0.3 * np.mean(wanted)
    # The sensor's noise is smoothed away: as it reads it would leave 0.5 % of the torque.
    np.testing.assert_allclose(torque[SETTLED], wanted[SETTLED], rtol=4e-3)
    apart = np.std((torque - wanted)[SETTLED])
    assert apart < 0.3 * np.std(friction_of(drive, WARM + NOISE_K * rng.standard_normal(len(TIME))) - wanted)


@pytest.mark.parametrize("readings", ["absent", "missing", "too large"])
def test_without_a_temperature_that_can_be_trusted_the_effect_has_its_own(readings: str) -> None:
    wrong = {"absent": None, "missing": np.nan, "too large": 1e30}[readings]
    channels = {} if wrong is None else {"temperature": np.full(len(TIME), wrong)}
    torque, drive = predicted(record(**channels), "rigid")
    np.testing.assert_allclose(torque, friction_of(drive, REFERENCE), rtol=1e-6)


def test_a_temperature_that_stands_still_is_known_too() -> None:
    torque, drive = predicted(record(temperature=np.full(len(TIME), 41.0)), "rigid")
    np.testing.assert_allclose(torque, friction_of(drive, 41.0), rtol=1e-6)
