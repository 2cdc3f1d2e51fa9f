"""Channels at given times in one compiled call, against the public run of the same model."""

import numpy as np
import pytest

from hdsim.actuation.signal_data import SignalData
from hdsim.drive.model import Model
from hdsim.effects.load_dependent_kinematic_error import LoadDependentKinematicError
from hdsim.errors import InputError
from hdsim.estimate.spline import signal, smoothed
from hdsim.scenario import Scenario
from hdsim.simulation import rosenbrock
from hdsim.simulation.run import Run, RunFailed
from hdsim.simulation.sample import sample

RATE, DURATION, JUMP = 500.0, 2.0, 0.7
CHANNELS = ("motor_torque", "output_angle", "output_torque", "transmission_error")
EFFECTS = {
    "none": {},
    "kinematic error": {"kinematic_error": {}},
    "ripple": {"motor_torque_ripple": {"components": [{"order": 12, "cogging_nm": 0.03}]}},
    "housing": {"base_flexibility": {"stiffness_nm_per_rad": 1.5e5, "natural_frequency_hz": 60.0}},
    "memory": {"torsional_hysteresis_maxwell": {}, "lugre_friction": {}},
    "sensors": {
        "sensors": {
            "output_angle": {"delay_s": 0.0007, "eccentricity_arcmin": 0.3},
            "output_torque": {"ripple": [{"order": 2.0, "amplitude_nm": 0.1}]},
        }
    },
}


def measured_motion():
    """A swing of the motor with an encoder's noise: a spline that bends at every knot."""
    time = np.arange(0.0, DURATION + 0.05, 1 / RATE)
    angle = 80.0 * (1.0 - np.cos(2 * np.pi * 0.8 * time))
    return signal(*smoothed(time, angle + 2e-4 * np.random.default_rng(1).standard_normal(len(time))))


def model_of(effects, mesh="lumped", *, audited=True, motion=None):
    scenario = Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": mesh}},
        "effects": effects,
        "command": {"motor": {"type": "free"}},
        "load": {
            "inertia_kg_m2": 0.5,
            "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3},
            # A jump of the torque is a cut.
            "torque": {"type": "step", "height_nm": 10.0, "start_time_s": JUMP},
        },
        "run": {"duration_s": DURATION, "sample_rate_hz": RATE},
    })  # fmt: skip
    return Model(
        scenario.drive,
        [*scenario.effects.active().values(), scenario.load],
        load_inertia_kg_m2=0.5,
        motions={"motor": measured_motion() if motion is None else motion},
        audited=audited,
    )


def run_of(model, rtol):
    run = Run(model, duration_s=DURATION, sample_rate_hz=RATE, rtol=rtol)
    return run, run.record()


def far(found, wanted):
    return float(np.std(found - wanted) / np.std(wanted))


@pytest.mark.parametrize("mesh", ["lumped", "rigid", "tabulated"])
def test_an_audited_model_gives_what_its_run_gives(mesh):
    model = model_of(EFFECTS["kinematic error"], mesh)
    _, recorded = run_of(model, 1e-6)
    found = sample(model, recorded.time, CHANNELS)
    # A run's sample at a jump is the last before it, here it is the first after it.
    alike = recorded.time != JUMP
    for channel in CHANNELS:
        np.testing.assert_allclose(
            found[channel][alike], recorded[channel][alike], rtol=1e-6, atol=1e-9, err_msg=channel
        )
    if mesh == "rigid":
        change = found["output_torque"] - recorded["output_torque"]
        assert change[~alike] == pytest.approx([-10.0], rel=1e-6)


@pytest.mark.parametrize("effects", EFFECTS)
@pytest.mark.parametrize("mesh", ["lumped", "rigid"])
def test_without_energies_the_error_stays_what_the_tolerance_promises(effects, mesh):
    if mesh == "rigid" and effects == "memory":
        effects = "none"  # a rigid drive has no spring that could remember
    parts = EFFECTS[effects]
    _, exact = run_of(model_of(parts, mesh), 1e-10)
    _, recorded = run_of(model_of(parts, mesh), 1e-6)
    found = sample(model_of(parts, mesh, audited=False), recorded.time, CHANNELS, rtol=1e-6)
    alike = exact.time != JUMP
    for channel in found:
        error = far(found[channel][alike], exact[channel][alike])
        # The audit's energies may have asked for shorter steps than motion and torques need.
        assert error < max(3e-5, 2.0 * far(recorded[channel], exact[channel])), channel
    assert ("measured_output_torque" in found) == (effects == "sensors")


def test_times_may_jitter_and_leave_gaps():
    model = model_of(EFFECTS["sensors"], audited=False)
    even = np.arange(0.0, DURATION, 1 / RATE)
    rng = np.random.default_rng(2)
    times = even + rng.uniform(0.0, 0.5 / RATE, len(even))
    times = times[(times < 0.9) | (times > 1.4)]
    _, fine = run_of(model_of(EFFECTS["sensors"]), 1e-10)
    found = sample(model, times, CHANNELS)
    for channel in ("output_angle", "measured_output_angle"):
        wanted = np.interp(times, fine.time, fine[channel])
        assert far(found[channel], wanted) < 1e-4


def test_a_model_without_an_audit_keeps_the_states_of_its_parts():
    audited, bare = (model_of(EFFECTS["memory"], audited=given) for given in (True, False))
    assert bare.system.size == audited.system.size - 3
    assert bare.system.quadratures == 0
    # Nor does it keep accounts of heat.
    assert audited.heat_accounts
    assert bare.heat_accounts == ()
    assert bare.system.scratch_size == audited.system.scratch_size - len(audited.heat_accounts)
    name = bare.states[0].name
    _, recorded = run_of(audited, 1e-8)
    found = sample(bare, recorded.time, (name,), rtol=1e-8)
    assert far(found[name], recorded[name]) < 1e-5


def test_failures_say_what_a_run_says():
    class Nonsense:
        """A load that is not a number after a while."""

        def contribute(self, build):
            from hdsim.actuation._kernels import load_torque

            move = SignalData(measured_motion().move).scaled(np.nan).move
            build.element(load_torque, [build.signal(SignalData(move))])

    model = model_of({})
    broken = Model(model.drive, [Nonsense()], load_inertia_kg_m2=0.5, motions={"motor": measured_motion()})
    run, _ = run_of(broken, 1e-6)
    with pytest.raises(RunFailed) as failed:
        sample(broken, np.arange(0.0, DURATION, 1 / RATE), CHANNELS)
    assert run.failure == str(failed.value)


def test_a_motion_beyond_any_drive_is_a_failure_and_not_a_prediction():
    model = model_of({}, "rigid", audited=False, motion=measured_motion().scaled(1e4))
    with pytest.raises(RunFailed, match="RunawayError: motor velocity exceeds"):
        sample(model, np.arange(0.0, DURATION, 1 / RATE), CHANNELS)


def test_a_channel_that_there_is_not_is_refused_by_name():
    with pytest.raises(InputError, match="no channel 'speed'; there are: motor_angle"):
        sample(model_of({}), np.arange(0.0, DURATION, 1 / RATE), ("speed",))


def test_a_load_that_runs_away_behind_a_prescribed_motor_is_given_up_before_its_teeth_are_followed(
    monkeypatch,
):
    """Teeth whose stiffness is below zero over a part of the turn: no drive, but what a search may try."""
    monkeypatch.setattr(LoadDependentKinematicError, "misfit", lambda *_: "")
    uneven = [{"order": 2, "stiffness_nm_per_rad": 4e4, "per": "relative_turn"}]
    effects = {"load_dependent_kinematic_error": {"components": uneven}, "kinematic_error": {}}
    # The motor's limit of 1e5 rad/s, behind a ratio of 100.
    with pytest.raises(RunFailed, match=r"output less ideal velocity \(rad/s\) exceeds 1000\b"):
        sample(model_of(effects, audited=False), np.arange(0.0, DURATION, 1 / RATE), CHANNELS, rtol=3e-5)


def test_a_run_that_takes_far_more_steps_than_those_like_it_is_given_up(monkeypatch):
    monkeypatch.setattr(rosenbrock, "_BLOCKS", 1)  # blocks of 64 steps between two looks
    times, steps = np.arange(0.0, DURATION, 1 / RATE), []
    for _ in range(2):
        sample(model_of({}), times, CHANNELS, steps=steps)
    assert steps[0] == steps[1] > 1000
    monkeypatch.setattr("hdsim.simulation.sample.FAR_MORE", 0.2)
    # The first counts, not the last; one step a sample where that is more, as of a model without a state.
    for first, most in ((2000, 400), (0, 200)):
        alike = [first, 10**6]
        with pytest.raises(RunFailed, match=f"More than {most} steps"):
            sample(model_of({}), times, CHANNELS, steps=alike)
        assert most < alike[-1] <= most + 64 + 1
