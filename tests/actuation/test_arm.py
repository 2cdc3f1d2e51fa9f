"""A robot arm as a load, against MuJoCo's own dynamics of the same file."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hdsim
from hdsim.actuation.arm import Arm, ArmTorque
from hdsim.cli import main

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

ROOT = Path(__file__).parents[2]
URDF = ROOT / "scenarios/arms/six_joint.urdf"
SCENARIO = ROOT / "scenarios/arms/joint_2.yaml"
JOINTS = [f"joint_{k}" for k in range(1, 7)]


def mujoco_arm(payload: dict | None = None):
    """The file's arm in MuJoCo without joint limits, and with a point mass on the tool."""
    text = URDF.read_text(encoding="utf-8")
    if payload:
        mass = f"<mass value='{payload['mass_kg']}'/><origin xyz='0 0 {payload['lever_m']}'/>"
        inertia = "<inertia ixx='1e-9' iyy='1e-9' izz='1e-9' ixy='0' ixz='0' iyz='0'/>"
        text = text.replace(
            '<link name="tool"/>', f"<link name='tool'><inertial>{mass}{inertia}</inertial></link>"
        )
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity[:] = (0.0, 0.0, -9.80665)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return model


def inverse(model, motion) -> np.ndarray:
    """MuJoCo's inverse dynamics: torques (n, 6) of angles, velocities and accelerations (3, n, 6)."""
    data, found = mujoco.MjData(model), []
    for q, w, a in zip(*motion, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, w, a
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    return np.array(found)


def motion(seed: int, times: np.ndarray) -> np.ndarray:
    """Sums of sines for six joints, (3, n, 6): angle, velocity, acceleration."""
    rng = np.random.default_rng(seed)
    size, rate, phase = rng.uniform(-1, 1, (3, 6)), rng.uniform(0.5, 6.0, (3, 6)), rng.uniform(0, 6, (3, 6))
    x = rate[:, None] * times[None, :, None] + phase[:, None]
    waves = (np.sin(x), rate[:, None] * np.cos(x), -(rate[:, None] ** 2) * np.sin(x))
    return np.array([np.sum(size[:, None] * wave, axis=0) for wave in waves])


@pytest.mark.parametrize("joint", [0, 1, 3, 5])
@pytest.mark.parametrize("payload", [None, {"link": "tool", "mass_kg": 2.5, "lever_m": 0.11}])
def test_torque_along_random_motions_is_mujocos(joint, payload):
    arm = Arm(file=URDF, joint=JOINTS[joint], payload=payload)
    times = np.linspace(0.0, 0.5, 501)
    full = motion(joint, times)
    others = {name: full[:, :, k] for k, name in enumerate(JOINTS) if k != joint}
    torque = arm.along(times, others).torque(arm, times, full[:, :, joint])
    expected = inverse(mujoco_arm(payload), full)[:, joint]
    # All is exact but the slope of the inertia, which is that of a cubic spline.
    assert np.max(np.abs(torque + expected)) < 1e-6 * np.max(np.abs(expected)) + 1e-6


def test_the_arm_of_a_run_moves_as_in_mujoco(tmp_path):
    """A rigid gear without friction under a motor's torque, beside MuJoCo's terms in SciPy's integration."""
    preset = "{preset: seed-2021, mesh: {model: rigid}, friction: {coulomb_nm: 0, viscous_nm_s_per_rad: 0, "
    (tmp_path / "run.yaml").write_text(
        f"""
drive: {preset}load_coefficient: 0}}}}
command:
  motor: {{type: torque, torque: {{type: sine, amplitude_nm: 0.6, frequency_hz: 1.5, phase_deg: 40}}}}
load:
  inertia_kg_m2: 0.3
  arm:
    file: {URDF}
    joint: joint_2
    zero_deg: 20
    joints:
      joint_1: {{type: sine, amplitude_rad: 0.5, frequency_hz: 0.7}}
      joint_3: {{type: sine, amplitude_rad: 1.2, frequency_hz: 1.1, offset_rad: 0.6}}
run: {{duration_s: 0.8, sample_rate_hz: 200, rtol: 1.0e-8}}
""",
        encoding="utf-8",
    )
    scenario = hdsim.load_scenario(tmp_path / "run.yaml")
    run = hdsim.simulate(scenario)
    model, ratio, inertia = mujoco_arm(), scenario.drive.ratio, scenario.drive.inertia
    reflected = 0.3 + ratio**2 * (inertia.motor_kg_m2 + inertia.wave_generator_kg_m2) + inertia.ring_kg_m2
    swings = {0: (0.5, 0.7, 0.0), 2: (1.2, 1.1, 0.6)}

    def rates(t, y):
        full = np.zeros((3, 6))
        for k, (size, hertz, offset) in swings.items():
            w = 2 * np.pi * hertz
            full[:, k] = (
                offset + size * np.sin(w * t),
                size * w * np.cos(w * t),
                -size * w * w * np.sin(w * t),
            )
        full[0, 1], full[1, 1] = y[0] + np.radians(20), y[1]
        still, pushed = full.copy(), full.copy()
        pushed[2, 1] = 1.0
        bias, unit = inverse(model, np.array([still, pushed]).transpose(1, 0, 2))[:, 1]
        motor = 0.6 * np.sin(2 * np.pi * 1.5 * t + np.radians(40))
        return [y[1], (ratio * motor - bias) / (reflected + unit - bias)]

    found = solve_ivp(rates, (0.0, 0.8), [0.0, 0.0], t_eval=run.time, rtol=1e-8, atol=1e-10)
    assert np.ptp(found.y[0]) > 0.3
    # What changes of the inertia is heard with a lag of 0.2 ms.
    assert run["output_angle"] == pytest.approx(found.y[0], abs=1e-3 * np.ptp(found.y[0]))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"file": "none.urdf"}, "none.urdf: no such file"),
        ({"joint": "joint_9"}, "no revolute joint 'joint_9'; there are joint_1, joint_2"),
        ({"joints": {"joint_2": {"type": "hold"}}}, "joint_2 is the joint that the drive moves"),
        ({"joints": {"elbow": {"type": "hold"}}}, "no revolute joint 'elbow'"),
        ({"payload": {"link": "hand", "mass_kg": 1, "lever_m": 0.1}}, "no link 'hand'"),
        ({"payload": {"link": "link_1", "mass_kg": 1, "lever_m": 0.1}}, "joint_2 does not carry the link"),
    ],
)
def test_mistakes_are_one_error_with_file_and_line(tmp_path, capsys, changes, said):
    from ruamel.yaml import YAML

    data = YAML(typ="safe").load(SCENARIO.read_text(encoding="utf-8"))
    data["load"]["arm"] |= {"file": str(URDF)} | changes
    with open(tmp_path / "bad.yaml", "w", encoding="utf-8") as file:
        YAML().dump(data, file)
    with pytest.raises(SystemExit) as stop:
        main(["check", str(tmp_path / "bad.yaml")])
    told = capsys.readouterr().err
    assert stop.value.code == 2
    assert said in told
    assert "bad.yaml:" in told
    assert "Traceback" not in told


def test_what_is_no_urdf_is_said_so(tmp_path):
    (tmp_path / "arm.urdf").write_text("<robot", encoding="utf-8")
    with pytest.raises(ValueError, match="no URDF that Pinocchio can read"):
        Arm(file=tmp_path / "arm.urdf", joint="joint_1")


def test_without_the_extra_the_error_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    (tmp_path / "arm.urdf").write_text(URDF.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"pip install 'hdsim\[arm\]'"):
        Arm(file=tmp_path / "arm.urdf", joint="joint_1")


def test_without_an_arm_a_load_needs_its_inertia(tmp_path):
    from hdsim.actuation.loads import Load

    with pytest.raises(ValueError, match=r"inertia_kg_m2\n.*greater than 0"):
        Load()


def test_derivatives_of_the_torque_are_exact():
    """The kernel as plain Python: its Jacobian beside central differences, in a piece and outside."""
    from hdsim.actuation._arm_kernel import arm_torque
    from hdsim.kernel import OUTPUT_ANGLE, OUTPUT_VELOCITY, OWN, TIME

    class Build:
        def element(self, kernel, parameters, states):
            self.parameters, self.states = np.array(parameters), states

    rng, build = np.random.default_rng(0), Build()
    ArmTorque(np.linspace(1.0, 1.4, 5), rng.uniform(1.0, 2.0, (5, 6))).contribute(build)
    assert len(build.states) == 1
    columns = OWN + 1
    for time in (0.5, 1.03, 1.27, 1.5):
        inputs = rng.uniform(-1.0, 1.0, columns)
        inputs[TIME] = time

        def outputs(inputs, jacobian=None):
            found = np.zeros(columns)
            jacobian = np.zeros(columns * columns) if jacobian is None else jacobian
            arm_torque.function(inputs, build.parameters, OWN, columns, found, jacobian)
            return found

        exact = np.zeros(columns * columns)
        outputs(inputs, exact)
        for column in (OUTPUT_ANGLE, OUTPUT_VELOCITY, TIME, OWN):
            step = np.zeros(columns)
            step[column] = 1e-6
            slope = (outputs(inputs + step) - outputs(inputs - step)) / 2e-6
            own = exact.reshape(columns, columns)[:, column]
            assert own == pytest.approx(slope, rel=1e-5, abs=1e-4)
