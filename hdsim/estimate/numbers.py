"""Numbers of a model that a fit may move: declared at their fields (``hdsim.number``), found here."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import BaseModel

from hdsim.estimate.state import State
from hdsim.number import FIXED, Number, declared, limits
from hdsim.parts import Effect
from hdsim.scenario.fields import split_unit

#: Prior standard deviations of the torques' sensitivities (their logarithms): a torque constant is printed at
#: +-10 % and falls with saturation and heat, strain gauges on a joint are calibrated to a few percent.
GAIN_PRIORS = {"motor_torque": 0.15, "output_torque": 0.03}
#: The same of a torque's delay beside the motion, in samples.
DELAY_PRIOR = 1.0
#: Factor from 1 beyond which a fitted sensitivity is suspect.
FAR_GAIN = 2.0
#: Farthest that a logarithm goes from where its prior has its centre.
REACH = 3.0


@dataclass(frozen=True)
class Free:
    """A number of the base model that a fit may scale: its value is the start times exp(theta).

    Attributes:
        name: dotted path in the scenario.
        paths: the numbers that scale together; none of a reading.
        prior: standard deviation of theta that an engineer would believe before the measurement.
        value: the start value, of the first path.
        unit: of the value; empty for a pure number.
        step: where it is not 0, the value is the start plus theta times this: it may be negative.
        given: theta of the model's own number as it was before anything was fitted.
        compliance: it is the stiffness of a compliance in series with the output.
        gain_of: the channel whose sensitivity it is, if it is one.
        delay_of: the channel whose delay it is, if it is one.
        least: least value that all its fields allow.
        most: largest value that all its fields allow.
        far: factor from the model's value beyond which a fitted one is suspect.
        may_vanish: only a larger one is.
    """

    name: str
    paths: tuple[str, ...]
    prior: float
    value: float
    unit: str = ""
    step: float = 0.0
    given: float = 0.0
    compliance: bool = False
    gain_of: str = ""
    delay_of: str = ""
    least: float = 0.0
    most: float = math.inf
    far: float = 5.0
    may_vanish: bool = False

    @property
    def reading(self) -> bool:
        """Whether it changes how a channel is read, not what happens."""
        return bool(self.gain_of or self.delay_of)

    @property
    def none(self) -> float:
        """Where the prior's centre is: theta of the model's own number, or of no delay."""
        return -self.value / self.step if self.step else self.given

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and largest theta: within reach of the prior's centre and what its fields allow."""
        low, high = self.none - REACH, self.none + REACH
        if self.step:
            return low, high
        if self.least > 0:
            low = max(low, math.log(self.least / self.value))
        return low, min(high, math.log(self.most / self.value)) if math.isfinite(self.most) else high

    def at(self, theta: float) -> float:
        """The value at ``theta``."""
        return self.value + self.step * theta if self.step else self.value * math.exp(theta)

    def moved(self, theta: float) -> Free:
        """The same number, started at ``theta``: what was believed of it before stays."""
        return replace(self, value=self.at(theta), given=self.given - theta)


@dataclass
class Interval:
    """A fitted number with its 95 % interval; ``determined`` is false when the data cannot say.

    Where the measured motion does not resolve what would tell it, it is not ``resolved``: fitted, it makes up
    for that, and says nothing of the drive (``hdsim.estimate.resolved``).
    """

    name: str
    value: float
    start: float
    low: float
    high: float
    unit: str = ""
    determined: bool = True
    tied_to: list[str] = field(default_factory=list)
    delay_of: str = ""
    resolved: bool = True

    @property
    def moved(self) -> bool:
        """Whether the start value lies outside the interval and more than 3 % away; a delay is no model's."""
        away = self.start != 0.0 and abs(self.value - self.start) > 0.03 * abs(self.start)
        return self.determined and away and not self.low <= self.start <= self.high


def base_freedoms(
    state: State,
    channels: Sequence[str],
    *,
    load_known: bool = False,
    locked: bool = False,
    apart: Collection[str] = (),
) -> list[Free]:
    """Numbers that the model has and that a fit may move by itself: the zero ones stay zero.

    Args:
        state: the model.
        channels: the predicted channels; the sensitivities of the torques among them are free.
        load_known: the output's torque is measured and given, so nothing of the load is free.
        locked: nothing moves but the drive's own spring: then only a second torque tells the sensitivity of
            one from stiffness and friction.
        apart: paths of numbers of a group that move by themselves, such as the drive's first stiffness.
    """
    sections: dict[str, Any] = {"drive": state.drive, "load": state.load}
    if load_known:
        del sections["load"]
    sections |= {f"effects.{name}": effect for name, effect in state.effects.items()}
    found: dict[tuple[str, str], Free] = {}
    for section, model in sections.items():
        for path, value, number, metadata in _numbers(model, section):
            if (
                value <= 0
                or not number.prior
                or number.asked
                or (number.matters is not None and not number.matters(model))
            ):
                continue
            one = _free(path, value, number, metadata)
            one = replace(one, compliance=number.compliance or _inverse(model, path.rpartition(".")[2]))
            group = number.group if number.group and path not in apart else path
            first = found.setdefault((section, group), one)
            if first is not one:
                # The factor of the group stays where each of its members is legal.
                ratio = first.value / value
                found[section, group] = replace(
                    first,
                    paths=(*first.paths, path),
                    least=max(first.least, one.least * ratio),
                    most=min(first.most, one.most * ratio),
                )
    torques = predicted_torques(channels, load_known=load_known)
    if locked and len(torques) < 2:
        torques = ()
    gains = [
        Free(f"{c}_gain", (), GAIN_PRIORS[c], state.gains.get(c, 1.0), gain_of=c, far=FAR_GAIN)
        for c in torques
    ]
    return [*found.values(), *gains]


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
    return [
        Free(f"{c}_delay_s", (), DELAY_PRIOR, state.delays.get(c, 0.0), "s", period_s, delay_of=c)
        for c in predicted_torques(channels, load_known=load_known)
    ]


def predicted_torques(channels: Sequence[str], *, load_known: bool = False) -> tuple[str, ...]:
    """Torques among the predicted channels; the output's is none where it is given as the load."""
    torques = ("motor_torque",) if load_known else ("motor_torque", "output_torque")
    return tuple(c for c in torques if c in channels)


def undeclared(state: State, path: str, prior: float) -> Free | None:
    """A number of the model that no fit moves by itself; None where there is none above zero.

    Args:
        state: the model.
        path: dotted, in the scenario.
        prior: standard deviation of its logarithm, where its field does not say.
    """
    sections = {"drive": state.drive, "load": state.load}
    sections |= {f"effects.{name}": effect for name, effect in state.effects.items()}
    for section, model in sections.items():
        for own, value, number, metadata in _numbers(model, section):
            if own == path and value > 0:
                return _free(own, value, replace(number, prior=number.prior or prior), metadata)
    return None


def _free(path: str, value: float, number: Number, metadata: Sequence[Any]) -> Free:
    least, most = limits(metadata)
    return Free(
        path, (path,), number.prior, value, split_unit(path.rpartition(".")[2])[1],
        compliance=number.compliance, least=least, most=most, far=number.far, may_vanish=number.may_vanish,
    )  # fmt: skip


def _numbers(model: BaseModel, path: str) -> Iterator[tuple[str, float, Number, Sequence[Any]]]:
    """Path, value, annotation and metadata of every number that a model has, sections included."""
    for name, info in type(model).model_fields.items():
        value, own = getattr(model, name), f"{path}.{name}"
        if isinstance(value, BaseModel):
            yield from _numbers(value, own)
        elif isinstance(value, float):
            number = declared(info.metadata)
            if number is None:
                number = model.number if isinstance(model, Effect) else FIXED
            yield own, value, number, info.metadata


def _inverse(model: BaseModel, name: str) -> bool:
    """Whether an effect is fitted by the inverse of this field."""
    terms = [term for fitting in getattr(model, "fittings", ()) for term in fitting.terms]
    return any(term.series_field == name for term in terms)


def scaled(state: State, frees: Sequence[Free], theta: Sequence[float]) -> State:
    """``state`` with every freedom's numbers multiplied by exp(theta), delays moved by their steps."""
    sections: dict[str, Any] = {"drive": state.drive, "load": state.load}
    effects, gains, delays = dict(state.effects), dict(state.gains), dict(state.delays)
    for free, t in zip(frees, theta, strict=True):
        if free.delay_of:
            delays[free.delay_of] = delays.get(free.delay_of, 0.0) + free.step * float(t)
            continue
        factor = math.exp(float(t))
        if free.gain_of:
            gains[free.gain_of] = gains.get(free.gain_of, 1.0) * factor
        for path in free.paths:
            section, _, rest = path.partition(".")
            if section in sections:
                sections[section] = _multiplied(sections[section], rest, factor)
            else:
                name, _, field_name = rest.partition(".")
                effects[name] = _multiplied(effects[name], field_name, factor)
    return replace(
        state, drive=sections["drive"], load=sections["load"], effects=effects, gains=gains, delays=delays
    )


def _multiplied(model: BaseModel, path: str, factor: float) -> Any:
    name, _, rest = path.partition(".")
    value = getattr(model, name)
    new = _multiplied(value, rest, factor) if rest else value * factor
    return model.model_copy(update={name: new})
