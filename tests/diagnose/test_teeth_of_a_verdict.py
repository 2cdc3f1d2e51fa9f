"""What a verdict says of teeth: the number of a tooth, a half-gap, and a lumped drive's play as teeth."""

import numpy as np
import pytest

import hdsim
from hdsim.diagnosis.teeth import teeth_found, toothed_changes
from hdsim.diagnosis.verdict import IdentifiedEffect
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.drive.play_as_teeth import play_as_teeth
from hdsim.drive.spring import catalogue_wind_up
from hdsim.errors import PhysicsError
from hdsim.estimate.found import ParameterEstimate
from hdsim.estimate.state import state_of
from hdsim.scenario.writer import to_yaml
from hdsim.studies.bench import torsion
from hdsim.studies.metrics.torsion import torsion_loop
from hdsim.surface.flank import Flank, structure_function

ARCMIN = np.pi / 10800


def named(name, settings=None, **parameters):
    return IdentifiedEffect(
        name=name,
        confidence=0.9,
        chance=0.01,
        explained=0.9,
        settings=settings or {},
        parameters={k: ParameterEstimate(value=v[0], interval=v[1:] or None) for k, v in parameters.items()},
    )


def state(mesh, effects=None, **drive):
    return state_of(
        hdsim.Scenario.model_validate(
            {
                "drive": {"preset": "csg-20-100", "mesh": mesh} | drive,
                "effects": effects or {},
                "command": {"motor": {"type": "locked"}},
                "load": {"inertia_kg_m2": 0.5},
                "run": {"duration_s": 1.0},
            }
        )
    )


@pytest.mark.parametrize(
    ("member", "value", "tooth", "opposite"),
    [("flexspline", 57.2, 57, 157), ("flexspline", -43.0, 57, 157), ("circular_spline", 158.0, 57, 158)],
)
def test_a_tooth_has_a_number_an_interval_and_an_opposite(member, value, tooth, opposite):
    effect = named(
        "tooth_error", {"member": member}, tooth=(value, value - 1.0, value + 1.4), shift_um=(9.0, 8.0, 10.0)
    )
    found = teeth_found([effect], state({"model": "teeth"}))
    assert found.member == member
    assert found.tooth.value == pytest.approx(tooth, abs=0.21)
    assert found.opposite == pytest.approx(opposite, abs=0.21)
    low, high = found.tooth.interval
    assert (low, high) == pytest.approx((found.tooth.value - 1.0, found.tooth.value + 1.4))
    (said,) = found.sentences
    assert f"tooth {tooth} ({low:.0f} to {high:.0f}) of the {member.replace('_', ' ')}" in said
    assert f"tooth {opposite}:" in said


def test_wear_of_a_drive_with_teeth_is_told_as_its_half_gap():
    base = state({"model": "tabulated"})
    effect = named("output_backlash", backlash_arcmin=(0.5, 0.4, 0.6))
    found = teeth_found([effect], base)
    worn = state({"model": "tabulated"}, {"output_backlash": {"backlash_arcmin": 0.5}})
    new, old = (
        Model(one.drive, list(one.effects.values()), load_inertia_kg_m2=0.5).teeth for one in (worn, base)
    )
    extra = new.parameters[19] - old.parameters[19]  # EXTRA_GAP
    assert found.half_gap_um.start == pytest.approx(1e6 * old.half_gaps_m.mean(), rel=1e-9)
    assert found.half_gap_um.value == pytest.approx(1e6 * (old.half_gaps_m.mean() + extra), rel=1e-9)
    low, high = found.half_gap_um.interval
    assert low < found.half_gap_um.value < high
    tighter = teeth_found([named("mesh_preload", interference_arcmin=(0.05, 0.04, 0.06))], base)
    assert tighter.half_gap_um.value < tighter.half_gap_um.interval[1] < tighter.half_gap_um.start


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("arcmin", [0.3, 2.0])
def test_the_drive_with_teeth_winds_up_as_the_lumped_one_with_the_play(arrangement, arcmin):
    drive = Drive.model_validate(
        {"preset": "csg-20-100", "mesh": {"model": "lumped"}, "arrangement": arrangement}
    )
    found = play_as_teeth(drive, arcmin * ARCMIN)
    whole = Drive.model_validate({"preset": "csg-20-100", "arrangement": arrangement} | found.changes)
    teeth = Model(whole, load_inertia_kg_m2=0.5).teeth
    assert teeth.half_gaps_m.mean() == pytest.approx(found.half_gap_m, rel=1e-6)
    torque = np.array([0.3, 0.6, 1.0]) * whole.rated_torque_nm
    wanted = catalogue_wind_up(drive.torsion, torque) + 0.5 * arcmin * ARCMIN
    has = np.array([teeth.wind_up(t) for t in torque]) + teeth.structure_wind_up(torque)
    assert has == pytest.approx(wanted, rel=0.01)
    # Heights, and the root of the structure function with them, go with G^(D - 2).
    given = {"circular_spline": 2.384e-11, "flexspline": 1.152e-10}
    for name, roughness in found.roughness_m.items():
        dimension = found.dimensions[name]
        ratio = structure_function(1e-5, Flank(dimension, roughness)) / structure_function(
            1e-5, Flank(dimension, given[name])
        )
        assert np.sqrt(ratio) == pytest.approx(found.heights, rel=1e-9)
    assert found.rough == (arcmin < 1.0)


def test_a_play_without_flanks_that_could_leave_it_says_so():
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "lumped"}})
    with pytest.raises(PhysicsError):
        play_as_teeth(drive, 600 * ARCMIN)


def test_the_written_scenario_has_the_lumped_ones_lost_motion(tmp_path):
    play = 0.4
    base = state({"model": "lumped"})
    effects = [named("output_backlash", backlash_arcmin=(play, 0.36, 0.44))]
    said = teeth_found(effects, base)
    assert said.half_gap_um.value == pytest.approx(
        0.5e6 * play * ARCMIN * 0.0254 * np.cos(np.radians(10)), rel=2e-3
    )
    assert "half-gap of" in said.sentences[0]
    assert "G = " in said.sentences[0]
    found = torsion.build(
        {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        effects={"output_backlash": {"backlash_arcmin": play}},
        period_s=4.0,
    )
    (tmp_path / "found.yaml").write_text(to_yaml(found.model_dump(mode="json", exclude_defaults=True)))
    changes = toothed_changes(effects, base)
    (tmp_path / "toothed.yaml").write_text(to_yaml({"extends": "found.yaml"} | changes))
    toothed = hdsim.load_scenario(tmp_path / "toothed.yaml")
    assert toothed.drive.mesh.model == "teeth"
    assert "output_backlash" not in toothed.effects.active()
    loops = [torsion_loop(hdsim.simulate(one)) for one in (found, toothed)]
    rated = toothed.drive.rated_torque_nm
    for share, within in ((0.04, 0.06), (0.3, 0.01), (0.9, 0.01)):
        lumped, teeth = (loop.lost_motion(share * rated) for loop in loops)
        assert teeth == pytest.approx(lumped, rel=within)


def test_other_meshes_and_effects_say_nothing_of_teeth():
    ripple = named("motor_torque_ripple")
    play = named("output_backlash", backlash_arcmin=(0.5,))
    assert teeth_found([ripple], state({"model": "teeth"})) is None
    assert teeth_found([play], state({"model": "rigid"})) is None
    assert toothed_changes([play], state({"model": "rigid"})) is None
    assert toothed_changes([ripple], state({"model": "lumped"})) is None
