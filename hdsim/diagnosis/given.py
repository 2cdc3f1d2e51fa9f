"""An effect that is named over the base's numbers as given, where none over the fitted base is enough.

A fit may bend the base far to stand in for a part of what is missing, and what is left then is no trace of it
any more. What is named over the numbers as given is taken where it is likelier.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from hdsim.diagnosis.again import Step, left_of
from hdsim.diagnosis.name import Named, name_effect
from hdsim.diagnosis.point import as_given
from hdsim.diagnosis.screen import LEVEL
from hdsim.diagnosis.traces import Screening, screen
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, strain
from hdsim.estimate.orders import lines_of
from hdsim.estimate.refit import REACHED, unlikelihood
from hdsim.estimate.standstill import CLEARLY

if TYPE_CHECKING:
    from hdsim.diagnosis.passes import Stage

#: Squared prior spreads by which a base may be bent without another explanation being clearly likelier.
AT_STAKE = 2.0 * CLEARLY


def is_all(bench: Bench, found: Fit) -> bool:
    """Whether a fit has reached the noise without bending the base: then nothing is clearly likelier."""
    reached = bench.power(found.predictions) <= REACHED * bench.noise_power
    return bool(reached and strain(found) <= AT_STAKE)


def over_the_given(
    bench: Bench,
    current: Fit,
    beaten: frozenset[str],
    enough: float,
    stage: Stage,
    named: Named | None,
    during: Callable[[str, str], Step],
) -> Named | None:
    """The next effect, or the one that is named over the base's numbers as given where that is likelier.

    A fit may bend the base far to stand in for a part of what is missing, and what is left then is no trace
    of it any more.
    """
    if stage.over_given is None:
        stage.over_given = list(_named_over_the_given(bench, current, beaten, enough, during))
    for other, screening in stage.over_given:
        if named is None or unlikelihood(bench, other.fit, other.fit) < unlikelihood(
            bench, named.fit, other.fit
        ):
            stage.screening = screening
            return other
    return named


def _named_over_the_given(
    bench: Bench, current: Fit, beaten: frozenset[str], enough: float, during: Callable[[str, str], Step]
) -> Iterator[tuple[Named, Screening]]:
    """What is named over the base's numbers as given, if they have been bent and anything is."""
    given = as_given(bench, current)
    if given is None:
        return
    left = left_of(bench, given)
    lines = lines_of(bench, bench.residuals(given.predictions, drift=True), given.state.delays)
    tell = during("screen", "screening the catalogue over the model as given")
    screening = screen(bench, given.state, left, lines, leave_out=beaten, on_step=tell)
    if not screening.ranked or screening.chance > LEVEL:
        return
    if (1.0 - screening.ranked[0].share.share) * left.power > enough:
        return
    tell = during("fit", "fitting the shortlist from the model as given")
    named = name_effect(bench, given, screening, left, on_step=tell, alone=current)
    if named is not None:
        yield named, screening
