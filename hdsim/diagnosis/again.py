"""Names that are asked again beside the others, and what a model leaves for any name to explain."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from hdsim.diagnosis.contest import confusable
from hdsim.diagnosis.locate import Location, locate
from hdsim.diagnosis.name import SAME, Named, freedom, level, name_effect
from hdsim.diagnosis.revise import carried_on, without
from hdsim.diagnosis.screen import LEVEL, Residual
from hdsim.diagnosis.traces import Screening, screen
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, sharpened
from hdsim.estimate.orders import Line, lines_of, power_of
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added
from hdsim.estimate.unwound import unwound

#: Part of what a channel lacked at first that a later effect must explain where no smooth curve over the
#: coordinates of the effects before it does: a sharp line in an order spectrum is that small.
BEYOND_GAIN = 0.005
#: Part of what is left by which it must have fallen for the last name to be asked again.
NEWS = 0.1
#: Share of resampled records that a name must have won not to be asked again because of a far smaller one.
CLEAR = 0.995

Step = Callable[[str], object]


def again(
    bench: Bench,
    base: Fit,
    current: Fit,
    names: list[Named],
    tell: Step,
    *,
    before: Screening | None = None,
    every: bool = False,
    lines: Sequence[Line] = (),
) -> Fit:
    """Ask every name again.

    The last one was asked beside the others, and is so again only where they have changed since, or where it
    has gone to the end of its range.

    Args:
        bench: the measured series.
        base: the re-fitted model.
        current: the model with all names.
        names: in the order of ``current.state.added``; changed in place.
        tell: told what is being done.
        before: the first screening.
        every: ask also those that are clear.
        lines: that have come to light since; names that read their orders from such lines are asked, too.
    """
    lit = [(line.channel, line.order) for line in lines]
    first = bench.power(current.predictions)
    k = 0
    while k < len(names):
        stuck = current.state.added[k].at_limit
        asked = stuck or every or _reads(current.state.added[k], lit)
        if not asked and _clear(names[k], names[-1]):
            k += 1
            continue
        no_news = bench.power(current.predictions) > (1.0 - NEWS) * first
        if k == len(names) - 1 and no_news and not asked:
            break
        own, added = names[k], current.state.added
        rest = _of_the_others(bench, base, current, k)
        if rest is None:
            if len(names) > 1:
                k += 1
                continue
            rest = sharpened(bench, base)
        left = left_of(bench, rest)
        peaks = lines_of(bench, bench.residuals(rest.predictions, drift=True), rest.state.delays)
        tell(f"{own.name} again")
        done = instead(one for one in names if one is not own)
        screening = screen(bench, rest.state, left, peaks, before=before, leave_out=done)
        named = None
        if screening.ranked and screening.chance <= LEVEL:
            # In its place a name has to leave less than the model with it does.
            known = math.inf if stuck else bench.power(current.predictions)
            named = name_effect(bench, rest, screening, left, on_step=tell, known_power=known)
        alone = len(names) == 1
        if named is None or (not alone and gain(bench, base, rest, named.fit) < BEYOND_GAIN):
            by_itself = as_good(bench, current, k, rest)
            if by_itself is not None:
                # It explains what the newest does as well.
                beaten = names.pop().name
                own.group[beaten] = 1.0
                own.instead_of |= {beaten}
                current = by_itself
                k += 1
                continue
            # The others explain what it did, so what it explained is theirs.
            gone, newest = names.pop(k), names[-1] if names else None
            if newest is not None and k < len(names):
                if set(added[k].lives_in) & set(added[-1].lives_in):
                    _inherit(newest, gone)  # a law elsewhere cannot have explained it
                if newest.name in gone.group:
                    # It was as good a name before, and neither is needed beside the other.
                    newest.group[gone.name] = 1.0
            current = rest
            continue
        loss, now = bench.power(current.predictions), bench.power(named.fit.predictions)
        same = named.name == own.name or own.name in named.group
        better = now < (1.0 - SAME) * loss
        if same or stuck or better:
            # Beside the others a simpler name may leave less by now, though the two were alike.
            simpler = better and freedom(named.fit) <= added[k].freedom
            own = named if named.name == own.name or not same or stuck or simpler else own
            if own is named:
                # It was fitted last: back to its place; where the same law lay better, that is kept.
                last = len(added) - 1
                if stuck or named.name != names[k].name or now < loss:
                    current = named.fit.ordered([*range(k), last, *range(k, last)])
            else:
                own.group = {name: part for name, part in named.group.items() if name != own.name}
                own.group[named.name] = 1.0
            own.gain, own.of_lines, own.alike = names[k].gain, names[k].of_lines, names[k].alike
            own.instead_of = names[k].instead_of if own.name == names[k].name else frozenset()
            names[k] = own
        k += 1
    return current


def _of_the_others(bench: Bench, base: Fit, current: Fit, k: int) -> Fit | None:
    """The model without an effect; None where its fit fails: it leaves more than the base does alone."""
    rest, most = without(bench, current, k), (1.0 + NEWS) * bench.power(base.predictions)
    if rest is None or bench.power(rest.predictions) <= most:
        return rest
    if len(current.state.added) > 1:
        # A rough fit may not come back from numbers that were right beside a strong effect.
        rest = carried_on(bench, rest)
    return rest if bench.power(rest.predictions) <= most else None


def as_good(bench: Bench, current: Fit, k: int, rest: Fit) -> Fit | None:
    """The model without its newest effect where a simpler one that looks like it does as well alone.

    The two have never been compared: the newest was found with the simpler one in the model, beside which it
    explained more, and now it explains what the simpler one did. They are two names of one effect, and which
    of them is decided as in a contest.

    Args:
        bench: the measured series.
        current: the model with both.
        k: which of its effects nothing is missing without.
        rest: the model without that.
    """
    last, added = len(current.state.added) - 1, current.state.added
    if k == last or added[k].freedom >= added[last].freedom:
        return None
    if not confusable(added[k].effect, added[last].effect):
        return None
    alone, neither = without(bench, current, last), without(bench, rest, last - 1)
    if alone is None or neither is None:
        return None
    own, newest, none = (bench.block_powers(each.predictions) for each in (alone, rest, neither))
    return alone if level(own, newest, SAME * float((none - newest).sum())) else None


def instead(names: Iterable[Named]) -> frozenset[str]:
    """Effects that are not asked for, because these names do the same."""
    return frozenset().union(*(one.instead_of for one in names))


def _reads(added: Added, lines: Sequence[tuple[str, float]]) -> bool:
    """Whether an effect has its orders from spectra, and would from these lines, channel and order each."""
    return any(term.orders_among(lines, 1) for term in added.fitting.terms) if added.orders else False


def _inherit(one: Named, other: Named) -> None:
    """A name that takes another's place explains at least what that did."""
    one.gain = max(one.gain, other.gain)


def _clear(one: Named, newest: Named) -> bool:
    """Whether a name won so clearly that what came since can't have changed it."""
    return one is not newest and one.confidence >= CLEAR and not one.group and newest.gain < NEWS * one.gain


def left_of(bench: Bench, current: Fit) -> Residual:
    """The whitened residual without what the model's own numbers and the sensors' offsets explain."""
    zeros = [column[:, None] for column in unwound(bench, current.state, current.predictions).values()]
    # A delay of a few samples takes little, but without its bounds it would take all that lags.
    own = [k for k in range(current.columns.shape[1]) if k >= len(current.frees) or not current.frees[k].step]
    columns: Array = np.hstack([current.columns[:, own], bench.offset_columns(), *zeros])
    return Residual(
        bench.stacked(bench.residuals(current.predictions, drift=True)), columns, bench.stacked_blocks()
    )


def located(bench: Bench, current: Fit) -> tuple[Residual, Location]:
    """What a fit leaves, and where."""
    left, residuals = left_of(bench, current), bench.residuals(current.predictions, drift=True)
    return left, locate(bench, left, residuals, current.state.delays)


def gain(bench: Bench, base: Fit, before: Fit, now: Fit) -> float:
    """Largest part of what a channel lacked at first, beyond its noise, that a fit explains more."""
    first, last, new = (bench.channel_powers(each.predictions) for each in (base, before, now))
    noise = bench.noise_powers
    return max(float((last[c] - new[c]) / max(first[c] - noise[c], noise[c], 1e-300)) for c in first)


def part_of_lines(bench: Bench, before: Fit, now: Fit, lines: Sequence[Line]) -> float:
    """Part of the lines of what was left that a fit explains."""
    last, new = (
        power_of(bench, bench.residuals(each.predictions, drift=True), lines, each.state.delays)
        for each in (before, now)
    )
    return float(np.clip(1.0 - new / last, 0.0, 1.0)) if last > 0 else 0.0
