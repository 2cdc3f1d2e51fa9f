"""How much a search may do before it looks for no further effect, counted so that any machine ends alike."""

from __future__ import annotations

from hdsim.diagnosis.again import BEYOND_GAIN
from hdsim.diagnosis.passes import Search
from hdsim.diagnosis.sensitive import told_of_motion
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.fit import Fit

#: Most effects that one diagnosis adds, and most passes that it makes.
MOST_EFFECTS, MOST_STAGES = 4, 7
#: Passes that every search makes: a first effect, and a second beside it (of 551 truths of blind cases that
#: were named the first two passes have found 546, and none was found after the third).
PASSES = 2
#: Work after which no further pass begins, in integration steps: about a minute of a processor core (chosen:
#: that is asked of a whole diagnosis; with 8 million two of 45 blind pairs were explained less well than with
#: 16, and 60 pairs as well with 16 as with 22, which take a minute since right-hand sides became cheaper).
MOST_WORK = 22e6
#: Samples worked on in the time of a step (0.6 and 2.4 microseconds add up to the time of a long diagnosis).
SAMPLES_A_STEP = 4.0


def work_of(bench: Bench) -> float:
    """What all predictions have taken so far, in integration steps of a model."""
    return sum(
        sum(one.steps) + len(one.steps) * len(one.record.time) / SAMPLES_A_STEP for one in bench.predictors
    )


def enough_done(bench: Bench, passes: int) -> bool:
    """Whether a search ends after so many passes although another effect may be there."""
    return passes >= PASSES and work_of(bench) > MOST_WORK


def told_of_end(bench: Bench, found: Search) -> list[Problem]:
    """The warnings of a search that has ended so, or because the model answers to its motion's noise."""
    if found.sensitive:
        return [told_of_motion(bench)]
    if not found.ended:
        return []
    passes = len(found.stages) - 1
    message = (
        f"the search has ended after {passes} passes: the predictions had taken {work_of(bench) / 1e6:.0f} "
        f"million integration steps, more than {MOST_WORK / 1e6:.0f}. What a further effect would explain is "
        "in the residual; `--thorough` goes on"
    )
    return [Problem(bench.predictors[0].record.name, "model", "search", "warning", message)]


def more_could(bench: Bench, base: Fit, now: Fit) -> bool:
    """Whether more than noise is left in some channel, enough for one more effect to matter."""
    first, last = (bench.channel_powers(each.predictions) for each in (base, now))
    noise = bench.noise_powers
    return any(last[c] - noise[c] >= BEYOND_GAIN * (first[c] - noise[c]) for c in first)
