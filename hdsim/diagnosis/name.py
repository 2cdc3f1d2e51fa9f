"""Step 5b, name: the best of the screen are fitted in the simulated model, and the best of them has the name.

The base's own numbers stay free in these fits; candidates are compared block of time by block of time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hdsim.diagnosis.contest import Fitted, against_priors, confusable, contest
from hdsim.diagnosis.evidence import CandidateEvidence
from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.traces import Screened, Screening
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.records import Array
from hdsim.estimate.refit import REACHED

#: Least share of the weighed residual that an effect must explain to be worth a name.
LEAST_SHARE = 0.03
#: Candidates that are fitted roughly, and the part of the best share that they must reach on the screen.
SHORTLIST, NEAR = 9, 0.25
#: The same part for effects that are known to look like the best, or that live in the coordinate that
#: explains most: the screen is linear, they are not.
ALIKE = 0.1
#: What the screen says that a candidate leaves, in units of what it says of the best, for its fit to be worth
#: its time: of effects that are linear in their numbers, and of those that have shapes.
LINEAR, FREER = 4.0, 8.0
#: Logarithm by which a re-fit must have made the drive softer for a compliance to be suspected.
SOFTER = 0.03
#: Part of its share that another effect must keep beside the best to be an effect of its own.
BESIDE = 0.6
#: Part of all that there is to explain beyond which two effects cannot have explained parts of their own.
OVERLAP = 1.2
#: Part of what an effect at the end of its range explains for one of no more freedom to be preferred.
INSIDE = 0.8
#: What another effect leaves beside the noise, in its units, to be seen to be wrong where the best one has
#: reached the noise, in however few blocks of time.
SEEN = 0.5
#: Part of the first pass's structure that an effect must explain for a finer formula of it to be looked for.
#: Plain formulas of other laws leave up to 0.14 of it (calibration cases of `numpy`, seeds 84 to 138): of a
#: smaller one that is less than a further effect must explain (``BEYOND_GAIN`` of a search).
WORTH_FINER = 0.03
#: Loss of explained power, as a part of it, within which two effects count as the same trace.
SAME = 0.02
#: The same for effects that are known to look alike, when neither reaches the noise.
MISMATCH = 0.1
#: Part of what the best one explains that another must explain to be a name of the same, however few blocks
#: of time tell the two apart (calibration cases: of the 13 in which the truth was such another name it
#: explained 0.6 to 1, and 0.1 where the best was taken back later).
HALF = 0.5


@dataclass
class Named:
    """A fitted effect.

    Attributes:
        name: in the catalogue.
        fit: the model with it.
        losses: shape (blocks,), power of each block's residual after the fit, with a share of what the priors
            have against its numbers.
        group: effects that these data cannot tell from it, with the ratio of explained power.
        confidence: share of resampled records (over blocks) in which it, or its group, is best.
        share: of the residual, which its trace explained on the screen.
        chance: of the search that found it.
        alternatives: fits of the others on the shortlist, carried on to their optimum but not proved there.
        candidates: all that were fitted, the best first, as evidence.
        of_left: part of what was left beyond the noise that its fit explained; likewise.
        of_lines: part of the sharp lines that were left that it explained, where it lives there; likewise.
        gain: part of the first pass's structure that it explained; set by the search.
        needed: part of what would be missing without it that it explains, beside all others; likewise.
        worth: power that it explains beside all others; likewise, where there are others.
        less: the model without it, all the rest fitted anew; likewise.
        alike: names of which either alone explains nearly all that both do; set when they are revised.
        instead_of: names with more freedom that do the same as this one; not asked for beside it.
    """

    name: str
    fit: Fit
    losses: Array
    group: dict[str, float]
    confidence: float
    share: float
    chance: float
    alternatives: dict[str, Fit]
    candidates: list[CandidateEvidence]
    gain: float = 1.0
    of_left: float = 1.0
    of_lines: float = 0.0
    needed: float = 1.0
    worth: float = 0.0
    less: Fit | None = None
    alike: frozenset[str] = frozenset()
    instead_of: frozenset[str] = frozenset()

    @property
    def worth_finer(self) -> bool:
        """Whether a finer formula could explain as much as a further effect would have to.

        What a formula errs by is a part of what its effect explains, and costs many fits to find.
        """
        return self.gain >= WORTH_FINER

    def look_alikes(self, bench: Bench, before: Fit) -> list[Fit]:
        """The alternatives that look like it and explain nearly as much, those that leave least first.

        Args:
            bench: the measured series.
            before: the model without any of them.
        """
        own = bench.power(self.fit.predictions)
        enough = own + MISMATCH * (bench.power(before.predictions) - own)
        left = {name: bench.power(each.predictions) for name, each in self.alternatives.items()}
        near = [name for name in left if left[name] <= enough and confusable(self.name, name)]
        return [self.alternatives[name] for name in sorted(near, key=left.__getitem__)]

    def gives_way(self, bench: Bench, before: Fit, own: Fit, found: Fit) -> None:
        """Take the name of a look-alike that explains more in a finer formula.

        Args:
            bench: the measured series.
            before: the model without either.
            own: the model with this one.
            found: the model with the other instead.
        """
        name, none = found.state.added[-1].effect, bench.power(before.predictions)
        part = (none - bench.power(own.predictions)) / (none - bench.power(found.predictions))
        self.alternatives = {k: each for k, each in self.alternatives.items() if k != name} | {
            self.name: self.fit
        }
        self.group = {self.name: part} if part > 1.0 - MISMATCH else {}
        self.name, self.fit = name, found


def name_effect(
    bench: Bench,
    base: Fit,
    screening: Screening,
    residual: Residual,
    *,
    coordinate: str = "",
    on_step: Callable[[str], object] | None = None,
    fitted: Fitted | None = None,
    known_power: float = math.inf,
    alone: Fit | None = None,
) -> Named | None:
    """Fit the screen's best in the simulated model and keep the best of them.

    Args:
        bench: the measured series.
        base: the fitted model without the effect.
        screening: the catalogue on the screen.
        residual: what it was screened on.
        coordinate: the one that explains most of it; effects that live there are fitted more readily.
        on_step: told what is being fitted.
        fitted: the base with each effect that was fitted for another residual of it; those of this one are
            added.
        known_power: what a model that is known leaves, which this one is to take the place of.
        alone: the model without the effect where its own numbers explain a part of what ``base`` leaves: only
            the rest is the effect's.
    """
    best = screening.ranked[0]
    known = catalogue()

    def near(name: str) -> float:
        lives = coordinate in known[name].signature.lives_in[:1]
        return ALIKE if lives or confusable(best.name, name) else NEAR

    shortlist = [one for one in screening.ranked if one.share.share >= near(one.name) * best.share.share]
    # A trace of which the base explains nearly all is told by what its simulation is not linear in.
    shortlist += [
        one
        for one in screening.ranked
        if one not in shortlist and confusable(best.name, one.name) and not one.added.fitting.shapes
    ]
    shortlist = [one for one in shortlist if _could_win(one, best)][:SHORTLIST]
    softer = [free.none / free.prior for free in at_present(base) if free.compliance and free.none > SOFTER]
    series = [one for one in screening.ranked if one.added.fitting.in_series]
    kin = any(one in series or any(confusable(one.name, other.name) for other in series) for one in shortlist)
    if softer and (kin or max(softer) > 1.0):
        # The re-fit may have taken any compliance in series for the drive's own, and where that is softer
        # than is likely, all of it.
        shortlist += [one for one in series if one not in shortlist]
    with bench.coarse():
        results = contest(bench, base, shortlist, residual, on_step, fitted, known_power)
    if not results:
        return None
    without = alone or base
    *results, (_, _, before) = against_priors(
        bench, [*results, ("", without, bench.block_powers(without.predictions))]
    )
    results.sort(key=lambda result: float(result[2].sum()))
    explained = float((before - results[0][2]).sum())
    if explained <= 0:
        return None
    results = simplest_first(_inside(results, before), SAME * explained)
    name, found, losses = results[0]
    explained = float((before - losses).sum())
    group = {}
    on_screen = {one.name: one for one in shortlist}
    noise = bench.noise_power
    whole = float(before.sum()) - noise
    for other, rival, rest in results[1:]:
        if rival.state.added[-1].at_limit and not found.state.added[-1].at_limit:
            continue
        if float((before - rest).sum()) < HALF * explained:
            continue
        difference = rest - losses
        spread = float(np.sqrt(len(difference)) * difference.std())
        apart = explained + float((before - rest).sum()) < OVERLAP * whole
        if apart and beside(residual, on_screen[name], on_screen[other]):
            continue
        if float(losses.sum()) < REACHED * noise and float(rest.sum()) > (1.0 + SEEN) * noise:
            continue
        same = max(2.0 * spread, SAME * explained)
        if confusable(name, other):
            # Two formulas that both miss the noise are not told apart by less than what the better one lacks,
            # nor a simple one from one with more freedom, which may reach the noise where it does not.
            lacks = float(losses.sum()) - noise
            freer = freedom(found) > freedom(rival)
            same = max(same, MISMATCH * explained if freer else min(lacks, MISMATCH * explained))
        if difference.sum() < same:
            group[other] = float((before - rest).sum()) / explained
    # No more than all that was to be explained, however little of it the noise may have left.
    most = max(whole, *(float((before - rest).sum()) for _, _, rest in results))
    return Named(
        name,
        found,
        losses,
        group,
        _confidence(results, {name, *group}),
        on_screen[name].share.share,
        screening.chance,
        {other: each for other, each, _ in results[1:]},
        [_as_evidence(result, results[0], before, most, on_screen[result[0]]) for result in results],
    )


def _could_win(one: Screened, best: Screened) -> bool:
    """Whether a candidate's fit may still catch up with what the screen's best one leaves.

    An effect that is linear in its numbers fits hardly better than its trace; one with shapes, a play or a
    compliance in series may.
    """
    fitting = one.added.fitting
    if fitting.in_series or fitting.play:
        return True
    room = FREER if fitting.shapes else LINEAR
    return 1.0 - one.share.share <= room * (1.0 - best.share.share)


def _as_evidence(
    result: tuple[str, Fit, Array],
    best: tuple[str, Fit, Array],
    before: Array,
    whole: float,
    screened: Screened,
) -> CandidateEvidence:
    """A fitted candidate as plain data."""
    name, found, losses = result
    added = found.state.added[-1]
    difference, explained = losses - best[2], max(float((before - best[2]).sum()), 1e-300)
    return CandidateEvidence(
        name=name,
        label=added.fitting.label,
        screened=screened.share.share,
        explained=float((before - losses).sum()) / max(whole, 1e-300),
        behind=float(difference.sum()) / explained,
        behind_spread=float(np.sqrt(len(difference)) * difference.std()) / explained,
        numbers=freedom(found),
        at_limit=added.at_limit,
    )


def _inside(results: list[tuple[str, Fit, Array]], before: Array) -> list[tuple[str, Fit, Array]]:
    """The results without those at the end of their range, if the best is and no freer one will do."""
    best = results[0]
    inside = [result for result in results if not result[1].state.added[-1].at_limit]
    if not best[1].state.added[-1].at_limit or not inside or freedom(inside[0][1]) > freedom(best[1]):
        return results
    enough = float((before - inside[0][2]).sum()) > INSIDE * float((before - best[2]).sum())
    return inside if enough else results


def simplest_first(results: list[tuple[str, Fit, Array]], same: float) -> list[tuple[str, Fit, Array]]:
    """The results, the one of least freedom first of those that blocks of time cannot tell from the best."""
    alike = (result for result in results if level(result[2], results[0][2], same))
    best = min(alike, key=lambda result: freedom(result[1]))
    return [best, *(result for result in results if result is not best)]


def level(rest: Array, least: Array, same: float) -> bool:
    """Whether what one fit leaves in every block of time is no more than another's, by chance or ``same``."""
    difference = rest - least
    return float(difference.sum()) <= min(2.0 * float(np.sqrt(len(rest)) * difference.std()), same)


def freedom(found: Fit) -> int:
    """Free numbers of a fit's last effect."""
    return found.state.added[-1].freedom


def beside(residual: Residual, one: Screened, other: Screened) -> bool:
    """Whether two traces are two effects rather than two names of one: each explains what the other can't."""
    both = residual.share(np.hstack([one.columns, other.columns])).share
    return both - one.share.share > BESIDE * other.share.share


def _confidence(results: list[tuple[str, Fit, Array]], group: set[str], draws: int = 400) -> float:
    losses = np.stack([rest for _, _, rest in results])
    rng = np.random.default_rng(3)
    picks = rng.integers(0, losses.shape[1], size=(draws, losses.shape[1]))
    best = np.argmin(losses[:, picks].sum(axis=2), axis=0)
    return float(np.mean([results[int(k)][0] in group for k in best]))
