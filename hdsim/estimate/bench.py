"""The measured series that models are held against: masks, blocks for cross-validation, held-out parts."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.estimate.covariance import sample_power
from hdsim.estimate.covered import covered
from hdsim.estimate.offsets import Zeros, offset_columns, offsets_of
from hdsim.estimate.predict import COARSE_RTOL, PredictionError, Predictor
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.series import Series
from hdsim.estimate.still import fresh
from hdsim.estimate.swings import Swings, swing_columns, without_swings

if TYPE_CHECKING:
    from hdsim.estimate.state import State

#: Aimed length of a block, s, and the least and most blocks of a record.
BLOCK_S = 0.25
FEWEST_BLOCKS, MOST_BLOCKS = 18, 90
#: Without a record to hold out, every third of this many stretches of each record is held out.
STRETCHES = 9
#: Part of the largest speed beyond which a motor turns, and of its fair share of the training samples below
#: which fits see too little of a direction (chosen).
TURNS, SEEN = 0.1, 0.25
#: Time at the start of a record that is not compared: the model's own oscillation may not have died away, s.
SETTLE_S = 0.05
#: Share of the residual that counts as noise, so that a channel with little noise does not alone decide.
MODEL_NOISE = 0.1


class Bench:
    """Measured records with their predictors.

    Args:
        training: predictors of the records that fits see.
        holdout: predictors of records that they don't; empty: parts of the training records are held out.
        zeros: whether a torque sensor has one zero in all records, one in each, or is trusted to have none.
    """

    def __init__(
        self, training: Sequence[Predictor], holdout: Sequence[Predictor] = (), zeros: Zeros = "campaign"
    ) -> None:
        self.predictors = [*training, *holdout]
        self.training, self.zeros, self.blocks = len(training), zeros, 0
        self.series: list[Series] = []
        #: Predictions with the model's own flanks, then with others (``flanks.hear_flanks``).
        self.redrawn: list[list[Array]] = []
        #: Time at the beginning of records that does not count, s (``hdsim.estimate.beginning``).
        self.begins_s: dict[int, float] = {}
        #: What swings of the training records' loads do (``hdsim.estimate.free_swing``).
        self.swings: Swings = {}
        #: Error of the short cut that was not taken (``hdsim.estimate.short_cut``), by channel.
        self.refused: dict[str, float] = {}
        for index, predictor in enumerate(self.predictors):
            self._add(index, predictor, own_record=index >= self.training, split=not holdout)
        if not any(series.train.any() for series in self.series):
            raise InputError("no trusted sample is left to fit")

    def _add(self, index: int, predictor: Predictor, *, own_record: bool, split: bool) -> None:
        record, predictor.number = predictor.record, index
        n = len(record.time)
        count = int(np.clip(record.duration_s / BLOCK_S, FEWEST_BLOCKS, MOST_BLOCKS))
        block = np.minimum((np.arange(n) * count) // n, count - 1)
        stretch = (np.arange(n) * STRETCHES) // n
        held = _held(predictor, stretch) if split else np.full(n, own_record)
        usable = (record.time > SETTLE_S) & record.trusted[predictor.plan.motion]
        for channel in predictor.plan.channels:
            measured, trusted, noise, reading = predictor.measured(channel)
            good, own = usable & trusted & fresh(predictor, channel), self.blocks + block
            self.series.append(
                Series(index, channel, measured, good & ~held, good & held, own, noise, reading)
            )
        self.blocks += count

    @property
    def channels(self) -> tuple[str, ...]:
        """The predicted channels, each once."""
        return tuple(dict.fromkeys(series.channel for series in self.series))

    @property
    def measured(self) -> set[str]:
        """Channels that every record has measured and that vary, compared or not."""
        return set.intersection(
            *(
                {c for c, good in r.trusted.items() if good.sum() > 20 and np.ptp(r.channels[c][good]) > 0}
                for r in (p.record for p in self.predictors)
            )
        )

    @property
    def load_known(self) -> bool:
        """Whether the load is the measured torque at the output."""
        return all(predictor.plan.load == "output_torque" for predictor in self.predictors)

    def of_the_load(self, series: Series) -> bool:
        """Whether a series is a sensor that is the load: only what goes round with a shaft is its error."""
        return self.load_known and series.channel == "output_torque"

    @property
    def noise_powers(self) -> dict[str, float]:
        """What the sensors' noise alone leaves of each channel's whitened training residual, as power."""
        found = dict.fromkeys(self.channels, 0.0)
        for s in self.series:
            if s.record < self.training:
                found[s.channel] += float(s.train.sum()) * (s.noise / s.sigma) ** 2
        return found

    @property
    def noise_power(self) -> float:
        """The same of all channels together."""
        return sum(self.noise_powers.values())

    @property
    def turns(self) -> float:
        """Longest travel of the wave generator in a training record, turns."""
        return max(float(np.ptp(p.motor_angle)) for p in self.predictors[: self.training]) / (2 * np.pi)

    def trace(self, base: Sequence[Array], there: Sequence[Array]) -> Array:
        """Whitened difference of two sets of predictions, offsets removed, shape (rows,)."""
        return self.stacked(self._without([b - a for a, b in zip(base, there, strict=True)], drift=False))

    def ranges(self, state: State) -> dict[str, float]:
        """What the training records cover, by the names that fittings use (``covered``)."""
        return covered(self.predictors[: self.training], state)

    def predict(self, state: State, *, everything: bool = False) -> list[Array]:
        """What the log would show of all series; of records that are held out only when ``everything``.

        Args:
            state: the model.
            everything: predict the held-out records too.

        Raises:
            PredictionError: the model could not be predicted.
        """
        reach = len(self.predictors) if everything else self.training
        candidate = state.candidate()
        return self._series(state, [p.predict(candidate) for p in self.predictors[:reach]])

    def _series(self, state: State, found: Sequence[Mapping[str, Array]]) -> list[Array]:
        """What the log would show of all series, of the channels of the first records."""
        return [
            state.reading(s.channel, self.time_of(s), found[s.record][s.channel])
            if s.record < len(found)
            else np.zeros(0)
            for s in self.series
        ]

    def reread(self, predictions: Sequence[Array], before: State, now: State) -> list[Array]:
        """Predictions of a state that differs from ``before`` in the readings' gains and delays only."""
        return [
            now.reading(s.channel, self.time_of(s), values, before) if len(values) else values
            for s, values in zip(self.series, predictions, strict=True)
        ]

    def time_of(self, series: Series) -> Array:
        """Times of a series' samples, shape (n,), s."""
        return self.predictors[series.record].record.time

    @contextlib.contextmanager
    def coarse(self) -> Iterator[None]:
        """Predict with the tolerance of a search."""
        with contextlib.ExitStack() as stack:
            for predictor in self.predictors:
                stack.enter_context(predictor.within(max(predictor.rtol, COARSE_RTOL)))
            yield

    def predict_all(self, states: Sequence[State]) -> list[list[Array] | None]:
        """Predictions of the training records for many models, side by side in threads.

        Args:
            states: the models.

        Returns:
            One list of series for each, None where the model could not be predicted.
        """
        from hdsim.simulation.ensemble import in_order

        def one(state: State) -> list[Array] | None:
            try:
                return self.predict(state)
            except PredictionError:
                return None

        return in_order(one, states)

    def beside(self, state: State, others: Sequence[State]) -> list[tuple[list[Array], list[Array]] | None]:
        """Predictions of the training records for a model and for each of others next to it.

        Args:
            state: the model.
            others: models that differ so little that they may be linearised beside it.

        Returns:
            What ``predict`` returns of both; None where the other one is made of other parts.
        """
        from hdsim.simulation.ensemble import in_order

        candidate, near = state.candidate(), [other.candidate() for other in others]
        try:
            found = in_order(lambda p: p.beside(candidate, near), self.predictors[: self.training])
        except PredictionError:
            return [None] * len(others)
        return [
            None
            if any(pair is None for pair in pairs)
            else (
                self._series(state, [pair[0] for pair in pairs]),
                self._series(other, [pair[1] for pair in pairs]),
            )
            for other, pairs in zip(others, zip(*found, strict=True), strict=True)
        ]

    def sample_power(self, rest: Array) -> float:
        """What one independent sample of a stacked residual, shape (rows,), counts."""
        return sample_power(rest, self.stacked_blocks())

    def offsets(self, predictions: Sequence[Array], *, drift: bool = False) -> list[float]:
        """The sensors' zeros, SI units: what is measured less what is predicted, by ``offsets_of``."""
        return offsets_of(self.series, self.apart(predictions), self.zeros, drift=drift)

    def residuals(self, predictions: Sequence[Array], *, drift: bool = False) -> list[Array]:
        """Measured less predicted, less the sensor's zero; empty where nothing is predicted.

        Args:
            predictions: shape (n,) each.
            drift: whether zeros may drift between records: where what is missing is judged, not where numbers
                are fitted, which would be bent by as much as is forgiven.
        """
        return self._without(self.apart(predictions), drift=drift)

    def _without(self, values: Sequence[Array], *, drift: bool) -> list[Array]:
        """Residuals or changes without what zeros of sensors and swings of loads may do."""
        return without_swings(self.series, self.centred(values, drift=drift), self.swings)

    def centred(self, values: Sequence[Array], *, drift: bool = False) -> list[Array]:
        """Residuals or changes without what zeros of sensors may do."""
        offsets = offsets_of(self.series, values, self.zeros, drift=drift)
        return [value - offset for value, offset in zip(values, offsets, strict=True)]

    def apart(self, predictions: Sequence[Array]) -> list[Array]:
        """Measured less predicted; empty where nothing is predicted."""
        return [
            s.measured - predicted if len(predicted) else np.zeros(0)
            for s, predicted in zip(self.series, predictions, strict=True)
        ]

    def offset_columns(self) -> Array:
        """What sensors' zeros, and swings of loads, do to the rows of ``stacked``, shape (rows, k)."""
        zeros = offset_columns(self.series, self.training, self.zeros)
        return np.hstack([zeros, swing_columns(self.series, self.training, self.swings)])

    def block_powers(self, predictions: Sequence[Array]) -> Array:
        """Power of the whitened training residual in each block, shape (blocks,)."""
        rest = self.stacked(self.residuals(predictions))
        return np.asarray(np.bincount(self.stacked_blocks(), rest**2, self.blocks), dtype=float)

    def power(self, predictions: Sequence[Array]) -> float:
        """Power of the whitened training residual."""
        return float(self.block_powers(predictions).sum())

    def channel_powers(self, predictions: Sequence[Array]) -> dict[str, float]:
        """Power of the whitened training residual in each channel."""
        return self.powers(self.residuals(predictions))

    def powers(self, residuals: Sequence[Array]) -> dict[str, float]:
        """Power of residuals, or of changes, of all series in each channel's training samples, whitened."""
        found = dict.fromkeys(self.channels, 0.0)
        for series, residual in zip(self.series, residuals, strict=True):
            if series.record < self.training:
                found[series.channel] += float(np.sum((residual[series.train] / series.sigma) ** 2))
        return found

    def beyond_noise(self, predictions: Sequence[Array]) -> dict[str, float]:
        """Mean square of each channel's training residual beyond its noise, SI units, 0 or more."""
        found = {}
        for channel in self.channels:
            own = [
                (s, rest[s.train])
                for s, rest in zip(self.series, self.residuals(predictions), strict=True)
                if s.channel == channel and len(rest)
            ]
            count = sum(len(rest) for _, rest in own)
            power = sum(float(rest @ rest) - len(rest) * s.noise**2 for s, rest in own)
            found[channel] = max(power, 0.0) / max(count, 1)
        return found

    def weigh(self, residuals: Sequence[Array]) -> None:
        """Set every series' ``sigma`` from its noise and from what is left of its channel in training data.

        A record that is held out has no residual that may be looked at: it takes its channel's of the others.
        """
        powers: dict[str, list[float]] = {}
        rests: list[float | None] = []
        for series, residual in zip(self.series, residuals, strict=True):
            seen = len(residual) > 0 and bool(series.train.any())
            power = float(np.mean(residual[series.train] ** 2)) if seen else None
            rests.append(power)
            if power is not None:
                powers.setdefault(series.channel, []).append(power)
        for series, power in zip(self.series, rests, strict=True):
            if power is None:
                power = float(np.mean(powers.get(series.channel, [0.0])))
            series.sigma = max(float(np.hypot(series.noise, MODEL_NOISE * np.sqrt(power))), 1e-15)

    def stacked(self, columns: Sequence[Array]) -> Array:
        """Training samples of all series under one another, divided by their sigma."""
        return np.concatenate(
            [
                column[series.train] / series.sigma
                for series, column in zip(self.series, columns, strict=True)
                if len(column)
            ]
        )

    def stacked_blocks(self) -> NDArray[np.int64]:
        """Block of every row of ``stacked``."""
        return np.concatenate([s.block[s.train] for s in self.series if s.record < self.training])

    def stacked_series(self) -> NDArray[np.int64]:
        """Number of the series of every row of ``stacked``."""
        return np.concatenate(
            [np.full(int(s.train.sum()), k) for k, s in enumerate(self.series) if s.record < self.training]
        )


def _held(predictor: Predictor, stretch: NDArray[np.int64]) -> Mask:
    """Every third stretch of a record, shape (n,), so that fits see each direction in which its motor turns.

    What only held-out stretches show no fit can learn: friction, of a motor that turns one way, is an offset.

    Args:
        predictor: of the record.
        stretch: number of each sample's, shape (n,).
    """
    speed = predictor.motor_velocity
    ways = [speed > TURNS * np.abs(speed).max(), speed < -TURNS * np.abs(speed).max()]
    ways = [way for way in ways if way.any()]
    held: list[Mask] = [stretch % 3 == k for k in (2, 1, 0)]
    # As much as there is by a fair share, or nearly.
    seen = [min((float(way[~rows].mean() / way.mean()) for way in ways), default=1.0) for rows in held]
    return held[0 if seen[0] >= SEEN else int(np.argmax(seen))]
