"""Step 8, what has no name: the curve over a coordinate that explains it best, as a ``table`` effect.

The values follow from penalised least squares, whose roughness is the one that predicts left-out blocks of
time best, so that noise draws no curve. What the model's own numbers or the sensors' offsets explain is left
to them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.coordinates import hats
from hdsim.diagnosis.curve_fit import FINE, effect, solved, unit_of, unit_traces
from hdsim.diagnosis.curve_kinds import PLACES, Kind, kinds, sign_of, values_of
from hdsim.diagnosis.further import CurveFound
from hdsim.diagnosis.locate import Location
from hdsim.diagnosis.penalised import Penalised, penalised, roughness
from hdsim.diagnosis.screen import Residual
from hdsim.effects.table import COORDINATE_UNITS
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.found import Gap
from hdsim.estimate.prove import borne_out, gaps
from hdsim.estimate.records import Array
from hdsim.estimate.refit import align
from hdsim.estimate.state import Added, State

#: Part of a curve's promise that held-out data must show: nearer to all of it than to none.
HALF = 0.5
#: Corners of a curve, and of a curve over a period.
CORNERS, ROUND_CORNERS = 14, 12
#: Least cross-validated share of the weighed residual that a curve must explain to be offered.
LEAST_SHARE = 0.05
#: Share by which a later kind of curve must be better than an earlier, plainer one.
TIE = 0.01


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
    residuals = bench.residuals(fit.predictions, drift=True)
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
    both = solved(bench, fit, left, at, added, columns, found)
    if both is None:
        return None
    fitted, spread = both
    coefficients = np.array(fitted.state.added[-1].coefficients)
    unit = unit_of(fit.state, kind)
    low, high = unit * (coefficients - 2.0 * spread), unit * (coefficients + 2.0 * spread)
    return CurveFit(kind, at, unit * coefficients, low, high, share, tried, fitted)


def proved(bench: Bench, without: Fit, curve: CurveFit) -> dict[str, Gap] | None:
    """Held-out gaps of a model without (``refit``) and with a curve (``after``).

    Args:
        bench: the measured series.
        without: the model.
        curve: its curve.

    Returns:
        By channel; None where held-out data do not bear the curve out.
    """
    align(bench, curve.fit)
    found, there = gaps(bench, {"before": without.state, "refit": without.state, "after": curve.fit.state})
    slope, _ = borne_out(bench, there["refit"], there["after"])
    align(bench, without)
    return found if slope >= HALF else None


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
        found = values_of(bench, state, kind, int(k), residuals)
        if found is None:
            return None
        values[int(k)] = found[bench.series[k].train]
    x = np.concatenate([values[k] for k in sorted(values)])
    low, high = float(x.min()), float(x.max())
    if high <= low:
        return None
    fine = np.linspace(low, high, FINE)
    names = {PLACES[kind.coordinate]} | ({"direction"} if kind.coordinate == "motor_velocity" else set())
    channels = [place.channel for place in location.places if place.coordinate in names]
    rows = np.isin(
        numbers, [k for k, s in enumerate(bench.series) if not channels or s.channel == channels[0]]
    )
    columns = hats(x[rows], fine)
    if kind.times_direction:
        sign = np.concatenate([sign_of(bench, s)[s.train] for s in bench.series if s.record < bench.training])
        columns = columns * sign[rows][:, None]
    smooth = penalised(columns, left.values[rows], blocks[rows], roughness(FINE))
    bend = np.abs(np.diff(smooth.values, 2))
    density = np.sqrt(np.concatenate([bend[:1], bend, bend[-1:]]))
    density = density + 0.3 * density.mean() + 1e-300
    along = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.asarray(np.interp(np.linspace(0, along[-1], CORNERS), along, fine))
