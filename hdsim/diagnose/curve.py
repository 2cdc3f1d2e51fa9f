"""Step 8 for ``unknown``: the curve over a coordinate that explains best what is left, as a ``table`` effect.

Each corner's unit curve is simulated once in the re-fitted model; its change of all channels is a column.
The values follow from penalised least squares, whose roughness is the one that predicts left-out blocks of
time best, so that noise draws no curve. What the model's own numbers or the sensors' offsets explain is left
to them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdsim.diagnose.coordinates import coordinates, hats
from hdsim.diagnose.further import CurveFound
from hdsim.diagnose.locate import Location
from hdsim.diagnose.penalised import UNSEEN, Penalised, penalised, roughness
from hdsim.diagnose.screen import Residual
from hdsim.diagnose.search import left_of
from hdsim.effects._fitting import Amplitude, Fitting
from hdsim.effects.table import COORDINATE_UNITS, Acting, Coordinate, TableCurve, cells
from hdsim.estimate.bench import Bench, Series
from hdsim.estimate.fit import Fit
from hdsim.estimate.numbers import scaled
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State
from hdsim.estimate.vector import COEFFICIENT_PRIOR

#: Corners of a curve, of a curve over a period, and of the fine curve that says where corners are needed.
CORNERS, ROUND_CORNERS, FINE = 14, 12, 80
#: Coordinates that are tried, and the part of the best located share that each must have.
MOST_PLACES, NEAR = 3, 0.5
#: Least cross-validated share of the weighed residual that a curve must explain to be offered.
LEAST_SHARE = 0.05
#: Share by which a later kind of curve must be better than an earlier, plainer one.
TIE = 0.01
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
        turned = ", turned with the direction" if self.times_direction else ""
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


@dataclass
class CurveFit:
    """A fitted curve.

    Attributes:
        kind: what it is a function of and what it does.
        at: corners, shape (k,), in the coordinate's SI unit.
        values: shape (k,), N m or rad.
        low: lower ends of the values' 95 % intervals, shape (k,).
        high: upper ends.
        share: cross-validated share of the weighed training residual.
        tried: share of every kind of curve that was tried, by its words.
        fit: the model with the curve; its last added effect is the curve.
    """

    kind: Kind
    at: Array
    values: Array
    low: Array
    high: Array
    share: float
    tried: dict[str, float]
    fit: Fit

    @property
    def added(self) -> Added:
        """The curve as an effect."""
        return self.fit.state.added[-1]

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return "rad" if self.kind.acts_on == "mesh_angle" else "N m"

    def found(self) -> CurveFound:
        """What ``verdict.json`` holds of it."""
        return CurveFound(
            words=self.kind.words,
            coordinate=self.kind.coordinate,
            coordinate_unit=COORDINATE_UNITS[self.kind.coordinate],
            acts_on=self.kind.acts_on,
            times_direction=self.kind.times_direction,
            period=self.kind.period,
            at=[float(v) for v in self.at],
            values=[float(v) for v in self.values],
            intervals=[(float(a), float(b)) for a, b in zip(self.low, self.high, strict=True)],
            unit=self.unit,
            share=round(self.share, 4),
            tried={words: round(share, 4) for words, share in self.tried.items()},
        )


def fit_curve(
    bench: Bench, fit: Fit, location: Location, *, on_step: Callable[[str], object] | None = None
) -> CurveFit | None:
    """Fit the curve that explains best what a model leaves, of those over the best located coordinates.

    Args:
        bench: the measured series; they are weighed by what ``fit`` leaves.
        fit: the fitted model, as ``refit`` leaves it.
        location: where its residual lives.
        on_step: told what is being tried.

    Returns:
        The curve, or None when none explains enough of what has not been fitted.
    """
    bench.weigh(bench.residuals(fit.predictions))
    residuals = bench.residuals(fit.predictions)
    left = left_of(bench, fit)
    best: tuple[float, Kind, Array, Added, Array, Penalised] | None = None
    tried: dict[str, float] = {}
    for kind in kinds(bench, location):
        if on_step is not None:
            on_step(f"a curve: {kind.words}")
        at = corners(bench, fit.state, kind, location, left, residuals)
        if at is None:
            continue
        added = effect(fit.state, kind, at)
        columns = unit_traces(bench, fit, kind, at, added, residuals)
        if columns is None:
            continue
        found = penalised(
            left.project(columns),
            left.values,
            bench.stacked_blocks(),
            roughness(len(at), closed=kind.period is not None),
        )
        tried[kind.words] = max(tried.get(kind.words, 0.0), found.share)
        if best is None or found.share > best[0] + TIE:
            best = (found.share, kind, at, added, columns, found)
    if best is None or best[0] < LEAST_SHARE:
        return None
    share, kind, at, added, columns, found = best
    fitted, spread = _solved(bench, fit, left, at, added, columns, found)
    coefficients = np.array(fitted.state.added[-1].coefficients)
    unit = _unit(fit.state, kind)
    low, high = unit * (coefficients - 2.0 * spread), unit * (coefficients + 2.0 * spread)
    return CurveFit(kind, at, unit * coefficients, low, high, share, tried, fitted)


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


def _values(bench: Bench, state: State, kind: Kind, index: int, residuals: Sequence[Array]) -> Array | None:
    """The coordinate of a curve at all samples of a series, shape (n,)."""
    series = bench.series[index]
    predictor = bench.predictors[series.record]
    if kind.coordinate == "motor_angle":
        return np.asarray(predictor.motor_angle)
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


def corners(
    bench: Bench, state: State, kind: Kind, location: Location, left: Residual, residuals: Sequence[Array]
) -> Array | None:
    """Where the corners of a curve stand: close where the residual bends over the coordinate.

    A fine curve through the residual of the channel that shows it best is smoothed in the same way as the
    final one, and the corners share out the root of its curvature evenly (de Boor 2001, A Practical Guide to
    Splines, ch. XII).
    """
    if kind.period is not None:
        return np.arange(ROUND_CORNERS) * kind.period / ROUND_CORNERS
    numbers, blocks = bench.stacked_series(), bench.stacked_blocks()
    values = {}
    for k in np.unique(numbers):
        found = _values(bench, state, kind, int(k), residuals)
        if found is None:
            return None
        values[int(k)] = found[bench.series[k].train]
    x = np.concatenate([values[k] for k in sorted(values)])
    low, high = float(x.min()), float(x.max())
    if high <= low:
        return None
    fine = np.linspace(low, high, FINE)
    names = {_PLACES[kind.coordinate]} | ({"direction"} if kind.coordinate == "motor_velocity" else set())
    channels = [place.channel for place in location.places if place.coordinate in names]
    rows = np.isin(
        numbers, [k for k, s in enumerate(bench.series) if not channels or s.channel == channels[0]]
    )
    columns = hats(x[rows], fine)
    if kind.times_direction:
        sign = np.concatenate([_sign(bench, s)[s.train] for s in bench.series if s.record < bench.training])
        columns = columns * sign[rows][:, None]
    smooth = penalised(columns, left.values[rows], blocks[rows], roughness(FINE))
    bend = np.abs(np.diff(smooth.values, 2))
    density = np.sqrt(np.concatenate([bend[:1], bend, bend[-1:]]))
    density = density + 0.3 * density.mean() + 1e-300
    along = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.asarray(np.interp(np.linspace(0, along[-1], CORNERS), along, fine))


_PLACES: dict[Coordinate, str] = {
    "motor_angle": "wave_generator_angle",
    "motor_velocity": "velocity",
    "output_angle": "output_angle",
    "output_velocity": "velocity",
    "transmitted_torque": "torque",
    "twist": "torque",
    "time": "time",
}


def _sign(bench: Bench, series: Series) -> Array:
    """Smoothed sign of the motor's speed at all samples of a series, shape (n,)."""
    smoothing = TableCurve.model_fields["smoothing_velocity_rad_per_s"].default
    return np.asarray(np.tanh(bench.predictors[series.record].motor_velocity / smoothing))


def _unit(state: State, kind: Kind) -> float:
    """Value at coefficient 1: a hundredth of the rated torque, or 2 arcsec."""
    if kind.acts_on == "mesh_angle":
        return 1e-5
    rated = 0.01 * float(state.drive.rated_torque_nm)
    return rated / abs(state.drive.ratio) if kind.acts_on == "motor_torque" else rated


def effect(state: State, kind: Kind, at: Array) -> Added:
    """A curve as an effect with one coefficient for each corner, all 0."""
    blank = kind.curve(at, np.zeros(len(at))).model_dump(
        mode="json", exclude_none=True, exclude_defaults=True
    )
    field = "values_rad" if kind.acts_on == "mesh_angle" else "values_nm"
    unit = _unit(state, kind)
    terms = tuple(Amplitude({f"curves.0.{field}.{k}": unit}, signed=True) for k in range(len(at)))
    return Added("table", Fitting(terms, settings={"curves": [blank]}), (0.0,) * len(at))


def unit_traces(
    bench: Bench, fit: Fit, kind: Kind, at: Array, added: Added, residuals: Sequence[Array]
) -> Array | None:
    """Change of the whitened predictions for every coefficient at 1 alone, shape (rows, k).

    The motor's motion is prescribed, so a torque on the motor is found again in the torque that holds it
    there, with the opposite sign, and nowhere else: that needs no simulation.
    """
    unit = _unit(fit.state, kind)
    if kind.acts_on == "motor_torque":
        whole = np.zeros((len(bench.stacked_series()), len(at)))
        row = 0
        for k, series in enumerate(bench.series):
            if series.record >= bench.training:
                continue
            count = int(series.train.sum())
            if series.channel == "motor_torque" and count:
                x = _values(bench, fit.state, kind, k, residuals)
                if x is None:
                    return None
                basis = -unit * _basis(at, kind.period, x)
                if kind.times_direction:
                    basis *= _sign(bench, series)[:, None]
                time = bench.predictors[series.record].record.time
                change = fit.state.reading(series.channel, time, basis)[series.train]
                whole[row : row + count] = (change - change.mean(axis=0)) / series.sigma
            row += count
        return whole
    states = []
    for k in range(len(at)):
        one = tuple(1.0 if j == k else 0.0 for j in range(len(at)))
        states.append(replace(fit.state, added=(*fit.state.added, replace(added, coefficients=one))))
    found = bench.predict_all(states)
    columns = [bench.trace(fit.predictions, there) for there in found if there is not None]
    return np.column_stack(columns) if len(columns) == len(found) else None


def _basis(at: Array, period: float | None, x: Array) -> Array:
    """The unit curves of the table at values of the coordinate, shape (n, corners)."""
    count = len(at)
    columns = np.empty((len(x), count))
    for k in range(count):
        unit = tuple(1.0 if j == k else 0.0 for j in range(count))
        edges, packed = cells(tuple(at.tolist()), unit, period)
        numbers = np.array(packed).reshape(-1, 5)
        inside = x if period is None else edges[0] + np.mod(x - edges[0], period)
        inside = np.clip(inside, edges[0], edges[-1])
        cell = np.clip(np.searchsorted(edges, inside, side="right") - 1, 0, len(numbers) - 1)
        s = inside - np.array(edges)[cell]
        c0, c1, c2, c3 = numbers[cell, :4].T
        columns[:, k] = c0 + s * (c1 + s * (c2 + s * c3))
    return columns


def _solved(
    bench: Bench, fit: Fit, left: Residual, at: Array, added: Added, columns: Array, found: Penalised
) -> tuple[Fit, Array]:
    """The model with the curve, and the standard deviations of its coefficients.

    The traces stay those of the start (a chord method): a second step takes up what is not linear in them.
    The variances are the sum of two: that of the Bayesian view of the penalty, which covers the smoothing's
    bias (Nychka 1988, J. American Statistical Association 83:1134), and the cluster-robust one over blocks of
    time, which covers residuals that are correlated.
    """
    projected = left.project(columns)
    blocks = bench.stacked_blocks()
    right = projected.T @ left.values
    coefficients = np.zeros(columns.shape[1])
    level = projected.sum(axis=1)
    theta = np.zeros(len(fit.frees))
    chosen: tuple[float, State, list[Array], Array] | None = None
    rest = bench.stacked(bench.residuals(fit.predictions))
    numbers = bench.stacked_series()
    offsets = (numbers[:, None] == np.unique(numbers)[None, :]).astype(float)
    # Delays stay where they are: nothing bounds them here.
    own = fit.columns[:, : len(fit.frees)] * np.array([not free.step for free in fit.frees])
    for _ in range(2):
        step = found.inverse @ (right - found.penalty @ coefficients)
        coefficients = coefficients + step
        if float(level @ level) < UNSEEN * float(np.trace(projected.T @ projected)):
            # Nobody can say where zero is: it is where the curve is most of the way.
            even = np.interp(np.linspace(at[0], at[-1], FINE), at, coefficients)
            coefficients = coefficients - np.median(even)
        # The model's own numbers take their part again.
        moved, *_ = np.linalg.lstsq(np.hstack([own, offsets]), rest - columns @ step, rcond=1e-6)
        # What the data hardly tell is not carried away.
        theta = np.clip(theta + moved[: len(theta)], -2.0, 2.0)
        state = scaled(fit.state, fit.frees, theta.tolist())
        state = replace(
            state, added=(*state.added, replace(added, coefficients=tuple(coefficients.tolist())))
        )
        predictions = bench.predict(state)
        rest = bench.stacked(bench.residuals(predictions))
        loss = float(rest @ rest)
        if chosen is not None and loss >= chosen[0]:
            break
        chosen = (loss, state, predictions, theta)
        right = projected.T @ left.project(rest)
    assert chosen is not None
    loss, state, predictions, theta = chosen
    rest = bench.stacked(bench.residuals(predictions))
    used = np.unique(blocks)
    sums = np.array([(projected[blocks == b].T @ rest[blocks == b]) for b in used])
    meat = sums.T @ sums * len(used) / max(len(used) - columns.shape[1], 1)
    power = float(np.mean(rest**2))
    covariance = found.inverse @ meat @ found.inverse + power * found.inverse
    p = fit.covariance.shape[0]
    both = np.zeros((p + len(covariance), p + len(covariance)))
    both[:p, :p], both[p:, p:] = fit.covariance, covariance
    fitted = replace(
        fit,
        state=state,
        theta=fit.theta + theta,
        predictions=predictions,
        columns=np.hstack([fit.columns, columns]),
        covariance=both,
    )
    return fitted, np.minimum(np.sqrt(np.diag(covariance)), COEFFICIENT_PRIOR)
