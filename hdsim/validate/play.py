"""A position loop over a drive with play: its limit cycle, three times over without hdsim.

The same loop (position at the output, speed at the motor, play in the contact of Modelica's ElastoBacklash)
is written down again as an ODE for SciPy, as passive forces of a MuJoCo model, and as a harmonic balance.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ARCSEC = math.pi / 180.0 / 3600.0
RATIO = -100.0
STIFFNESS, DAMPING = 2.0e4, 85.0
HALF_PLAY = 3.0 * 60.0 * ARCSEC
MOTOR, LOAD, RING = 0.7e-4, 0.5, 2e-5
OUTPUT = LOAD + RING
COULOMB, VISCOUS, SMOOTHING = 0.005, 1e-4, 0.5
POSITION_GAIN, VELOCITY_GAIN, REFERENCE = 80.0, 0.01, math.radians(0.5)
DURATION = 1.5
RATE = 4000


def with_hdsim() -> tuple[Array, Array]:
    """Time in s and output angle in rad of hdsim's own simulation, shape (n,)."""
    from hdsim.scenario import Scenario
    from hdsim.simulation.simulate import simulate

    stiffness = {f"stiffness_k{k}_nm_per_rad": STIFFNESS for k in (1, 2, 3)}
    friction = {
        "coulomb_nm": COULOMB,
        "viscous_nm_s_per_rad": VISCOUS,
        "load_coefficient": 0.0,
        "smoothing_velocity_rad_per_s": SMOOTHING,
    }
    data: dict[str, Any] = {
        "drive": {
            "preset": "seed-2021",
            "mesh": {"model": "lumped"},
            "friction": friction,
            "torsion": {**stiffness, "damping_nm_s_per_rad": DAMPING},
            "inertia": {"motor_kg_m2": MOTOR, "wave_generator_kg_m2": 0.0, "ring_kg_m2": RING},
        },
        "effects": {"output_backlash": {"backlash_arcmin": 2.0 * HALF_PLAY / ARCSEC / 60.0}},
        "command": {
            "motor": {
                "type": "position",
                "feedback": "output",
                "trajectory": {"type": "hold", "angle_deg": math.degrees(REFERENCE)},
                "controller": {
                    "type": "cascade",
                    "velocity_feedback": "motor",
                    "position_gain_per_s": POSITION_GAIN,
                    "velocity_gain_nm_s_per_rad": VELOCITY_GAIN,
                },
            }
        },
        "load": {"inertia_kg_m2": LOAD},
        "run": {"duration_s": DURATION, "sample_rate_hz": RATE, "rtol": 1e-7},
    }
    found = simulate(Scenario.model_validate(data))
    return found.time, found["output_angle"]


def contact(twist: float, rate: float) -> float:
    """Torque of Modelica.Mechanics.Rotational.Components.ElastoBacklash, N m: it never pulls."""
    if abs(twist) <= HALF_PLAY:
        return 0.0
    spring = STIFFNESS * (twist - math.copysign(HALF_PLAY, twist))
    damper = DAMPING * rate
    if spring > 0:
        return 0.0 if spring + damper <= 0 else spring + min(spring, damper)
    return 0.0 if spring + damper >= 0 else spring + max(spring, damper)


def _torques(motor: float, speed: float, output: float, output_speed: float) -> tuple[float, float]:
    """Torques on motor and output, N m, of the loop's state in rad and rad/s."""
    torque = contact(motor / RATIO - output, speed / RATIO - output_speed)
    drive = VELOCITY_GAIN * (RATIO * POSITION_GAIN * (REFERENCE - output) - speed)
    friction = COULOMB * math.tanh(speed / SMOOTHING) + VISCOUS * speed
    return drive - friction - torque / RATIO, torque


def with_scipy() -> tuple[Array, Array]:
    """Time and output angle by SciPy's LSODA."""
    from scipy.integrate import solve_ivp

    def rates(_: float, y: Array) -> list[float]:
        motor, output = _torques(*(float(value) for value in y))
        return [y[1], motor / MOTOR, y[3], output / OUTPUT]

    times = np.arange(round(RATE * DURATION) + 1) / RATE
    found = solve_ivp(rates, (0, DURATION), np.zeros(4), "LSODA", times, rtol=1e-9, atol=1e-11, max_step=5e-4)
    return found.t, found.y[2]


def with_mujoco() -> tuple[Array, Array]:
    """Time and output angle by MuJoCo's Runge-Kutta method of order 4, step 25 µs."""
    import mujoco

    def body(name: str, inertia: float) -> str:
        return (
            f'<body><joint name="{name}" type="hinge" axis="0 0 1"/>'
            f'<inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/></body>'
        )

    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0" integrator="RK4" timestep="2.5e-5"/><worldbody>'
        f"{body('motor', MOTOR)}{body('output', OUTPUT)}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)

    def passive(_: Any, state: Any) -> None:
        q, v = state.qpos, state.qvel
        state.qfrc_passive[:] = _torques(float(q[0]), float(v[0]), float(q[1]), float(v[1]))

    every = round(1.0 / RATE / 2.5e-5)
    time, angle = [0.0], [0.0]
    mujoco.set_mjcb_passive(passive)
    try:
        while time[-1] < DURATION:
            for _ in range(every):
                mujoco.mj_step(model, data)
            time.append(data.time)
            angle.append(float(data.qpos[1]))
    finally:
        mujoco.set_mjcb_passive(None)
    return np.array(time), np.array(angle)


def harmonic_balance() -> tuple[float, float]:
    """Amplitude of the output in arcsec and frequency in Hz by the describing functions of gap and friction.

    A twist A sin(w t) meets the stiffness K N and the damping c N with N = 1 - 2/pi (p + sin p cos p),
    p = asin(b/A), b half the play (Gelb and Vander Velde 1968, Multiple-Input Describing Functions); Coulomb
    friction at a motor's speed amplitude B counts as 4 T_c/(pi B). The loop swings where its
    characteristic equation has a root i w.
    """
    from scipy.optimize import fsolve

    def motions(amplitude: float, w: float) -> tuple[complex, complex, complex]:
        p = math.asin(min(HALF_PLAY / amplitude, 1.0))
        share = 1.0 - 2.0 / math.pi * (p + math.sin(p) * math.cos(p))
        torque = share * complex(STIFFNESS, w * DAMPING) * amplitude
        output = -torque / (OUTPUT * w**2)
        return torque, output, output + amplitude

    def balance(x: Array) -> list[float]:
        amplitude, w = HALF_PLAY * (1.0 + math.exp(float(x[0]))), math.exp(float(x[1]))
        torque, output, motor = motions(amplitude, w)
        coulomb = abs(RATIO) * 4.0 * COULOMB / (math.pi * abs(motor) * w)
        rest = (
            -MOTOR * RATIO**2 * w**2 * motor
            + VELOCITY_GAIN * RATIO**2 * (POSITION_GAIN * output + 1j * w * motor)
            + (VISCOUS * RATIO**2 + coulomb) * 1j * w * motor
            + torque
        ) / abs(torque)
        return [rest.real, rest.imag]

    found, _, status, message = fsolve(balance, [0.0, math.log(2.0 * math.pi * 8.0)], full_output=True)
    if status != 1:
        raise ArithmeticError(f"no limit cycle found by harmonic balance: {message}")
    amplitude, w = HALF_PLAY * (1.0 + math.exp(float(found[0]))), math.exp(float(found[1]))
    return abs(motions(amplitude, w)[1]) / ARCSEC, w / (2.0 * math.pi)


def cycle(time: Array, angle: Array) -> tuple[float, float]:
    """Amplitude in arcsec and frequency in Hz of the last 40 % of a swing."""
    late = time > 0.6 * time[-1]
    t, x = time[late], angle[late] - np.mean(angle[late])
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    crossings = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    return 0.5 * float(np.ptp(x)) / ARCSEC, 1.0 / float(np.mean(np.diff(crossings)))
