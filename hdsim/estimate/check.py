"""Step 1, check the data: what is missing, wrong or suspect in a record, with the evidence.

Noise: see ``hdsim.estimate.noise``. Spikes are found as Hampel's filter does, by the deviation from a running
median (Hampel 1974, J. American Statistical Association 69:383).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from hdsim.estimate.noise import noise_floor
from hdsim.estimate.records import LARGEST, Array, Mask, Record

Severity = Literal["info", "warning", "error"]

#: Deviations beyond which a sample is a spike, in standard deviations of the noise.
SPIKE_DEVIATIONS = 12.0
#: Samples of the running median.
SPIKE_WINDOW = 11
#: Longest run of samples that still is a spike.
LONGEST_SPIKE = 4
#: Steps of time longer than this many medians are gaps; from this many seconds on nobody knows the motion.
GAP, LONGEST_GAP_S = 3.0, 1.0
#: Sampling slower than this says little of a drive, Hz.
SLOWEST_HZ = 10.0
#: Input speed beyond which a record is not believed, rev/min: twice the 14000 that the smallest sizes are
#: rated for with oil (Harmonic Drive, CSG/CSF catalogue, rating tables).
FASTEST_RPM = 30000.0


@dataclass(frozen=True)
class Problem:
    """Something wrong or suspect.

    Attributes:
        record: name of the record.
        channel: name of the channel, or ``time``.
        kind: gap, missing, spikes, dead, saturated, clock, unit, sign, ratio, side, drive.
        severity: an ``error`` stops a diagnosis.
        message: what was found, with the numbers that say so.
        count: samples concerned.
    """

    record: str
    channel: str
    kind: str
    severity: Severity
    message: str
    count: int = 0


@dataclass
class Check:
    """What a check found: problems, and the noise floor of each channel in its unit."""

    problems: list[Problem] = field(default_factory=list)
    noise: dict[str, float] = field(default_factory=dict)

    @property
    def errors(self) -> list[Problem]:
        """The problems that stop a diagnosis."""
        return [problem for problem in self.problems if problem.severity == "error"]


def check_record(record: Record, ratio: float) -> Check:
    """Check a record, and take what is not to be trusted out of its masks.

    Args:
        record: the record; its ``trusted`` masks are narrowed in place.
        ratio: the model's signed ratio motor angle / output angle.
    """
    found = Check()
    _clock(record, found)
    for channel, values in record.channels.items():
        _channel(record, channel, values, found)
    _still(record, found)
    _units(record, ratio, found)
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
        severity: Severity = "warning"
        if steps.max() > LONGEST_GAP_S:
            severity = "error"
            message += (
                f"; nothing tells the motion across more than {LONGEST_GAP_S:g} s: cut the recording there"
            )
        found.problems.append(Problem(record.name, "time", "gap", severity, message, int(gaps.sum())))
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
            f"{_largest_jump(values, trusted, spikes):.3g}; masked",
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


def _still(record: Record, found: Check) -> None:
    """Say so where nothing moves, or nothing that was measured answers the motion."""

    def varies(channel: str) -> bool:
        good = record.trusted[channel]
        values = record.channels[channel][good]
        if len(values) < 20 or np.ptp(values) == 0.0:
            return False
        return float(np.std(values)) > 1.5 * found.noise.get(channel, 0.0)

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


def saturated(values: Array, trusted: Mask) -> Mask:
    """Samples at the highest or lowest number of a channel that stays there for a while, shape (n,)."""
    found = np.zeros(len(values), dtype=bool)
    for extreme in (values[trusted].max(), values[trusted].min()):
        there = values == extreme
        run = longest_run(there)
        if run >= 10 and run > 0.002 * len(values) and there.mean() < 0.9:
            found |= there
    return found


def find_spikes(values: Array, trusted: Mask) -> Mask:
    """Samples far from the running median, in runs of a few samples at most: shape (n,)."""
    from scipy.ndimage import label, median_filter

    filled = np.interp(np.arange(len(values)), np.flatnonzero(trusted), values[trusted])
    # Along the local slope, or a spike on a ramp would shift the median for its neighbours.
    slope = median_filter(np.gradient(filled), SPIKE_WINDOW, mode="nearest")
    reach = SPIKE_WINDOW // 2
    padded = np.pad(filled, reach, mode="edge")
    shifted = [padded[reach + k : reach + k + len(filled)] - k * slope for k in range(-reach, reach + 1)]
    deviation = np.abs(filled - np.median(shifted, axis=0))
    # The local scale keeps the corners of a fast motion from being taken for spikes.
    local = median_filter(deviation, 5 * SPIKE_WINDOW, mode="nearest") / 0.6745
    scale = np.maximum(local, noise_floor(values, trusted))
    scale = np.maximum(scale, 1e-9 * np.ptp(values[trusted]))
    spikes = (deviation > SPIKE_DEVIATIONS * scale) & trusted
    runs, count = label(spikes)
    for k in range(1, count + 1):
        where = np.flatnonzero(runs == k)
        first, last = where[0], where[-1]
        before, after = (
            filled[max(0, first - SPIKE_WINDOW // 2) : first],
            filled[last + 1 :][: SPIKE_WINDOW // 2],
        )
        around = np.concatenate([before, after])
        # A spike leaves the range of its neighbours and comes back; a step or a corner does not.
        beyond = np.maximum(filled[where] - around.max(), around.min() - filled[where])
        least = max(0.5 * SPIKE_DEVIATIONS * float(scale[where].min()), float(np.ptp(around)))
        if len(where) > LONGEST_SPIKE or beyond.max() < least:
            spikes[where] = False
    return np.asarray(spikes)


def _largest_jump(values: Array, trusted: Mask, spikes: Mask) -> float:
    rest = trusted & ~spikes
    around = np.interp(np.flatnonzero(spikes), np.flatnonzero(rest), values[rest])
    return float(np.max(np.abs(values[spikes] - around)))


def longest_run(flags: Mask) -> int:
    """Length of the longest run of true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


def slope(x: Array, y: Array) -> tuple[float, float]:
    """Slope of y over x through their means, and the share of y's variation that it explains."""
    x, y = x - x.mean(), y - y.mean()
    power = float(x @ x)
    if power == 0.0 or float(y @ y) == 0.0:
        return math.nan, 0.0
    factor = float(x @ y) / power
    return factor, 1.0 - float(np.sum((y - factor * x) ** 2)) / float(y @ y)


#: What a factor between two numbers that should agree may come from: one of them is ...
_FACTORS = {
    180.0 / math.pi: "in degrees",
    2.0 * math.pi: "in revolutions",
    10800.0 / math.pi: "in arcmin",
    648000.0 / math.pi: "in arcsec",
    1000.0: "off by 1000 in its unit (ms for s, mN m for N m, mrad for rad)",
}
_RATES = _FACTORS | {60.0 / (2.0 * math.pi): "in rev/min"}


def explain(
    factor: float, ratio: float, within: float = 0.02, factors: Mapping[float, str] = _FACTORS
) -> tuple[str, str] | None:
    """Kind and likely cause of a factor that should be 1, or None when it is.

    Args:
        factor: what was found.
        ratio: the model's signed ratio.
        within: relative distance at which two factors count as the same.
        factors: what a factor may come from.

    Returns:
        The kind of a problem, and how a sentence ends that begins with "one of them is".
    """
    reach = math.log1p(within)

    def away(value: float) -> float:
        return abs(math.log(abs(factor / value)))

    if factor > 0 and away(1.0) < reach:
        return None
    causes = [("sign", -1.0, "")]
    for value, text in factors.items():
        causes += [("unit", sign * v, text) for v in (value, 1.0 / value) for sign in (1.0, -1.0)]
    # A torque or an angle that is given at the other side carries the ratio's sign.
    side = "at the other side of the gear"
    causes += [("side", v, side) for r in (ratio, -ratio) for v in (r, 1.0 / r)]
    same = [cause for cause in causes if cause[1] * factor > 0]
    kind, value, text = min(same, key=lambda cause: away(cause[1]))
    if away(value) >= reach:
        kind, text = "ratio", "of another drive, or in a wrong unit"
    turned = "with its sign turned" if factor * (ratio if kind == "side" else 1.0) < 0 else ""
    return kind, " ".join(part for part in (text, turned) if part)


def _units(record: Record, ratio: float, found: Check) -> None:
    """Compare channels that are tied by kinematics or by power."""
    usable = {c for c, good in record.trusted.items() if good.sum() > 20}
    moved = {c for c in usable if float(np.ptp(record.filled(c))) > 0}

    def suspect(
        channel: str, factor: float, cause: tuple[str, str], expected: str, severity: Severity = "error"
    ) -> None:
        message = f"is {factor:.4g} times {expected}: one of them is {cause[1]}"
        found.problems.append(Problem(record.name, channel, cause[0], severity, message))

    if record.ratio is not None and abs(record.ratio / ratio - 1.0) > 0.01:
        message = f"its mapping has the ratio {record.ratio:g}, the model {ratio:g}: another drive, or sign"
        found.problems.append(Problem(record.name, "ratio", "ratio", "error", message))
    if {"motor_angle", "output_angle"} <= moved:
        motor, output = record.filled("motor_angle"), record.filled("output_angle")
        factor, explained = slope(motor / ratio, output)
        # A drive that only winds up (output locked) says nothing about the ratio.
        if explained > 0.95 and (cause := explain(factor, ratio)):
            measured = f" (motor over output angle is {ratio / factor:.4g}, the model's ratio {ratio:g})"
            suspect("output_angle", factor, cause, f"motor_angle / {ratio:g}{measured}")
    for side, other, gear in (("motor", "output", ratio), ("output", "motor", 1.0 / ratio)):
        velocity, angle = f"{side}_velocity", f"{side}_angle"
        if angle in moved:
            gear = 1.0
        else:
            angle = f"{other}_angle"
        if {angle, velocity} <= moved:
            travelled = np.concatenate(
                [[0.0], np.cumsum(np.diff(record.time) * _midpoints(record.filled(velocity)))]
            )
            factor, explained = slope(gear * record.filled(angle), travelled)
            if explained > 0.95 and (cause := explain(factor, ratio, factors=_RATES)):
                suspect(
                    velocity, factor, cause, f"the rate of {angle}" + (f" x {gear:g}" if gear != 1 else "")
                )
    if {"motor_torque", "output_torque"} <= moved:
        factor, explained = slope(record.filled("output_torque") / ratio, record.filled("motor_torque"))
        # Friction and the motor's own inertia stand between the two: a gross factor only raises a suspicion,
        # which the model will tell more of.
        if explained > 0.5 and not 0.2 < factor < 5:
            cause = explain(factor, ratio, 0.3) or ("unit", "in a wrong unit")
            severity: Severity = "error" if factor < 0 else "warning"
            suspect("motor_torque", factor, cause, f"output_torque / {ratio:g}", severity)
    if found.errors:
        return
    for channel, size in (("motor_angle", 1.0), ("output_angle", abs(ratio))):
        speed = size * fastest(record, channel) * 30.0 / math.pi if channel in moved else 0.0
        if speed > FASTEST_RPM:
            message = (
                f"its motion makes the motor run at {speed:.3g} rev/min; strain wave gears are rated up to "
                f"14000, {FASTEST_RPM:g} is the most that is believed: a wrong unit, side or clock"
            )
            found.problems.append(Problem(record.name, channel, "unit", "error", message))


def fastest(record: Record, channel: str) -> float:
    """Speed of an angle that is exceeded 1 % of the time, rad/s, from its travel over 20 ms."""
    values = record.filled(channel)
    reach = min(max(1, round(0.02 / record.period_s)), len(values) - 1)
    rates = np.abs(values[reach:] - values[:-reach]) / (record.time[reach:] - record.time[:-reach])
    return float(np.quantile(rates, 0.99))


def _midpoints(values: Array) -> Array:
    return np.asarray(0.5 * (values[1:] + values[:-1]))
