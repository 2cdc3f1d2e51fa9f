"""What a fit may change: numbers that the base model has, and coefficients of an effect."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ValidationError

from hdsim.effects import catalogue
from hdsim.effects._fitting import Amplitude, Fitting, Harmonic, Inverse, Periodic
from hdsim.effects.table import Table
from hdsim.estimate.predict import LEAD_IN_S, Candidate, PredictionError
from hdsim.estimate.records import Array

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

#: Coefficient below which a compliance in series counts as none.
STIFF = 1e-6
#: Part of a shape's limit within which it stands there.
LIMIT = 0.02
#: Prior standard deviation of a torque's delay beside the motion, samples.
DELAY_PRIOR = 1.0


@dataclass(frozen=True)
class Free:
    """A number of the base model that a fit may scale: its value is the start times exp(theta).

    Attributes:
        name: dotted path in the scenario.
        paths: the numbers that scale together.
        prior: standard deviation of theta that an engineer would believe before the measurement.
        value: the start value, of the first path.
        unit: of the value.
        step: where it is not 0, the value is the start plus theta times this: it may be negative.
        given: theta of the model's own number as it was before anything was fitted.
    """

    name: str
    paths: tuple[str, ...]
    prior: float
    value: float
    unit: str = ""
    step: float = 0.0
    given: float = 0.0

    @property
    def reading(self) -> bool:
        """Whether it changes how a channel is read, not what happens."""
        return self.paths == ("gain",) or bool(self.step)

    @property
    def none(self) -> float:
        """Where the prior's centre is: theta of the model's own number, or of no delay."""
        return -self.value / self.step if self.step else self.given

    def at(self, theta: float) -> float:
        """The value at ``theta``."""
        return self.value + self.step * theta if self.step else self.value * math.exp(theta)

    def moved(self, theta: float) -> Free:
        """The same number, started at ``theta``: what was believed of it before stays."""
        return replace(self, value=self.at(theta), given=self.given - theta)


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
    def at_limit(self) -> bool:
        """Whether a shape stands at the end of its range: what is fitted would rather be another effect."""
        return any(
            value <= shape.least * (1.0 + LIMIT) or value >= shape.most / (1.0 + LIMIT)
            for shape, value in zip(self.fitting.shapes, self.shapes, strict=True)
        )

    def settings(self) -> dict[str, Any]:
        """Values of the effect's fields."""
        data: dict[str, Any] = _copied(self.fitting.settings)
        for shape, value in zip(self.fitting.shapes, self.shapes, strict=True):
            put(data, shape.path, value)
        at = 0
        c = self.coefficients
        total: dict[str, float] = {}
        for term in self.fitting.terms:
            if isinstance(term, Amplitude):
                for path, unit in term.units.items():
                    put(data, path, c[at] * unit + total.get(path, 0.0))
                    total[path] = total.get(path, 0.0) + c[at] * unit
                at += 1
            elif isinstance(term, Inverse):
                put(data, term.path, term.unit / max(c[at], STIFF))
                at += 1
            elif isinstance(term, Harmonic):
                put(data, term.amplitude, term.unit * math.hypot(c[at], c[at + 1]))
                put(data, term.phase, math.degrees(math.atan2(c[at + 1], c[at])))
                at += 2
            else:
                items = _copied(self.fitting.items(term.section))
                items = _copied(_at(data, term.section)) if items else items
                for order in self.orders:
                    item = dict(term.settings) | {"order": order}
                    item[term.amplitude] = term.unit * math.hypot(c[at], c[at + 1])
                    item["phase_deg"] = math.degrees(math.atan2(c[at + 1], c[at]))
                    items.append(item)
                    at += 2
                put(data, term.section, items)
        return data


def signed(fitting: Fitting, orders: int) -> list[bool]:
    """Whether each coefficient of a fitting may be negative."""
    found: list[bool] = []
    for term in fitting.terms:
        if isinstance(term, Harmonic):
            found += [True, True]
        elif isinstance(term, Periodic):
            found += [True, True] * orders
        elif isinstance(term, Amplitude):
            found.append(term.signed)
        else:
            found.append(False)
    return found


def ceilings(added: Added) -> list[float]:
    """Largest value that each coefficient may have, from the bounds of the effect's fields."""
    fields = catalogue()[added.effect].model_fields
    found: list[float] = []
    for term, count in zip(added.fitting.terms, _counts(added), strict=True):
        most = math.inf
        for path, unit in term.units.items() if isinstance(term, Amplitude) else ():
            for bound in fields[path].metadata if path in fields else ():
                limit = getattr(bound, "le", getattr(bound, "lt", None))
                most = most if limit is None else min(most, 0.999 * float(limit) / unit)
        found += [most] * count
    return found


def _counts(added: Added) -> list[int]:
    """Number of coefficients of each term."""
    sizes = {Harmonic: 2, Periodic: 2 * len(added.orders)}
    return [sizes.get(type(term), 1) for term in added.fitting.terms]


@dataclass(frozen=True)
class State:
    """A model in the course of a diagnosis.

    Attributes:
        drive: the drive.
        load: the load.
        effects: settings of the effects of the base, by name.
        added: effects that the diagnosis has added.
        gain: sensitivity of the motor torque's reading.
        seed: seed of the model.
        delays: age of the torques' readings beside that of the motion's, s, by channel.
    """

    drive: Any
    load: Any
    effects: dict[str, Any]
    added: tuple[Added, ...] = ()
    gain: float = 1.0
    seed: int = 0
    delays: Mapping[str, float] = field(default_factory=dict)

    def reading(self, channel: str, time: Array, values: Array, before: State | None = None) -> Array:
        """What the log shows of a predicted channel.

        Args:
            channel: its name.
            time: shape (n,), s.
            values: the prediction, shape (n,); or the reading under the state ``before``.
            before: a state that differs in gain and delays only.
        """
        delay, gain = self.delays.get(channel, 0.0), self.gain
        if before is not None:
            delay, gain = delay - before.delays.get(channel, 0.0), gain / before.gain
        if delay:
            from scipy.interpolate import CubicSpline

            values = CubicSpline(time, values)(np.clip(time - delay, time[0], time[-1]))
        return gain * values if channel == "motor_torque" else values

    def candidate(self) -> Candidate:
        """The model to predict with.

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
        for name, effect in effects.items():
            if isinstance(effect, Table):
                # A curve over time begins with the record, after the lead-in.
                effects[name] = effect.delayed(LEAD_IN_S)
        return Candidate(self.drive, effects, self.load, self.seed)


def state_of(scenario: Scenario) -> State:
    """The scenario's model before anything is fitted."""
    return State(scenario.drive, scenario.load, scenario.effects.active(), (), 1.0, scenario.run.seed)


#: Prior standard deviations of the logarithm, by the last part of a path.
_PRIORS = {
    "inertia_kg_m2": 0.5,
    "motor_kg_m2": 0.5,
    "mass_kg": 0.4,
    "coulomb_nm": 0.7,
    "viscous_nm_s_per_rad": 0.7,
    "load_coefficient": 0.7,
    "damping_nm_s_per_rad": 1.0,
}


def base_freedoms(
    state: State, channels: Sequence[str], *, load_known: bool = False, locked: bool = False
) -> list[Free]:
    """Numbers that the model has and that a fit may move: the zero ones stay zero.

    Args:
        state: the model.
        channels: the predicted channels; the torque's sensitivity is free when the motor's torque is one.
        load_known: the output's torque is measured and given, so nothing of the load is free.
        locked: the output does not move: then only a second torque tells the sensitivity of the motor's from
            the drive's own stiffness and friction.
    """
    drive, load = state.drive, state.load
    found = [_free("drive.inertia.motor_kg_m2", drive.inertia.motor_kg_m2, "kg m^2")]
    if not load_known:
        found.append(_free("load.inertia_kg_m2", load.inertia_kg_m2, "kg m^2"))
    if load.gravity is not None and not load_known:
        found.append(_free("load.gravity.mass_kg", load.gravity.mass_kg, "kg"))
    if drive.mesh.model != "rigid":
        paths = tuple(f"drive.torsion.stiffness_k{k}_nm_per_rad" for k in (1, 2, 3))
        value = drive.torsion.stiffness_k1_nm_per_rad
        found.append(Free("drive.torsion.stiffness_k1_nm_per_rad", paths, 0.4, value, "N m/rad"))
        found.append(
            _free("drive.torsion.damping_nm_s_per_rad", drive.torsion.damping_nm_s_per_rad, "N m s/rad")
        )
    friction = drive.friction
    found.append(_free("drive.friction.coulomb_nm", friction.coulomb_nm, "N m"))
    found.append(_free("drive.friction.viscous_nm_s_per_rad", friction.viscous_nm_s_per_rad, "N m s/rad"))
    found.append(_free("drive.friction.load_coefficient", friction.load_coefficient, "1"))
    for name, effect in state.effects.items():
        for field_name, value in effect:
            still = ("smoothing", "phase", "_deg", "gravity", "ambient", "reference", "sharpness", "counts")
            if isinstance(value, float) and value > 0 and not any(word in field_name for word in still):
                path = f"effects.{name}.{field_name}"
                found.append(Free(path, (path,), 0.7, value, field_name.rpartition("_nm")[1].strip("_")))
    if "motor_torque" in channels and ("output_torque" in channels or not locked):
        found.append(Free("motor_torque_gain", ("gain",), 0.15, state.gain, "1"))
    return [free for free in found if free.value > 0]


def delay_freedoms(
    state: State, channels: Sequence[str], period_s: float, *, load_known: bool = False
) -> list[Free]:
    """Delays of the predicted torques beside the motion: a log may stamp them late or early.

    Args:
        state: the model.
        channels: the predicted channels.
        period_s: of the samples.
        load_known: the output's torque is given, so only the motor's can be late.
    """
    torques = ("motor_torque",) if load_known else ("motor_torque", "output_torque")
    return [
        Free(f"{c}_delay_s", (f"{c}_delay_s",), DELAY_PRIOR, state.delays.get(c, 0.0), "s", period_s)
        for c in torques
        if c in channels
    ]


def _free(path: str, value: float, unit: str) -> Free:
    return Free(path, (path,), _PRIORS.get(path.rpartition(".")[2], 0.5), float(value), unit)


def scaled(state: State, frees: Sequence[Free], theta: Sequence[float]) -> State:
    """``state`` with every freedom's numbers multiplied by exp(theta), delays moved by their steps."""
    drive, load, effects, gain = state.drive, state.load, dict(state.effects), state.gain
    delays = dict(state.delays)
    for free, t in zip(frees, theta, strict=True):
        if free.step:
            channel = free.name.removesuffix("_delay_s")
            delays[channel] = delays.get(channel, 0.0) + free.step * float(t)
            continue
        factor = math.exp(float(t))
        for path in free.paths:
            section, _, rest = path.partition(".")
            if section == "gain":
                gain *= factor
            elif section == "drive":
                drive = _multiplied(drive, rest, factor)
            elif section == "load":
                load = _multiplied(load, rest, factor)
            else:
                name, _, field_name = rest.partition(".")
                effects[name] = _multiplied(effects[name], field_name, factor)
    return State(drive, load, effects, state.added, gain, state.seed, delays)


def _multiplied(model: BaseModel, path: str, factor: float) -> Any:
    name, _, rest = path.partition(".")
    value = getattr(model, name)
    new = _multiplied(value, rest, factor) if rest else value * factor
    return model.model_copy(update={name: new})


def _at(data: Any, path: str) -> Any:
    for key in path.split("."):
        data = data[key]
    return data


def number_at(state: State, path: str) -> float | None:
    """A number of a state by its dotted path in the scenario; None where it is not set."""
    section, _, rest = path.partition(".")
    here: Any = {"drive": state.drive, "load": state.load, "effects": state.effects}[section]
    for key in rest.split("."):
        here = here[key] if isinstance(here, dict) else getattr(here, key)
    return float(here) if here is not None else None


def put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set a value by its dotted path; numbers in the path are indices of lists that are there."""
    here: Any = data
    *parents, last = path.split(".")
    for key in parents:
        here = here[int(key)] if isinstance(here, list) else here.setdefault(key, {})
    if isinstance(here, list):
        here[int(last)] = value
    else:
        here[last] = value


def merge(data: dict[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """``more`` laid over ``data`` in place; lists are appended to lists."""
    for key, value in more.items():
        below = data.get(key)
        if isinstance(value, Mapping) and isinstance(below, dict):
            merge(below, value)
        elif isinstance(value, list) and isinstance(below, list | tuple):
            data[key] = [*below, *value]
        else:
            data[key] = _copied(value)
    return data


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _copied(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_copied(item) for item in value]
    return value


@dataclass
class Interval:
    """A fitted number with its 95 % interval; ``determined`` is false when the data cannot say."""

    name: str
    value: float
    start: float
    low: float
    high: float
    unit: str = ""
    determined: bool = True
    tied_to: list[str] = field(default_factory=list)

    @property
    def moved(self) -> bool:
        """Whether the start value lies outside the interval and more than 3 % away; a delay is no model's."""
        away = self.start != 0.0 and abs(self.value - self.start) > 0.03 * abs(self.start)
        return self.determined and away and not self.low <= self.start <= self.high
