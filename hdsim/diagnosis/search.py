"""Steps 4 to 6 in turn: locate, name, add, until nothing significant is left.

The first names are given while other effects are still missing, so each is asked again once there are
several: the model without it, but with all others, is screened anew, and the best effect there takes its
place or, when nothing significant is missing there, none does. The torques' delays are fitted when nothing
more is found, and all is asked once more when they have explained something.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from hdsim.diagnosis.again import (
    BEYOND_GAIN,
    NEWS,
    Step,
    again,
    gain,
    instead,
    left_of,
    located,
    part_of_lines,
)
from hdsim.diagnosis.anew import begun_anew, gone_on_with, heard
from hdsim.diagnosis.beyond import beyond_curves
from hdsim.diagnosis.contest import FAR_LEFT_IN, Fitted
from hdsim.diagnosis.effort import MOST_EFFECTS, MOST_STAGES, enough_done, more_could
from hdsim.diagnosis.finer import each_refined, refined
from hdsim.diagnosis.given import is_all, over_the_given
from hdsim.diagnosis.held import hopeless
from hdsim.diagnosis.late import lines_shown, read_late
from hdsim.diagnosis.locate import SHARP
from hdsim.diagnosis.name import LEAST_SHARE, LINEAR, Named, name_effect
from hdsim.diagnosis.passes import Search, Stage
from hdsim.diagnosis.point import from_where_it_was
from hdsim.diagnosis.rest import only_sticks, sticks_beside
from hdsim.diagnosis.revise import base_alone, revised
from hdsim.diagnosis.screen import LEVEL, Residual
from hdsim.diagnosis.sensitive import within_motion_noise
from hdsim.diagnosis.traces import ranked_anew, screen
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, sharpened
from hdsim.estimate.flanks import nothing_but_flanks, of_other_flanks
from hdsim.estimate.refit import align, as_far_as_promised, reweigh, together, with_delays
from hdsim.estimate.short_cut import follow_teeth
from hdsim.estimate.standstill import has_a_sign

#: Part of what a channel lacked at first that a later effect must explain where a smooth curve over the
#: coordinates of the effects before it would, because no formula is exact.
WITHIN_GAIN = 0.1
#: Part of what is left that makes it the next effect's, even in the coordinates of those that are there.
MOST = 0.5


def search(
    bench: Bench,
    base: Fit,
    during: Callable[[str, str], Step],
    *,
    thorough: bool = False,
    earlier: Search | None = None,
) -> Search:
    """Add effects until nothing significant is left.

    Args:
        bench: the measured series, weighed.
        base: the re-fitted model.
        during: told the step that begins and what it does; returns who is told the details.
        thorough: look for further effects whatever it takes (``hdsim.diagnosis.effort``).
        earlier: the search after which all began anew.
    """
    if earlier is not None and earlier.kept:
        found = gone_on_with(bench, earlier)
    else:
        was = None if earlier is None else earlier.fit
        found = Search(base, left_of(bench, base), thorough=thorough, earlier=was)
    last = found.fit, list(found.named)
    while True:
        if found.named and found.fit is not found.asked and heard(bench, last[0], found.fit):
            return begun_anew(bench, found, last, (found.fit, found.named))
        names = list(found.named)
        following = _next(bench, base, found, during)
        if following is not None:
            last, found.fit = (found.fit, names), following
            if found.anew:
                newest = found.stages[-1].named
                return begun_anew(bench, found, last, (following, [*names, newest] if newest else []))
            follow_teeth(bench, base.state, following.state)
            continue
        late = with_delays(bench, found.fit, rough=True)
        if late is None:
            return _settled(bench, base, found, during)
        noise = bench.noise_power
        left, now = (bench.power(each.predictions) - noise for each in (found.fit, late))
        lines = lines_shown(bench, found.fit, late)
        found.fit = late
        if len(found.stages) == MOST_STAGES or (now > (1.0 - NEWS) * left and not lines):
            return _settled(bench, base, found, during)
        # What a delay has blurred may show now.
        align(bench, found.fit)
        reweigh(bench, found.fit)
        if found.named and lines:
            tell, before = during("again", "testing each effect again"), found.stages[0].screening
            found.fit = again(bench, base, found.fit, found.named, tell, before=before, lines=lines)


def _settled(bench: Bench, base: Fit, found: Search, during: Callable[[str, str], Step]) -> Search:
    """The search's last fit carried on to its optimum, without needless names, with the covariance there."""
    if len(found.named) > 1:
        # What another effect did may have hidden what a finer formula does.
        worth = [one.worth_finer for one in found.named]
        found.fit = each_refined(bench, base, found.fit, partial(during, "fit"), worth)
    found.fit = together(bench, found.fit)
    if found.named:
        tell = during("again", "testing each effect beside the others")
        count = len(found.named)
        found.fit = revised(bench, found.fit, found.named, tell)
        if len(found.named) < count:
            # Beside a name that was needless others may have been wrong, or as good as the one that is left.
            before = found.stages[0].screening
            asked = again(bench, base, found.fit, found.named, tell, before=before, every=True)
            found.fit = together(bench, asked)
            found.fit = revised(bench, found.fit, found.named, tell)
        if len(found.named) == 1:
            tell(f"without {found.named[0].name}")
            found.better = base_alone(bench, base, found.fit)
            if found.better is not None:
                return found
        for one in found.named:
            if one.name in one.alike:
                one.group = dict.fromkeys(sorted(one.alike - {one.name}), 1.0) | one.group
            for other in found.named:
                one.group.pop(other.name, None)  # what is there by itself is no other name of this
        # What is left is what this fit leaves, not the rough one before it.
        last = found.stages[-1]
        found.left, last.location = located(bench, found.fit)
        last.power = found.left.power
    return found


def _next(bench: Bench, base: Fit, found: Search, during: Callable[[str, str], Step]) -> Fit | None:
    """The model with one more effect; None when nothing significant is left, or nothing that matters."""
    current = found.fit = read_late(bench, found.fit)
    title = "refit" if not found.named else f"with {found.named[-1].name}"
    during("locate", f"locating the residual {title}")
    found.left, location = located(bench, current)
    more = not found.named or more_could(bench, base, current)
    if bench.swings and not more and location.sharp(LEVEL):
        # Lines so near the noise may be what a swing leaves that is short of its end.
        align(bench, current)
        current = found.fit = together(bench, sharpened(bench, current), rough=True)
        found.left, location = located(bench, current)
    more = more or location.sharp(LEVEL)
    stage = Stage(title, location, found.left.power)
    found.stages.append(stage)
    found.ended = found.sensitive = False
    if nothing_but_flanks(bench, stage.power, found.left.project):
        return None
    # Names that take each other's place would go on for ever.
    if len(found.named) == MOST_EFFECTS or len(found.stages) == MOST_STAGES:
        return None
    may_end = more and not found.thorough
    found.ended = may_end and enough_done(bench, len(found.stages) - 1)
    lines = location.lines if location.sharp(LEVEL) else ()
    found.sensitive = bool(may_end and found.named and within_motion_noise(bench, current, lines))
    if found.ended or found.sensitive or not more:
        return None
    fitted: Fitted = {} if found.named else from_where_it_was(bench, base, found.earlier)
    named = _one_more(bench, base, current, found, stage, bool(found.named), during, fitted)
    if found.named and (named is None or named.of_left < MOST):
        within = _one_more(bench, base, current, found, stage, False, during, fitted)
        # No formula errs by so much that another explains most of it.
        if within is not None and (named is None or within.of_left > max(MOST, named.of_left)):
            named = within
    if named is None:
        return None
    if len(found.named) > 1 and hopeless(bench, named.fit, named):
        return None
    if not found.named and stage.screening is not None:
        traces = [each.columns for one in stage.screening.ranked for each in (one, *one.others)]
        if sticks_beside(bench, current, named.fit, traces):
            found.anew, stage.named = True, named
            return named.fit
    current = plain = _near_its_end(bench, found, named)
    alone = not found.named
    # A beginning that swings is not explained by a finer formula, which would take long to try.
    anew = alone and not is_all(bench, plain) and heard(bench, found.fit, plain, rests=False)
    if not anew:
        current = _finished(bench, base, found, named, plain, during)
        if alone and not is_all(bench, current):
            anew = heard(bench, found.fit, current, beginnings=current is not plain)
            found.asked = current
    if anew:
        found.anew, stage.named = True, named
        return current
    stage.named = named
    found.named.append(named)
    align(bench, current)
    reweigh(bench, current)
    if len(found.named) > 1:
        known = [replace(one, group=dict(one.group)) for one in found.named[:-1]]
        if has_a_sign(current.state) and only_sticks(bench, found.fit, current, whole=True):
            found.anew = True
            return current
        tell = during("again", "testing each effect again beside the others")
        if current.undetermined:
            current = together(bench, current, rough=True)
        current = again(bench, base, current, found.named, tell, before=found.stages[0].screening)
        current = sharpened(bench, current)
        align(bench, current)
        reweigh(bench, current)
        left, now = (bench.power(each.predictions) for each in (found.fit, current))
        if len(found.named) >= len(known) and now >= left:
            # Names that take each other's place without explaining more would go on doing so.
            found.named[:] = known
            return None
    return current


def _near_its_end(bench: Bench, found: Search, named: Named) -> Fit:
    """The model with an effect more, a first one near its optimum."""
    current = named.fit
    if found.named:
        return current
    # A base that carried nothing could tell nothing of its springs.
    current = together(bench, current, rough=True) if current.undetermined else current
    return as_far_as_promised(bench, sharpened(bench, current))


def _finished(
    bench: Bench, base: Fit, found: Search, named: Named, plain: Fit, during: Callable[[str, str], Step]
) -> Fit:
    """The model with an effect more in a finer formula where that explains more, near its optimum."""
    current = plain
    if named.worth_finer:
        current = refined(bench, base, plain, partial(during, "fit"), named.look_alikes(bench, found.fit))
        if current.state.added[-1].effect != named.name:
            named.gives_way(bench, found.fit, plain, current)
    return current if current is plain and not found.named else as_far_as_promised(bench, current)


def _one_more(
    bench: Bench,
    base: Fit,
    current: Fit,
    found: Search,
    stage: Stage,
    beyond: bool,
    during: Callable[[str, str], Step],
    fitted: Fitted,
) -> Named | None:
    """The best further effect; ``beyond``: of what no curve over the present ones' coordinates explains.

    No formula is ever exact, and what the present ones leave in their own coordinates would be taken for
    another effect. An effect that shows there only must explain much more.
    """
    left = beyond_curves(bench, current, found.left) if beyond else found.left
    places = stage.location.places
    if stage.screening is None:
        tell = during("screen", "screening the catalogue")
        first = found.stages[0].screening
        beaten = instead(found.named)
        lines = stage.location.lines
        screening = screen(
            bench, current.state, left, lines, places=places, before=first, leave_out=beaten, on_step=tell
        )
    else:
        screening = ranked_anew(stage.screening, left)
    if stage.screening is None or screening.chance < stage.screening.chance:
        stage.screening = screening
    # What is more than noise and other flanks is there, however few blocks of time tell a trace of it.
    if not screening.ranked or (screening.chance > LEVEL and (found.named or not bench.redrawn)):
        return None
    if not found.named and screening.ranked[0].share.share < LEAST_SHARE:
        return None
    tell = during("fit", "fitting the shortlist")
    coordinate = places[0].coordinate if places else ""
    named = name_effect(bench, current, screening, left, coordinate=coordinate, on_step=tell, fitted=fitted)
    known_power = bench.power(current.predictions if named is None else named.fit.predictions)
    matters = partial(_matters, bench, base, found, stage, left=left, beyond=beyond)
    if found.named:
        # Beside the effects that are there a linear fit has to come near what is known already.
        enough, ask = LINEAR * known_power, known_power > FAR_LEFT_IN * bench.noise_power
    elif named is not None and matters(named):
        return named
    else:
        enough, ask = math.inf, True
    if ask:
        named = over_the_given(bench, current, instead(found.named), enough, stage, named, during)
    return named if named is not None and matters(named) else None


def _matters(
    bench: Bench,
    base: Fit,
    found: Search,
    stage: Stage,
    named: Named,
    left: Residual,
    *,
    beyond: bool = False,
) -> bool:
    """Whether an effect explains enough of what is ``left``, and more than other flanks; sets how much."""
    current = found.fit
    change = left.project(bench.trace(current.predictions, named.fit.predictions))
    seen = {} if found.named or stage.screening is None else stage.screening.seen
    traces = None if found.named else [columns for _, columns in seen.values()]
    if float(change @ change) < of_other_flanks(bench, left.project, traces):
        return False
    named.gain = gain(bench, base, current, named.fit)
    named.of_left = float(np.clip(named.candidates[0].explained, 0.0, 1.0))
    sharp = named.fit.state.added[-1].lives_in[0] == SHARP and stage.location.sharp(LEVEL)
    if found.named and sharp:
        # Lines stand out of what is left, however little they are beside what was missing and what still is.
        named.of_lines = part_of_lines(bench, current, named.fit, stage.location.lines)
        return True
    least = LEAST_SHARE if not found.named else BEYOND_GAIN if beyond else WITHIN_GAIN
    return named.gain >= least
