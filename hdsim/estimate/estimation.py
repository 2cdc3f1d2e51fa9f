"""Parameter estimation of a scenario from measured records: what a fit says, and how far to trust it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.all_data import on_all_data, refuse_held_out_records
from hdsim.estimate.baseline import trees, with_baselines
from hdsim.estimate.beginning import beginnings
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.determine import UNDETERMINED
from hdsim.estimate.drift import drifted
from hdsim.estimate.fit import Fit, base_intervals
from hdsim.estimate.found import Gap, ShortCut
from hdsim.estimate.numbers import Free, Interval, base_freedoms, undeclared
from hdsim.estimate.offsets import Zeros
from hdsim.estimate.one_thread import one_blas_thread
from hdsim.estimate.opening import bench_for, checked
from hdsim.estimate.plan import LoadSource
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.prove import gaps
from hdsim.estimate.records import Array, Record
from hdsim.estimate.refit import Refit, refit
from hdsim.estimate.repeat import with_repeats
from hdsim.estimate.resolved import told_of_damping
from hdsim.estimate.short_cut import short_cut_of
from hdsim.estimate.solution import Direction, correlations, directions
from hdsim.estimate.state import State, state_of
from hdsim.estimate.suspect import delays, moving_zeros, one_way, suspicions
from hdsim.estimate.unsettled import unsettled
from hdsim.estimate.vector import Vector, sensitivities
from hdsim.estimate.write import scenario_changes

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

#: Prior spread of the logarithm of a number that is asked for and that no field declares: a factor of two.
ASKED_PRIOR = 0.7


@dataclass(frozen=True)
class Reading:
    """Offsets and zeros of one record.

    Attributes:
        record: its name.
        held: whether it is a validation record.
        offsets: measured less predicted, mean, of each channel, in SI units: the sensors' zeros.
        zero: of a locked drive the motor's angle at which it carries nothing, beside where the record's own
            torques put it, rad; None of one that turns.
    """

    record: str
    held: bool
    offsets: dict[str, float]
    zero: float | None


@dataclass
class Estimation:
    """Estimates of a scenario's parameters from measured records.

    Attributes:
        intervals: every free parameter, with its 95 % interval, or the parameters it is confounded with.
        names: of the estimated parameters, as in ``correlation``.
        correlation: shape (f, f).
        directions: combinations of all free parameters, identifiable or not, the best determined first.
        left: posterior over prior spread of each estimated parameter.
        gap: held-out RMS residual of each channel, before and after.
        readings: offsets of the sensors and zeros of a locked drive, by record.
        problems: of the data.
        bench: the measured series.
        start: the model as given.
        fit: the model as fitted.
        refit: how it was fitted.
        predictions: of all series, ``before`` and ``after``.
        short_cut: how predictions with teeth were made; None without.
        estimated_from: data that the estimates are of; ``gap`` is of those from training data.
    """

    intervals: list[Interval]
    names: list[str]
    correlation: Array
    directions: list[Direction]
    left: dict[str, float]
    gap: dict[str, Gap]
    readings: list[Reading]
    problems: list[Problem]
    bench: Bench
    start: State
    fit: Fit
    refit: Refit
    predictions: dict[str, list[Array]]
    short_cut: ShortCut | None = None
    estimated_from: Literal["training", "all"] = "training"

    @property
    def moved(self) -> list[str]:
        """Parameters whose interval excludes the model's value."""
        return [interval.name for interval in self.intervals if interval.moved]

    @property
    def changes(self) -> dict[str, float]:
        """The parameters that the fit changed, by their paths: for ``Scenario.with_``."""
        return scenario_changes(self.fit.state, self.refit.freedoms, self.start)

    def _repr_html_(self) -> str:
        from hdsim.notebook import fit_html

        return fit_html(self)


@one_blas_thread()
def estimate(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    *,
    holdout: Sequence[Recording | Record] = (),
    free: Collection[str] = (),
    fix: Collection[str] = (),
    apart: Collection[str] = (),
    load: LoadSource | None = None,
    zeros: Zeros = "campaign",
    force: bool = False,
    black_box: bool = False,
    all_data: bool = False,
    on_step: Callable[[str], object] | None = None,
) -> Estimation:
    """Estimate a scenario's parameters from measured records; ``hdsim.fit`` takes files too.

    All records share the parameters and the torque sensors' zeros (``zeros``); an angle's zero, and that of a
    locked drive, belong to each record.

    Args:
        measured: records that the fit uses.
        scenario: the model; what it commands does not matter, its motion is the measured one.
        holdout: validation records, used in no fit; parts of ``measured`` when there are none.
        free: paths of the only free parameters; all that the model declares when empty. Parameters of a group
            that are given together scale together.
        fix: paths of parameters that stay fixed.
        apart: paths of parameters of a group that are estimated by themselves.
        load: source of the load torque; ``load_torque`` when that is measured, else the scenario.
        zeros: whether a torque sensor has one zero in all records, one in each, or is trusted to have none.
        force: continue in spite of errors in the data.
        black_box: also fit gradient-boosted trees as a baseline.
        all_data: estimate the parameters again from the held-out stretches too, once these have judged the
            model (``hdsim.estimate.all_data``).
        on_step: called with the name of each step.

    Raises:
        InputError: the data cannot answer the question, or are suspect (see ``force``), or a path is none, or
            a black box is asked for without scikit-learn.
    """
    tell = on_step or (lambda _: None)
    refuse_held_out_records(all_data, holdout)
    if black_box:
        trees()
    tell("checking the data")
    records, held, checks = checked(measured, scenario, holdout=holdout, load=load, force=force)
    tell("predicting the measured channels")
    bench, start = bench_for(records, held, scenario, load, zeros=zeros), state_of(scenario)
    locked = all(predictor.plan.locked for predictor in bench.predictors)
    known = base_freedoms(start, bench.channels, load_known=bench.load_known, locked=locked, apart=apart)
    frees = chosen(start, known, free=free, fix=fix, apart=apart)
    begins = [float(predictor.motor_angle[0]) for predictor in bench.predictors]
    tell("estimating the parameters")
    try:
        found = refit(bench, start, frees)
    except PredictionError as error:
        said = ", ".join(record.name for record in records)
        raise InputError(f"{said}: the model cannot follow the measured motion: {error}") from None
    found.fit = drifted(bench, found.fit)
    found.intervals = base_intervals(found.fit, found.freedoms)
    tell("validating on held-out data")
    states = {"before": start, "refit": found.fit.state, "after": found.fit.state}
    gap, predictions = gaps(bench, states)
    gap = with_baselines(bench, start, gap, black_box=black_box)
    gap = with_repeats(bench, found.fit.state, gap, predictions["after"])
    problems = [problem for check in checks for problem in check.problems]
    problems += [*suspicions(bench, found, start), *delays(bench, found.intervals)]
    problems += [*beginnings(bench), *one_way(bench), *moving_zeros(bench, found.fit.predictions)]
    judged = found.fit
    if all_data:
        tell("estimating the parameters from all data")
    with on_all_data(bench, judged) if all_data else contextlib.nullcontext(judged) as final:
        if final is not judged:
            found.fit, found.intervals = final, base_intervals(final, found.freedoms)
        seen = _directions(bench, final)
    found.intervals, blurred = told_of_damping(bench, found.fit.state, found.intervals)
    problems += [*unsettled(bench, found.fit), *blurred]
    own = found.fit.frees
    covariance, names = found.fit.covariance[: len(own), : len(own)], [each.name for each in own]
    matrix = correlations(covariance)
    spreads = np.sqrt(np.diag(covariance))
    left = {each.name: min(float(s) / each.prior, 1.0) for each, s in zip(own, spreads, strict=True)}
    groups = tied_groups(names, matrix)
    for one in found.intervals:
        # Where the end tells less of a number than the start promised, its prior is what bounds it.
        if left.get(one.name, 0.0) > UNDETERMINED:
            one.tied_to = [
                name for group in groups if one.name in group for name in group if name != one.name
            ]
    return Estimation(
        found.intervals,
        names,
        matrix,
        seen,
        left,
        gap,
        _readings(bench, predictions["after"], begins),
        problems,
        bench,
        start,
        found.fit,
        found,
        predictions,
        short_cut_of(bench, judged.predictions, predictions["after"]),
        "training" if found.fit is judged else "all",
    )


def chosen(
    state: State,
    known: Sequence[Free],
    *,
    free: Collection[str] = (),
    fix: Collection[str] = (),
    apart: Collection[str] = (),
) -> list[Free]:
    """The numbers that are to move.

    Args:
        state: the model.
        known: those that it declares.
        free: paths of the only ones that move; all when empty.
        fix: paths of those that do not.
        apart: paths that have to be among the known ones.

    Raises:
        InputError: a path is no number that could move; or none is left.
    """
    paths = {path for each in known for path in (each.paths or (each.name,))}
    there = f"there are {', '.join(sorted(paths))}"
    extra: list[Free] = []
    for path in [*free, *fix, *apart]:
        if path in paths:
            continue
        more = undeclared(state, path, ASKED_PRIOR) if path in free else None
        if more is None:
            raise InputError(
                f"{path}: no parameter of this model above zero that these data could identify; {there}"
            )
        extra.append(more)
    both = sorted(set(free) & set(fix))
    if both:
        raise InputError(f"{both[0]}: both free and fixed")
    found = [_without(state, each, free, fix) for each in [*known, *extra]]
    left = [each for each in found if each is not None]
    if not left:
        raise InputError(f"no free parameter: {there}")
    return left


def _without(state: State, free: Free, only: Collection[str], fix: Collection[str]) -> Free | None:
    """A number without those of its group that do not move."""
    if free.reading:
        return free if free.name not in fix and (not only or free.name in only) else None
    paths = tuple(path for path in free.paths if path not in fix and (not only or path in only))
    if not paths:
        return None
    if paths == free.paths:
        return free
    first = undeclared(state, paths[0], free.prior)
    assert first is not None, "it was found with the group"
    return replace(free, name=first.name, paths=paths, value=first.value, least=first.least, most=first.most)


def _directions(bench: Bench, found: Fit) -> list[Direction]:
    """What the data see of the free numbers at the end of the fit."""
    columns, frees = found.columns[:, : len(found.frees)], [*found.frees, *found.undetermined]
    if found.undetermined:
        beside = found.beside[0][:, : len(found.undetermined)] if found.beside is not None else None
        if beside is None:
            unknown = Vector(found.state, tuple(found.undetermined), 0)
            beside = sensitivities(bench, unknown, unknown.start(), found.predictions)
        columns = np.hstack([columns, beside])
    rest = bench.stacked(bench.residuals(found.predictions))
    power = bench.sample_power(rest)
    priors = np.array([free.prior for free in frees])
    return directions(columns, priors, power, [free.name for free in frees])


def _readings(bench: Bench, predictions: Sequence[Array], begins: Sequence[float]) -> list[Reading]:
    """Sensors' offsets and locked zeros of every record.

    Args:
        bench: the measured series.
        predictions: of all of them.
        begins: the prescribed motor angle at each record's first sample before the fit, rad.
    """
    found = []
    zeros = bench.offsets(predictions)
    for k, (predictor, begin) in enumerate(zip(bench.predictors, begins, strict=True)):
        offsets = {s.channel: at for s, at in zip(bench.series, zeros, strict=True) if s.record == k}
        zero = float(predictor.motor_angle[0]) - begin if predictor.plan.locked else None
        found.append(Reading(predictor.record.name, k >= bench.training, offsets, zero))
    return found


def tied_groups(names: Sequence[str], matrix: Array, least: float = 0.9) -> list[list[str]]:
    """Numbers of which only combinations are known well, in groups whose correlations chain them together.

    Args:
        names: of the numbers.
        matrix: their correlations, shape (f, f).
        least: least absolute correlation: at 0.9 one alone would be known more than twice as well.
    """
    groups: list[list[int]] = []
    for k in range(len(names)):
        near = [group for group in groups if any(abs(matrix[j, k]) >= least for j in group)]
        groups = [group for group in groups if group not in near]
        groups.append(sorted({k, *(j for group in near for j in group)}))
    return [[names[k] for k in group] for group in groups if len(group) > 1]
