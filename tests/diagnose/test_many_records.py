"""Several records of one joint: what differs between them is evidence, for sensors have one zero."""

import numpy as np
import pytest

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.offsets import drift_columns, offset_columns, offsets_of, part_zeros
from hdsim.estimate.records import Record

RATIO = 100.0
COULOMB_NM, VISCOUS_NM_S_PER_RAD = 0.012, 1.0e-4
NOISE_NM = 5e-4
RIGID = """
name: rigid and without friction
drive:
  rated_torque_nm: 30
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  torsion:
    stiffness_k1_nm_per_rad: 1.6e4
    stiffness_k2_nm_per_rad: 2.5e4
    stiffness_k3_nm_per_rad: 2.9e4
    torque_t1_nm: 7
    torque_t2_nm: 25
  inertia: {motor_kg_m2: 3.0e-5, wave_generator_kg_m2: 1.0e-5}
  mesh: {model: rigid}
command: {motor: {type: free}}
load: {inertia_kg_m2: 1.0e-4}
run: {duration_s: 1.0}
"""


@pytest.fixture
def base(tmp_path):
    (tmp_path / "base.yaml").write_text(RIGID)
    return hdsim.load_scenario(tmp_path / "base.yaml")


def at_constant_speed(speed_rad_per_s: float, zero_nm: float = 0.004) -> Record:
    """A motor turning evenly against Coulomb and viscous friction, its torque read with an offset."""
    rng = np.random.default_rng(abs(int(1000 * speed_rad_per_s)))
    time = np.arange(900) * 4e-3
    angle = 0.3 + speed_rad_per_s * time
    torque = np.sign(speed_rad_per_s) * COULOMB_NM + VISCOUS_NM_S_PER_RAD * speed_rad_per_s + zero_nm
    channels = {
        "motor_angle": angle + 1e-5 * rng.standard_normal(len(time)),
        "motor_torque": torque + NOISE_NM * rng.standard_normal(len(time)),
    }
    return Record(f"{speed_rad_per_s} rad/s", time, channels)


@pytest.mark.slow
def test_friction_is_what_differs_between_records_at_constant_speed(base):
    learnt = [at_constant_speed(w) for w in (20, -40, 70, -90, 125)]
    held = [at_constant_speed(w) for w in (-30, 50, -80, 110)]
    verdict = diagnose(learnt, base, holdout=held).verdict
    assert [effect.name for effect in verdict.effects] == ["input_coulomb_viscous"]
    fitted = verdict.effects[0].parameters
    assert fitted["coulomb_nm"].value == pytest.approx(COULOMB_NM, rel=0.02)
    assert fitted["viscous_nm_s_per_rad"].value == pytest.approx(VISCOUS_NM_S_PER_RAD, rel=0.02)
    gap = verdict.gap["motor_torque"]
    assert gap.before > 10 * NOISE_NM
    assert gap.after < 1.1 * NOISE_NM


def test_motion_in_one_direction_is_said_to_leave_coulomb_friction_open(base):
    learnt = [at_constant_speed(w) for w in (20, 60, 125)]
    verdict = diagnose(learnt, base, holdout=[at_constant_speed(90)]).verdict
    [friction] = verdict.effects
    assert friction.parameters["viscous_nm_s_per_rad"].value == pytest.approx(VISCOUS_NM_S_PER_RAD, rel=0.02)
    assert any(p.kind == "one way" and p.channel == "motor_torque" for p in verdict.data_problems)


class _Series:
    def __init__(self, record, channel, n=10, noise=0.1, sigma=1.0):
        self.record, self.channel, self.noise, self.sigma = record, channel, noise, sigma
        self.reading, self.own_zero = noise, False
        self.train, self.hold = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)


def test_a_torque_has_one_zero_and_an_angle_one_for_each_record():
    series = [_Series(r, c) for c in ("motor_torque", "output_angle") for r in (0, 1)]
    values = [np.full(10, v) for v in (1.0, 3.0, 1.0, 3.0)]
    assert offsets_of(series, values, "campaign", drift=False) == [2.0, 2.0, 1.0, 3.0]
    assert offsets_of(series, values, "record", drift=False) == [1.0, 3.0, 1.0, 3.0]
    # A torque's zero may move by twice its noise between records.
    assert offsets_of(series, values, "campaign", drift=True) == pytest.approx([1.8, 2.2, 1.0, 3.0])


def test_a_zero_drifts_by_the_noise_of_a_reading_however_many_a_sample_is_the_mean_of():
    series = [_Series(r, "motor_torque", noise=0.1) for r in (0, 1)]
    for one in series:
        one.reading = 0.4  # means of 16
    values = [np.full(10, 1.0), np.full(10, 3.0)]
    assert offsets_of(series, values, "campaign", drift=True) == pytest.approx([1.2, 2.8])


@pytest.mark.parametrize(
    ("apart", "speeds", "parted"),
    [
        (0.15, ("swing", "swing"), True),  # nobody would see it in a record
        (0.25, ("swing", "swing"), False),  # more than zeros drift
        (0.15, ("slow", "fast"), False),  # at constant speeds it is friction
    ],
)
def test_zeros_part_where_records_tell_friction_by_themselves(apart, speeds, parted):
    series = [_Series(r, "motor_torque", noise=0.1) for r in (0, 1)]
    values = [np.full(10, 1.0 - apart), np.full(10, 1.0 + apart)]
    motions = {"swing": 10.0 * np.sin(np.arange(10)), "slow": np.full(10, 1.0), "fast": np.full(10, 20.0)}
    part_zeros(series, values, "campaign", [motions[speed] for speed in speeds])
    assert [one.own_zero for one in series] == [parted, parted]
    zeros = offsets_of(series, values, "campaign", drift=False)
    assert zeros == pytest.approx([1.0 - apart, 1.0 + apart] if parted else [1.0, 1.0])
    # What a shift of each zero does is one column each, or one of both.
    assert offset_columns(series, 2, "campaign").shape == (20, 2 if parted else 1)
    assert drift_columns(series, 2, "campaign")[0].shape == (20, 0 if parted else 2)


def test_a_zero_is_weighed_as_the_fit_weighs_it():
    series = [_Series(0, "motor_torque", n=10, sigma=1.0), _Series(1, "motor_torque", n=40, sigma=2.0)]
    rng = np.random.default_rng(0)
    values = [rng.standard_normal(10), 2.0 + rng.standard_normal(40)]
    columns = np.concatenate([np.full(10, 1.0), np.full(40, 0.5)])
    whitened = np.concatenate([values[0], values[1] / 2.0])
    least_squares = columns @ whitened / (columns @ columns)
    assert offsets_of(series, values, "campaign", drift=False) == pytest.approx([least_squares] * 2)
