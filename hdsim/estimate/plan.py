"""What a model is told of a record, and what it is asked: prescribed motion, load, predicted channels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.records import Record

Locked = Literal["", "motor", "output"]
LoadSource = Literal["scenario", "load_torque", "output_torque"]


@dataclass(frozen=True)
class Plan:
    """What a model is told of a record, and what it is asked.

    Attributes:
        motion: ``motor_angle`` or ``output_angle``: the measured motion that is prescribed.
        load: where the load's torque comes from.
        channels: the channels that are predicted.
        locked: the side that the scenario locks, if any.
    """

    motion: str
    load: LoadSource
    channels: tuple[str, ...]
    locked: Locked = ""


def plan_for(record: Record, *, load: LoadSource | None = None, locked: Locked = "") -> Plan:
    """Decide what is prescribed and what can be predicted.

    Args:
        record: the measured run.
        load: where the load's torque comes from; ``load_torque`` when that is measured, else the scenario.
        locked: the side that the scenario locks, if any.

    Raises:
        InputError: nothing can be predicted; the message names what is missing.
    """
    has = record.readable
    moving = {c for c in has if float(np.ptp(record.filled(c))) > 0}
    if load is None:
        load = "load_torque" if "load_torque" in moving else "scenario"
    if load != "scenario" and load not in has:
        raise InputError(f"{record.name}: the load is to come from {load}, which is not measured")
    if locked and load == "output_torque":
        raise InputError(
            f"{record.name}: the {locked} is locked, so output_torque is what a model predicts and no "
            "load; leave load to the scenario"
        )
    if locked == "motor":
        return _motor_locked(record, moving)
    if "motor_angle" in has:
        motion = "motor_angle"
    elif "output_angle" in has and not locked:
        motion = "output_angle"
    else:
        raise InputError(
            f"{record.name}: a motion is needed, motor_angle or output_angle; found {', '.join(sorted(has))}"
        )
    predicted = [c for c in ("motor_torque", "output_angle", "output_torque") if c in moving]
    if motion == "output_angle" or locked:
        predicted = [c for c in predicted if c != "output_angle"]
    if not predicted:
        raise InputError(
            f"{record.name}: nothing can be predicted from {', '.join(sorted(has))}: with {motion} given, "
            "motor_torque, output_torque or (with motor_angle) output_angle must be measured and vary"
        )
    return Plan(motion, load, tuple(predicted), locked)


def _motor_locked(record: Record, moving: set[str]) -> Plan:
    """A drive that is twisted from its output: the torque follows from the angle."""
    if {"output_angle", "output_torque"} <= moving:
        return Plan("output_angle", "scenario", ("output_torque",), "motor")
    raise InputError(
        f"{record.name}: with the motor locked, output_angle and output_torque are needed and must vary; "
        f"found {', '.join(sorted(moving)) or 'nothing that varies'} (a load that is measured at the output, "
        "without inertia between, may be given as output_torque with its sign reversed)"
    )


def given(record: Record, *, load: LoadSource | None = None, locked: Locked = "") -> tuple[str, ...]:
    """Channels of a record that a model is told (``plan_for``), those that something can be read of.

    Args:
        record: the measured run.
        load: see ``plan_for``.
        locked: the side that the scenario locks, if any.

    Raises:
        InputError: nothing can be predicted.
    """
    plan = plan_for(record, load=load, locked=locked)
    return plan.motion, *(() if plan.load == "scenario" else (plan.load,))
