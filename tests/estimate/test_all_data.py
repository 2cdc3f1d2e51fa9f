"""Numbers from all data, once the held-out part has judged the model."""

import numpy as np
import pytest
from rig import TRUTH, model, record

import hdsim
from hdsim.errors import InputError
from hdsim.estimate import all_data
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

#: A rotor with friction, N m and N m s/rad, kg m2.
COULOMB, VISCOUS, INERTIA = 0.03, 3.5e-4, 1.2e-4
JOINT = {
    "drive": {
        "preset": "csg-20-100",
        "mesh": {"model": "rigid"},
        "inertia": {"motor_kg_m2": 0.8 * INERTIA, "wave_generator_kg_m2": 0.0},
        "friction": {"coulomb_nm": 1.3 * COULOMB, "viscous_nm_s_per_rad": VISCOUS, "load_coefficient": 0.0},
    },
    "command": {"motor": {"type": "free"}},
    "load": {"inertia_kg_m2": 1e-9},
    "run": {"duration_s": 1.0},
}


def starts_and_stops(seed: int) -> Record:
    """A joint that turns one way: it starts in 0.7 s, and stops in the last ninth, which is held out."""
    rate, seconds, top = 500.0, 9.0, 60.0
    t = np.arange(round(rate * seconds)) / rate

    def rise(begin):
        u = np.clip((t - begin) / 0.7, 0.0, 1.0)
        slope = np.where((u > 0) & (u < 1), 6 * u * (1 - u) / 0.7, 0.0)
        return 3 * u**2 - 2 * u**3, slope

    (up, faster), (down, slower) = rise(0.2), rise(8.1)
    speed, acceleration = top * (up - down), top * (faster - slower)
    angle = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / (2 * rate))])
    torque = INERTIA * acceleration + COULOMB * np.tanh(speed / 0.5) + VISCOUS * speed
    rng = np.random.default_rng(seed)
    angle = angle + 1e-4 * rng.standard_normal(len(t))
    return Record(
        "joint", t, {"motor_angle": angle, "motor_torque": torque + 4e-3 * rng.standard_normal(len(t))}
    )


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_friction_of_a_joint_that_stops_out_of_sight_is_known_by_all_data(seed):
    """Start and stop tell friction from inertia; either alone does not."""
    base, one = Scenario.model_validate(JOINT), starts_and_stops(seed)
    asked = {"fix": ["motor_torque_gain"], "zeros": "trusted"}
    part = hdsim.fit([one], base, **asked)
    whole = hdsim.fit([one], base, **asked, all_data=True)
    widths = {}
    for found in (part, whole):
        number = next(n for n in found.intervals if n.name == "drive.friction.coulomb_nm")
        assert number.low < COULOMB < number.high
        widths[found.estimated_from] = number.high - number.low
    assert widths["all"] < 0.8 * widths["training"]
    # The validation is of what was held out then.
    assert whole.gap == part.gap
    masks = [(series.train, series.hold) for series in whole.bench.series]
    assert all(not (train & hold).any() and hold.any() for train, hold in masks)


def test_all_rows_count_for_a_while_only(tmp_path):
    base = model(tmp_path)
    bench = bench_for([record(0, 3.0)], [], base)
    found = refit(bench, state_of(base)).fit
    before = [(series.train, series.hold) for series in bench.series]
    with all_data.on_all_data(bench, found) as final:
        assert final is not found
        for series, (train, hold) in zip(bench.series, before, strict=True):
            assert np.array_equal(series.train, train | hold)
    for series, (train, hold) in zip(bench.series, before, strict=True):
        assert series.train is train
        assert series.hold is hold


def test_every_number_is_as_true_and_better_known(tmp_path):
    base = model(tmp_path)
    part, whole = (
        hdsim.fit([record(0, 6.0)], base, fix=["motor_torque_gain"], all_data=all_data)
        for all_data in (False, True)
    )
    known = {number.name: number for number in part.intervals}
    shares = []
    for number in whole.intervals:
        if number.determined and known[number.name].determined:
            assert number.low < TRUTH[number.name] < number.high
            shares.append((number.high - number.low) / (known[number.name].high - known[number.name].low))
    assert len(shares) == len(TRUTH)
    # Three halves of the data; an interval is an estimate, too.
    assert 0.7 < np.median(shares) < 0.95


def test_a_diagnosis_has_the_numbers_of_its_effects_from_all_data():
    """The rotor has no friction in the base: the effect's numbers are those of all data."""
    none = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
    base = Scenario.model_validate({**JOINT, "drive": {**JOINT["drive"], "friction": none}})
    part, whole = (
        hdsim.diagnose(starts_and_stops(0), base, zeros="trusted", all_data=all_data)
        for all_data in (False, True)
    )
    (one,), (two,) = part.verdict.effects, whole.verdict.effects
    assert one.name == two.name == "input_coulomb_viscous"
    known, better = (effect.parameters["coulomb_nm"] for effect in (one, two))
    assert better.interval[1] - better.interval[0] < known.interval[1] - known.interval[0]
    assert better.interval[0] < COULOMB < better.interval[1]
    assert (part.verdict.estimated_from, whole.verdict.estimated_from) == ("training", "all")
    assert whole.verdict.gap == part.verdict.gap
    # The scenario that is written has them.
    assert whole.changes["effects.input_coulomb_viscous"].coulomb_nm == pytest.approx(better.value)


def test_records_that_are_held_out_stay_unseen(tmp_path):
    one, other = record(0, 3.0), record(1, 3.0)
    for run in (hdsim.fit, hdsim.diagnose):
        with pytest.raises(InputError, match="--all-data: records of --holdout are used in no fit"):
            run([one], model(tmp_path), holdout=[other], all_data=True)


@pytest.mark.parametrize("friction", [1.3, 0.0])
def test_where_all_data_cannot_be_followed_all_stays_as_it_was(monkeypatch, friction):
    """A number that is wrong, and an effect that is missing."""
    own = {key: friction * value for key, value in JOINT["drive"]["friction"].items()}
    base = Scenario.model_validate({**JOINT, "drive": {**JOINT["drive"], "friction": own}})
    part = hdsim.diagnose(starts_and_stops(0), base, zeros="trusted").verdict

    def lost(bench, found):
        raise PredictionError

    monkeypatch.setattr(all_data, "together", lost)
    whole = hdsim.diagnose(starts_and_stops(0), base, zeros="trusted", all_data=True).verdict
    assert whole.estimated_from == "training"
    assert part.verdict == ("effect" if friction == 0.0 else "parameter")
    for what in ("sentence", "parameters", "moved", "effects", "gap"):
        assert getattr(whole, what) == getattr(part, what)
