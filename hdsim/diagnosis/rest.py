"""A shaft at rest that shows once an effect is named.

Behind what is missing, the torque that holds a shaft at rest is missed no more than the others, and a re-fit
does not look for it (``hdsim.estimate.standstill``); beside the effect that was found it would be taken for
the next one, a friction that remembers. So each time that effects were found it is asked once more.
"""

from __future__ import annotations

from functools import partial

from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.refit import at_its_end, together
from hdsim.estimate.standstill import has_a_sign, hear_standstill, leave_out_rest


def hear_rest(bench: Bench, found: Fit) -> bool:
    """Take the sign of friction sharper, or leave rests out, where that is clearly likelier now.

    Args:
        bench: the measured series, weighed; predictors and masks are changed where that is so.
        found: the model with the effects that were found.

    Returns:
        Whether anything was changed.
    """
    if not has_a_sign(found.state):
        return leave_out_rest(bench, found)
    later = hear_standstill(
        bench,
        found.state,
        found.predictions,
        found,
        lambda: together(bench, found, rough=True),
        partial(at_its_end, bench),
    )
    return later is not found
