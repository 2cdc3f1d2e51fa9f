"""A named effect in a finer formula of the same law, where the data tell its further numbers.

A contest asks for plain formulas: of an effect that is not identified yet more numbers say little, and would
fit what is another's. Once it has its name, what its formula leaves may be what a finer one explains, as the
play of many teeth, whose gaps differ, beside that of one. It is taken where it is better, priors included, by
more than the freedom of its further numbers is worth to the Bayesian information criterion (Schwarz 1978),
and by as much of what was missing at first as a further effect would have to explain, or a tenth of what is
left. A plain formula may have bent the base to stand in for what it lacks, so a finer one is fitted from the
base's numbers as given, too.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from hdsim.diagnosis.again import BEYOND_GAIN, NEWS
from hdsim.diagnosis.point import as_given
from hdsim.diagnosis.revise import EXCESS
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import worth_of_a_number
from hdsim.estimate.fit import Fit, at_present, fit, sharpened
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import REACHED, unlikelihood
from hdsim.estimate.state import Added

#: Evaluations of a fit, and most times that it is carried on.
EVALUATIONS, TIMES = 14, 2
#: Part of the fits from several starts that is carried on each time, those that leave least.
CARRIED_ON = 0.5


def refined(
    bench: Bench, base: Fit, current: Fit, tell: Callable[[str], object], rivals: Sequence[Fit] = ()
) -> Fit:
    """The model with its newest effect, or a look-alike, in a finer formula, if that explains what is left.

    Args:
        bench: the measured series.
        base: the re-fitted model without effects.
        current: the model.
        tell: told what is being done.
        rivals: the model with look-alikes of the newest effect in its place, whose formulas are asked where
            its own do not explain all.
    """
    noise = bench.noise_power
    if bench.power(current.predictions) <= REACHED * noise:
        return current
    inside: list[Fit] = []
    for asked in (current, *rivals):
        if min(bench.power(found.predictions) for found in (current, *inside)) <= REACHED * noise:
            break
        begins = list(_begins(bench, asked, asked.state.added[-1]))
        if begins:
            tell(f"fitting a finer {asked.state.added[-1].effect}")
            inside += _in_finer(bench, asked, begins)
    if not inside:
        return current
    with bench.coarse():
        # The plain one may not have been at its end.
        plain = next(iter(_at_their_ends(bench, [(current, list(current.state.added))])), current)
    least = min([plain, *inside], key=lambda found: bench.power(found.predictions))
    rest, blocks = bench.stacked(bench.residuals(least.predictions)), bench.stacked_blocks()
    sample, number = bench.sample_power(rest), worth_of_a_number(rest, blocks)

    def cost(found: Fit) -> float:
        """Of the data, of the priors, and of the effect's numbers."""
        return sample * unlikelihood(bench, found, least) + number * found.state.added[-1].freedom

    best = min(inside, key=cost, default=plain)
    missing, left = (bench.power(each.predictions) - noise for each in (base, plain))
    matters = min(BEYOND_GAIN * missing, max(NEWS * left, EXCESS * noise))
    if cost(plain) - cost(best) > matters:
        return sharpened(bench, best)
    # Nor may the one that is taken be short of its end where the plain one has come on.
    came_on = cost(current) - cost(plain) > NEWS * (bench.power(current.predictions) - noise)
    return sharpened(bench, plain) if came_on else current


def _in_finer(bench: Bench, current: Fit, begins: Sequence[Added]) -> list[Fit]:
    """Fits of a model with its newest effect in finer formulas that do not end at the end of a range."""
    others = current.state.added[:-1]
    with bench.coarse():
        ways = [(current, [*others, one]) for one in _nearest(bench, current, begins)]
        given = as_given(bench, current)
        if given is not None:
            # A plain formula may have bent the base to stand in for what it lacks.
            ways += [(given, [*others, one]) for one in _nearest(bench, given, begins)]
        # At the end of a range its further numbers are told no more.
        inside = [found for found in _at_their_ends(bench, ways) if not found.state.added[-1].at_limit]
        if inside:
            inside += _with_fewer(bench, min(inside, key=lambda found: bench.power(found.predictions)))
    return inside


def each_refined(
    bench: Bench, base: Fit, current: Fit, tell: Callable[[str], object], worth: Sequence[bool]
) -> Fit:
    """The model with each effect that is ``worth`` it in a finer formula, as ``refined`` has its newest."""
    count = len(current.state.added)
    for k in range(count):
        # Each in turn is the newest; after as many turns they stand as they did.
        current = current.ordered([count - 1, *range(count - 1)])
        if worth[count - 2 - k]:
            current = refined(bench, base, current, tell)
    return current


def _begins(bench: Bench, current: Fit, plain: Added) -> Iterator[Added]:
    """An effect in the others of its finer formulas, as large as it is: their further terms at none.

    Shapes that it has already begin where they are, and at the next minima that they may have there.
    """
    finer: tuple[Fitting, ...] = catalogue()[plain.effect].finer
    own = {
        shape.path: (value, *shape.next_minima(value))
        for shape, value in zip(plain.fitting.shapes, plain.shapes, strict=True)
    }
    label, settings = plain.fitting.label, plain.settings()
    measured = bench.measured
    for fitting in finer:
        if not fitting.of_mesh(current.state.toothed) or bench.turns < fitting.turns:
            continue
        if not fitting.of_channels(measured, bench.channels):
            continue
        if label == fitting.label or (fitting.refines and label not in fitting.refines):
            continue
        begun = set()
        for one in starts(plain.effect, fitting, (), bench.ranges(current.state)):
            pairs = zip(fitting.shapes, one.shapes, strict=True)
            orders = one.fitting.orders_of(plain.orders)
            coefficients = one.fitting.read(settings, orders)
            # Starts of a shape that the effect has already are one.
            for shapes in product(*(own.get(shape.path, (start,)) for shape, start in pairs)):
                if shapes not in begun:
                    begun.add(shapes)
                    yield replace(one, coefficients=coefficients, shapes=shapes, orders=orders)


def _with_fewer(bench: Bench, found: Fit) -> list[Fit]:
    """Fits of formulas with fewer numbers from where that with more is: they may not have come as far."""
    *others, finer = found.state.added
    begins = [one for one in _begins(bench, found, finer) if one.freedom < finer.freedom]
    ends = _at_their_ends(bench, [(found, [*others, one]) for one in _nearest(bench, found, begins)])
    return [end for end in ends if not end.state.added[-1].at_limit]


def _nearest(bench: Bench, current: Fit, begins: Sequence[Added]) -> list[Added]:
    """Of the starts of a formula's last shape the one that leaves least before anything is fitted.

    A play that is too sharp rattles where the true one does not, and no slope leads away from there.
    """
    *others, _ = current.state.added
    predicted = bench.predict_all([replace(current.state, added=(*others, one)) for one in begins])
    least: dict[tuple[str, tuple[float, ...]], tuple[float, Added]] = {}
    for one, there in zip(begins, predicted, strict=True):
        power = math.inf if there is None else bench.power(there)
        way = one.fitting.label, one.shapes[:-1]
        if way not in least or power < least[way][0]:
            least[way] = power, one
    return [one for _, one in least.values()]


def _at_their_ends(bench: Bench, ways: Sequence[tuple[Fit, list[Added]]]) -> list[Fit]:
    """All numbers fitted with these effects, from where each way begins, as far as that leads.

    Those that leave least are carried on, fewer each time (successive halving: Jamieson and Talwalkar 2016,
    AISTATS 51:240): most of several starts are seen early to end in the same place or in a worse one. What
    has fallen by less than an independent sample of what it leaves is worth has come to its end.

    Args:
        bench: the measured series.
        ways: a fit to go on from, and the effects.

    Returns:
        Where each has come to; without those that led nowhere.
    """
    begun = (_fitted(bench, current, added, begun=True) for current, added in ways)
    ends = [found for found in begun if found is not None]
    left = {k: bench.power(found.predictions) for k, found in enumerate(ends)}
    for _ in range(TIMES):
        on = sorted(left, key=left.__getitem__)[: math.ceil(CARRIED_ON * len(left))]
        lower: dict[int, float] = {}
        for k in on:
            further = _fitted(bench, ends[k], list(ends[k].state.added))
            if further is None or (power := bench.power(further.predictions)) >= left[k]:
                continue
            ends[k] = further
            if left[k] - power > bench.sample_power(bench.stacked(bench.residuals(further.predictions))):
                lower[k] = power
        left = lower
    return ends


def _fitted(bench: Bench, current: Fit, added: list[Added], *, begun: bool = False) -> Fit | None:
    """A fit with these effects from where another has come to; ``begun``: there all but the last are known.

    The other numbers do to the plain formula nearly what they do to a finer one that is as large.
    """
    state = replace(current.state, added=tuple(added))
    last = current.numbers_of(len(current.state.added) - 1)
    known = (current.columns[:, : last.start], math.nan) if begun else None
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        return fit(
            bench, state, at_present(current), prune=False, evaluations=EVALUATIONS, after=current,
            known=known, rough=True,
        )  # fmt: skip
    return None
