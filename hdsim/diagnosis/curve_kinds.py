"""The kinds of curves that can stand for an effect without a name: what acts, over which coordinate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdsim.diagnosis.coordinates import coordinates
from hdsim.diagnosis.locate import Location
from hdsim.effects.table import Acting, Coordinate, TableCurve
from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array
from hdsim.estimate.series import Series
from hdsim.estimate.state import State

#: Coordinates that are tried, and the part of the best located share that each must have.
MOST_PLACES, NEAR = 3, 0.5
_WORDS: dict[Coordinate, str] = {
    "motor_angle": "wave-generator angle",
    "motor_velocity": "motor speed",
    "output_angle": "output angle",
    "output_velocity": "output speed",
    "transmitted_torque": "transmitted torque",
    "twist": "twist",
    "time": "time",
}
_ACTS: dict[Acting, str] = {
    "motor_torque": "torque on the motor",
    "output_torque": "torque on the output",
    "twist_torque": "torque on the torsion spring's twist",
    "mesh_angle": "angle in the mesh",
}
#: A curve's coordinate as located residuals name it.
PLACES: dict[Coordinate, str] = {
    "motor_angle": "wave_generator_angle",
    "motor_velocity": "velocity",
    "output_angle": "output_angle",
    "output_velocity": "velocity",
    "transmitted_torque": "torque",
    "twist": "torque",
    "time": "time",
}


@dataclass(frozen=True)
class Kind:
    """What a curve is a function of and what it does; the first corner's phase is free for a periodic one."""

    coordinate: Coordinate
    acts_on: Acting
    times_direction: bool = False
    period: float | None = None

    @property
    def words(self) -> str:
        """For a sentence: what over what."""
        turned = ", times the sign of the velocity" if self.times_direction else ""
        return f"{_ACTS[self.acts_on]} over {_WORDS[self.coordinate]}{turned}"

    def curve(self, at: Array, values: Array) -> TableCurve:
        """The curve with these corners, SI units."""
        field = "values_rad" if self.acts_on == "mesh_angle" else "values_nm"
        return TableCurve.model_validate(
            {
                "coordinate": self.coordinate,
                "acts_on": self.acts_on,
                "times_direction": self.times_direction,
                "period": self.period,
                "at": at.tolist(),
                field: values.tolist(),
            }
        )


def kinds(bench: Bench, location: Location) -> list[Kind]:
    """The curves that are worth trying, by the coordinates in which the residual lives."""
    best = location.places[0].share if location.places else 0.0
    names: list[str] = []
    for place in location.places:
        if place.share >= NEAR * best and place.coordinate not in names:
            names.append(place.coordinate)
    found: list[Kind] = []
    for name in [n for n in names if n != "time_since_reversal"][:MOST_PLACES]:
        if name == "time" and bench.training == len(bench.predictors) == 1:
            found += [Kind("time", "motor_torque"), Kind("time", "output_torque")]
        elif name in ("velocity", "direction"):
            found += [Kind("motor_velocity", "motor_torque"), Kind("output_velocity", "output_torque")]
        elif name == "output_angle":
            found += [
                Kind("output_angle", "output_torque"),
                Kind("output_angle", "mesh_angle"),
                Kind("output_angle", "motor_torque"),
                Kind("output_angle", "motor_torque", times_direction=True),
            ]
        elif name == "torque":
            found += [
                Kind("twist", "twist_torque"),
                Kind("transmitted_torque", "motor_torque", times_direction=True),
            ]
        elif name == "wave_generator_angle":
            order = max((line for line in location.lines), key=lambda line: line.share, default=None)
            period = 2.0 * math.pi / (order.order if order is not None else 1.0)
            found += [Kind("motor_angle", acts, period=period) for acts in ("motor_torque", "mesh_angle")]
    return list(dict.fromkeys(found))


def values_of(bench: Bench, state: State, kind: Kind, index: int, residuals: Sequence[Array]) -> Array | None:
    """The coordinate of a curve at all samples of a series, shape (n,), SI unit; None where nothing tells it.

    Args:
        bench: the measured series.
        state: the model, whose spring tells the twist.
        kind: the curve.
        index: number of the series.
        residuals: of all series; they say what torque the model has.
    """
    series = bench.series[index]
    predictor = bench.predictors[series.record]
    if kind.coordinate == "motor_angle":
        return np.asarray(predictor.motor_angle)
    if kind.coordinate == "twist" and predictor.plan.locked:
        return np.asarray(predictor.motor_angle / predictor.ratio)
    known: dict[str, Array] = coordinates(bench, series, residuals)
    if kind.coordinate == "motor_velocity":
        return known["velocity"]
    if kind.coordinate == "output_velocity":
        return np.asarray(known["velocity"] / predictor.ratio)
    if kind.coordinate in ("time", "output_angle"):
        return known[kind.coordinate]
    torque = known.get("torque")
    if torque is None or kind.coordinate == "transmitted_torque":
        return torque
    from hdsim.drive.spring import catalogue_wind_up

    return np.asarray(catalogue_wind_up(state.drive.torsion, torque))


def sign_of(bench: Bench, series: Series) -> Array:
    """Smoothed sign of the motor's speed at all samples of a series, shape (n,)."""
    smoothing = TableCurve.model_fields["smoothing_velocity_rad_per_s"].default
    return np.asarray(np.tanh(bench.predictors[series.record].motor_velocity / smoothing))
