"""Real machines, where their data are at hand; see the SOURCE.md beside them for their origin and licence."""

from pathlib import Path

import pytest

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.records import record_from

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
KINOVA = DATA / "kinova-gen3-7dof" / "validation_data"
CYCLOIDAL = DATA / "cycloidal-backlash-hysteresis" / "2024-07-11__15-56-27__torqueramp__base_runin6.csv"

#: Coulomb friction (N m at the output) of a straight-line fit of motor torque less sensor torque over the
#: velocity and its sign, first record (SOURCE.md).
FRICTION_NM = {1: 2.66, 3: 2.17, 4: 2.44, 6: 1.18, 7: 1.14}
#: What least squares of the motor's torque leave in the held-out stretches of both records, N m at the motor:
#: over velocity and its sign of a spline with a knot each 72 ms, beside inertia and the sensor's torque.
REGRESSED_NM = {1: 0.0093, 3: 0.0100, 4: 0.0101, 6: 0.0048, 7: 0.0083}
#: Most that may be left of the gap: a quarter. Joint 6 turns one way in most of its held-out stretches: there
#: friction is an offset, and no gap, and more than a quarter does not repeat from turn to turn of the motor
#: (which the test holds against the data).
LEFT = {1: 0.25, 3: 0.25, 4: 0.25, 6: 0.47, 7: 0.25}
#: Names of one thing for these data: friction that turns with the direction.
FRICTIONS = {"input_coulomb_viscous", "lugre_friction", "load_dependent_loss", "stribeck_friction"}
#: Amplitudes of SOURCE.md, N m at the output: of the torque sensor's order 2, of the motor's order 12.
SENSORS = ("sensors", "output_torque.ripple.0", "amplitude_nm", 2.0)
MOTOR = ("motor_torque_ripple", "components.0", "cogging_nm", 12.0)
RIPPLE_NM = {
    1: [(*SENSORS, 0.167, 1.0)],
    3: [(*SENSORS, 0.084, 1.0)],
    7: [(*SENSORS, 0.054, 1.0), (*MOTOR, 1.2, 100.0)],
}

#: Lost motion of the actuator's loops at zero torque, as read off the recording.
LOST_MOTION_DEG = 3.2
HYSTERESES = {"torsional_hysteresis_maxwell", "torsional_hysteresis_duhem"}


def kinova(joint: int):
    mapping = ROOT / "scenarios" / "mappings" / f"kinova_joint_{joint}.yaml"
    files = [KINOVA / f"opti_traj_testing{k}.csv" for k in (1, 2)]
    records = [record_from(hdsim.import_recording(file, mapping), file.stem) for file in files]
    base = hdsim.load_scenario(ROOT / "scenarios" / "bases" / "kinova_rigid.yaml")
    return diagnose(records, base, load="output_torque").verdict


@pytest.mark.slow
@pytest.mark.skipif(not KINOVA.exists(), reason="the recordings are not here")
@pytest.mark.parametrize(
    "joint", [pytest.param(j, marks=pytest.mark.study) if j in (4, 6, 7) else j for j in FRICTION_NM]
)
def test_kinova_joints_lack_friction_first_then_the_ripples_that_their_source_lists(joint):
    found = kinova(joint)
    assert found.verdict == "effect"
    first = found.effects[0]
    names = {first.name, *first.indistinguishable_from}
    assert "input_coulomb_viscous" in names
    assert names <= FRICTIONS
    if first.name == "input_coulomb_viscous":
        assert 100 * first.parameters["coulomb_nm"].value == pytest.approx(FRICTION_NM[joint], rel=0.35)
    assert {effect.name for effect in found.effects[1:]} <= {"sensors", "motor_torque_ripple"}
    gap = found.gap["motor_torque"]
    assert gap.after < 1.05 * REGRESSED_NM[joint]
    assert gap.after < LEFT[joint] * gap.before
    assert gap.after < 1.3 * gap.regression
    # What no law of angle, speed and load explains: it is none of them from one turn to the next.
    floor = gap.after * (1.0 - gap.intervals["repeats"][1]) ** 0.5
    assert LEFT[joint] == 0.25 or floor > 0.25 * gap.before
    # Of the bound of the search nothing is told: the acceleration is the motion's, not its readings' errors'.
    inertia = found.parameters["drive.inertia.motor_kg_m2"]
    assert inertia.value > 0.1 * inertia.start
    # The mapping masks the control loop's hiccups, or the check finds them: said either way.
    assert any(p.kind in ("spikes", "missing") and p.channel == "motor_torque" for p in found.data_problems)
    for name, place, size, order, amplitude, ratio in RIPPLE_NM.get(joint, []):
        ripple = next(effect for effect in found.effects if effect.name == name)
        assert ripple.parameters[f"{place}.order"].value == order
        assert ratio * ripple.parameters[f"{place}.{size}"].value == pytest.approx(amplitude, rel=0.2)
    orders = {(one.channel, round(one.order, 2)): one for one in found.orders}
    if joint == 4:
        # Located, and not named: what is there wanders from period to period.
        torque = [one for one in found.orders if one.channel == "output_torque"]
        order = min(torque, key=lambda one: abs(one.order - 2.0))
        assert order.order == pytest.approx(2.0, abs=0.05)
        assert order.steady < 0.3
        assert "sensors" not in {effect.name for effect in found.effects}
        assert all(f"opti_traj_testing{k}" in order.sentence for k in (1, 2))
    else:
        assert joint == 6 or orders["output_torque", 2.0].growth == "same"
    if joint == 7:
        assert orders["output_torque", 7.0].growth == "grows"
        assert orders["motor_torque", 12.0].growth == "same"
        assert orders["motor_torque", 12.0].steady > 0.9
    # Joints and logger have clocks of their own: a row repeats every 0.19 s.
    clocks = [p for p in found.data_problems if (p.channel, p.kind) == ("time", "clock")]
    assert len(clocks) == 2
    assert all(15 < p.count < 60 for p in clocks)
    if joint in (4, 6, 7):
        # The current is logged late beside the angle: 12 periods a turn would be blurred without saying so.
        assert any(p.kind == "clock" and p.channel == "motor_torque" for p in found.data_problems)
    motor = {
        p.value
        for e in found.effects
        if e.name == "motor_torque_ripple"
        for path, p in e.parameters.items()
        if path.endswith("order")
    }
    # The orders that the source lists for the currents of joints 5 to 7, and twice the first two of them,
    # which the current's delay blurs. Joint 4 has some of them, a sixth of its friction at most.
    least = {6: {12.0, 14.0, 24.0, 28.0}, 7: {7.0, 12.0}}.get(joint, set())
    assert least <= motor <= least | ({1.0, 2.0, 14.0, 24.0} if joint == 4 else set())


@pytest.mark.slow
@pytest.mark.xfail(
    run=False,
    reason="100 s; the play is found, and its probability is 0.49 to 0.74: where a fit without it rests",
)
@pytest.mark.skipif(not CYCLOIDAL.exists(), reason="the recordings are not here")
def test_a_cycloidal_actuator_has_play_of_the_loops_own_width_and_hysteresis():
    mapping = ROOT / "scenarios" / "mappings" / "cycloidal_torque_ramp.yaml"
    record = record_from(hdsim.import_recording(CYCLOIDAL, mapping), "ramps")
    base = hdsim.load_scenario(ROOT / "scenarios" / "bases" / "cycloidal_linear_spring.yaml")
    found = diagnose([record], base).verdict
    assert found.verdict == "effect"
    names = [{effect.name, *effect.indistinguishable_from} for effect in found.effects]
    play = next(effect for effect in found.effects if effect.name == "output_backlash")
    assert len(play.indistinguishable_from) <= 2
    assert play.parameters["backlash_arcmin"].value == pytest.approx(60 * LOST_MOTION_DEG, rel=0.15)
    if not any(group & HYSTERESES for group in names):
        pytest.xfail("the hysteresis beside the play is found, and more likely wrong than right by the rules")
    assert found.gap["motor_torque"].after < 0.4 * found.gap["motor_torque"].refit
