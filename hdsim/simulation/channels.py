"""From the states of a run to its channels: named arrays with units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _layout as a
from hdsim.drive import _mesh_layout, _odd_tooth, _teeth
from hdsim.drive._assembly import observe, observe_coordinates
from hdsim.errors import InputError
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
    from hdsim.effects._readers import Sensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Formula:
    """A channel as a function of numbers in the compiled code's scratch.

    Args:
        unit: SI unit.
        description: one line for the log.
        places: where the numbers stand in the scratch.
        of: the channel, shape (m,), from their values, shape (m,) each.
    """

    unit: str
    description: str
    places: tuple[int, ...]
    of: Callable[..., Array] = lambda values: values


def _sum(first: Array, second: Array) -> Array:
    return first + second


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
        self._plans: dict[tuple[str, ...], tuple[dict[str, int], list[str], NDArray[np.int64]]] = {}
        integers = model.system.integers
        self._columns = int(integers[a.COLUMNS])
        self._kept = a.S_INPUTS + self._columns + OWN + len(model.states)

    @cached_property
    def formulas(self) -> dict[str, Formula]:
        """What the compiled code's scratch tells at each sample, by channel."""
        inputs, outputs = a.S_INPUTS, a.S_INPUTS + self._columns
        ratio = self.model.ratio
        found = {
            "motor_angle": Formula("rad", "motor and wave generator", (a.S_ANGLES,)),
            "motor_velocity": Formula("rad/s", "motor and wave generator", (a.S_VELOCITIES,)),
            # The windings' torque, or what a prescribed motion costs.
            "motor_torque": Formula(
                "N m", "torque of the motor on its shaft", (outputs + COMMANDED_TORQUE, a.S_CONSTRAINT), _sum
            ),
            "output_angle": Formula("rad", "output and load", (a.S_ANGLES + 2,)),
            "output_velocity": Formula("rad/s", "output and load", (a.S_VELOCITIES + 2,)),
            "output_torque": Formula(
                "N m",
                "torque of the drive on the output",
                (
                    inputs + TRANSMITTED_TORQUE,
                    outputs + TWIST_TORQUE,
                    a.S_TWIST_1 + 2,
                    outputs + MESH_TORQUE,
                    a.S_MESH_1 + 2,
                    a.S_HELD,
                ),
                lambda borne, twist, lever, mesh, mesh_lever, held: (
                    borne - held + twist * lever + mesh * mesh_lever
                ),
            ),
            "load_torque": Formula(
                "N m", "external torque on the output", (outputs + LOAD_TORQUE, a.S_CONSTRAINT + 2), _sum
            ),
        }
        if self.model.has_ring:
            found["ring_angle"] = Formula("rad", "flexspline toothed ring", (a.S_ANGLES + 1,))
            found["ring_velocity"] = Formula("rad/s", "flexspline toothed ring", (a.S_VELOCITIES + 1,))
        return found | {
            "transmission_error": Formula(
                "rad",
                "output angle less motor angle over ratio",
                (a.S_ANGLES + 2, a.S_ANGLES),
                lambda output, motor: output - motor / ratio,
            ),
            "kinematic_error": Formula("rad", "error of the unloaded drive", (a.S_ERROR,)),
            "twist": Formula("rad", "twist of the torsion spring", (inputs + TWIST,)),
            "input_friction_torque": Formula(
                "N m", "friction on the motor shaft", (outputs + INPUT_FRICTION,)
            ),
            "kinetic_energy": Formula("J", "of all inertias", (a.S_KINETIC,)),
            "potential_energy": Formula("J", "of mesh, torsion spring, load and effects", (a.S_POTENTIAL,)),
        }

    def samples(
        self, times: Array, states: Array, inside: Array, held: Array | None = None, place: int = -1
    ) -> Array:
        """The compiled code's scratch at every sample, shape (samples, kept).

        Args:
            times: shape (m,), s.
            states: shape (m, n).
            inside: shape (m,), a time within each sample's smooth span.
            held: shape (m,), torque that a sampled controller held at each sample, N m.
            place: where in the system's reals that torque stands.
        """
        return self._observed(np.arange(self._kept), times, states, inside, held, place)

    def values(self, channels: Sequence[str], times: Array, states: Array, inside: Array) -> dict[str, Array]:
        """Some channels, shape (m,) each; the arguments are those of ``samples``.

        Args:
            channels: names in ``formulas``, or of states that parts add.
            times: s.
            states: states of the model.
            inside: a time within each sample's smooth span, s.

        Raises:
            InputError: there is no such channel.
        """
        key = tuple(channels)
        if key not in self._plans:
            self._plans[key] = self._plan(key)
        own, chosen, places = self._plans[key]
        found = {name: np.ascontiguousarray(states[:, k]) for name, k in own.items()}
        columns = iter(np.ascontiguousarray(self._observed(places, times, states, inside).T))
        for name in chosen:
            formula = self.formulas[name]
            found[name] = formula.of(*(next(columns) for _ in formula.places))
        return found

    def _plan(self, channels: Sequence[str]) -> tuple[dict[str, int], list[str], NDArray[np.int64]]:
        """Channels that are states with their index, the others, and where their numbers stand."""
        own = {state.name: k for k, state in enumerate(self.model.states, self._first_state)}
        chosen = [name for name in channels if name not in own]
        for name in chosen:
            if name not in self.formulas:
                raise InputError(
                    f"the model has no channel {name!r}; there are: {', '.join([*self.formulas, *own])}"
                )
        places = np.array([p for name in chosen for p in self.formulas[name].places], dtype=np.int64)
        return {name: own[name] for name in channels if name in own}, chosen, places

    def _observed(
        self,
        places: NDArray[np.int64],
        times: Array,
        states: Array,
        inside: Array,
        held: Array | None = None,
        place: int = -1,
    ) -> Array:
        """The numbers of the scratch at some places, shape (samples, places)."""
        system = self.model.system
        rows = np.empty((len(times), len(places)))
        if self._coordinates.issuperset(places.tolist()):
            observe_coordinates(
                times,
                np.ascontiguousarray(states),
                system.integers,
                system.reals,
                inside,
                np.zeros(system.scratch_size),
                places,
                rows,
            )
            return rows
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
            places,
            rows,
        )
        return rows

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Channels that angles and velocities alone tell: a tenth of what the others cost."""
        return tuple(name for name, f in self.formulas.items() if self._coordinates.issuperset(f.places))

    @cached_property
    def _coordinates(self) -> set[int]:
        """Places of the scratch that are known before any torque."""
        if self.model.rigid:
            return set()
        bodies = (0, 1, 2) if self.model.has_ring else (0, 2)
        return {first + body for first in (a.S_ANGLES, a.S_VELOCITIES) for body in bodies}

    @property
    def _first_state(self) -> int:
        """Index of the first state that a part adds."""
        return self.model.system.size - self.model.system.quadratures - len(self.model.states)

    def least_heat(self, rows: Array) -> tuple[Array, Array]:
        """Heat (W) of the account of heat that has least, where that is negative (else 0), and its index."""
        return rows[:, a.S_LEAST_HEAT], rows[:, a.S_LEAST_ACCOUNT]

    def state_table(self, times: Array, states: Array, inside: Array, rows: Array) -> Table:
        """The channels of an audited model at full rate."""
        model = self.model
        columns = {
            name: Column(formula.of(*(rows[:, p] for p in formula.places)), formula.unit, formula.description)
            for name, formula in self.formulas.items()
        }
        if self.reference is not None:
            wanted = self.reference.values(times, inside)[0]
            columns["reference_angle"] = Column(wanted, "rad", "commanded angle, at the output")
            columns["tracking_error"] = Column(
                columns["output_angle"].values - wanted, "rad", "output angle less commanded angle"
            )
        supplied, delivered, heat = states[:, -3], states[:, -2], states[:, -1]
        stored = columns["kinetic_energy"].values + columns["potential_energy"].values
        balance = stored - supplied + delivered + heat
        if self._start_energy is None:
            self._start_energy = float(balance[0])
        columns |= {
            "work_supplied": Column(supplied, "J", "by the motor since the start"),
            "work_delivered": Column(delivered, "J", "to the outside at the output since the start"),
            "heat": Column(heat, "J", "dissipated since the start"),
            "energy_residual": Column(
                balance - self._start_energy, "J", "stored less start, supply, delivery and heat: the audit"
            ),
        }
        if model.teeth is not None:
            engaged = rows[:, a.S_MESH + _mesh_layout.ENGAGED] / model.teeth.count
            if not np.isnan(engaged).any():
                columns["engaged_share"] = Column(engaged, "1", "share of the teeth that carry load")
        for k, state in enumerate(model.states, self._first_state):
            columns[state.name] = Column(states[:, k], state.unit, state.description)
        return Table(times, {name: _contiguous(column) for name, column in columns.items()})

    def sensed(
        self, history: Table, at: Array, sensors_of: Mapping[str, Sequence[Sensor]] | None = None
    ) -> dict[str, Column]:
        """Readings of the sensors at the instants ``at`` (s), from a table that reaches back far enough.

        Args:
            history: the true channels.
            at: shape (m,), s.
            sensors_of: the sensors by channel; all of the model's when None.
        """
        readings = {}
        for channel, sensors in (self.model.sensors if sensors_of is None else sensors_of).items():
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
            twist = rows[k, a.S_MESH + _mesh_layout.MESH_TWIST]
            shift = teeth.lever_m * twist
            _teeth.tooth_forces(teeth.parameters, shift, ring - motor, forces[k], angles[k])
            _odd_tooth.odd_forces(
                teeth.parameters, shift, rows[k, a.S_RELATIVE : a.S_RELATIVE + 3], forces[k]
            )
        return Table(
            times,
            {
                "normal_force": Column(forces, "N", "normal force of each tooth, signed by flank"),
                "angle": Column(angles, "rad", "angle of each tooth from the wave generator's major axis"),
            },
        )


def _contiguous(column: Column) -> Column:
    return Column(np.ascontiguousarray(column.values), column.unit, column.description)
