"""Derivatives of a run's channels: against a formula, and against whole runs with other numbers."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hdsim
from hdsim.errors import InputError
from hdsim.nested import at, copied, put
from hdsim.scenario import Scenario

STIFFNESS, DAMPING, INERTIA, TORQUE = 2e4, 6.0, 0.5, 10.0
RUN = {"duration_s": 0.15, "sample_rate_hz": 1000, "teeth_rate_hz": 0}

#: A torque begins to act on an output whose motor is held.
RINGING = {
    "drive": {
        "preset": "csg-20-100",
        "mesh": {"model": "lumped"},
        "torsion": {f"stiffness_k{k}_nm_per_rad": STIFFNESS for k in (1, 2, 3)}
        | {"damping_nm_s_per_rad": DAMPING},
    },
    "command": {"motor": {"type": "motion", "trajectory": {"type": "hold"}}},
    "load": {"inertia_kg_m2": INERTIA, "torque": {"type": "hold", "torque_nm": TORQUE}},
    "run": RUN,
}

#: A positioned drive with friction, a kinematic error and a load, its loop closed.
POSITIONED = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "effects": {"kinematic_error": {}},
    "command": {
        "motor": {
            "type": "position",
            "trajectory": {
                "type": "s_curve",
                "distance_deg": 3.0,
                "maximum_velocity_deg_per_s": 60.0,
                "maximum_acceleration_deg_per_s2": 900.0,
                "maximum_jerk_deg_per_s3": 20000.0,
            },
            "controller": {
                "type": "cascade",
                "position_gain_per_s": 40.0,
                "velocity_gain_nm_s_per_rad": 0.025,
                "velocity_integral_gain_nm_per_rad": 0.5,
            },
        }
    },
    "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 2.0, "centre_of_mass_m": 0.2}},
    "run": RUN,
}


def changed(scenario, name, factor, **run):
    data = copied(scenario.model_dump(mode="json"))
    path = re.sub(r"\[([0-9]+)\]", r".\1", name)
    put(data, path, at(data, path) * factor)
    data["run"] |= run
    return Scenario.model_validate(data)


def difference(scenario, name, channels, part=1e-3, rtol=1e-10):
    """Central difference of two whole runs at a tight tolerance."""
    value = at(scenario.model_dump(mode="json"), re.sub(r"\[([0-9]+)\]", r".\1", name))
    low, high = hdsim.simulate_all(
        [changed(scenario, name, factor, rtol=rtol) for factor in (1 - part, 1 + part)], channels, threads=1
    )
    return {c: (high[c] - low[c]) / (2 * part * value) for c in channels}


@settings(max_examples=3, deadline=None)
@given(st.floats(1e4, 5e4), st.floats(2.0, 20.0), st.floats(0.2, 2.0))
def test_a_ringing_output_changes_with_its_inertia_as_the_formula_says(stiffness, damping, inertia):
    data = copied(RINGING)
    data["drive"]["torsion"] |= {f"stiffness_k{k}_nm_per_rad": stiffness for k in (1, 2, 3)}
    data["drive"]["torsion"]["damping_nm_s_per_rad"] = damping
    data["load"]["inertia_kg_m2"] = inertia
    data["run"] = RUN | {"duration_s": 0.1, "rtol": 1e-9}
    result = hdsim.simulate(Scenario.model_validate(data), sensitivities=["load.inertia_kg_m2"])

    def ringing(total):
        decay = damping / (2 * total)
        turn = np.sqrt(stiffness / total - decay**2)
        t = result.time
        return (
            TORQUE
            / stiffness
            * (1 - np.exp(-decay * t) * (np.cos(turn * t) + decay / turn * np.sin(turn * t)))
        )

    # Derivative by a complex step (Squire and Trapp 1998, SIAM Review 40:110); the ring is on the output.
    ring = Scenario.model_validate(data).drive.inertia.ring_kg_m2
    np.testing.assert_allclose(
        result["output_angle"], ringing(inertia + ring), atol=1e-6 * TORQUE / stiffness
    )
    wanted = ringing(inertia + ring + 1e-30j).imag / 1e-30
    found = result.sensitivities["load.inertia_kg_m2"]["output_angle"]
    assert np.max(np.abs(found - wanted)) < 1e-3 * np.max(np.abs(wanted))


GAIN = "command.motor.controller.position_gain_per_s"
ORDER = "effects.kinematic_error.components[0].amplitude_arcmin"
UNITS = {
    GAIN: "rad/(1/s)",
    ORDER: "rad/arcmin",
    "drive.torsion.damping_nm_s_per_rad": "rad/(N m s/rad)",
    "load.inertia_kg_m2": "rad/(kg m^2)",
}


def test_a_closed_loop_changes_as_runs_of_its_own_say():
    scenario = Scenario.model_validate(POSITIONED)
    channels = ["motor_angle", "output_angle", "output_torque", "motor_torque"]
    result = hdsim.simulate(scenario, sensitivities=list(UNITS))
    for name, unit in UNITS.items():
        found = result.sensitivities[name]
        assert found.columns["output_angle"].unit == unit
        for channel, wanted in difference(scenario, name, channels, rtol=1e-8).items():
            assert np.std(found[channel] - wanted) < 0.01 * np.std(wanted), (name, channel)


@pytest.mark.parametrize("name", ["stiffness_k1_nm_per_rad", "torque_t1_nm"])
def test_a_number_that_moves_a_corner_of_the_spring_is_told_where_the_corner_is_passed(name):
    scenario = Scenario.model_validate(POSITIONED)
    name = f"drive.torsion.{name}"
    result = hdsim.simulate(scenario, sensitivities=[name])
    corner = scenario.drive.torsion.torque_t1_nm
    passes = np.diff(np.abs(result["output_torque"]) > corner) != 0
    assert np.count_nonzero(passes) == 4
    channels = ["motor_angle", "output_angle", "output_velocity", "output_torque"]
    for channel, wanted in difference(scenario, name, channels, 1e-4).items():
        far = result.sensitivities[name][channel] - wanted
        assert np.std(far) < 0.01 * np.std(wanted), channel
        assert np.max(np.abs(far)) < 0.02 * np.max(np.abs(wanted)), channel


@pytest.mark.slow
@pytest.mark.parametrize("mesh", ["teeth", "tabulated"])
def test_toothed_drives_change_as_runs_of_their_own_say(mesh):
    data = copied(POSITIONED)
    data["drive"]["mesh"]["model"] = mesh
    scenario = Scenario.model_validate(data)
    names = [GAIN, ORDER, "load.inertia_kg_m2"]
    result = hdsim.simulate(scenario, sensitivities=names)
    for name in names:
        for channel, wanted in difference(
            scenario, name, ["output_angle", "motor_angle"], 1e-2, 1e-8
        ).items():
            assert np.std(result.sensitivities[name][channel] - wanted) < 0.02 * np.std(wanted), (
                name,
                channel,
            )


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("load.inertia", "nearest is 'load.inertia_kg_m2'"),
        ("run.duration_s", "no number of the model"),
        ("run.seed", "no number of the model"),
        ("drive.geometry.flexspline_teeth", "only numbers that can change a little"),
        ("load.torque.start_time_s", "moves when something happens"),
        ("command.motor.trajectory.start_time_s", "is 0"),
        ("load.torque.torque_nm", "expected the dotted name"),
    ],
)
def test_what_has_no_derivative_is_refused(name, message):
    data = copied(POSITIONED)
    data["load"]["torque"] = {"type": "step", "height_nm": 5.0, "start_time_s": 0.05}
    with pytest.raises(InputError, match=re.escape(message)):
        hdsim.simulate(Scenario.model_validate(data), sensitivities=[name])


def test_a_sampled_controller_is_refused():
    data = copied(POSITIONED)
    data["command"]["motor"]["sample_period_s"] = 1e-3
    with pytest.raises(InputError, match="sample_period_s"):
        hdsim.simulate(Scenario.model_validate(data), sensitivities=[GAIN])
