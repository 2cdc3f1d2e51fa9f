"""What held-out data say of effects, and whether a further one is worth going on with."""

from __future__ import annotations

from collections.abc import Sequence

from hdsim.diagnosis.decide import probability
from hdsim.diagnosis.evidence import Evidence, HeldOutEvidence, LawEvidence
from hdsim.diagnosis.locate import SHARP
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.revise import needed, without
from hdsim.diagnosis.rules import RULES
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.prove import borne_out
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added
from hdsim.estimate.unwound import turned_to_zero

#: Probability of a third or later name below which the search does not go on with it (chosen: a tenth of
#: what a name needs in the end, for its numbers and those of the others are rough yet; of eight pairs of
#: numpy, even seeds 214 to 226, right names have 0.97 and more, of a recorded joint 0.57; wrong ones 0.001 to
#: 0.2, and of that joint a second name that was to be replaced later 0.03: second ones are not asked).
HOPELESS = 0.05


def held_of(bench: Bench, before: Sequence[Array], after: Sequence[Array]) -> HeldOutEvidence:
    """How much of what makes one model another shows in held-out data.

    Args:
        bench: the measured series.
        before: predictions of all series by the one.
        after: likewise by the other.
    """
    slope, spread = borne_out(bench, before, after)
    return HeldOutEvidence(slope=slope, spread=min(spread, 1e6))


def own_held(bench: Bench, less: Fit | None, predictions: Sequence[Array]) -> HeldOutEvidence | None:
    """What held-out data say of one effect of several, against all others fitted without it.

    The numbers of the others are fitted anew: those that were fitted beside it are wrong without it, and
    nearly any effect would mend that.

    Args:
        bench: the measured series.
        less: the model without it; None where it is none.
        predictions: of all series by the model with it.
    """
    if less is None:
        return None
    try:
        without_it = turned_to_zero(bench, less.state)
    except PredictionError:
        return None
    return held_of(bench, without_it, predictions)


def hopeless(bench: Bench, current: Fit, newest: Named) -> bool:
    """Whether the newest of three names or more would not be believed, whatever all explain together.

    Of a name that is not believed in the end nothing stays, and each costs the fits of all that look like it
    and like those before it. What it is judged by is what it is judged by then.

    Args:
        bench: the measured series.
        current: the model with it, the last of its effects.
        newest: the name.
    """
    rest = without(bench, current, len(current.state.added) - 1, made_up=True)
    try:
        held = own_held(bench, rest, turned_to_zero(bench, current.state))
    except PredictionError:
        return False
    if rest is None or held is None:
        return False
    law = law_of(newest, current.state.added[-1], needed(bench, rest, current), held)
    return probability(Evidence(laws=[law, law], explained=1.0), 1, RULES, []) < HOPELESS


def law_of(named: Named, added: Added, part: float, held: HeldOutEvidence | None) -> LawEvidence:
    """The evidence for a name beside others, but for what the last residual says of it.

    Args:
        named: the name.
        added: its effect.
        part: of what would be missing without it, that which it explains.
        held: what held-out data say of it.
    """
    sharp = added.lives_in[0] == SHARP
    return LawEvidence(
        name=named.name,
        chance=named.chance,
        sampled=named.confidence,
        gain=named.gain,
        # Sharp lines are no part of what smooth effects have left.
        needed=max(part, named.of_lines) if sharp else part,
        exact=catalogue()[named.name].signature.exact,
        sharp=sharp,
        held=held,
    )
