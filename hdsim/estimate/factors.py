"""Factors between channels that kinematics or power tie: they tell a wrong unit, sign, side or ratio."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hdsim.estimate.data_problems import Check, Problem, Severity
from hdsim.estimate.records import Array, Record

#: Twist that a drive may have: size 20 at its ratcheting torque, 330 N m over 2.9e4 N m/rad (CSG catalogue).
WIND_UP_RAD = 0.012
#: Input speed beyond which a record is not believed, rev/min: twice the 14000 that the smallest sizes are
#: rated for with oil (Harmonic Drive, CSG/CSF catalogue, rating tables).
FASTEST_RPM = 30000.0
#: What a factor between two numbers that should agree may come from: one of them is ...
_FACTORS = {
    180.0 / math.pi: "in degrees",
    2.0 * math.pi: "in revolutions",
    10800.0 / math.pi: "in arcmin",
    648000.0 / math.pi: "in arcsec",
    1000.0: "wrong by 1000 in its unit (ms for s, mN m for N m, mrad for rad)",
}
_RATES = _FACTORS | {60.0 / (2.0 * math.pi): "in rev/min"}


def slope(x: Array, y: Array) -> tuple[float, float]:
    """Slope of y over x through their means, and the share of y's variation that it explains."""
    x, y = x - x.mean(), y - y.mean()
    power = float(x @ x)
    if power == 0.0 or float(y @ y) == 0.0:
        return math.nan, 0.0
    factor = float(x @ y) / power
    return factor, 1.0 - float(np.sum((y - factor * x) ** 2)) / float(y @ y)


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
    turned = "with its sign reversed" if factor * (ratio if kind == "side" else 1.0) < 0 else ""
    return kind, " ".join(part for part in (text, turned) if part)


def compare_channels(record: Record, ratio: float, found: Check) -> None:
    """Compare channels that are tied by kinematics or by power.

    Args:
        record: the record.
        ratio: the model's signed ratio motor angle / output angle.
        found: what the check has found so far; added to.
    """
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
        wound = abs(factor - 1.0) * float(np.ptp(output))
        if explained > 0.95 and wound > WIND_UP_RAD and (cause := explain(factor, ratio)):
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
