"""A drive and its parts, assembled into an ODE that SciPy's solvers integrate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import friction
from hdsim.drive.contributed import Contributed, Contributions
from hdsim.drive.parameters import Drive, LumpedMesh, RigidMesh, TabulatedMesh, TeethMesh
from hdsim.errors import InputError
from hdsim.kernel import OWN, SIGNAL_VALUES, Kernel

if TYPE_CHECKING:
    from hdsim.drive.toothed import Teeth
    from hdsim.parts import Part
    from hdsim.system import System

Array = NDArray[np.float64]

#: Scale of a motor speed at rest, in smoothing speeds of its friction's sign: it is held to 1e-4 of one
#: at a tolerance of 1e-6, and to 1e-2 at 1e-4.
_SIGNS = 100.0

#: Names of the three coordinates, in the order of the compiled code.
COORDINATES = ("motor", "ring", "output")


class Model(Contributed):
    """A drive with its parts; the ``Builder`` that parts contribute to.

    Args:
        drive: the drive's numbers.
        parts: effects, load, controllers: anything with ``contribute``.
        load_inertia_kg_m2: inertia on the output, kg m^2.
        motions: signals that prescribe ``motor`` or ``output`` angles (rad).
        signals: what else is known over time, by name, for parts that ask for it (``Builder.external``):
            ``temperature``, degC.
        seed: seed of the random tooth surfaces and of all noise.
        audited: the energies supplied, delivered and dissipated are states, and every part's heat has its
            account: what the energy audit needs.
        table_for: of a toothed mesh, ``Teeth.fingerprint`` of all whose table serves for their sum; as the
            drive's mesh says when None.

    Attributes:
        system: the ODE, a ``hdsim.system.System``.
        states: the parts' own states in their order in the state vector.
        teeth: gaps, pitch errors and contact table of the toothed meshes, else None.
        heat_accounts: names of the accounts of heat, in the order of the compiled code; none without audit.
        input_frictions: friction on the motor shaft, of the drive and the parts.
    """

    def __init__(
        self,
        drive: Drive,
        parts: Sequence[Part] = (),
        *,
        load_inertia_kg_m2: float,
        motions: dict[str, Any] | None = None,
        signals: Mapping[str, Any] | None = None,
        seed: int = 0,
        audited: bool = True,
        table_for: frozenset[str] | None = None,
    ) -> None:
        super().__init__()
        self._table_for = table_for
        self.drive = drive
        self.audited = audited
        self.parts = tuple(parts)
        self.ratio = drive.ratio
        self.rated_torque_nm = drive.rated_torque_nm
        toothed = isinstance(drive.mesh, TeethMesh | TabulatedMesh)
        self.twist_sign = -1.0 if toothed and drive.arrangement == "flexspline_fixed" else 1.0
        self.seed = seed
        self.motions = dict(motions or {})
        self._offered = dict(signals or {})
        self.load_inertia_kg_m2 = load_inertia_kg_m2
        self.teeth: Teeth | None = None
        # The signals' columns follow the own states, whose number is known only after a first pass; so is the
        # friction of all parts.
        self._has_play, self._film_share = False, 0.0
        for _ in range(2):
            self._given = Contributions()
            self.motion_columns = {name: self.signal(motion) for name, motion in self.motions.items()}
            self._contribute_drive()
            for part in self.parts:
                part.contribute(self)
            given = self._given
            self._has_play = given.play or given.half_gap_rad > 0.0 or bool(given.gap_waves)
            self._film_share, self._own_before = given.film_share, len(given.states)
            self._names = {state.name: OWN + k for k, state in enumerate(self._given.states)}
            self.input_frictions = tuple(self._given.input_frictions)
        if len(self._names) < len(self._given.states):
            raise InputError("two parts of the model add a state of the same name")
        self.states = tuple(self._given.states)
        self.signals = tuple(self._given.signals)
        self.sensors = self._given.sensors
        self.heat_accounts = tuple(self._given.heat_accounts) if audited else ()
        self.system = self._assemble()

    # The drive's own part.

    @property
    def rigid(self) -> bool:
        """Whether the mesh has no compliance."""
        return isinstance(self.drive.mesh, RigidMesh)

    @property
    def has_ring(self) -> bool:
        """Whether the ring is a degree of freedom."""
        mesh = self.drive.mesh
        return isinstance(mesh, TeethMesh | TabulatedMesh) and mesh.ring == "dynamic"

    def _contribute_drive(self) -> None:
        friction.contribute_friction(self, self.drive.friction)
        damping = self.drive.torsion.damping_nm_s_per_rad
        mesh = self.drive.mesh
        if damping > 0 and not self.rigid:
            # A ring of its own has its own twist; else damper and play are in series, but share one twist.
            free_play = isinstance(mesh, TeethMesh | TabulatedMesh) or self._has_play
            kernel = friction.contact_damping if free_play and not self.has_ring else friction.torsion_damping
            if self._film_share < 1.0:
                self.element(kernel, [(1.0 - self._film_share) * damping])
            if self._film_share > 0.0:
                self.element(friction.mesh_damping, [self._film_share * damping])
        if isinstance(mesh, TeethMesh | TabulatedMesh) and mesh.damping_nm_s_per_rad > 0:
            self.element(friction.mesh_damping, [mesh.damping_nm_s_per_rad])

    def _mesh_parameters(self) -> tuple[Kernel | None, Array]:
        """The mesh kernel and its numbers."""
        from hdsim.drive import _mesh, _mesh_layout, kept_teeth, spring
        from hdsim.drive.odd_teeth import with_odd_teeth

        mesh = self.drive.mesh
        if isinstance(mesh, RigidMesh):
            return None, np.zeros(0)
        if isinstance(mesh, LumpedMesh):
            reach = spring.TABLE_REACH * self.rated_torque_nm
            step, numbers = spring.catalogue_numbers(self.drive.torsion, tuple(self._given.wind_ups), reach)
            parameters = np.zeros(_mesh_layout.HEADER)
            parameters[_mesh_layout.INVERSE_RATIO] = 1 / self.ratio
            # Below zero where it is preloaded: without teeth to press that takes up play only.
            parameters[_mesh_layout.EXTRA_GAP] = self._given.half_gap_rad
            parameters[_mesh_layout.SPRING_STEP] = step
            parameters[_mesh_layout.SPRING_CELLS] = spring.CELLS
            parameters[_mesh_layout.SPRING_AT] = _mesh_layout.HEADER
            waves = self._given.gap_waves
            parameters[_mesh_layout.WAVES] = len(waves) // _mesh_layout.PER_WAVE
            parameters[_mesh_layout.WAVES_AT] = _mesh_layout.HEADER + len(numbers)
            return _mesh.lumped_mesh, np.concatenate([parameters, numbers, waves])
        if self._given.gap_waves:
            raise InputError("the teeth of this mesh have gaps of their own: a play that goes round has none")
        self.teeth = kept_teeth.teeth_of(
            self.drive,
            mesh,
            self._given.wind_ups,
            extra_half_gap_rad=self._given.half_gap_rad,
            seed=self.seed,
            gap_growth=self._given.gap_growth,
            table_for=self._table_for,
            odd=bool(self._given.odd_teeth),
        )
        self.teeth = with_odd_teeth(self.teeth, self._given.odd_teeth)
        kernel = _mesh.table_mesh if isinstance(self.teeth.mesh, TabulatedMesh) else _mesh.teeth_mesh
        return kernel, self.teeth.parameters

    @property
    def kinematics(self) -> tuple[float, float, float]:
        """(g, nu, kappa) of the arrangement, see ``hdsim.drive._mesh``."""
        geometry = self.drive.geometry
        if self.drive.arrangement == "circular_spline_fixed":
            return 1.0, 0.0, 1.0
        return -geometry.circular_spline_teeth / geometry.flexspline_teeth, 1.0, 0.0

    @property
    def inertias(self) -> tuple[float, float, float]:
        """Inertia of motor, ring and output, kg m^2; a ring that is no coordinate moves with the output."""
        inertia = self.drive.inertia
        output = self.load_inertia_kg_m2
        if not self.has_ring and self.drive.arrangement == "circular_spline_fixed":
            output += inertia.ring_kg_m2
        return inertia.rotor_kg_m2, inertia.ring_kg_m2, output

    def _assemble(self) -> System:
        from hdsim.drive import _layout as a
        from hdsim.drive._assembly import drive_system
        from hdsim.system import System

        given = self._given
        if "output" in self.motions and self.rigid:
            raise InputError("a rigid drive cannot have its output prescribed: prescribe the motor")
        kernel, mesh_parameters = self._mesh_parameters()
        free = [name for name in COORDINATES if self._is_free(name)]
        energies = 3 if self.audited else 0
        states = 2 * len(free) + len(given.states) + energies
        columns = OWN + len(given.states) + SIGNAL_VALUES * len(given.signals)
        rows = OWN + len(given.states)
        gain, output_share, kappa = self.kinematics

        reals = [np.zeros(a.PARAMETERS)]
        head = reals[0]
        head[a.INERTIA : a.INERTIA + 3] = self.inertias
        head[a.INVERSE_RATIO] = 1 / self.ratio
        head[a.GAIN], head[a.OUTPUT_SHARE], head[a.KAPPA] = gain, output_share, kappa
        head[a.LAMBDA + 1] = kappa / self.ratio
        head[a.LAMBDA + 2] = 1 / self.ratio
        length = a.PARAMETERS

        def place(values: Array) -> int:
            nonlocal length
            at = length
            reals.append(values)
            length += len(values)
            return at

        lists: list[int] = []
        ordered = sorted(given.elements, key=lambda entry: entry[3])
        self.element_places: list[tuple[Kernel, int]] = []
        for element_kernel, parameters, own, _, account in ordered:
            at = place(parameters)
            lists += [element_kernel.address, at, own, account]
            self.element_places.append((element_kernel, at))
        for twist_kernel, parameters in given.twists:
            lists += [twist_kernel.address, place(parameters)]
        for signal in given.signals:
            lists += [signal.kernel.address, place(np.asarray(signal.pack(), dtype=np.float64))]
        on_spring = [OWN + k for k, state in enumerate(given.states) if state.on_spring]
        lists += on_spring

        head_integers = np.zeros(a.LISTS, dtype=np.int64)
        head_integers[a.STATES] = states
        head_integers[a.OWN_STATES] = len(given.states)
        head_integers[a.ENERGIES] = energies
        head_integers[a.SIGNALS] = len(given.signals)
        head_integers[a.ELEMENTS] = len(given.elements)
        head_integers[a.TWISTS] = len(given.twists)
        head_integers[a.COLUMNS] = columns
        head_integers[a.ON_SPRING] = len(on_spring)
        head_integers[a.ON_SPRING_AT] = a.LISTS + len(lists) - len(on_spring)
        head_integers[a.ACCOUNTS] = len(self.heat_accounts)
        if given.housing is not None and not self.rigid:
            head_integers[a.HOUSING], head[a.HOUSING_INERTIA] = given.housing
        head_integers[a.STATE_OF : a.STATE_OF + 3] = -1
        head_integers[a.SIGNAL_OF : a.SIGNAL_OF + 3] = -1
        self.place_of = {name: 2 * k for k, name in enumerate(free)}
        for k, name in enumerate(COORDINATES):
            if name in self.place_of:
                head_integers[a.STATE_OF + k] = self.place_of[name]
            if name in self.motion_columns:
                head_integers[a.SIGNAL_OF + k] = self.motion_columns[name]
        if kernel is None:
            head_integers[a.RING] = a.RIGID
        else:
            head_integers[a.MESH_ADDRESS] = kernel.address
            head_integers[a.MESH_AT] = place(mesh_parameters)
            if self.has_ring:
                head_integers[a.RING] = a.RING_DYNAMIC
            else:
                toothed = isinstance(self.drive.mesh, TeethMesh | TabulatedMesh)
                head_integers[a.RING] = a.RING_STATIC if toothed else a.RING_ABSENT
        scratch = a.S_INPUTS + columns + rows + rows * columns + len(self.heat_accounts)
        head_integers[[a.REALS, a.SCRATCH, a.INTEGERS]] = length, scratch, a.LISTS + len(lists)
        self._columns = columns
        y0, scale = self._initial(states, energies)
        return System(
            kernel=drive_system,
            integers=np.concatenate([head_integers, np.array(lists, dtype=np.int64)]),
            reals=np.concatenate(reals),
            scratch_size=scratch,
            y0=y0,
            quadratures=energies,
            scale=scale,
        )

    def seen_scale(self, closer: float = 1.0) -> Array:
        """Sizes at which errors of the states matter beside a sensor's noise, shape (states,).

        A ring's speed counts by what it does to its own twist alone, not by its dampers' torque too.

        Args:
            closer: part of that speed that counts, as its inverse.
        """
        found = self.system.scale.copy()
        if "ring" in self.place_of:
            at = self.place_of["ring"]
            found[at + 1] = max(found[at + 1], self._own_speed(found[at]) / closer)
        return found

    def _own_speed(self, twist_rad: float) -> float:
        """Speed (rad/s) of the ring's own mode between motor and output at an amplitude."""
        torsion = self.drive.torsion
        return twist_rad * float(np.sqrt(torsion.stiffness_k3_nm_per_rad / self.drive.inertia.ring_kg_m2))

    def _is_free(self, name: str) -> bool:
        if name in self.motions:
            return False
        if name == "ring":
            return self.has_ring
        return not (name == "output" and self.rigid)

    def _initial(self, size: int, energies: int) -> tuple[Array, Array]:
        """Initial states and the sizes at which their errors matter."""
        y0, scale = np.zeros(size), np.zeros(size)
        torsion = self.drive.torsion
        wind_up = self.rated_torque_nm / torsion.stiffness_k3_nm_per_rad
        _, _, output = self.inertias
        for name, at in self.place_of.items():
            angle = wind_up * (abs(self.ratio) if name == "motor" else 1.0)
            scale[at] = angle
            # Velocity of the slow torsional mode at that amplitude.
            scale[at + 1] = angle * float(np.sqrt(torsion.stiffness_k3_nm_per_rad / max(output, 1e-3)))
        if "ring" in self.place_of:
            # What it does to its own twist and to the torque of its dampers. Held to the load's speed, a
            # hundredth of that, it would set the step: teeth that touch and part stir it, and nothing else.
            at, mesh = self.place_of["ring"], self.drive.mesh
            assert isinstance(mesh, TeethMesh | TabulatedMesh)
            damping = self.drive.torsion.damping_nm_s_per_rad + mesh.damping_nm_s_per_rad
            damped = self.rated_torque_nm / damping if damping > 0 else np.inf
            scale[at + 1] = max(scale[at + 1], min(self._own_speed(wind_up), damped))
        if "motor" in self.place_of:
            # A sign of the speed over w_s: a stuck shaft that is off by w_s is no longer stuck.
            at = self.place_of["motor"] + 1
            signs = [f.smoothing_velocity_rad_per_s for f in self.input_frictions if f.coulomb_nm > 0]
            if self.drive.friction.load_coefficient > 0:
                signs.append(self.drive.friction.smoothing_velocity_rad_per_s)
            scale[at] = min([scale[at], *(_SIGNS * smoothing for smoothing in signs)])
        for k, state in enumerate(self.states):
            y0[size - energies - len(self.states) + k] = state.initial
            scale[size - energies - len(self.states) + k] = state.scale
        scale[size - energies :] = self.rated_torque_nm * wind_up
        return y0, scale

    def initial_state(
        self, *, motor_angle: float = 0.0, motor_velocity: float = 0.0, output_twist: float = 0.0
    ) -> Array:
        """State vector for a motor angle (rad), a velocity (rad/s) and a twist of the output (rad).

        Ring and output start at the ideal gear's angle, the output displaced by ``-output_twist``.
        """
        y = self.system.y0.copy()
        if "motor" in self.place_of:
            y[self.place_of["motor"]] = motor_angle
            y[self.place_of["motor"] + 1] = motor_velocity
        if "output" in self.place_of:
            y[self.place_of["output"]] = -output_twist
        return y
