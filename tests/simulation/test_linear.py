"""The linear model against the simulation, analytic resonances and finite differences."""

import json
import math
import re
from pathlib import Path

import control as ct
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.errors import InputError, PhysicsError
from hdsim.plot import plot_bode
from hdsim.plot.bode import frequency_grid
from hdsim.scenario import Scenario
from hdsim.simulation.commands_linear import linearize as command
from hdsim.simulation.failures import state_names
from hdsim.simulation.linear import OUTPUTS, close_loop, find_operating_point, io_system, linearize
from hdsim.simulation.modes import modes
from hdsim.simulation.plant import Plant
from hdsim.simulation.setup import build_run

LOAD_INERTIA = 0.5
# The linear model's own; with the default the motor sticks, and small signals do not move it.
SMOOTH = {"smoothing_velocity_rad_per_s": 0.5}
FRICTIONLESS = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}


def scenario(mesh="lumped", *, load=None, **changed) -> Scenario:
    """A seed-2021 drive at rest; ``changed`` replaces sections, ``friction`` and ``torsion`` of the drive."""
    drive = {"preset": "seed-2021", "mesh": {"model": mesh} if isinstance(mesh, str) else mesh}
    drive |= {name: changed.pop(name) for name in ("friction", "torsion", "arrangement") if name in changed}
    data = {
        "name": "linear test",
        "drive": drive,
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": LOAD_INERTIA, **(load or {})},
        "run": {"duration_s": 1.0},
    }
    return Scenario.model_validate(data | changed)


def oscillation(system: ct.StateSpace):
    """The slowest oscillating mode."""
    return next(mode for mode in modes(system) if mode.oscillates)


@pytest.mark.parametrize(("torque", "stiffness"), [(4.0, "k1"), (-16.0, "k2"), (40.0, "k3")])
@pytest.mark.parametrize("damped", [False, True])
def test_resonance_of_the_lumped_drive_is_that_of_two_masses(torque, stiffness, damped):
    torsion = {} if damped else {"damping_nm_s_per_rad": 0.0}
    one = scenario(friction=FRICTIONLESS, torsion=torsion)
    drive = one.drive
    k = getattr(drive.torsion, f"stiffness_{stiffness}_nm_per_rad")
    motor = drive.inertia.motor_kg_m2 + drive.inertia.wave_generator_kg_m2
    load = LOAD_INERTIA + drive.inertia.ring_kg_m2
    point = find_operating_point(one, load_torque_nm=torque)
    free = oscillation(linearize(one, operating_point=point))
    held = oscillation(linearize(one, operating_point=point, hold_motor=True))
    two_masses = math.sqrt(k * (1 / load + 1 / (drive.ratio**2 * motor)))
    assert 2 * math.pi * free.frequency_hz == pytest.approx(two_masses, rel=1e-4)
    assert 2 * math.pi * held.frequency_hz == pytest.approx(math.sqrt(k / load), rel=1e-4)
    # A damper parallel to the spring of stiffness k: zeta = d omega / 2 k.
    damping = drive.torsion.damping_nm_s_per_rad
    assert (damping > 0) == damped
    assert free.damping_ratio == pytest.approx(damping * two_masses / (2 * k), rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(("velocity", "share"), [(100.0, -1), (-100.0, 1)])
def test_load_dependent_friction_of_a_turning_motor_shifts_the_resonance_as_it_must(velocity, share):
    # The motor feels tau / i (1 + c_L) when it drives and (1 - c_L) when it is driven.
    one = scenario()
    loss = one.drive.friction.load_coefficient
    assert loss > 0.05
    k = one.drive.torsion.stiffness_k2_nm_per_rad
    motor = one.drive.inertia.motor_kg_m2 + one.drive.inertia.wave_generator_kg_m2
    point = find_operating_point(one, load_torque_nm=-16.0, motor_velocity_rad_per_s=velocity)
    found = oscillation(linearize(one, operating_point=point))
    expected = math.sqrt(k * (1 / LOAD_INERTIA + (1 + share * loss) / (one.drive.ratio**2 * motor)))
    assert 2 * math.pi * found.frequency_hz == pytest.approx(expected, rel=1e-3)


def test_the_operating_point_is_where_a_slow_simulation_ends():
    one = scenario(
        "teeth",
        load={"torque": {"type": "ramp", "rate_nm_per_s": 20.0}},
        effects={"torsional_hysteresis_maxwell": {}, "kinematic_error": {}},
        command={"motor": {"type": "locked"}},
    )
    end = build_run(one).record()
    point = find_operating_point(one, time=1.0)
    assert point.load_torque == pytest.approx(20.0)
    for name in ("output_angle", "ring_angle", "output_torque", "transmission_error"):
        assert point.outputs[name] == pytest.approx(end[name][-1], rel=0.01), name
    assert point.motor_torque == pytest.approx(end["motor_torque"][-1], rel=0.01)
    slipping = [state.name for state in Plant(one).model.states][:3]
    for name, value in zip(slipping, point.states[6:9], strict=True):
        assert value == pytest.approx(end[name][-1], rel=0.03), name


@pytest.mark.parametrize(
    ("mesh", "arrangement"),
    [
        ("rigid", "circular_spline_fixed"),
        ("lumped", "circular_spline_fixed"),
        ("lumped", "flexspline_fixed"),
        ("teeth", "circular_spline_fixed"),
        ({"model": "teeth", "ring": "static"}, "circular_spline_fixed"),
        ("teeth", "flexspline_fixed"),
    ],
)
@pytest.mark.parametrize("load_side", [{}, {"gravity": {"mass_kg": 3.0, "centre_of_mass_m": 0.4}}])
def test_all_four_matrices_are_the_derivatives_of_the_nonlinear_drive(mesh, arrangement, load_side):
    one = scenario(
        mesh,
        arrangement=arrangement,
        load=load_side,
        effects={"kinematic_error": {}, "torsional_hysteresis_maxwell": {}} if mesh != "rigid" else {},
    )
    plant = Plant(one)
    x = find_operating_point(
        one, load_torque_nm=15.0, motor_angle_rad=0.7, motor_velocity_rad_per_s=3.0
    ).states + 1e-3 * plant.system.scale[: plant.size] * np.cos(np.arange(plant.size))
    torques = np.array([0.1, 15.0])
    at = plant.derivatives(0.0, x, torques)

    def both(state, u):
        return np.concatenate([plant.rates(0.0, state, u), plant.values(0.0, state, u)])

    exact = np.block([[at.A, at.B], [at.C, at.D]])
    n = plant.size
    for k in range(n + 2):
        step = 1e-6 * (plant.system.scale[k] if k < n else 1.0)
        nudge = np.zeros(n + 2)
        nudge[k] = step
        above, below = both(x + nudge[:n], torques + nudge[n:]), both(x - nudge[:n], torques - nudge[n:])
        found = (above - below) / (2 * step)
        rounding = 1e-9 * (1 + np.abs(np.concatenate([at.rates, at.outputs]))) / step * 1e-4
        np.testing.assert_allclose(
            found, exact[:, k], rtol=1e-4, atol=np.max(rounding) + 1e-7 * abs(exact[:, k]).max()
        )


@settings(max_examples=15, deadline=None)
@given(torque=st.floats(-50, 50), angle=st.floats(-3, 3))
def test_the_balance_carries_the_load_torque(torque, angle):
    point = find_operating_point(scenario(), load_torque_nm=torque, motor_angle_rad=angle)
    assert point.outputs["output_torque"] == pytest.approx(-torque, abs=1e-6)
    # Power in at the motor and out at the load cancel along the rigid motion.
    assert point.motor_torque == pytest.approx(-torque / -100.0, abs=1e-6)


def measured(
    one: Scenario, point, source: str, frequencies: list[float], held: bool
) -> dict[str, np.ndarray]:
    """Response of the nonlinear simulation to small sines on one torque: complex, by least squares."""
    settle, periods = 1.6 if held else 0.8, 0.4
    amplitude = {"motor_torque": 2e-5, "load_torque": 2e-3}[source]
    sines = {"type": "multisine", "amplitude_nm": amplitude, "frequencies_hz": frequencies}
    steady = {"motor_torque": point.motor_torque, "load_torque": point.load_torque}
    torque = {name: {"type": "hold", "torque_nm": value} for name, value in steady.items()}
    torque[source] = sines | {"offset_nm": steady[source]}
    motor = {"type": "locked"} if held else {"type": "torque", "torque": torque["motor_torque"]}
    data = one.model_dump(mode="json")
    data["command"] = {"motor": motor}
    data["load"]["torque"] = torque["load_torque"]
    data["run"] = {"duration_s": settle + periods, "sample_rate_hz": 2000, "rtol": 1e-9, "teeth_rate_hz": 0}
    run = build_run(Scenario.model_validate(data))
    first = 2 if held else 0
    run.y0[: len(point.states) - first] = point.states[first:]
    result = run.record()
    some = result.time >= settle
    t = result.time[some]
    excited = np.exp(2j * np.pi * np.outer(t, frequencies))
    drift = np.vander(t - t.mean(), 3)
    basis = np.hstack([excited.real, excited.imag, drift])
    count = len(frequencies)
    k = np.arange(1, count + 1)
    phases = -np.pi * k * (k - 1) / count
    found = {}
    for name in ("motor_velocity", "output_velocity", "output_torque"):
        fit = np.linalg.lstsq(basis, result[name][some], rcond=None)[0]
        # cos, sin coefficients of a signal whose input is amplitude * sin(omega t + phase).
        found[name] = (fit[count : 2 * count] + 1j * fit[:count]) / (amplitude * np.exp(1j * phases))
    return found


@pytest.mark.parametrize("mesh", ["lumped", "teeth"])
@pytest.mark.parametrize(
    ("source", "held"), [("motor_torque", False), ("load_torque", False), ("load_torque", True)]
)
def test_small_sines_in_the_full_simulation_agree_with_the_linear_response(mesh, source, held):
    one = scenario(mesh, friction=SMOOTH)
    point = find_operating_point(one, load_torque_nm=16.0, motor_angle_rad=0.4)
    system = linearize(one, operating_point=point, hold_motor=held)
    resonance = oscillation(system).frequency_hz
    assert 30 < resonance < 45
    frequencies = [5.0 * round(resonance * share / 5) for share in (0.5, 0.75, 1.0, 1.25, 2.0)]
    for name, response in measured(one, point, source, frequencies, held).items():
        if held and name == "motor_velocity":
            continue
        expected = system[name, source](2j * np.pi * np.array(frequencies))
        np.testing.assert_allclose(response, expected, rtol=0.01, err_msg=name)


def test_the_io_system_and_the_linear_model_agree_through_control_itself():
    one = scenario("teeth", effects={"kinematic_error": {}})
    point = find_operating_point(one, load_torque_nm=16.0)
    block = io_system(one)
    assert block.input_labels == ["motor_torque", "load_torque"]
    assert block.output_labels == list(OUTPUTS)
    expected = linearize(one, operating_point=point)
    # Control differentiates by itself, by forward differences.
    found = block.linearize(point.states, point.torques, eps=1e-9)
    outputs, sources = block.output_labels, block.input_labels
    for output in ("motor_velocity", "output_velocity", "output_torque"):
        for source in ("motor_torque", "load_torque"):
            s = 2j * np.pi * np.array([10.0, 40.0, 100.0])
            np.testing.assert_allclose(
                found[outputs.index(output), sources.index(source)](s), expected[output, source](s), rtol=0.01
            )


def test_a_loop_around_the_io_system_brings_the_motor_to_its_reference():
    one = scenario()
    drive = io_system(one)
    controller = ct.ss(
        [[0.0]], [[1.0, -1.0, 0.0]], [[0.02]], [[0.5, -0.5, -0.02]],
        inputs=["reference", "motor_angle", "motor_velocity"], outputs=["motor_torque"], name="pid",
    )  # fmt: skip
    loop = ct.interconnect(
        [drive, controller], inputs=["reference", "load_torque"], outputs=["motor_angle"], check_unused=False
    )
    t = np.linspace(0.0, 1.5, 301)
    wanted = np.vstack([np.full(301, 2.0), np.zeros(301)])
    response = ct.input_output_response(loop, t, wanted, solve_ivp_method="BDF")
    assert response.outputs[0, -1] == pytest.approx(2.0, abs=0.1)


def test_the_closed_linear_loop_follows_a_simulated_step():
    controller = {
        "type": "cascade",
        "position_gain_per_s": 30,
        "velocity_gain_nm_s_per_rad": 0.02,
        "velocity_integral_gain_nm_per_rad": 0.4,
    }
    step = 1e-5
    motor = {
        "type": "position",
        "at": "output",
        "trajectory": {"type": "step", "height_rad": step},
        "controller": controller,
    }
    load = {"torque": {"type": "hold", "torque_nm": 16.0}}
    one = scenario("lumped", command={"motor": motor}, load=load, friction=SMOOTH)
    data = one.model_dump(mode="json")
    data["run"] |= {"duration_s": 0.5, "rtol": 1e-10}
    run = build_run(Scenario.model_validate(data))
    point = find_operating_point(one)
    run.y0[: len(point.states)] = point.states
    closed = close_loop(one, linearize(one, operating_point=point))
    assert closed.input_labels == [
        "reference_position",
        "reference_velocity",
        "reference_acceleration",
        "load_torque",
    ]
    place = next(k for k, label in enumerate(state_names(run.model)) if label.startswith("controller"))
    gain = one.command.motor.canonical(one.drive.ratio).C[0]
    run.y0[place] = point.motor_torque / gain
    simulated = run.record()
    expected = ct.forced_response(
        closed["output_angle", "reference_position"], simulated.time, np.full(len(simulated.time), step)
    )
    moved = simulated["output_angle"] - simulated["output_angle"][0]
    np.testing.assert_allclose(moved, expected.outputs, atol=0.01 * np.abs(moved).max())


def test_a_rigid_drive_is_one_inertia():
    one = scenario("rigid", friction=FRICTIONLESS)
    system = linearize(one)
    motor = one.drive.inertia.motor_kg_m2 + one.drive.inertia.wave_generator_kg_m2
    load = LOAD_INERTIA + one.drive.inertia.ring_kg_m2
    total = motor + load / one.drive.ratio**2
    s = 2j * np.pi * 7.0
    assert system["motor_velocity", "motor_torque"](s) == pytest.approx(1 / (total * s))
    assert system["output_velocity", "load_torque"](s) == pytest.approx(1 / (total * s * one.drive.ratio**2))


def test_modes_of_a_known_system():
    system = ct.ss(
        [[0, 1, 0], [-400, -2, 0], [0, 0, -5]], np.ones((3, 1)), np.eye(3), 0, states=["x", "v", "z"]
    )
    slow, fast = modes(system)
    assert (slow.state, slow.pole, slow.oscillates) == ("z", pytest.approx(-5), False)
    assert fast.frequency_hz == pytest.approx(20 / (2 * math.pi))
    assert fast.damping_ratio == pytest.approx(0.05)
    assert fast.state in ("x", "v")
    assert fast.participation == pytest.approx(0.5, abs=0.01)


def test_an_arm_that_gravity_pulls_over_has_no_balance_or_an_unstable_mode():
    heavy = {"gravity": {"mass_kg": 4000.0, "centre_of_mass_m": 1.0, "hanging_angle_deg": 180.0}}
    try:
        system = linearize(scenario(load=heavy), hold_motor=True)
    except PhysicsError as error:
        assert "balance" in str(error)  # noqa: PT017
    else:
        assert max(mode.pole.real for mode in modes(system)) > 1.0


def test_what_is_not_there_is_refused_with_what_is():
    one = scenario()
    with pytest.raises(InputError, match=r"no input 'voltage'.*motor_torque"):
        linearize(one, inputs=("voltage",))
    with pytest.raises(InputError, match=r"no output 'ring_angle'.*output_angle"):
        linearize(one, outputs=("ring_angle",))
    with pytest.raises(InputError, match="another drive"):
        linearize(one, operating_point=find_operating_point(scenario("teeth")))
    with pytest.raises(InputError, match="'free'"):
        close_loop(one, linearize(one))


def test_the_bode_plot_marks_the_resonance_and_unwraps_the_phase():
    one = scenario()
    system = linearize(one, operating_point=find_operating_point(one, load_torque_nm=16.0))
    figure = plot_bode(system, outputs=("output_velocity",), range_hz=(1.0, 1000.0))
    magnitude, phase = figure.axes
    line = magnitude.lines[0]
    assert line.get_xdata()[0] == pytest.approx(1.0)
    peak = line.get_xdata()[np.argmax(line.get_ydata() * line.get_xdata())]
    assert peak == pytest.approx(oscillation(system).frequency_hz, rel=0.03)
    assert np.max(np.abs(np.diff(phase.lines[0].get_ydata()))) < 30
    assert "(rad/s) / (N m)" in magnitude.get_legend().get_texts()[0].get_text()
    with pytest.raises(InputError, match="no output 'heat'"):
        plot_bode(system, outputs=("heat",))
    with pytest.raises(InputError, match="must be positive and rise"):
        frequency_grid([], (10.0, 1.0))


def test_a_connection_that_is_only_rounding_is_not_drawn():
    system = ct.ss(
        [[-1.0, 0], [0, -2.0]],
        np.eye(2),
        [[1.0, 1e-13]],
        0,
        inputs=["motor_torque", "load_torque"],
        outputs=["motor_velocity"],
    )
    figure = plot_bode(system, range_hz=(1.0, 10.0))
    assert len(figure.axes[0].lines) == len(figure.axes[1].lines) == 1
    assert [text.get_text()[:17] for text in figure.axes[0].get_legend().get_texts()] == ["from motor torque"]


def test_the_command_prints_modes_and_draws(tmp_path):
    path = tmp_path / "one.yaml"
    path.write_text(scenario().to_yaml())
    picture = tmp_path / "bode.png"
    arguments = [str(path), "--load-torque-nm", "16"]
    done = CliRunner().invoke(command, [*arguments, "-o", str(picture)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "output_angle (rad)" in done.output or "output_velocity (rad/s)" in done.output
    assert "load torque 16 N m" in done.output
    assert picture.read_bytes().startswith(b"\x89PNG")
    done = CliRunner().invoke(command, [*arguments, "--json", "--hold-motor"], catch_exceptions=False)
    data = json.loads(done.output)
    assert data["inputs"] == ["load_torque"]
    assert data["operating_point"]["load_torque_nm"] == 16.0
    k, load = 25000.0, LOAD_INERTIA
    resonance = [mode["frequency_hz"] for mode in data["modes"] if mode["pole_per_s"][1] > 0]
    assert resonance == [pytest.approx(math.sqrt(k / load) / (2 * math.pi), rel=0.001)]


@pytest.mark.slow
def test_the_documented_code_runs(monkeypatch):
    root = Path(__file__).resolve().parents[2]
    monkeypatch.chdir(root)
    blocks = re.findall(r"```python\n(.*?)```", (root / "docs" / "linearize.md").read_text(), flags=re.S)
    names: dict[str, object] = {}
    for block in blocks:
        exec(block, names)
    assert names["response"].outputs[0, -1] == pytest.approx(0.1, abs=0.05)
    assert "load_torque" in names["compliance"].input_labels
