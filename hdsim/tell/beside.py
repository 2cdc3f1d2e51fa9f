"""What is said beside a verdict: regressions on the held-out data, and parameters that effects have moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from hdsim.estimate.found import Gap
from hdsim.tell.wording import changed
from hdsim.tell.words import short, spoken, standard_errors, unit_of

if TYPE_CHECKING:
    from hdsim.diagnosis.verdict import Verdict

#: Standard errors from which a parameter is said to have moved beside an effect: of 20 parameters one is that
#: far off by chance in one record of twenty (two-sided, normal).
FAR = 3.0


def also_moved(verdict: Verdict) -> str:
    """Parameters of the model that have changed beside the identified effects, as a sentence."""
    if verdict.verdict != "effect":
        return ""
    numbers = verdict.moved_parameters.items()
    said = [changed(name, number) for name, number in numbers if standard_errors(number) >= FAR]
    return f"Beside that the fit has changed: {', '.join(said)}." if said else ""


def last_model(verdict: Verdict) -> str:
    """What the model of ``after`` is called."""
    if verdict.verdict == "effect":
        return "the model with the identified effects"
    return "the model with the curve" if verdict.curve is not None else "the fitted model"


def baselines(gaps: Mapping[str, Gap], model: str = "the fitted model") -> list[str]:
    """A sentence for each channel with a baseline.

    Args:
        gaps: by channel.
        model: what the model of ``after`` is called.
    """
    said = []
    for channel, gap in gaps.items():
        if gap.regression is None:
            continue
        unit = unit_of(gap)
        regression, after, noise = (short(unit.factor * v) for v in (gap.regression, gap.after, gap.noise))
        box = "" if gap.black_box is None else f", gradient boosting {short(unit.factor * gap.black_box)}"
        turns = ""
        if gap.repeats is not None:
            turns = f"; {100 * gap.repeats:.0f} % of the final residual's power repeats from turn to turn"
        said.append(
            f"{spoken(channel)}: linear regression {regression} {unit.name}{box}, {model} {after}, "
            f"noise {noise}{turns}"
        )
    return said
