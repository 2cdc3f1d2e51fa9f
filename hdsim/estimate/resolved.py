"""Whether the measured motion resolves the resonance that tells the damping.

Of a sine of frequency f the cubic spline through samples, or knots, that are h apart keeps the part
sinc(f h)^4 / sum_k sinc(f h - k)^4 (M. Unser 1999, *Splines: a perfect fit for signal and image processing*,
IEEE Signal Processing Magazine 16(6):22). What it loses at the resonance of the load on the drive's spring
drives the model no more, and a fit makes up for that by damping: 13.1 for 5.1 N m s/rad with 2.5 knots a
period, 9.4 with 3.1, 5.2 with 6.0 (seed drive, a chirp).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.numbers import Interval
from hdsim.estimate.predict import Predictor
from hdsim.estimate.state import State

DAMPING = "drive.torsion.damping_nm_s_per_rad"
#: Part of what damping does at resonance, twice its ratio, that the motion may lose there (chosen: an
#: interval of a damping is seldom narrower; on that chirp it lies between 3.1 and 6.0 knots a period).
SMALL = 0.1
#: Neighbouring spectra that alias.
ALIASES = np.arange(-8, 9)


def lost(cycles: float) -> float:
    """Part of a sine that a cubic spline loses, of ``cycles`` periods a knot; all of it from a half on."""
    if cycles >= 0.5:
        return 1.0
    each = np.sinc(cycles - ALIASES) ** 4
    return float(1.0 - np.sinc(cycles) ** 4 / each.sum())


def told_of_damping(
    bench: Bench, state: State, intervals: Sequence[Interval]
) -> tuple[list[Interval], list[Problem]]:
    """The intervals, that of a damping undetermined where a motion does not resolve what would tell it.

    Args:
        bench: the measured series.
        state: the fitted model.
        intervals: its numbers.

    Returns:
        All intervals, the damping's not ``resolved`` where it was taken back, and then a warning.
    """
    one = next((i for i in intervals if i.name == DAMPING and i.determined and i.start > 0.0), None)
    torsion, inertia = state.drive.torsion, state.load.inertia_kg_m2
    own = [p for p in bench.predictors[: bench.training] if _is_driven(p)]
    if one is None or not own or inertia <= 0.0:
        return list(intervals), []
    stiffness = torsion.stiffness_k1_nm_per_rad
    ratio = 0.5 * min(one.start, one.value) / math.sqrt(stiffness * inertia)
    hertz = math.sqrt(stiffness / inertia) / (2.0 * math.pi)
    knot_s, record = max((p.samples_a_knot * p.record.period_s, p.record.name) for p in own)
    part = lost(hertz * knot_s)
    if part <= SMALL * 2.0 * ratio:
        return list(intervals), []
    message = (
        f"the load's resonance near {hertz:.3g} Hz is {1.0 / (hertz * knot_s):.2g} knots of the measured "
        f"motion a period, which lose {100.0 * part:.0f} % of it where damping makes {200.0 * ratio:.2g} %: "
        "the fitted torsional damping makes up for that and is not determined; readings at a higher rate, or "
        "with less noise, would tell it"
    )
    unknown = replace(one, low=math.nan, high=math.nan, determined=False, resolved=False)
    return [unknown if i is one else i for i in intervals], [
        Problem(record, "motor_angle", "resonance", "warning", message)
    ]


def _is_driven(predictor: Predictor) -> bool:
    """Whether a record's motor drives a load that is the scenario's."""
    plan = predictor.plan
    return plan.motion == "motor_angle" and not plan.locked and plan.load != "output_torque"
