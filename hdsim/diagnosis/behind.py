"""Effects on the load's side of a torque sensor whose reading is the load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.starts import starts
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import RTOL, PredictionError
from hdsim.estimate.state import State

#: Channels in which an effect shows where it acts, and those that tell the drive's stiffness.
CHANGED = "motor_torque", "output_torque", "output_angle"
ASKED = *CHANGED, "twist"
#: Part of each (Hooke's wind-up, the motor's torque) that an effect behind the sensor must do: it does all.
BEHIND = 0.5


def behind_sensor(
    bench: Bench, state: State, name: str, fitting: Fitting, ranges: Mapping[str, float]
) -> bool:
    """Whether an effect acts on the output, in records whose load is what the output's torque sensor reads.

    Such an effect changes the torque that the sensor has measured already, so it cannot be missing there. It
    is a torque that the output does not feel beside the drive's: where all is slow it winds the drive up by
    as much as its spring yields (Hooke), and goes on to the motor. One in the drive turns the output there by
    far more than the torque that moves the output would, or has no torque at the output at all.
    """
    first = bench.predictors[0]
    if first.slow is None:
        return False
    for added in starts(name, fitting, (), ranges)[:1]:
        candidate = state.candidate()
        try:
            # What counts may be small beside the sensors' noise, to which a record's own tolerance is set.
            with first.within(min(first.rtol, RTOL)):
                without = first.predict(candidate, ASKED)
                there = first.predict(replace(state, added=(*state.added, added)).candidate(), ASKED)
        except PredictionError:
            return True
        change = {c: first.slow.of(there[f"true_{c}"] - without[f"true_{c}"]) for c in CHANGED}
        torque, twist = (float(np.std(without[f"true_{c}"])) for c in ("output_torque", "twist"))
        carried = float(np.linalg.norm(change["output_torque"]))
        wound = float(np.linalg.norm(change["output_angle"]))
        motor = float(np.linalg.norm(change["motor_torque"])) * abs(first.ratio)
        # A rigid drive is not wound up, and has no twist.
        return carried * twist >= BEHIND * wound * torque and carried > BEHIND * motor
    return False
