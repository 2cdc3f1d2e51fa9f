"""Six joints that move at once, MuJoCo's inverse dynamics, and a rigid drive with friction in one of them."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

ROOT = Path(__file__).parents[2]
URDF = ROOT / "scenarios/arms/six_joint.urdf"
RATE, RATIO, ROTOR, COULOMB, VISCOUS = 500.0, -100.0, 7e-5, 0.06, 6e-4
MASS, LEVER = 2.5, 0.11

#: The drive's model; PAYLOAD is what is believed of it.
MODEL = """
name: joint of an arm
drive:
  rated_torque_nm: 90
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  torsion: {stiffness_k1_nm_per_rad: 3.0e4, stiffness_k2_nm_per_rad: 5.0e4, stiffness_k3_nm_per_rad: 6.0e4,
            torque_t1_nm: 14, torque_t2_nm: 48}
  inertia: {motor_kg_m2: 5.0e-5, wave_generator_kg_m2: 2.0e-5}
  friction: {coulomb_nm: COULOMB, viscous_nm_s_per_rad: 6.0e-4}
  mesh: {model: rigid}
command: {motor: {type: free}}
load:
  arm: {file: FILE, joint: JOINT, payload: {link: tool, mass_kg: PAYLOAD, lever_m: 0.11}}
run: {duration_s: 1.0}
"""
MAPPING = """
ratio: -100
time: {column: time, unit: s}
channels:
  motor_angle: {column: motor, unit: rad}
  motor_torque: {column: torque, unit: N m}
joints:
"""


def model(folder: Path, joint: int, payload: float = 2.0, coulomb: float = 0.06) -> Path:
    """The scenario of one joint, written to ``base.yaml``."""
    text = MODEL.replace("FILE", str(URDF)).replace("JOINT", f"joint_{joint + 1}")
    path = folder / "base.yaml"
    path.write_text(text.replace("PAYLOAD", str(payload)).replace("COULOMB", str(coulomb)), encoding="utf-8")
    return path


def motions(seconds: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,), and angle, velocity and acceleration of all joints, (3, n, 6): two sines each."""
    t = np.arange(round(seconds * RATE)) / RATE
    return t, at(t, seed)


def at(t: np.ndarray, seed: int) -> np.ndarray:
    """The same motion at other times (n,): angle, velocity and acceleration of all joints, (3, n, 6)."""
    rng = np.random.default_rng(seed)
    found = np.zeros((3, len(t), 6))
    for k in range(6):
        for size, hertz in ((rng.uniform(0.4, 0.7), rng.uniform(0.1, 0.25)), (0.15, rng.uniform(0.3, 0.6))):
            w, phase = 2 * np.pi * hertz, rng.uniform(0, 2 * np.pi)
            found[0, :, k] += size * np.sin(w * t + phase)
            found[1, :, k] += size * w * np.cos(w * t + phase)
            found[2, :, k] -= size * w * w * np.sin(w * t + phase)
    return found


def arm() -> mujoco.MjModel:
    """The arm with the payload on its tool."""
    inertial = f"<mass value='{MASS}'/><origin xyz='0 0 {LEVER}'/>"
    inertial += "<inertia ixx='1e-9' iyy='1e-9' izz='1e-9' ixy='0' ixz='0' iyz='0'/>"
    text = URDF.read_text(encoding="utf-8").replace(
        '<link name="tool"/>', f"<link name='tool'><inertial>{inertial}</inertial></link>"
    )
    found = mujoco.MjModel.from_xml_string(text)
    found.opt.gravity[:] = (0.0, 0.0, -9.80665)
    found.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return found


def carried(motion: np.ndarray) -> np.ndarray:
    """Torques of all joints (n, 6), by MuJoCo, with the payload on the tool."""
    model = arm()
    data, found = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(*motion, strict=True):
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    return np.array(found)


def record(
    folder: Path, joint: int, seconds: float = 8.0, seed: int = 0, noise: float = 2e-3
) -> tuple[Path, Path]:
    """A recording of one joint's motor and all other joints' encoders as CSV, and its mapping."""
    t, motion = motions(seconds, seed)
    angle, speed, rate = RATIO * motion[:, :, joint]
    torque = (
        carried(motion)[:, joint] / RATIO + ROTOR * rate + COULOMB * np.tanh(speed / 0.5) + VISCOUS * speed
    )
    rng = np.random.default_rng([seed, 1])
    columns = {"time": t, "motor": angle, "torque": torque + noise * rng.standard_normal(len(t))}
    mapping = MAPPING
    for k in range(6):
        if k != joint:
            columns[f"q{k + 1}"] = motion[0, :, k] + 1e-5 * rng.standard_normal(len(t))
            mapping += f"  joint_{k + 1}: {{column: q{k + 1}, unit: rad}}\n"
    data, map_file = folder / "run.csv", folder / "map.yaml"
    np.savetxt(
        data, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments=""
    )
    map_file.write_text(mapping, encoding="utf-8")
    return data, map_file
