"""What of the held-out data can be learnt at all: a plain regression, and a black box, beside a model's gap.

Both see what the model sees (the prescribed motion, the known load), and learn from the samples that the
fits learn from; zeros are those of ``Bench.residuals``. What either leaves is no bound: it says how much of
what can be learnt the model explains.

The regression is least squares over the terms in which a joint's torque and wind-up are linear: gravity as
sine and cosine of the output's angle, Coulomb and viscous friction, acceleration, the known load (Swevers,
Verdonck and De Schutter 2007, IEEE Control Systems Magazine 27(5):58), and the orders per wave-generator turn
that it leaves (``order_lines``). A locked drive has its twist and the cube of it (Tuttle and Seering 1996,
IEEE Transactions on Robotics and Automation 12:368) in place of gravity.

The black box is gradient boosting of regression trees on histograms (Friedman 2001, Annals of Statistics
29:1189; scikit-learn's ``HistGradientBoostingRegressor``), which begins with what the regression leaves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.drive.parameters import RESOLVED_RAD_PER_S
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.found import Gap
from hdsim.estimate.offsets import groups
from hdsim.estimate.orders import order_lines
from hdsim.estimate.predict import Predictor
from hdsim.estimate.prescribed import LEAD_IN_S
from hdsim.estimate.prove import held_out_gap
from hdsim.estimate.records import Array
from hdsim.estimate.series import Series

if TYPE_CHECKING:
    from hdsim.estimate.state import State

#: Size of a direction of the columns, each of length 1, below which the data do not tell it.
SINGULAR = 1e-4
#: Parts of a record that are left out in turn, and in how many folds.
PARTS, FOLDS = 12, 3
#: Of what else the black box sees: how long ago, s.
LAGS_S = (0.01, 0.05, 0.2)
#: Rate and most rounds of boosting, leaves of a tree, fewest samples in a leaf, most samples learnt from.
RATE, ROUNDS, LEAVES, FEWEST, MOST = 0.05, 300, 15, 20, 30_000


def with_baselines(
    bench: Bench, state: State, gap: Mapping[str, Gap], *, black_box: bool = False
) -> dict[str, Gap]:
    """The gaps with what a regression, and a black box, leave of the same held-out samples.

    Args:
        bench: the measured series.
        state: the model; its load is known to a regression too.
        gap: by channel.
        black_box: ask one; it takes seconds for each channel.

    Raises:
        InputError: a black box is asked for and scikit-learn is not there.
    """
    predictions = {"regression": regression(bench, state)}
    if black_box:
        predictions["black_box"] = boosted(bench, state, predictions["regression"])
    left = {name: bench.residuals(found, drift=True) for name, found in predictions.items()}
    result = {}
    for channel, own in gap.items():
        rng = np.random.default_rng(19)
        held = {name: held_out_gap(bench, channel, rest, rng) for name, rest in left.items()}
        intervals = own.intervals | {name: interval for name, (_, interval) in held.items()}
        numbers = {name: value for name, (value, _) in held.items()}
        result[channel] = own.model_copy(update={"intervals": intervals, **numbers})
    return result


def regression(bench: Bench, state: State) -> list[Array]:
    """What least squares over training samples predict of every series, shape (n,) each.

    Args:
        bench: the measured series.
        state: the model, for its load.
    """
    smooth = [_columns(bench.predictors[s.record], s, state) for s in bench.series]
    found = _fitted(bench, smooth)
    rest = bench.residuals(found)
    orders = {c: [line.order for line in order_lines(bench, rest, c)] for c in bench.channels}
    tried = []
    for most in range(1 + max(map(len, orders.values()))):
        waves = [
            np.outer(bench.predictors[s.record].motor_angle, orders[s.channel][:most]) for s in bench.series
        ]
        columns = [np.hstack([c, np.sin(w), np.cos(w)]) for c, w in zip(smooth, waves, strict=True)]
        tried.append((columns, _left_out_power(bench, columns)))
    # Lines that do not foretell left-out parts are of a resonance, or of chance.
    best = {c: min(tried, key=lambda one: one[1][c])[0] for c in bench.channels}
    return _fitted(bench, [best[s.channel][k] for k, s in enumerate(bench.series)])


def boosted(bench: Bench, state: State, begun: Sequence[Array]) -> list[Array]:
    """What a black box predicts of every series after the regression, shape (n,) each.

    Args:
        bench: the measured series.
        state: the model, for its load.
        begun: what the regression predicts.

    Raises:
        InputError: scikit-learn is not there.
    """
    maker, rest = trees(), bench.residuals(begun, drift=True)
    heat = all("temperature" in predictor.record.readable for predictor in bench.predictors)
    found = list(begun)
    for channel in bench.channels:
        own = [k for k, s in enumerate(bench.series) if s.channel == channel]
        seen = [k for k in own if bench.series[k].train.any()]
        if not seen:
            continue
        features = {
            k: _features(bench.predictors[bench.series[k].record], bench.series[k], state, heat) for k in own
        }
        rows = [bench.series[k].train for k in seen]
        part = [_folds(len(r)) for r in rows]
        x = np.concatenate([features[k][r] for k, r in zip(seen, rows, strict=True)])
        y = np.concatenate([rest[k][r] for k, r in zip(seen, rows, strict=True)])
        fold = np.concatenate([p[r] for p, r in zip(part, rows, strict=True)])
        if len(y) > MOST:
            chosen = np.sort(np.random.default_rng(0).choice(len(y), MOST, replace=False))
            x, y, fold = x[chosen], y[chosen], fold[chosen]
        rounds = _rounds(maker, x, y, fold)
        if rounds:
            learnt = _box(maker, rounds).fit(x, y)
            for k in own:
                found[k] = found[k] + learnt.predict(features[k])
    return found


def trees() -> Any:
    """scikit-learn's class of boosted trees.

    Raises:
        InputError: it is not there.
    """
    try:
        from sklearn.ensemble import HistGradientBoostingRegressor
    except ImportError:
        raise InputError("a black box needs scikit-learn: pip install 'hdsim[baseline]'") from None
    return HistGradientBoostingRegressor


def _columns(predictor: Predictor, series: Series, state: State) -> Array:
    """Terms of a series' regression without its orders, shape (n, p); zeros for a sensor that is the load."""
    terms = np.column_stack([beside_inertia(predictor, state), predictor.motor_acceleration])
    return np.zeros_like(terms) if _is_load(predictor, series) else terms


def beside_inertia(predictor: Predictor, state: State) -> Array:
    """Terms of a record's regression but its acceleration: gravity, friction, known load; shape (n, p)."""
    angle, speed = predictor.motor_angle / predictor.ratio, predictor.motor_velocity
    place = [angle, angle**3] if predictor.plan.locked else [np.sin(angle), np.cos(angle)]
    if predictor.plan.load == "output_torque":
        place = [np.zeros_like(angle)] * 2  # the sensor reads gravity too
    return np.column_stack([*place, np.tanh(speed / RESOLVED_RAD_PER_S), speed, *_load(predictor, state)])


def _features(predictor: Predictor, series: Series, state: State, heat: bool) -> Array:
    """What the black box sees of a series, its temperature too where there is ``heat``, shape (n, p)."""
    time, angle, speed = predictor.record.time, predictor.motor_angle, predictor.motor_velocity
    known = _load(predictor, state)
    if _is_load(predictor, series):
        known = [np.zeros_like(time)] * len(known)
    if heat:
        known.append(predictor.record.filled("temperature"))
    follow = [speed, predictor.motor_acceleration, *known]
    late = [np.interp(time - lag, time, values) for lag in LAGS_S for values in follow]
    return np.column_stack([angle / predictor.ratio, np.mod(angle, 2 * np.pi), *follow, *late])


def _is_load(predictor: Predictor, series: Series) -> bool:
    """Whether a series is the very reading that is the load: it is not told of itself."""
    return series.channel == predictor.plan.load


def _load(predictor: Predictor, state: State) -> list[Array]:
    """Torques of an arm and of a load on the output, known or none, shape (n,) each.

    Records of one campaign have the same terms, whatever is known of the load of each.
    """
    time = predictor.record.time
    arm, known = np.zeros_like(time), np.zeros_like(time)
    if predictor.course is not None:
        motion = np.array([predictor.motor_angle, predictor.motor_velocity, predictor.motor_acceleration])
        arm = predictor.course.torque(state.load.arm, time, motion / predictor.ratio)
    if predictor.load_torque is not None:
        known = predictor.load_torque.values(time + LEAD_IN_S)[0]
    elif state.load.torque is not None:
        known = state.load.torque.values(time + predictor.record.begins_s)[0]
    return [arm, known]


def _given(bench: Bench, series: Series) -> Array:
    """What is known of a series before anything is learnt, shape (n,)."""
    predictor = bench.predictors[series.record]
    if _is_load(predictor, series):
        return np.asarray(predictor.slow_torque)
    if series.channel == "output_angle":
        return np.asarray(predictor.motor_angle / predictor.ratio)
    return np.zeros(len(series.measured))


def _fitted(bench: Bench, columns: Sequence[Array], fold: int | None = None) -> list[Array]:
    """Predictions of all series by least squares over the training samples, zeros included.

    Args:
        bench: the measured series.
        columns: terms of each, shape (n, p).
        fold: the one that is left out, if any.
    """
    found = [_given(bench, s) for s in bench.series]
    for channel in bench.channels:
        own = [k for k, s in enumerate(bench.series) if s.channel == channel]
        zeros = [group for group in groups(bench.series, bench.zeros) if group[0] in own]
        designs, rows = {}, {}
        for k in own:
            n = len(columns[k])
            shift = np.tile([float(k in group) for group in zeros], (n, 1))
            designs[k] = np.hstack([columns[k], shift])
            rows[k] = bench.series[k].train & (_folds(n) != fold)
        terms = np.concatenate([designs[k][rows[k]] for k in own])
        target = np.concatenate([(bench.series[k].measured - found[k])[rows[k]] for k in own])
        scale = np.sqrt(np.sum(terms**2, axis=0))
        scale[scale == 0.0] = 1.0
        weights, *_ = np.linalg.lstsq(terms / scale, target, rcond=SINGULAR)
        for k in own:
            found[k] = found[k] + designs[k] @ (weights / scale)
    return found


def _left_out_power(bench: Bench, columns: Sequence[Array]) -> dict[str, float]:
    """Power that least squares leave of parts of the training samples that they have not seen, by channel."""
    power = dict.fromkeys(bench.channels, 0.0)
    for fold in range(FOLDS):
        for s, predicted in zip(bench.series, _fitted(bench, columns, fold), strict=True):
            out = s.train & (_folds(len(predicted)) == fold)
            power[s.channel] += float(np.sum((s.measured - predicted)[out] ** 2))
    return power


def _folds(count: int) -> NDArray[np.int64]:
    """The fold of each sample of a record, shape (n,): parts of its time in turn."""
    return np.asarray(np.arange(count) * PARTS // count % FOLDS)


def _box(maker: Any, rounds: int) -> Any:
    return maker(
        learning_rate=RATE, max_iter=rounds, max_leaf_nodes=LEAVES, min_samples_leaf=FEWEST,
        early_stopping=False, random_state=0,
    )  # fmt: skip


def _rounds(maker: Any, x: Array, y: Array, fold: Array) -> int:
    """Rounds of boosting that predict left-out parts of the records best; 0 where none helps."""
    power = np.zeros(ROUNDS + 1)
    for left_out in range(FOLDS):
        out = fold == left_out
        if out.all() or not out.any():
            continue
        learnt = _box(maker, ROUNDS).fit(x[~out], y[~out])
        power[0] += float(np.sum(y[out] ** 2))
        power[1:] += [float(np.sum((y[out] - p) ** 2)) for p in learnt.staged_predict(x[out])]
    return int(np.argmin(power))
