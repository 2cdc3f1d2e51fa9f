"""A model in the course of a fit: the scenario's, effects that were added, and how its log is read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from hdsim import number
from hdsim.drive.parameters import ToothedMesh
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting, range_of, scales_of
from hdsim.effects.table import Table
from hdsim.estimate.predict import Candidate, PredictionError
from hdsim.estimate.prescribed import LEAD_IN_S
from hdsim.estimate.records import Array
from hdsim.nested import copied, merge, put

if TYPE_CHECKING:
    from hdsim.scenario import Scenario


@dataclass(frozen=True)
class Added:
    """An effect with coefficients: a fitting, its terms' coefficients and its shapes' values.

    Attributes:
        effect: its name in the catalogue.
        fitting: how it is fitted.
        coefficients: one for each column of its terms.
        shapes: one value for each of its shapes.
        orders: orders per wave-generator turn of its periodic terms.
    """

    effect: str
    fitting: Fitting
    coefficients: tuple[float, ...]
    shapes: tuple[float, ...] = ()
    orders: tuple[float, ...] = ()

    @property
    def lives_in(self) -> tuple[str, ...]:
        """Coordinates in which what it leaves is a function, the most telling first."""
        return self.fitting.lives_in or catalogue()[self.effect].signature.lives_in

    @property
    def at_limit(self) -> bool:
        """Whether a number stands at the end of its range: what is fitted would rather be another effect.

        The range is the fitting's, within what the field allows and what its sources have. A number of the
        effect's strength has no lower end: it is weak there.
        """
        if any(
            shape.at_end(value, self.limits)
            for shape, value in zip(self.fitting.shapes, self.shapes, strict=True)
        ):
            return True
        return any(
            term.at_end(self.coefficients[part], self.limits)
            for term, part in self.fitting.parts(self.orders)
        )

    @property
    def freedom(self) -> int:
        """Free numbers; orders that are read from the data are, too."""
        return len(self.coefficients) + len(self.shapes) + len(self.orders)

    def held(self) -> Added:
        """The effect with its shapes as settings, which no fit moves."""
        settings: dict[str, Any] = copied(self.fitting.settings)
        for shape, value in zip(self.fitting.shapes, self.shapes, strict=True):
            put(settings, shape.path, value)
        return replace(self, fitting=replace(self.fitting, shapes=(), settings=settings), shapes=())

    def beside(self, other: Added) -> bool:
        """Whether no shape is so far from the same effect's elsewhere that a minimum may lie between."""
        pairs = zip(self.fitting.shapes, self.shapes, other.shapes, strict=True)
        return all(shape.beside(one, another) for shape, one, another in pairs)

    def limits(self, path: str) -> tuple[float, float]:
        """Least and largest value that a field of the effect allows."""
        return number.limits(_metadata(self.effect, path))

    def to_plausible(self, drive: Any) -> float:
        """Factor on its units at which the first of them is as strong as is plausible in a drive."""
        kind = catalogue()[self.effect]
        scales = scales_of(drive.rated_torque_nm, drive.ratio, drive.torsion.stiffness_k1_nm_per_rad)
        factor = math.inf
        for term in self.fitting.terms:
            for path, strength in term.strengths().items():
                known = range_of(kind, path).plausible
                if known is not None and strength:
                    factor = min(factor, known.times(scales)[1] / abs(strength))
        return factor

    def settings(self) -> dict[str, Any]:
        """Values of the effect's fields."""
        return self.fitting.written(self.coefficients, self.shapes, self.orders)


@cache
def _metadata(effect: str, path: str) -> tuple[Any, ...]:
    """What a field of an effect says of its values."""
    from hdsim.scenario.fields import shape_of

    shape = shape_of(catalogue()[effect])
    for key in path.split("."):
        child = shape.child(int(key) if key.isdigit() else key)
        if child is None:
            raise KeyError(f"{effect} has no {path}")
        shape = child
    return shape.metadata


@dataclass(frozen=True)
class State:
    """A model in the course of a fit.

    Attributes:
        drive: the drive.
        load: the load.
        effects: settings of the effects of the base, by name.
        added: effects that the diagnosis has added.
        gains: sensitivities of the torques' readings where they are not 1, by channel.
        seed: seed of the model.
        delays: age of the torques' readings beside that of the motion's, s, by channel.
        swings: angle (rad) and speed (rad/s) by which the output is off its balance where records begin, by
            their numbers (``hdsim.estimate.free_swing``).
    """

    drive: Any
    load: Any
    effects: dict[str, Any]
    added: tuple[Added, ...] = ()
    gains: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    delays: Mapping[str, float] = field(default_factory=dict)
    swings: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    @property
    def toothed(self) -> bool:
        """Whether the drive's mesh has teeth."""
        return isinstance(self.drive.mesh, ToothedMesh)

    def reading(self, channel: str, time: Array, values: Array, before: State | None = None) -> Array:
        """What the log shows of a predicted channel.

        Args:
            channel: its name.
            time: shape (n,), s.
            values: the prediction, shape (n,); or the reading under the state ``before``.
            before: a state that differs in gains and delays only.
        """
        delay, gain = self.delays.get(channel, 0.0), self.gains.get(channel, 1.0)
        if before is not None:
            delay, gain = delay - before.delays.get(channel, 0.0), gain / before.gains.get(channel, 1.0)
        if delay:
            from scipy.interpolate import CubicSpline

            values = CubicSpline(time, values)(np.clip(time - delay, time[0], time[-1]))
        return gain * values

    def candidate(self) -> Candidate:
        """The model to predict with.

        Raises:
            PredictionError: a coefficient is outside its effect's bounds.
        """
        effects = self.merged_effects()
        for name, effect in effects.items():
            if isinstance(effect, Table):
                # A curve over time begins with the record, after the lead-in.
                effects[name] = effect.delayed(LEAD_IN_S)
        return Candidate(self.drive, effects, self.load, self.seed, self.swings)

    def merged_effects(self) -> dict[str, Any]:
        """The base's effects and those that were added, by name.

        Raises:
            PredictionError: a coefficient is outside its effect's bounds.
        """
        effects = dict(self.effects)
        known = catalogue()
        merged: dict[str, dict[str, Any]] = {}
        for added in self.added:
            merge(merged.setdefault(added.effect, {}), added.settings())
        for name, settings in merged.items():
            if name in effects:
                settings = merge(effects[name].model_dump(exclude_none=True), settings)
            try:
                effects[name] = known[name](**settings)
            except ValidationError as error:
                raise PredictionError(str(error)) from None
        return effects


def state_of(scenario: Scenario) -> State:
    """The scenario's model before anything is fitted."""
    return State(scenario.drive, scenario.load, scenario.effects.active(), seed=scenario.run.seed)


def number_at(state: State, path: str) -> float | None:
    """A number of a state by its dotted path in the scenario; None where it is not set."""
    section, _, rest = path.partition(".")
    here: Any = {"drive": state.drive, "load": state.load, "effects": state.effects}[section]
    for key in rest.split("."):
        here = here[key] if isinstance(here, dict) else getattr(here, key)
    return float(here) if here is not None else None
