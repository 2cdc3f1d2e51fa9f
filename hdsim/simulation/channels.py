"""From the states of a run to its channels: named arrays with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _layout as a
from hdsim.drive import _mesh
from hdsim.drive._assembly import observe
from hdsim.kernel import (
    COMMANDED_TORQUE,
    INPUT_FRICTION,
    LOAD_TORQUE,
    MESH_TORQUE,
    OWN,
    TRANSMITTED_TORQUE,
    TWIST,
    TWIST_TORQUE,
)
from hdsim.recording import Column, Table

if TYPE_CHECKING:
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.model import Model

Array = NDArray[np.float64]


class Observer:
    """Computes every channel of a model from samples of its state vector.

    Args:
        model: the model.
        reference: the commanded angle of the output, or None.
    """

    def __init__(self, model: Model, reference: SignalData | None = None) -> None:
        self.model = model
        self.reference = reference
        self._start_energy: float | None = None
        integers = model.system.integers
        self._columns = int(integers[a.COLUMNS])
        self._rows = OWN + len(model.states)
        self._kept = a.S_INPUTS + self._columns + self._rows

    def samples(
        self, times: Array, states: Array, inside: Array, held: Array | None = None, place: int = -1
    ) -> Array:
        """The compiled code's scratch at every sample, shape (samples, kept + states).

        Args:
            times: shape (m,), s.
            states: shape (m, n).
            inside: shape (m,), a time within each sample's smooth span.
            held: shape (m,), torque that a sampled controller held at each sample, N m.
            place: where in the system's reals that torque stands.
        """
        system = self.model.system
        rows = np.empty((len(times), self._kept + system.size))
        observe(
            system.kernel.address,
            times,
            np.ascontiguousarray(states),
            system.integers,
            system.reals,
            inside,
            place,
            np.zeros(len(times)) if held is None else held,
            np.zeros(system.scratch_size),
            self._kept,
            rows,
        )
        return rows

    def inputs(self, rows: Array, column: int) -> Array:
        """A column of the elements' inputs."""
        found: Array = rows[:, a.S_INPUTS + column]
        return found

    def outputs(self, rows: Array, row: int) -> Array:
        """A row of the elements' outputs."""
        found: Array = rows[:, a.S_INPUTS + self._columns + row]
        return found

    def least_heat(self, rows: Array) -> tuple[Array, Array]:
        """Heat (W) of the account of heat that has least, where that is negative (else 0), and its index."""
        return rows[:, a.S_LEAST_HEAT], rows[:, a.S_LEAST_ACCOUNT]

    def motor_torque(self, rows: Array) -> Array:
        """Torque at the motor shaft: the windings', or what a prescribed motion costs, N m."""
        return self.outputs(rows, COMMANDED_TORQUE) + rows[:, a.S_CONSTRAINT]

    def state_table(self, times: Array, states: Array, inside: Array, rows: Array) -> Table:
        """The channels at full rate."""
        model = self.model
        motor, ring, output = (rows[:, a.S_ANGLES + k] for k in range(3))
        motor_v, ring_v, output_v = (rows[:, a.S_VELOCITIES + k] for k in range(3))
        kinetic, potential = rows[:, a.S_KINETIC], rows[:, a.S_POTENTIAL]
        supplied, delivered, heat = states[:, -3], states[:, -2], states[:, -1]
        balance = kinetic + potential - supplied + delivered + heat
        if self._start_energy is None:
            self._start_energy = float(balance[0])
        output_torque = (
            self.inputs(rows, TRANSMITTED_TORQUE)
            + self.outputs(rows, TWIST_TORQUE) * rows[:, a.S_TWIST_1 + 2]
            + self.outputs(rows, MESH_TORQUE) * rows[:, a.S_MESH_1 + 2]
        )
        columns = {
            "motor_angle": Column(motor, "rad", "motor and wave generator"),
            "motor_velocity": Column(motor_v, "rad/s", "motor and wave generator"),
            "motor_torque": Column(self.motor_torque(rows), "N m", "torque of the motor on its shaft"),
            "output_angle": Column(output, "rad", "output and load"),
            "output_velocity": Column(output_v, "rad/s", "output and load"),
            "output_torque": Column(output_torque, "N m", "torque of the drive on the output"),
            "load_torque": Column(
                self.outputs(rows, LOAD_TORQUE) + rows[:, a.S_CONSTRAINT + 2],
                "N m",
                "external torque on the output",
            ),
        }
        if model.has_ring:
            columns["ring_angle"] = Column(ring, "rad", "flexspline toothed ring")
            columns["ring_velocity"] = Column(ring_v, "rad/s", "flexspline toothed ring")
        if self.reference is not None:
            wanted = self.reference.values(times, inside)[0]
            columns["reference_angle"] = Column(wanted, "rad", "commanded angle, at the output")
            columns["tracking_error"] = Column(output - wanted, "rad", "output angle less commanded angle")
        columns |= {
            "transmission_error": Column(
                output - motor / model.ratio, "rad", "output angle less motor angle over ratio"
            ),
            "kinematic_error": Column(rows[:, a.S_ERROR].copy(), "rad", "error of the unloaded drive"),
            "twist": Column(self.inputs(rows, TWIST), "rad", "twist of the torsion spring"),
            "input_friction_torque": Column(
                self.outputs(rows, INPUT_FRICTION), "N m", "friction on the motor shaft"
            ),
            "kinetic_energy": Column(kinetic, "J", "of all inertias"),
            "potential_energy": Column(potential, "J", "of mesh, torsion spring, load and effects"),
            "work_supplied": Column(supplied, "J", "by the motor since the start"),
            "work_delivered": Column(delivered, "J", "to the outside at the output since the start"),
            "heat": Column(heat, "J", "dissipated since the start"),
            "energy_residual": Column(
                balance - self._start_energy, "J", "stored less start, supply, delivery and heat: the audit"
            ),
        }
        if model.teeth is not None:
            engaged = rows[:, a.S_MESH + _mesh.ENGAGED] / model.teeth.count
            if not np.isnan(engaged).any():
                columns["engaged_share"] = Column(engaged, "1", "share of the teeth that carry load")
        first = states.shape[1] - 3 - len(model.states)
        for k, state in enumerate(model.states):
            columns[state.name] = Column(states[:, first + k], state.unit, state.description)
        return Table(times, {name: _contiguous(column) for name, column in columns.items()})

    def sensed(self, history: Table, at: Array) -> dict[str, Column]:
        """Readings of the sensors at the instants ``at`` (s), from a table that reaches back far enough."""
        readings = {}
        for channel, sensors in self.model.sensors.items():
            values = history[channel]
            times = history.time
            for sensor in sensors:
                context = {name: history[name] for name in sensor.needs}
                values = sensor.read(times, values, at, context)
                times = at
            column = history.columns[channel]
            readings[f"measured_{channel}"] = Column(values, column.unit, f"{channel} as the sensor reads it")
        return readings

    @property
    def memory(self) -> float:
        """How far back the sensors look, s."""
        return max((s.history for sensors in self.model.sensors.values() for s in sensors), default=0.0)

    def teeth_table(self, times: Array, rows: Array) -> Table:
        """Normal force and angle of every tooth."""
        teeth = self.model.teeth
        assert teeth is not None
        forces = np.zeros((len(times), teeth.count))
        angles = np.zeros((len(times), teeth.count))
        for k in range(len(times)):
            motor, ring, _ = rows[k, a.S_ANGLES : a.S_ANGLES + 3]
            twist = rows[k, a.S_MESH + _mesh.MESH_TWIST]
            _mesh.tooth_forces(teeth.parameters, teeth.lever_m * twist, ring - motor, forces[k], angles[k])
        return Table(
            times,
            {
                "normal_force": Column(forces, "N", "normal force of each tooth, signed by flank"),
                "angle": Column(angles, "rad", "angle of each tooth from the wave generator's major axis"),
            },
        )


def _contiguous(column: Column) -> Column:
    return Column(np.ascontiguousarray(column.values), column.unit, column.description)
