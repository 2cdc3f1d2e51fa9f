import control as ct
import numpy as np
import pytest
from actuation_bench import Bench, jacobian_error
from pydantic import TypeAdapter, ValidationError

from hdsim import kernel as k
from hdsim.actuation.canonical import INPUTS
from hdsim.actuation.command import Command, PositionCommand, VelocityCommand
from hdsim.actuation.loads import GravityArm, Load

COMMAND = TypeAdapter(Command)
INERTIA = 2e-4
S = ct.tf("s")
PLANT = 1.0 / (INERTIA * S**2)

STEP = {"type": "step", "height_rad": 1.0}
SMOOTH = {
    "type": "trapezoid",
    "distance_rad": 2.0,
    "maximum_velocity_rad_per_s": 20.0,
    "maximum_acceleration_rad_per_s2": 400.0,
    "start_time_s": 0.01,
}
PID = {
    "type": "pid",
    "proportional_nm_per_rad": 1.0,
    "integral_nm_per_rad_s": 10.0,
    "derivative_nm_s_per_rad": 0.03,
}
CASCADE = {
    "type": "cascade",
    "position_gain_per_s": 40.0,
    "velocity_gain_nm_s_per_rad": 0.03,
    "velocity_integral_gain_nm_per_rad": 1.0,
}
LEAD = {"type": "transfer_function", "numerator": [0.05, 1.0], "denominator": [0.001, 1.0]}
STATE_SPACE = {
    "type": "state_space",
    "inputs": ["output_velocity", "reference_position", "motor_angle"],
    "A": [[-50.0, 3.0], [0.0, -20.0]],
    "B": [[1.0, 2.0, -2.0], [0.5, 0.0, 1.0]],
    "C": [0.3, 4.0],
    "D": [0.1, 1.0, -1.0],
}
SPEED_PI = {"type": "pi", "proportional_nm_s_per_rad": 0.03, "integral_nm_per_rad": 1.0}


def position(controller, trajectory=STEP, **more):
    fields = {"type": "position", "at": "motor", "trajectory": trajectory, "controller": controller, **more}
    return PositionCommand.model_validate(fields)


def velocity(controller, trajectory, **more):
    fields = {"type": "velocity", "at": "motor", "trajectory": trajectory, "controller": controller, **more}
    return VelocityCommand.model_validate(fields)


def bench(part, ratio=-100.0):
    built = Bench(ratio)
    part.contribute(built)
    return built


def tracked(command, times, ratio=-100.0):
    return bench(command, ratio).simulate(INERTIA, times)


JACOBIAN_CASES = {
    "torque": {"type": "torque", "torque": {"type": "sine", "amplitude_nm": 2.0, "frequency_hz": 1.0}},
    "pd": {"controller": {"type": "pd", "proportional_nm_per_rad": 1.0, "derivative_nm_s_per_rad": 0.1}},
    "pid": {"controller": {**PID, "derivative_filter_time_s": 1e-3}, "feedback": "output", "at": "output"},
    "pid saturated": {"controller": PID, "torque_limit_nm": 0.01},
    "cascade": {"controller": {**CASCADE, "velocity_feedback": "motor"}, "feedback": "output"},
    "cascade saturated": {"controller": CASCADE, "torque_limit_nm": 0.01},
    "transfer function": {"controller": LEAD},
    "state space": {"controller": STATE_SPACE},
    "state space saturated": {
        "controller": {**STATE_SPACE, "anti_windup_gain": [3.0, -5.0]},
        "torque_limit_nm": 0.01,
    },
    "velocity": {
        "type": "velocity",
        "controller": {
            **SPEED_PI,
            "type": "pid",
            "derivative_nm_s2_per_rad": 1e-3,
            "derivative_filter_time_s": 1e-2,
            "acceleration_feedforward_nm_s2_per_rad": 2e-4,
        },
        "trajectory": {"type": "sine", "amplitude_rpm": 100, "frequency_hz": 2.0},
    },
}


@pytest.mark.parametrize("name", JACOBIAN_CASES)
def test_a_commands_jacobian_is_exact(name):
    fields = {"type": "position", **JACOBIAN_CASES[name]}
    if fields["type"] == "position":
        fields = {"trajectory": SMOOTH, **fields}
    built = Bench(-100.0)
    COMMAND.validate_python({"motor": fields}).contribute(built)
    inputs = built.inputs(0.1, 0.1)
    inputs[:] = np.random.default_rng(3).normal(size=len(inputs))
    worst, exact = jacobian_error(built, inputs)
    assert worst < 1e-7
    assert np.any(exact[k.SUPPLIED] != 0.0)
    assert np.all(np.isfinite(exact))


def test_a_loads_jacobian_is_exact():
    load = Load.model_validate(
        {
            "inertia_kg_m2": 1.0,
            "torque": {"type": "hold", "torque_nm": 3.0},
            "gravity": {"mass_kg": 2.0, "centre_of_mass_m": 0.3, "hanging_angle_deg": 30.0},
        }
    )
    built = bench(load)
    inputs = np.random.default_rng(4).normal(size=built.width)
    worst, exact = jacobian_error(built, inputs)
    assert worst < 1e-8
    assert exact[k.OUTPUT_TORQUE, k.OUTPUT_ANGLE] != 0.0


def test_gravity_is_the_slope_of_its_energy_and_zero_when_hanging():
    arm = GravityArm(mass_kg=2.0, centre_of_mass_m=0.5, hanging_angle_deg=-90.0)
    built = bench(arm)

    def at(angle):
        return built.call(built.inputs(0.0, 0.0, output=(angle, 0.0)))[0]

    assert at(0.0)[k.OUTPUT_TORQUE] == pytest.approx(-2.0 * 9.80665 * 0.5)
    assert abs(at(-np.pi / 2)[k.OUTPUT_TORQUE]) < 1e-12
    h = 1e-6
    slope = (at(0.7 + h)[k.STORED] - at(0.7 - h)[k.STORED]) / (2.0 * h)
    assert slope == pytest.approx(-at(0.7)[k.OUTPUT_TORQUE], rel=1e-8)


def test_a_load_torque_takes_what_it_does_not_give():
    built = bench(Load.model_validate({"inertia_kg_m2": 1, "torque": {"type": "hold", "torque_nm": -5.0}}))
    out, _ = built.call(built.inputs(0.0, 0.0, output=(0.0, 2.0)))
    assert out[k.OUTPUT_TORQUE] == out[k.LOAD_TORQUE] == -5.0
    assert out[k.DELIVERED] == 10.0


TIMES = np.linspace(0.0, 0.3, 601)


@pytest.mark.parametrize("ratio", [-100.0, 80.0])
def test_a_pd_step_is_controls_step_response(ratio):
    simulated = tracked(
        position({"type": "pd", "proportional_nm_per_rad": 1.0, "derivative_nm_s_per_rad": 0.015}),
        TIMES,
        ratio,
    )
    # The reference is constant between its steps: the derivative acts on the measured angle alone.
    loop = ct.feedback(1.0 * ct.feedback(PLANT, 0.015 * S), 1)
    np.testing.assert_allclose(simulated.angle, ct.step_response(loop, TIMES).outputs, atol=2e-6)


@pytest.mark.parametrize("side", ["motor", "output"])
@pytest.mark.parametrize("ratio", [-100.0, 80.0])
def test_gains_belong_to_the_fed_back_side_and_need_no_sign(ratio, side):
    scale = 1.0 if side == "motor" else abs(ratio)
    command = position(
        {
            "type": "pd",
            "proportional_nm_per_rad": scale,
            "derivative_nm_s_per_rad": 0.015 * scale,
        },
        feedback=side,
    )
    simulated = tracked(command, TIMES, ratio)
    loop = ct.feedback(1.0 * ct.feedback(PLANT, 0.015 * S), 1)
    np.testing.assert_allclose(simulated.angle, ct.step_response(loop, TIMES).outputs, atol=2e-6)


def test_a_filtered_pid_is_controls_forced_response():
    filter_time = 2e-3
    simulated = tracked(position({**PID, "derivative_filter_time_s": filter_time}, SMOOTH), TIMES)
    law = 1.0 + 10.0 / S + 0.03 * S / (filter_time * S + 1.0)
    reference = position(PID, SMOOTH).signal.values(np.linspace(0.0, 0.3, 60_001))[0]
    response = ct.forced_response(ct.feedback(law * PLANT, 1), np.linspace(0.0, 0.3, 60_001), reference)
    np.testing.assert_allclose(simulated.angle, response.outputs[::100], atol=2e-6)


def test_a_transfer_function_controller_is_controls_closed_loop():
    simulated = tracked(position(LEAD), TIMES)
    loop = ct.feedback((0.05 * S + 1.0) / (0.001 * S + 1.0) * PLANT, 1)
    np.testing.assert_allclose(simulated.angle, ct.step_response(loop, TIMES).outputs, atol=2e-6)


def test_a_velocity_pi_is_controls_closed_loop():
    simulated = tracked(velocity(SPEED_PI, {"type": "step", "height_rad_per_s": 3.0}), TIMES)
    loop = ct.feedback((0.03 + 1.0 / S) / (INERTIA * S), 1)
    np.testing.assert_allclose(simulated.velocity, 3.0 * ct.step_response(loop, TIMES).outputs, atol=1e-5)


def test_a_velocity_pid_differentiates_the_error_through_its_filter():
    law = {
        **SPEED_PI,
        "type": "pid",
        "derivative_nm_s2_per_rad": 1e-4,
        "derivative_filter_time_s": 5e-3,
    }
    simulated = tracked(velocity(law, {"type": "step", "height_rad_per_s": 3.0}), TIMES)
    loop = ct.feedback((0.03 + 1.0 / S + 1e-4 * S / (5e-3 * S + 1)) / (INERTIA * S), 1)
    np.testing.assert_allclose(simulated.velocity, 3.0 * ct.step_response(loop, TIMES).outputs, atol=1e-5)


def test_a_cascade_is_controls_nested_loops():
    law = {**CASCADE, "velocity_feedforward": 0.0}
    simulated = tracked(position(law), TIMES)
    inner = ct.feedback((0.03 + 1.0 / S) / (INERTIA * S), 1)
    loop = ct.feedback(40.0 * inner / S, 1)
    np.testing.assert_allclose(simulated.angle, ct.step_response(loop, TIMES).outputs, atol=1e-5)


@pytest.mark.parametrize("ratio", [-100.0, 80.0])
@pytest.mark.parametrize(("feedback", "inner"), [("motor", None), ("output", "motor"), ("output", "output")])
def test_full_feedforward_leaves_a_rigid_drive_no_error(ratio, feedback, inner):
    seen = abs(ratio) if (inner or feedback) == "output" else 1.0
    law = {
        **CASCADE,
        "velocity_feedback": inner,
        "acceleration_feedforward_nm_s2_per_rad": INERTIA * seen,
    }
    command = position(law, SMOOTH, at="output", feedback=feedback)
    simulated = tracked(command, TIMES, ratio)
    np.testing.assert_allclose(
        simulated.angle, ratio * command.signal.values(TIMES)[0], atol=1e-7 * abs(ratio)
    )


def test_a_state_space_controller_wires_its_inputs():
    canonical = position(STATE_SPACE, at="output", feedback="motor").canonical(-50.0)
    np.testing.assert_allclose(
        canonical.D[[INPUTS.index(n) for n in STATE_SPACE["inputs"]]], [0.1, -50.0, -1.0]
    )
    np.testing.assert_allclose(canonical.B[:, INPUTS.index("output_velocity")], [1.0, 0.5])
    np.testing.assert_allclose(canonical.A, STATE_SPACE["A"])
    assert canonical.B[:, INPUTS.index("motor_velocity")].tolist() == [0.0, 0.0]


def test_a_static_state_feedback_has_no_states():
    law = {"type": "state_space", "inputs": ["reference_position", "motor_angle", "motor_velocity"]}
    simulated = tracked(position({**law, "D": [1.0, -1.0, -0.015]}), TIMES)
    loop = ct.feedback(1.0 * ct.feedback(PLANT, 0.015 * S), 1)
    np.testing.assert_allclose(simulated.angle, ct.step_response(loop, TIMES).outputs, atol=2e-6)


def overshoot(simulated, target):
    return np.max(simulated.angle) - target, np.max(np.abs(simulated.angle[-50:] - target))


def test_anti_windup_shortens_the_overshoot():
    law = {**PID, "integral_nm_per_rad_s": 20.0, "derivative_nm_s_per_rad": 0.03}
    times = np.linspace(0.0, 1.0, 1001)
    step = {"type": "step", "height_rad": 10.0}
    limit = {"torque_limit_nm": 0.2}
    held, held_late = overshoot(tracked(position(law, step, **limit), times), 10.0)
    wound, wound_late = overshoot(
        tracked(position({**law, "anti_windup": False}, step, **limit), times), 10.0
    )
    assert held < 0.5 * wound
    assert held_late <= wound_late


def test_the_torque_stays_within_its_limit():
    built = bench(position(PID, torque_limit_nm=0.5))
    for reference in (-9.0, 0.1, 9.0):
        inputs = built.inputs(0.0, 0.0)
        inputs[-4] = reference
        out, _ = built.call(inputs)
        assert out[k.MOTOR_TORQUE] == out[k.COMMANDED_TORQUE] == pytest.approx(np.clip(reference, -0.5, 0.5))


def run_sampled(command, steps, ratio=-100.0):
    """Motor angles at the samples of a rigid drive, integrated exactly over each held torque."""
    sampled = command.sampled(ratio)
    sampled.reset()
    period = command.sample_period_s
    angle = speed = 0.0
    angles, torques = [], []
    for n in range(steps):
        angles.append(angle)
        measured = {"motor_angle": angle, "motor_velocity": speed}
        measured |= {"output_angle": angle / ratio, "output_velocity": speed / ratio}
        torque = sampled.update(n * period, measured)
        torques.append(torque)
        angle += speed * period + 0.5 * torque / INERTIA * period**2
        speed += torque / INERTIA * period
    return np.array(angles), np.array(torques)


@pytest.mark.parametrize("method", ["zoh", "tustin"])
def test_a_sampled_controller_is_controls_discrete_loop(method):
    period = 1e-3
    law = {"type": "transfer_function", "numerator": [0.06, 1.0, 2.0], "denominator": [0.002, 1.0, 0.0]}
    command = position(law, sample_period_s=period, discretisation=method)
    angles, _ = run_sampled(command, 300)
    held = ct.sample_system(ct.tf2ss(PLANT), period, "zoh")
    discrete = ct.sample_system(ct.tf2ss([0.06, 1.0, 2.0], [0.002, 1.0, 0.0]), period, method)
    loop = ct.feedback(held * discrete, 1)
    expected = ct.step_response(loop, np.arange(300) * period).outputs
    np.testing.assert_allclose(angles, expected, atol=1e-9)


def test_a_sampled_pid_tends_to_the_continuous_one():
    law = {**PID, "derivative_filter_time_s": 5e-3}
    times = np.linspace(0.0, 0.2, 2001)
    exact = tracked(position(law, SMOOTH), times).angle
    errors = []
    for period in (1e-3, 1e-4):
        angles, _ = run_sampled(position(law, SMOOTH, sample_period_s=period), round(0.2 / period))
        errors.append(np.max(np.abs(angles - exact[:: round(period / 1e-4)][: len(angles)])))
    assert errors[1] < 0.15 * errors[0] < 0.05


def test_a_sampled_integrator_stops_at_the_limit():
    law = {**PID, "integral_nm_per_rad_s": 20.0}
    more = {"torque_limit_nm": 0.2, "sample_period_s": 1e-3}
    step = {"type": "step", "height_rad": 10.0}
    held, torques = run_sampled(position(law, step, **more), 1000)
    wound, _ = run_sampled(position({**law, "anti_windup": False}, step, **more), 1000)
    assert np.max(np.abs(torques)) == 0.2
    assert np.max(held) - 10.0 < 0.5 * (np.max(wound) - 10.0)


def test_a_sample_at_a_step_sees_the_step_whatever_the_rounding():
    law = {"type": "state_space", "inputs": ["reference_position"], "D": [1.0]}
    for n in range(1, 200):
        # The step may be written a rounding later than the sample is computed (as 0.1 + 0.2 and 0.3 are).
        later = float(np.nextafter(n * 1e-3, 1.0))
        command = position(law, {**STEP, "start_time_s": later}, sample_period_s=1e-3)
        sampled = command.sampled(1.0)
        rest = dict.fromkeys(INPUTS[3:], 0.0)
        assert sampled.update((n - 1) * 1e-3, rest) == 0.0
        assert sampled.update(n * 1e-3, rest) == 1.0


def test_a_sampled_command_registers_the_held_torque_alone():
    from hdsim.actuation._kernels import held_torque

    built = bench(position(PID, sample_period_s=1e-3))
    [(kernel, parameters, _)] = built.elements
    assert kernel is held_torque
    parameters[0] = 0.7
    out, jacobian = built.call(built.inputs(0.0, 0.0, motor=(0.0, 3.0)))
    assert (out[k.MOTOR_TORQUE], out[k.SUPPLIED]) == pytest.approx((0.7, 2.1))
    assert jacobian[k.SUPPLIED, k.MOTOR_VELOCITY] == 0.7


def test_motions_of_both_axes_are_prescribed_together():
    command = COMMAND.validate_python(
        {
            "motor": {"type": "motion", "at": "output", "trajectory": {"type": "hold", "angle_deg": 1.0}},
            "output": {"type": "locked"},
        }
    )
    built = bench(command)
    motor, output = command.motions(-100.0)
    assert built.elements == []
    assert (motor.axis, output.axis) == ("motor", "output")
    assert np.rad2deg(motor.signal.values([0.0])[0, 0]) == pytest.approx(-100.0)
    assert output.signal.values([0.0])[:, 0].tolist() == [0.0] * 4
    assert command.sampled(-100.0) is None


def test_the_reference_is_seen_from_either_side():
    command = position(PID, {"type": "hold", "angle_rad": 1.0}, at="output")
    assert command.reference(-50.0, "motor").values([0.0])[0, 0] == -50.0
    assert command.reference(-50.0, "output").values([0.0])[0, 0] == 1.0


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        ({"type": "transfer_function", "numerator": [1, 0], "denominator": [1]}, "degree 1"),
        ({"type": "transfer_function", "numerator": [1], "denominator": [0]}, "denominator is zero"),
        ({**STATE_SPACE, "C": [1.0]}, "C: expected 2 numbers"),
        ({**STATE_SPACE, "A": [[1.0], [2.0]]}, "A: expected 2 rows of 2"),
        ({**STATE_SPACE, "inputs": ["motor_angle", "motor_angle", "output_angle"]}, "named twice"),
        ({**STATE_SPACE, "inputs": ["angle"]}, "'motor_angle'"),
        ({**PID, "proportional_nm_per_rad": -1.0}, "greater than 0"),
    ],
)
def test_a_wrong_controller_is_refused_with_what_is_wrong(controller, message):
    with pytest.raises(ValidationError, match=message):
        position(controller)


def test_a_velocity_command_has_no_reference_position():
    with pytest.raises(ValidationError, match="reference_velocity"):
        velocity(
            {"type": "state_space", "inputs": ["reference_position"], "D": [1.0]},
            {"type": "hold", "velocity_rpm": 1.0},
        )


def test_checking_a_command_imports_no_heavy_library():
    import subprocess
    import sys

    code = """
import sys
from hdsim.actuation.command import Command
from hdsim.actuation.loads import Load
Command.model_validate({"motor": {"type": "torque", "torque": {"type": "hold", "torque_nm": 1}}})
Load.model_validate({"inertia_kg_m2": 1, "torque": {"type": "sine", "amplitude_nm": 1, "frequency_hz": 1}})
Command.model_json_schema()
print([name for name in ("numpy", "scipy", "numba", "control", "matplotlib") if name in sys.modules])
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


AS_STATE_SPACE = {
    "type": "state_space",
    "inputs": ["reference_position", "motor_angle", "reference_velocity", "motor_velocity"],
    "A": [[0.0]],
    "B": [[20.0, -20.0, 0.0, 0.0]],
    "C": [1.0],
    "D": [1.0, -1.0, 0.03, -0.03],
}


def test_a_pid_written_as_state_space_with_its_anti_windup_is_the_pid():
    law = {**PID, "integral_nm_per_rad_s": 20.0, "anti_windup_time_s": 0.05}
    more = {"trajectory": {"type": "step", "height_rad": 10.0}, "torque_limit_nm": 0.2}
    built_in = tracked(position(law, **more), TIMES)
    written = tracked(position({**AS_STATE_SPACE, "anti_windup_gain": [20.0]}, **more), TIMES)
    np.testing.assert_allclose(written.angle, built_in.angle, rtol=1e-7, atol=1e-7)


def test_a_sampled_state_space_controller_follows_its_anti_windup_gain():
    more = {
        "trajectory": {"type": "step", "height_rad": 10.0},
        "torque_limit_nm": 0.2,
        "sample_period_s": 1e-3,
    }
    held, _ = run_sampled(position({**AS_STATE_SPACE, "anti_windup_gain": [20.0]}, **more), 1000)
    wound, _ = run_sampled(position(AS_STATE_SPACE, **more), 1000)
    assert np.max(held) - 10.0 < 0.5 * (np.max(wound) - 10.0)
