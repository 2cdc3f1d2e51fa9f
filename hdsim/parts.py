"""The contract between a piece of the model and the model: parameters in, kernels out.

Everything that an engineer can add to a drive (an effect, a load, a controller, a friction law) is a
``Part``: its numbers, with units and bounds, and one method, ``contribute``, that hands kernels to a
``Builder``. No part knows another one, and no table lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol

from pydantic import BaseModel, ConfigDict

from hdsim.number import Number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hdsim.kernel import Kernel

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """A state that a part adds to the model.

    Args:
        name: its name in the log, unique in the model.
        unit: SI unit.
        initial: value at the start.
        scale: size at which an error of rtol matters, in the state's unit; sets its absolute tolerance.
        description: one line for the log.
        on_spring: whether it is a torque, N m, parallel to the torsion spring (and its part puts minus it on
            the twist): behind an open gap the spring rests where the two balance.
    """

    name: str
    unit: str
    initial: float
    scale: float
    description: str = ""
    on_spring: bool = False


@dataclass(frozen=True)
class InputFriction:
    """Friction on the motor shaft, T = T_c tanh(w/w_s) + b w, that a part has added there.

    A part that changes the friction of others (with temperature, say) must know how much there is of it.

    Args:
        coulomb_nm: T_c, N m.
        viscous_nm_s_per_rad: b, N m s/rad.
        smoothing_velocity_rad_per_s: w_s, rad/s.
    """

    coulomb_nm: float
    viscous_nm_s_per_rad: float
    smoothing_velocity_rad_per_s: float


@dataclass(frozen=True)
class OddTooth:
    """A tooth that differs from those that a mesh has drawn.

    Args:
        member: the spline that it belongs to.
        tooth: its number there, from the one that is on the wave generator's major axis at zero angles,
            rising with the angle; between two whole numbers each of the two teeth has its share of the
            error.
        shift_m: how far it is out of place along its normal, m: with a positive one its pair meets earlier at
            a positive twist.
        widened_m: half-gap of its pair on top of its own, m; negative where the tooth is too thick.
    """

    member: Literal["flexspline", "circular_spline"]
    tooth: float
    shift_m: float = 0.0
    widened_m: float = 0.0


#: Account of the heat of friction on the motor shaft (see ``Builder.element``).
INPUT_FRICTION_HEAT = "friction on the motor shaft"


@dataclass(frozen=True)
class Signature:
    """The trace that an effect leaves in measured data.

    Args:
        lives_in: the coordinates in which its residual is a function, most telling first, among ``time``,
            ``wave_generator_angle``, ``output_angle``, ``velocity``, ``direction``, ``time_since_reversal``,
            ``torque``, ``temperature``, ``frequency``.
        channels: the contract's channels in which it shows, most telling first.
        orders: orders per wave-generator turn at which it appears, if it is periodic.
        confused_with: names of effects that can look alike, with what separates them.
        exact: the law follows from statics or geometry alone: what it leaves in its own coordinate is no
            error of its formula but another effect.
    """

    lives_in: tuple[str, ...]
    channels: tuple[str, ...]
    orders: tuple[float, ...] = ()
    confused_with: dict[str, str] = field(default_factory=dict)
    exact: bool = False


@dataclass(frozen=True)
class OfTeeth:
    """What a field of an effect says of the teeth, for reports.

    Args:
        field: its name.
        says: ``place``: a tooth's number on the spline that the field ``member`` names; ``play``: how much
            wider all gaps are; ``growth``: by which part of itself each gap is wider.
        play_arcmin: of ``play``, the play at the output for 1 of the field, arcmin.
    """

    field: str
    says: Literal["place", "play", "growth"]
    play_arcmin: float = 0.0


class Parameters(BaseModel):
    """Base of everything that a scenario can set: unknown keys refused, values checked, frozen."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True, strict=False
    )


class Builder(Protocol):
    """What a part may ask of the model that it contributes to."""

    ratio: float
    """Signed ratio motor angle / output angle."""
    rated_torque_nm: float
    twist_sign: float
    """Sign of the torque on the output at a positive twist of the torsion spring, 1 or -1."""
    input_frictions: Sequence[InputFriction]
    """Friction on the motor shaft, of the drive and of every part that has declared its own."""
    seed: int
    """Seed of every random number of the run; derive one with ``numpy.random.default_rng([seed, ...])``."""

    def element(
        self,
        kernel: Kernel,
        parameters: Sequence[float] | Array,
        *,
        states: Sequence[State] = (),
        last: bool = False,
        heat: str = "",
    ) -> int:
        """Add an element; returns the index of its first own state.

        Args:
            kernel: the element.
            parameters: its numbers.
            states: states of its own.
            last: runs it after all others.
            heat: account of its heat; an element that changes another's friction shares that one's account.
                The heat of an account is never negative, and a run's audit holds it to that. By default
                every element has its own.
        """

    def declare_input_friction(self, friction: InputFriction) -> None:
        """Tell the other parts of friction that an element adds on the motor shaft."""

    def housing(self, own: int, inertia_kg_m2: float) -> None:
        """Let the housing turn: its angle is the part's state ``inputs[own]``, its speed ``inputs[own + 1]``.

        The mesh then sees every angle from there, and its reaction, over the inertia, is added to the rate of
        that speed; whatever else acts on the housing is the part's own. A rigid mesh has no compliance: its
        housing stands still.

        Raises:
            InputError: the model has a moving housing already.
        """

    def twist(self, kernel: Kernel, parameters: Sequence[float] | Array) -> None:
        """Add a contribution to the mesh twist (kinematic error and its kin)."""

    def series_compliance(self, wind_up: Callable[[Array], Array], *, play: bool = False) -> None:
        """Put a spring in series with the torsion spring: odd wind-up (rad, at output) over torque (N m).

        Args:
            wind_up: the spring.
            play: whether it is free play taken up gradually: what is not in contact is not damped.
        """

    def widen_gap(self, half_gap_rad: float) -> None:
        """Add to the half-gap of the mesh, as an angle at the output; below zero teeth are pressed."""

    def wave_of_gap(self, amplitude_rad: float, by_motor: float, by_output: float, phase_rad: float) -> None:
        """Let the half-gap of a lumped mesh go round with the angles of motor and output.

        It is wider by amplitude sin(by_motor theta_m + by_output theta_o + phase), an angle at the output,
        and nowhere below zero. A rigid mesh has no gap.

        Raises:
            InputError: the mesh has teeth, each with a gap of its own.
        """

    def fill_gap(self, share: float) -> None:
        """Let a share of the drive's damper be that of the grease between the flanks, in the gap, too."""

    def grow_gaps(self, growth: float) -> None:
        """Widen each tooth's own half-gap by a part of itself; a mesh without teeth has none."""

    def odd_tooth(self, tooth: OddTooth) -> None:
        """Let a tooth differ from the drawn ones; a mesh without teeth has none."""

    def signal(self, signal: Any) -> int:
        """Register a signal (``hdsim.actuation.signals``); returns the column of its value in the inputs.

        The next three columns hold its first three derivatives.
        """

    def external(self, name: str) -> int | None:
        """Column of a signal that whoever runs the model provides by name; None when it does not.

        ``temperature``: measured temperature of the drive, degC. Derivatives follow as for ``signal``.
        """

    def state_index(self, name: str) -> int | None:
        """Index in the inputs of another part's state, or None when the model has none of that name."""

    def sensor(self, channel: str, sensor: Any) -> None:
        """Let ``sensor`` (see ``hdsim.effects.sensors``) stand between a channel and its reader."""


class Part(Parameters):
    """A piece of the model with parameters; subclasses say what it adds."""

    def contribute(self, build: Builder) -> None:
        """Hand this part's kernels to the builder."""
        raise NotImplementedError


@dataclass(frozen=True)
class DriveSize:
    """What the default numbers of effects depend on.

    Args:
        rated_torque_nm: at the output, N m.
        ratio: motor angle / output angle.
        stiffness_k1_nm_per_rad: first stiffness, N m/rad.
        accuracy_rad: printed transmission accuracy, peak to peak, rad; 0 where nothing is printed.
        hysteresis_loss_rad: printed hysteresis loss, rad; 0 where nothing is printed.
    """

    rated_torque_nm: float
    ratio: float
    stiffness_k1_nm_per_rad: float
    accuracy_rad: float = 0.0
    hysteresis_loss_rad: float = 0.0


class Effect(Part):
    """A physical effect: one file in ``hdsim/effects``, off until a scenario names it.

    Class attributes:
        title: the field's standard term, for reports.
        source: where the equation comes from.
        signature: the trace it leaves in measured data.
        number: what its numbers say to a fit where a field's annotation (``hdsim.number``) says nothing else:
            a source's number is often another machine's.
        several: whether its fittings are errors of different things, one beside the other.
        adds_to: its fields that come on top of a number of the drive, by that number's path in the drive.
        printed: whether catalogues print how large it is, so that ``effects: {set: catalogue}`` turns it on.
        of_teeth: what it says of the teeth, if anything.
        finer: ways to fit it (``Fitting``) with more numbers, asked once it has its name.
    """

    title: ClassVar[str]
    source: ClassVar[str]
    signature: ClassVar[Signature]
    number: ClassVar[Number] = Number(0.7, far=15.0, may_vanish=True)
    several: ClassVar[bool] = False
    adds_to: ClassVar[tuple[tuple[str, str], ...]] = ()
    printed: ClassVar[bool] = False
    of_teeth: ClassVar[OfTeeth | None] = None
    finer: ClassVar[tuple[Any, ...]] = ()

    def misfit(self, least_stiffness_nm_per_rad: float) -> str:
        """Which numbers no drive with such a torsion spring can have, as ``field: found ..., expected ...``.

        Args:
            least_stiffness_nm_per_rad: of the spring's softest segment; infinite where the mesh is rigid.

        Returns:
            The complaint; empty where there is none.
        """
        return ""

    @classmethod
    def sized(cls, given: Mapping[str, Any], size: DriveSize, reference: DriveSize) -> dict[str, Any]:
        """Default numbers for a drive, beyond those that grow with what their ``Plausible.of`` says.

        Args:
            given: fields that a scenario states.
            size: the drive.
            reference: the drive of the fields' own defaults.
        """
        return {}
