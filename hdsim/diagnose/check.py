"""Step 1, check the data: what is missing, wrong or suspect in a record, with the evidence.

Noise is estimated from fourth differences, which a signal much slower than the sampling leaves near zero:
for white noise of standard deviation s they have the standard deviation s sqrt(70), 70 being the sum of
the squared binomial coefficients (Rice 1984, Annals of Statistics 12:1215, difference-based estimators).
Spikes are found as Hampel's filter does, by the deviation from a running median (Hampel 1974, J. American
Statistical Association 69:383).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from hdsim.diagnose.measured import Array, Mask, Record

Severity = Literal["info", "warning", "error"]

#: Deviations beyond which a sample is a spike, in standard deviations of the noise.
SPIKE_DEVIATIONS = 12.0
#: Samples of the running median.
SPIKE_WINDOW = 11
#: Longest run of samples that still is a spike.
LONGEST_SPIKE = 4
#: Steps of time longer than this many medians are gaps.
GAP = 3.0


@dataclass(frozen=True)
class Problem:
    """Something wrong or suspect.

    Attributes:
        record: name of the record.
        channel: name of the channel, or ``time``.
        kind: gap, missing, spikes, dead, saturated, clock, unit, sign, ratio, side, channel.
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
    _units(record, ratio, found)
    return found


def noise_floor(values: Array, trusted: Mask) -> float:
    """Standard deviation of the white noise on a channel, in its unit (robust; 0 when there is none)."""
    differences = np.diff(np.where(trusted, values, np.nan), 4)
    differences = differences[np.isfinite(differences)]
    if len(differences) < 10:
        return 0.0
    # 0.6745: the median of |x| of a standard normal.
    return float(np.median(np.abs(differences)) / 0.6745 / math.sqrt(70.0))


def _clock(record: Record, found: Check) -> None:
    steps = np.diff(record.time)
    period = record.period_s
    gaps = steps > GAP * period
    if gaps.any():
        where = ", ".join(f"{t:.3g} s" for t in record.time[:-1][gaps][:3])
        found.problems.append(
            Problem(
                record.name,
                "time",
                "gap",
                "warning",
                f"{int(gaps.sum())} gaps longer than {GAP:g} samples, the longest "
                f"{steps.max():.3g} s (at {where})",
                int(gaps.sum()),
            )
        )
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
        add("missing", severity, f"{missing} of {len(values)} samples are missing or not a number", missing)
    good = values[trusted]
    if len(good) < 20:
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
    for extreme, word in ((good.max(), "upper"), (good.min(), "lower")):
        stuck = longest_run(values == extreme)
        if stuck >= 10 and stuck > 0.002 * len(values) and (values == extreme).mean() < 0.9:
            still = channel.endswith("angle") or channel.endswith("velocity")
            if not still:
                add(
                    "saturated",
                    "warning",
                    f"stays at its {word} limit {extreme:.4g} for {stuck} samples",
                    stuck,
                )
    found.noise[channel] = noise_floor(values, trusted)


def find_spikes(values: Array, trusted: Mask) -> Mask:
    """Samples far from the running median, in runs of a few samples at most: shape (n,)."""
    from scipy.ndimage import label, median_filter

    filled = np.interp(np.arange(len(values)), np.flatnonzero(trusted), values[trusted])
    middle = median_filter(filled, SPIKE_WINDOW, mode="nearest")
    deviation = np.abs(filled - middle)
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


#: What a factor between two channels that should agree may come from.
_FACTORS = {
    180.0 / math.pi: "one of them is in degrees",
    2.0 * math.pi: "one of them is in revolutions",
    60.0 / (2.0 * math.pi): "one of them is in rev/min",
    1000.0: "a factor of 1000 in a unit (ms for s, mN m for N m)",
}


def explain(factor: float, ratio: float) -> tuple[str, str] | None:
    """Kind and likely cause of a factor that should be 1, or None when it is within 2 %."""
    if abs(factor - 1.0) < 0.02:
        return None
    sign = "and the sign is turned" if factor < 0 else ""
    size = abs(factor)
    if abs(size - 1.0) < 0.02:
        return "sign", "the sign of one of them is turned"
    causes = [("unit", value, text) for value, text in _FACTORS.items()]
    causes.append(("side", abs(ratio), "one of them is on the other side of the gear"))
    for kind, value, text in causes:
        for candidate in (value, 1.0 / value):
            if abs(size / candidate - 1.0) < 0.02:
                return kind, f"{text} {sign}".strip()
    return "ratio", f"the drive's ratio is another one, or a unit is wrong {sign}".strip()


def _units(record: Record, ratio: float, found: Check) -> None:
    """Compare channels that are tied by kinematics or by power."""

    def moved(channel: str) -> bool:
        return channel in record.channels and float(np.ptp(record.filled(channel))) > 0

    def suspect(channel: str, factor: float, cause: tuple[str, str], expected: str) -> None:
        message = f"is {factor:.4g} times {expected}: {cause[1]}"
        found.problems.append(Problem(record.name, channel, cause[0], "error", message))

    usable = {c for c in record.channels if record.trusted[c].sum() > 20}
    if {"motor_angle", "output_angle"} <= usable and moved("motor_angle") and moved("output_angle"):
        motor, output = record.filled("motor_angle"), record.filled("output_angle")
        factor, explained = slope(motor / ratio, output)
        # A drive that only winds up (output locked) says nothing about the ratio.
        if explained > 0.95 and (cause := explain(factor, ratio)):
            suspect("output_angle", factor, cause, f"motor_angle / {ratio:g}")
    for side in ("motor", "output"):
        angle, velocity = f"{side}_angle", f"{side}_velocity"
        if {angle, velocity} <= usable and moved(angle) and moved(velocity):
            travelled = np.concatenate(
                [[0.0], np.cumsum(np.diff(record.time) * _midpoints(record.filled(velocity)))]
            )
            factor, explained = slope(record.filled(angle), travelled)
            if explained > 0.95 and (cause := explain(factor, ratio)):
                suspect(velocity, factor, cause, f"the rate of {angle}")
    if {"motor_torque", "output_torque"} <= usable and moved("motor_torque") and moved("output_torque"):
        factor, explained = slope(record.filled("output_torque") / ratio, record.filled("motor_torque"))
        if explained > 0.5:
            if factor < 0:
                suspect(
                    "motor_torque",
                    factor,
                    ("sign", "the sign of one of them is turned"),
                    "output_torque / ratio",
                )
            elif not 0.2 < factor < 5 and (cause := explain(factor, ratio)):
                suspect("motor_torque", factor, cause, f"output_torque / {ratio:g}")


def _midpoints(values: Array) -> Array:
    return np.asarray(0.5 * (values[1:] + values[:-1]))
