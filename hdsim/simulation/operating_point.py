"""Operating points: the state in which a loaded drive stands, or turns steadily, with the motor held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import PhysicsError
from hdsim.simulation.plant import Plant
from hdsim.simulation.ports import INPUTS

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Balance that counts as reached, as a share of the rated torque.
BALANCED = 1e-9

#: Time over which the load is brought up where the effects remember how they were loaded, s.
LOADING_TIME = 1.0


@dataclass(frozen=True)
class OperatingPoint:
    """A state around which a drive is linearised.

    Args:
        time: s, at which prescribed motions are read.
        motor_torque: N m, what holds the motor's speed constant.
        load_torque: N m, external torque on the output.
        states: shape (n,), the plant's states: motor, then ring and output less the ideal gear, then the
            effects' own.
        outputs: values of everything that a plant gives out there, SI units.
    """

    time: float
    motor_torque: float
    load_torque: float
    states: Array
    outputs: dict[str, float]

    @property
    def torques(self) -> Array:
        """Motor and load torque, N m."""
        return np.array([self.motor_torque, self.load_torque])


def find_operating_point(
    scenario: Scenario,
    *,
    time: float = 0.0,
    load_torque_nm: float | None = None,
    motor_angle_rad: float = 0.0,
    motor_velocity_rad_per_s: float = 0.0,
) -> OperatingPoint:
    """Find where ring and output come to balance while the motor keeps its angle or its speed.

    Effects with a memory (hysteresis, friction bristles, temperature) are brought there by loading the drive
    smoothly from zero within ``LOADING_TIME``; afterwards their states stand still.

    Args:
        scenario: the drive with effects and load.
        time: when the scenario's load torque and prescribed output are read, s.
        load_torque_nm: external torque on the output; the scenario's at ``time`` when None.
        motor_angle_rad: angle of the motor.
        motor_velocity_rad_per_s: its speed; ring and output turn with it.

    Raises:
        PhysicsError: there is no balance, as when gravity pulls the output over.
    """
    if load_torque_nm is None:
        torque = scenario.load.torque
        load_torque_nm = 0.0 if torque is None else float(torque.data.values([time])[0, 0])
    plant = Plant(scenario)
    x = plant.system.y0[: plant.size].copy()
    motor = plant.model.place_of["motor"]
    x[motor], x[motor + 1] = motor_angle_rad, motor_velocity_rad_per_s
    if len(plant.model.states) > len(INPUTS):
        x = _load(plant, _balance(plant, time, x, 0.0), time, load_torque_nm)
    x = _balance(plant, time, x, load_torque_nm)
    torques = np.array([0.0, load_torque_nm])
    # The motor's acceleration is linear in its torque, so one step holds the speed.
    for _ in range(3):
        at = plant.derivatives(time, x, torques)
        torques[0] -= at.rates[motor + 1] / at.B[motor + 1, 0]
    values = plant.values(time, x, torques)
    named = dict(zip(plant.outputs, map(float, values), strict=True))
    return OperatingPoint(time, float(torques[0]), float(torques[1]), x, named)


def _balance(plant: Plant, time: float, x: Array, load_torque: float) -> Array:
    """Ring and output where their torques cancel; everything else as in ``x``.

    The torques are minus the gradient of a potential, so q' = torque / stiffness flows into its minimum, even
    through a gap without any stiffness; an implicit method takes it there in a few dozen steps, and Newton's
    method makes it exact.

    Raises:
        PhysicsError: the flow does not come to rest.
    """
    from scipy.integrate import solve_ivp

    model = plant.model
    motor = model.place_of["motor"]
    places = [at for name, at in model.place_of.items() if name != "motor"]
    if not places:
        return x
    inertias = dict(zip(("motor", "ring", "output"), model.inertias, strict=True))
    inertia = np.array([inertias[name] for name in model.place_of if name != "motor"])
    T = plant.to_absolute()
    torques = np.array([0.0, load_torque])
    stiffness = model.drive.torsion.stiffness_k3_nm_per_rad

    def torque(q: Array) -> tuple[Array, Array]:
        """Torques on ring and output, N m, and their derivatives."""
        y = x.copy()
        y[places] = q
        for at in places:
            y[at + 1] = 0.0
        found = plant.derivatives(time, y, torques)
        rows = T[[at + 1 for at in places]]
        return inertia * (rows @ found.rates), inertia[:, None] * (rows @ found.A)[:, places]

    rated = model.rated_torque_nm
    flow = solve_ivp(
        lambda _, q: torque(q)[0] / stiffness,
        (0.0, 1e6),
        x[places],
        method="Radau",
        jac=lambda _, q: torque(q)[1] / stiffness,
        rtol=1e-6,
        atol=1e-9 * rated / stiffness,
        events=_at_rest(torque, 1e-5 * rated),
    )
    q = flow.y[:, -1]
    for _ in range(20):
        value, slope = torque(q)
        if np.max(np.abs(value)) <= BALANCED * rated:
            break
        q = q - np.linalg.lstsq(slope, value, rcond=None)[0]
    else:
        raise PhysicsError(
            f"no balance at {load_torque:g} N m on the output with the motor at {x[motor]:g} rad: "
            f"{np.max(np.abs(value)):.3g} N m remain"
        )
    found = x.copy()
    found[places] = q
    for at in places:
        found[at + 1] = 0.0
    return found


def _at_rest(torque: Callable[[Array], tuple[Array, Array]], small: float) -> Callable[[float, Array], float]:
    """Event of ``solve_ivp``: all torques are small."""

    def event(_: float, q: Array) -> float:
        return float(np.max(np.abs(torque(q)[0]))) - small

    event.terminal = True  # type: ignore[attr-defined]
    return event


def _load(plant: Plant, x: Array, time: float, load_torque: float) -> Array:
    """States after the load torque has been brought up from zero with the motor held, or turning steadily.

    Args:
        plant: the drive.
        x: shape (n,), its balance without load torque.
        time: s, at which a prescribed output is read.
        load_torque: the torque at the end, N m.

    Raises:
        PhysicsError: the integration fails.
    """
    from scipy.integrate import solve_ivp

    motor = plant.model.place_of["motor"]
    # Adds the motor's share back: what the ring and the output do while the motor keeps its speed.
    held = plant.to_absolute()
    held[motor + 1, motor + 1] = 0.0
    for at in plant.model.place_of.values():
        held[at, motor] = float(at == motor)

    def torques(t: float) -> Array:
        share = min(t / LOADING_TIME, 1.0)
        return np.array([0.0, load_torque * share * share * (3.0 - 2.0 * share)])

    start = x.copy()
    start[motor] -= x[motor + 1] * 1.2 * LOADING_TIME
    scale = plant.system.scale[: plant.size]
    done = solve_ivp(
        lambda t, y: held @ plant.rates(time, y, torques(t)),
        (0.0, 1.2 * LOADING_TIME),
        start,
        method="Radau",
        jac=lambda t, y: held @ plant.derivatives(time, y, torques(t)).A,
        rtol=1e-6,
        atol=1e-6 * np.maximum(scale, 1e-12),
    )
    if not done.success:
        raise PhysicsError(f"the drive cannot be brought to {load_torque:g} N m: {done.message}")
    loaded: Array = done.y[:, -1]
    loaded[motor : motor + 2] = x[motor : motor + 2]
    return loaded
