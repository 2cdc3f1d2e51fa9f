"""The drive without its command: torques in, motion out, with exact derivatives of both (loads numba)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim._evaluate import evaluate
from hdsim.drive import _layout as a
from hdsim.drive import _mesh_layout
from hdsim.drive.model import COORDINATES, Model
from hdsim.errors import InputError
from hdsim.kernel import MESH_TORQUE, OWN, TRANSMITTED_TORQUE, TWIST_TORQUE
from hdsim.simulation.ports import INPUTS, OUTPUT_UNITS, TorqueInputs

if TYPE_CHECKING:
    from hdsim.parts import Part
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Derivatives:
    """Everything at one state; the sizes are n states and m outputs, the inputs are two.

    Args:
        rates: shape (n,).
        outputs: shape (m,).
        A: d rates / d states, (n, n).
        B: d rates / d inputs, (n, 2).
        C: d outputs / d states, (m, n).
        D: d outputs / d inputs, (m, 2).
    """

    rates: Array
    outputs: Array
    A: Array
    B: Array
    C: Array
    D: Array


class Plant:
    """A scenario's drive, effects and load, driven by a motor torque and a load torque.

    The states are those of the model without energies: for ring and output the deviations from the ideal
    gear, as the head of ``hdsim.drive._assembly`` explains.

    Args:
        scenario: its command and its load torque are left out; a prescribed motion of the output stays.
        outputs: names among ``OUTPUT_UNITS``; all that the drive has when None.

    Raises:
        InputError: an output that there is not.
    """

    def __init__(self, scenario: Scenario, outputs: tuple[str, ...] | None = None) -> None:
        drive = scenario.drive.resolved()
        self.model = Model(
            drive,
            plant_parts(scenario),
            load_inertia_kg_m2=scenario.load.over(0.0)[1],
            motions={m.axis: m.signal for m in scenario.command.motions(drive.ratio) if m.axis == "output"},
            seed=scenario.run.seed,
        )
        self.system = self.model.system
        self.size = self.system.size - 3 - len(INPUTS)
        available = [name for name in OUTPUT_UNITS if self.model.has_ring or not name.startswith("ring")]
        for name in outputs or ():
            if name not in available:
                raise InputError(f"no output {name!r} of the drive; there are: {', '.join(available)}")
        self.outputs = tuple(available) if outputs is None else outputs
        self._scratch = np.zeros(self.system.scratch_size)
        self._columns = int(self.system.integers[a.COLUMNS])
        # The columns of the elements' inputs, less what is no state: angles, velocities, own states.
        own = [OWN + k for k in range(len(self.model.states))]
        self._kept = [0, 1, 2, 3, 4, 5, *own]
        free = [2 * COORDINATES.index(name) for name in self.model.place_of]
        self._of_states = [c for first in free for c in (first, first + 1)] + list(range(6, 4 + len(own)))
        self._of_inputs = [4 + len(own), 5 + len(own)]

    def full_state(self, x: Array, torques: Array) -> Array:
        """The model's state vector of plant states (n,) and torques (2,), energies zero."""
        return np.concatenate([x, torques, np.zeros(3)])

    def to_absolute(self) -> Array:
        """T (n, n) of absolute = T deviating: adds the ideal gear's share of the motor's motion."""
        T = np.eye(self.size)
        motor = self.model.place_of["motor"]
        for name, at in self.model.place_of.items():
            if name != "motor":
                share = self.system.reals[a.LAMBDA + COORDINATES.index(name)]
                T[at, motor] = T[at + 1, motor + 1] = share
        return T

    def state_names(self, *, absolute: bool) -> list[str]:
        """Names of the states with units."""
        names = [""] * self.size
        for name, at in self.model.place_of.items():
            label = name if absolute or name == "motor" else f"{name}_less_ideal"
            names[at], names[at + 1] = f"{label}_angle (rad)", f"{label}_velocity (rad/s)"
        first = 2 * len(self.model.place_of)
        for k, state in enumerate(self.model.states[: -len(INPUTS)]):
            names[first + k] = f"{state.name} ({state.unit})"
        return names

    def rates(self, t: float, x: Array, torques: Array) -> Array:
        """Rates of the states, shape (n,)."""
        return self._evaluate(t, x, torques, jacobian=False)[0][: self.size]

    def values(self, t: float, x: Array, torques: Array) -> Array:
        """Outputs, shape (m,)."""
        self._evaluate(t, x, torques, jacobian=False)
        return self._values()

    def derivatives(self, t: float, x: Array, torques: Array) -> Derivatives:
        """Rates, outputs and their exact derivatives."""
        dy, J = self._evaluate(t, x, torques, jacobian=True)
        n = self.size
        rows = [self._row(name) for name in self.outputs]
        # Rows are over absolute angles; the states deviate.
        of_states = np.array([row[self._of_states] for row in rows]).reshape(-1, n) @ self.to_absolute()
        of_inputs = np.array([row[self._of_inputs] for row in rows]).reshape(-1, len(INPUTS))
        return Derivatives(
            dy[:n], self._values(), J[:n, :n], J[:n, n : n + len(INPUTS)], of_states, of_inputs
        )

    def _evaluate(self, t: float, x: Array, torques: Array, *, jacobian: bool) -> tuple[Array, Array]:
        system = self.system
        n = system.size
        dy, J, dfdt = np.zeros(n), np.zeros((n, n)), np.zeros(n)
        system.reals[a.INSIDE] = t
        y = self.full_state(x, torques)
        evaluate(
            system.kernel.address,
            t,
            y,
            system.integers,
            system.reals,
            self._scratch,
            1 if jacobian else 0,
            dy,
            J,
            dfdt,
        )
        return dy, J

    def _values(self) -> Array:
        """Outputs at the last evaluation."""
        s = self._scratch
        inputs = s[a.S_INPUTS : a.S_INPUTS + self._columns]
        outputs = s[a.S_INPUTS + self._columns :]
        found = {f"{name}_angle": s[a.S_ANGLES + k] for k, name in enumerate(COORDINATES)}
        found |= {f"{name}_velocity": s[a.S_VELOCITIES + k] for k, name in enumerate(COORDINATES)}
        torque = inputs[TRANSMITTED_TORQUE]
        if not self.model.rigid:
            torque -= s[a.S_HELD]
            torque += outputs[TWIST_TORQUE] * s[a.S_TWIST_1 + 2] + outputs[MESH_TORQUE] * s[a.S_MESH_1 + 2]
        found["output_torque"] = torque
        found["transmission_error"] = found["output_angle"] - found["motor_angle"] / self.model.ratio
        return np.array([found[name] for name in self.outputs])

    def _row(self, name: str) -> Array:
        """Derivative of an output over angle and velocity of motor, ring and output and the own states."""
        if name == "output_torque":
            return self._torque_row()
        if name == "transmission_error":
            motor = self._row("motor_angle") / self.model.ratio
            return np.asarray(self._row("output_angle") - motor)
        side, kind = name.split("_")
        row = np.zeros(len(self._kept))
        if side == "output" and self.model.rigid:
            slope, bend = self._rigid_slope()
            if kind == "angle":
                row[0] = slope
            else:
                row[0], row[1] = bend * self._scratch[a.S_VELOCITIES], slope
            return row
        if side in self.model.place_of:
            row[2 * COORDINATES.index(side) + (kind == "velocity")] = 1.0
        return row

    def _rigid_slope(self) -> tuple[float, float]:
        """Slope c = d output / d motor of a rigid drive, and dc / d motor, from the kinematic error."""
        _, by_m, by_o, mm, mo, oo = self._scratch[a.S_ERROR : a.S_ERROR + 6]
        slope = (1 / self.model.ratio + by_m) / (1.0 - by_o)
        return slope, (mm + 2.0 * mo * slope + oo * slope * slope) / (1.0 - by_o)

    def _torque_row(self) -> Array:
        """Derivative of the drive's torque on the output.

        It is -dV/d output + sum_k P_k d twist_k / d output with the ports' torques P_k. Their rows of the
        elements' Jacobian, which the assembly has folded onto the angles, stand in the scratch.
        """
        s = self._scratch
        rows = OWN + len(self.model.states)
        outputs = s[a.S_INPUTS + self._columns :]
        full = outputs[rows : rows + rows * self._columns].reshape(rows, self._columns)
        if self.model.rigid:
            # The spare row in which the assembly keeps the derivative of the transmitted torque.
            return np.array(full[TWIST_TORQUE, self._kept])
        torsion, meshing = s[a.S_TWIST_1 + 2], s[a.S_MESH_1 + 2]
        row = torsion * full[TWIST_TORQUE, self._kept] + meshing * full[MESH_TORQUE, self._kept]
        hessian = s[a.S_MESH + _mesh_layout.HESSIAN : a.S_MESH + _mesh_layout.HESSIAN + 6]
        row[[0, 2, 4]] -= hessian[[2, 4, 5]]
        # How the levers bend, with the kinematic error and with a ring in balance.
        bent_mo, bent_oo = (
            outputs[TWIST_TORQUE] * s[a.S_TWIST_2 + k] + outputs[MESH_TORQUE] * s[a.S_MESH_2 + k]
            for k in (1, 2)
        )
        row[0] += bent_mo
        row[4] += bent_oo
        housing = int(self.system.integers[a.HOUSING])
        if housing:
            # The mesh sees the angles from there.
            row[6 + housing - OWN] += hessian[[2, 4, 5]].sum() - bent_mo - bent_oo
        return np.asarray(row)


def plant_parts(scenario: Scenario) -> list[Part]:
    """Effects, gravity, an arm as it begins; last the torques, so that their states follow all others."""
    load = scenario.load
    gravity, arm = [load.gravity] if load.gravity else [], load.over(0.0)[0][1:]
    return [*scenario.effects.active().values(), *gravity, *arm, TorqueInputs()]
