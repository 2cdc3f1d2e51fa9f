"""Predictions with teeth: the short cut against the whole model and the limit of no teeth, and its cost."""

import numpy as np
import pytest

from hdsim.drive import kept_teeth, tabulated
from hdsim.drive.model import Model
from hdsim.drive.parameters import TabulatedMesh, TeethMesh
from hdsim.estimate import short_cut
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.short_cut import LIMIT, follow_teeth, short_cut_of, whole_models
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario
from hdsim.simulation.rosenbrock import rodas4_through
from hdsim.simulation.spans import stops
from hdsim.tell.words import short_cut_words

NOISE = {"motor_angle": 2e-5, "output_angle": 4e-6, "motor_torque": 6e-3, "output_torque": 0.15}
RATIO = -100.0
#: A swing under gravity, whose torque reverses through the gap twice a period; a fast one without gravity, in
#: which the load's inertia throws it from flank to flank.
MOTIONS = {"under gravity": (30.0, 0.5), "slow": (30.0, 0.25), "thrown": (1.0, 3.0)}
HELD = {"mass_kg": 4.0, "centre_of_mass_m": 0.3}


def scenario(mesh, motion="under gravity", *, effects=(), torsion=None, **section):
    return Scenario.model_validate({
        "drive": {"preset": "seed-2021", "mesh": {"model": mesh, **section}, "torsion": torsion or {}},
        "effects": {name: {} for name in effects},
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 0.5} | ({"gravity": HELD} if motion != "thrown" else {}),
        "run": {"duration_s": 1.0},
    })  # fmt: skip


def swing(motion="under gravity", seconds=1.0):
    degrees, hertz = MOTIONS[motion]
    time = np.arange(round(1000 * seconds) + 1) / 1000
    angle = RATIO * np.radians(degrees) * np.sin(2 * np.pi * hertz * time)
    channels = {"motor_angle": angle, "output_angle": angle / RATIO}
    channels |= {"motor_torque": np.cos(time), "output_torque": np.cos(time)}
    rng = np.random.default_rng(0)
    return Record(
        "swing", time, {c: v + NOISE[c] * rng.standard_normal(len(time)) for c, v in channels.items()}
    )


def opened(base, motion="under gravity"):
    return bench_for([swing(motion)], [], base), state_of(base)


def both(bench, state):
    short = bench.predict(state)
    with whole_models(bench):
        return short, bench.predict(state)


def model_of(base, **given):
    parts = [*base.effects.active().values(), base.load]
    return Model(base.drive, parts, load_inertia_kg_m2=0.5, audited=False, **given)


@pytest.mark.parametrize(
    ("motion", "effects", "section"),
    [
        ("under gravity", (), {}),
        ("thrown", (), {"gap_factor": 2.0}),
        ("under gravity", (), {"engagement": {"kind": "clearance"}}),
        ("under gravity", ("torsional_hysteresis_maxwell",), {}),
        ("thrown", (), {"damping_nm_s_per_rad": 2.0}),
    ],
)
def test_the_short_cut_stays_a_small_part_of_the_noise(motion, effects, section):
    bench, state = opened(scenario("teeth", motion, effects=effects, **section), motion)
    found = short_cut_of(bench, *both(bench, state))
    assert found.taken
    error = found.error
    assert set(error) == {"motor_torque", "output_angle", "output_torque"}
    assert max(error.values()) < 0.03
    # Not the same predictions after all: the whole model follows its ring.
    assert min(error.values()) > 0.0


def test_the_whole_model_is_as_good_as_one_that_follows_the_ring_to_the_end():
    bench, state = opened(scenario("teeth"))
    short, whole = both(bench, state)
    away = short_cut_of(bench, short, whole).error
    # A hundredth of the tolerance resolves the ring's own vibration.
    bench.predictors[0].rtol = 1e-8
    with whole_models(bench):
        exact = bench.predict(state)
    for channel, left in short_cut_of(bench, whole, exact).error.items():
        assert left < 0.5 * away[channel], channel


def test_teeth_that_give_way_to_nothing_leave_the_lumped_drive():
    # No gap, a stiff contact, no bending: then the cup has all of the catalogue's wind-up.
    stiff = {
        "half_gap_m": 0.0,
        "tooth_bending_stiffness_n_per_m": None,
        "contact": {"law": "constant", "contact_stiffness_n_per_m": 1e12},
    }
    bench, state = opened(scenario("teeth", **stiff))
    found = bench.predict(state)
    plain, base = opened(scenario("lumped"))
    for series, teeth, lumped in zip(bench.series, found, plain.predict(base), strict=True):
        away = np.std((teeth - lumped)[series.train])
        assert away < 0.05 * NOISE[series.channel], series.channel


def test_a_table_is_made_once_and_is_the_same_to_the_last_bit():
    base = scenario("tabulated")
    first = model_of(base)
    other = base.with_({
        "drive.friction.coulomb_nm": 0.05,
        "drive.torsion.damping_nm_s_per_rad": 2.0,
        "drive.torsion.stiffness_k1_nm_per_rad": 1.5e4,
    })  # fmt: skip
    made = tabulated._kept.cache_info().misses
    second = model_of(other)
    assert tabulated._kept.cache_info().misses == made
    tabulated._kept.cache_clear()
    kept_teeth._kept_teeth.cache_clear()
    np.testing.assert_array_equal(model_of(other).teeth.parameters, second.teeth.parameters)
    assert second.teeth.fingerprint == first.teeth.fingerprint
    assert model_of(scenario("teeth")).teeth.fingerprint == first.teeth.fingerprint


@pytest.mark.parametrize(
    "change",
    [
        {"gap_factor": 1.1},
        {"pitch_error_m": 1e-7},
        {"tooth_bending_stiffness_n_per_m": 1.3e8},
        {"engagement": {"share": 0.29}},
    ],
)
def test_teeth_that_were_moved_are_summed(change):
    known = frozenset({model_of(scenario("teeth")).teeth.fingerprint})
    assert isinstance(model_of(scenario("teeth"), table_for=known).teeth.mesh, TabulatedMesh)
    for mesh in ("teeth", "tabulated"):
        assert isinstance(model_of(scenario(mesh, **change), table_for=known).teeth.mesh, TeethMesh)
    # An effect that widens the gap moves them too.
    worn = scenario("teeth", effects=("mesh_preload",))
    assert isinstance(model_of(worn, table_for=known).teeth.mesh, TeethMesh)


def test_teeth_of_which_one_is_out_of_place_are_always_in_a_table():
    known = frozenset({model_of(scenario("teeth")).teeth.fingerprint})
    moved = scenario("teeth", engagement={"share": 0.26}, effects=("tooth_error",))
    tabulated_ones, summed = (model_of(moved, table_for=given).teeth for given in (known, None))
    assert isinstance(tabulated_ones.mesh, TabulatedMesh)
    assert isinstance(summed.mesh, TeethMesh)
    assert tabulated_ones.table_error < 1e-3  # of the rated torque


def test_a_search_takes_the_teeth_that_it_has_come_to_from_a_table_too():
    bench, base = opened(scenario("teeth"))
    moved, other = (state_of(scenario("teeth", engagement={"share": share})) for share in (0.26, 0.34))
    predictor = bench.predictors[0]

    def summed(state):
        model = Model(
            state.drive, load_inertia_kg_m2=0.5, audited=False, seed=state.seed, table_for=predictor.table_for
        )
        return isinstance(model.teeth.mesh, TeethMesh)

    assert [summed(state) for state in (base, moved, other)] == [False, True, True]
    _, whole = both(bench, moved)
    follow_teeth(bench, base, moved)
    assert [summed(state) for state in (base, moved, other)] == [False, False, True]
    table, _ = both(bench, moved)
    assert max(short_cut_of(bench, table, whole).error.values()) < LIMIT
    follow_teeth(bench, base, other)
    assert [summed(state) for state in (base, moved, other)] == [False, True, False]


def test_a_short_cut_that_errs_too_far_is_not_taken(monkeypatch):
    assert LIMIT <= 0.1
    monkeypatch.setattr(short_cut, "LIMIT", 0.0)
    bench, state = opened(scenario("teeth"))
    assert bench.predictors[0].whole
    short, whole = both(bench, state)
    np.testing.assert_array_equal(short[0], whole[0])
    found = short_cut_of(bench, short, whole)
    assert not found.taken
    assert 0.0 < max(found.error.values()) < 0.03  # what it would have been
    assert "All predictions are those of the whole model" in short_cut_words(found)


def test_a_base_without_teeth_has_no_short_cut():
    bench, state = opened(scenario("lumped"))
    assert short_cut_of(bench, *both(bench, state)) is None


def test_a_ring_that_nothing_damps_stands_in_balance():
    damped = scenario("teeth")
    assert damped.drive.settled() is damped.drive
    bare = scenario("teeth", torsion={"damping_nm_s_per_rad": 0.0})
    assert bare.drive.settled().mesh.ring == "static"
    # The mesh's own damper serves as well.
    oiled = scenario("teeth", torsion={"damping_nm_s_per_rad": 0.0}, damping_nm_s_per_rad=1.0)
    assert oiled.drive.settled().mesh.ring == "dynamic"
    assert scenario("lumped").drive.settled().mesh.model == "lumped"
    # Where the damping goes towards nothing, so does what it does.
    bench, state = opened(bare)
    little = state_of(scenario("teeth", torsion={"damping_nm_s_per_rad": 0.06}))
    apart = [a - b for a, b in zip(bench.predict(state), bench.predict(little), strict=True)]
    near = state_of(scenario("teeth", torsion={"damping_nm_s_per_rad": 0.6}))
    farther = [a - b for a, b in zip(bench.predict(state), bench.predict(near), strict=True)]
    angle = next(k for k, s in enumerate(bench.series) if s.channel == "output_angle")
    assert np.std(apart[angle]) < 0.5 * np.std(farther[angle])


def test_what_the_ring_costs():
    """Evaluations of the right-hand side, which make the time: at most three times those without teeth."""

    def evaluations(mesh, as_the_load=False):
        predictor = opened(scenario(mesh), "slow")[0].predictors[0]
        model = model_of(scenario(mesh), motions={"motor": predictor.motion})
        end = float(predictor.record.time[-1])
        scale = model.seen_scale()
        if as_the_load:
            scale[model.place_of["ring"] + 1] = scale[model.place_of["output"] + 1]
        found = rodas4_through(
            model.system,
            np.array([0.0, end]),
            model.system.y0,
            predictor.record.time,
            rtol=1e-6,
            atol=1e-6 * scale,
            stops=stops(model, end),
        )
        assert found.success
        return found.statistics.nfev

    short = evaluations("tabulated")
    assert short < evaluations("tabulated", as_the_load=True) / 3
    assert short < 3 * evaluations("lumped")
