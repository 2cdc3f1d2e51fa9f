"""Step 1, check the data: what is missing, wrong or suspect in a record, with the evidence.

Noise: ``hdsim.estimate.noise``. Spikes and saturation: ``hdsim.estimate.spikes``. Repeated and lost samples:
``hdsim.estimate.clock`` where they are of all channels, else ``hdsim.estimate.slips``. Units, signs and
ratios: ``hdsim.estimate.factors``.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from hdsim.estimate.bridges import GAP
from hdsim.estimate.clock import own_clock
from hdsim.estimate.data_problems import Check, Problem, Severity
from hdsim.estimate.factors import compare_channels
from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import LARGEST, Array, Mask, Record
from hdsim.estimate.slips import MOST, around, find_slips
from hdsim.estimate.spikes import find_spikes, largest_jump, saturated

#: Standard deviations of its noise by which a channel must vary to tell anything.
ALIVE = 1.5
#: Sampling slower than this says little of a drive, Hz.
SLOWEST_HZ = 10.0


def check_records(records: Sequence[Record], ratio: float) -> list[Check]:
    """Check each of a set of records: a torque that stands still in one answers if it differs in others.

    Args:
        records: their ``trusted`` masks are narrowed in place.
        ratio: the model's signed ratio motor angle / output angle.
    """
    levels: dict[str, list[tuple[float, float]]] = {}
    for record in records:
        for channel in record.readable:
            if channel.endswith("torque"):
                values, trusted = record.channels[channel], record.trusted[channel]
                level = float(np.median(values[trusted])), noise_floor(values, trusted)
                levels.setdefault(channel, []).append(level)
    alive = {
        channel
        for channel, found in levels.items()
        if np.ptp([level for level, _ in found]) > ALIVE * max(noise for _, noise in found)
    }
    return [check_record(record, ratio, alive) for record in records]


def check_record(record: Record, ratio: float, alive: Collection[str] = ()) -> Check:
    """Check a record, and take what is not to be trusted out of its masks.

    Args:
        record: the record; its ``trusted`` masks are narrowed in place, and rows that repeat others left out.
        ratio: the model's signed ratio motor angle / output angle.
        alive: torques that differ between this record and others.
    """
    found = Check()
    _clock(record, found)
    for channel, values in record.channels.items():
        _channel(record, channel, values, found)
    _own_clock(record, found)
    _slips(record, found)
    _still(record, found, alive)
    compare_channels(record, ratio, found)
    return found


def _clock(record: Record, found: Check) -> None:
    steps = np.diff(record.time)
    period = record.period_s
    gaps = steps > GAP * period
    if gaps.any():
        where = ", ".join(f"{t:.3g} s" for t in record.time[:-1][gaps][:3])
        message = (
            f"{int(gaps.sum())} gaps longer than {GAP:g} samples, the longest {steps.max():.3g} s ({where})"
        )
        found.problems.append(Problem(record.name, "time", "gap", "warning", message, int(gaps.sum())))
    if period > 1.0 / SLOWEST_HZ:
        message = (
            f"one sample every {period:.3g} s over {record.duration_s:.4g} s: slower than {SLOWEST_HZ:g} Hz, "
            "friction and ripple average out. Is the unit of time right (ms for s)?"
        )
        found.problems.append(Problem(record.name, "time", "clock", "error", message))
    jitter = float(np.median(np.abs(steps[~gaps] - period)) / 0.6745)
    if jitter > 0.05 * period:
        message = f"sampling time {period:.4g} s jitters by {jitter:.2g} s"
        found.problems.append(Problem(record.name, "time", "clock", "info", message))


def _own_clock(record: Record, found: Check) -> None:
    """Take each reading once, for when it was taken, where a log shows a clock of the sensors' own."""
    clock = own_clock(record)
    if clock is None:
        return
    count, kept = int(clock.repeated.sum()), ~clock.repeated
    apart = float(np.ptp(clock.time - record.time[kept]))
    message = (
        f"{count} rows repeat the reading before in every channel, {clock.lost} readings are lost: log "
        f"and sensors have clocks of their own. Repeated rows are left out, and the others get the times at "
        f"which they were taken (by up to {apart:.2g} s to one another)"
    )
    # A controller that was given a reading twice jerks.
    if _masked_around(record, clock.repeated):
        message += "; motor_torque around them is masked"
    found.problems.append(Problem(record.name, "time", "clock", "info", message, count))
    record.keep(kept)
    record.time = clock.time


def _masked_around(record: Record, slips: Mask) -> int:
    """Take the motor's torque around slips out; how many samples that are: 0 where they would be too many."""
    near = around(slips)
    if near.mean() > MOST or "motor_torque" not in record.trusted:
        return 0
    record.trusted["motor_torque"] = record.trusted["motor_torque"] & ~near
    return int(near.sum())


def _channel(record: Record, channel: str, values: Array, found: Check) -> None:
    def add(kind: str, severity: Severity, message: str, count: int = 0) -> None:
        found.problems.append(Problem(record.name, channel, kind, severity, message, count))

    trusted = record.trusted[channel]
    missing = int((~trusted).sum())
    if missing:
        severity: Severity = "error" if missing > 0.5 * len(values) else "warning"
        text = f"{missing} of {len(values)} samples are missing, not a number or beyond {LARGEST:g}"
        add("missing", severity, text, missing)
    good = values[trusted]
    if len(good) < 20:
        if not missing:
            add("dead", "error", f"only {len(good)} valid samples")
        return
    if np.ptp(good) == 0.0:
        severity = "info" if channel in ("load_torque", "temperature") else "warning"
        add("dead", severity, f"constant at {good[0]:.6g}: a dead channel, or nothing moved")
        found.noise[channel] = 0.0
        return
    spikes = find_spikes(values, trusted)
    if spikes.any():
        share = spikes.mean()
        add(
            "spikes",
            "warning",
            f"{int(spikes.sum())} samples ({100 * share:.2g} %) are spikes of up to "
            f"{largest_jump(values, trusted, spikes):.3g}; masked",
            int(spikes.sum()),
        )
        record.trusted[channel] = trusted = trusted & ~spikes
        good = values[trusted]
    if channel in ("motor_torque", "output_torque"):
        stuck = saturated(values, trusted)
        if stuck.any():
            limits = " and ".join(f"{v:.4g}" for v in np.unique(values[stuck]))
            count = int(stuck.sum())
            severity = "error" if count > 0.5 * len(values) else "warning"
            add(
                "saturated",
                severity,
                f"stays at {limits} for {count} of {len(values)} samples; masked",
                count,
            )
            record.trusted[channel] = trusted = trusted & ~stuck
    found.noise[channel] = noise_floor(values, trusted)


def _slips(record: Record, found: Check) -> None:
    """Take what a log has repeated or lost out of the motor's torque, which accelerates the rotor."""
    for angle in ("motor_angle", "output_angle"):
        rate = record.rate(angle) if angle in record.readable else None
        if rate is None or "motor_torque" not in record.trusted:
            continue
        slips = find_slips(record.time, record.filled(angle), rate[0], record.trusted[angle] & rate[1])
        if not slips.any():
            continue
        count, masked = int(slips.sum()), _masked_around(record, slips)
        message = f"{count} samples are repeated or lost, by what its velocity says of the way between them"
        message += (
            f"; {masked} samples of motor_torque around them are masked"
            if masked
            else "; too many to be left out"
        )
        found.problems.append(Problem(record.name, angle, "slips", "warning", message, count))


def _still(record: Record, found: Check, alive: Collection[str]) -> None:
    """Say so where nothing moves, or nothing that was measured answers the motion."""

    def varies(channel: str) -> bool:
        good = record.trusted[channel]
        values = record.channels[channel][good]
        if len(values) < 20 or np.ptp(values) == 0.0:
            return False
        return channel in alive or float(np.std(values)) > ALIVE * found.noise.get(channel, 0.0)

    motions = ["motor_angle", "output_angle", "load_torque"]
    answers = [
        "motor_torque",
        "output_torque",
        *(["output_angle"] if "motor_angle" in record.channels else []),
    ]
    for group, what in ((motions, "nothing moves"), (answers, "nothing answers the motion")):
        there = [c for c in group if c in record.channels]
        # A group without a channel is for the plan to refuse, and one without samples has been refused.
        if not any(record.trusted[c].sum() > 20 for c in there) or any(map(varies, there)):
            continue
        verb = "does not vary by more than its" if len(there) == 1 else "do not vary by more than their"
        message = f"nothing can be learned: {what}, as {' and '.join(there)} {verb} noise"
        found.problems.append(Problem(record.name, there[0], "dead", "error", message))
        return
