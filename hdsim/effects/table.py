"""Torques or angles tabulated over a coordinate: for what has a measured curve but no name."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from hdsim.effects._fitting import Fitting
from hdsim.effects._table_kernels import tabulated_angle, tabulated_torque
from hdsim.kernel import (
    MOTOR_ANGLE,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    OUTPUT_ANGLE,
    OUTPUT_TORQUE,
    OUTPUT_VELOCITY,
    TIME,
    TRANSMITTED_TORQUE,
    TWIST,
    TWIST_RATE,
    TWIST_TORQUE,
)
from hdsim.parts import Builder, Effect, Parameters, Signature

Coordinate = Literal[
    "motor_angle", "motor_velocity", "output_angle", "output_velocity", "transmitted_torque", "twist", "time"
]
Acting = Literal["motor_torque", "output_torque", "twist_torque", "mesh_angle"]

#: Where the power of a tabulated torque is booked: as stored energy; as heat where it brakes and supplied
#: where it drives; as supplied by a source; as delivered to the outside.
_STORE, _BRAKE, _SOURCE, _OUTSIDE = 0.0, 1.0, 2.0, 3.0

_COLUMNS: dict[Coordinate, int] = {
    "motor_angle": MOTOR_ANGLE,
    "motor_velocity": MOTOR_VELOCITY,
    "output_angle": OUTPUT_ANGLE,
    "output_velocity": OUTPUT_VELOCITY,
    "transmitted_torque": TRANSMITTED_TORQUE,
    "twist": TWIST,
    "time": TIME,
}
_ROWS: dict[Acting, tuple[int, int]] = {
    "motor_torque": (MOTOR_TORQUE, MOTOR_VELOCITY),
    "output_torque": (OUTPUT_TORQUE, OUTPUT_VELOCITY),
    "twist_torque": (TWIST_TORQUE, TWIST_RATE),
}
#: Units of the coordinates, for messages and labels.
COORDINATE_UNITS: dict[Coordinate, str] = {
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "output_angle": "rad",
    "output_velocity": "rad/s",
    "transmitted_torque": "N m",
    "twist": "rad",
    "time": "s",
}


def cells(
    at: tuple[float, ...], values: tuple[float, ...], period: float | None
) -> tuple[list[float], list[float]]:
    """Edges and each cell's numbers (c0, c1, c2, c3, integral up to it) of the curve through the corners.

    A cubic Hermite curve whose slope at a corner is that of the parabola through it and its neighbours (de
    Boor 2001, A Practical Guide to Splines, ch. IV: piecewise cubic Bessel interpolation): continuously
    differentiable, and linear in the values, so that curves add. Beyond its ends it levels off within one
    more cell; with a period it closes.

    Args:
        at: corners, increasing.
        values: at the corners.
        period: None for a curve that does not repeat.
    """
    x, y = list(at), list(values)
    if period is not None:
        x = [at[-1] - period, *at, at[0] + period, at[1] + period]
        y = [values[-1], *values, values[0], values[1]]
    width = [b - a for a, b in pairwise(x)]
    secant = [(b - a) / h for (a, b), h in zip(pairwise(y), width, strict=True)]
    inner = [
        (width[k - 1] * secant[k] + width[k] * secant[k - 1]) / (width[k - 1] + width[k])
        for k in range(1, len(width))
    ]
    if period is not None:
        x, y, width, secant, slopes = x[1:-1], y[1:-1], width[1:-1], secant[1:-1], inner
    elif not inner:
        slopes = [secant[0], secant[0]]
    else:
        slopes = [2.0 * secant[0] - inner[0], *inner, 2.0 * secant[-1] - inner[-1]]
    if period is None:
        first, last = width[0], width[-1]
        x = [x[0] - first, *x, x[-1] + last]
        y = [y[0] - 0.5 * slopes[0] * first, *y, y[-1] + 0.5 * slopes[-1] * last]
        slopes = [0.0, *slopes, 0.0]
    numbers: list[float] = []
    area = 0.0
    for k in range(len(x) - 1):
        h = x[k + 1] - x[k]
        mean = (y[k + 1] - y[k]) / h
        c2 = (3.0 * mean - 2.0 * slopes[k] - slopes[k + 1]) / h
        c3 = (slopes[k] + slopes[k + 1] - 2.0 * mean) / (h * h)
        numbers += [y[k], slopes[k], c2, c3, area]
        area += h * (y[k] + h * (slopes[k] / 2.0 + h * (c2 / 3.0 + h * c3 / 4.0)))
    return x, numbers


class TableCurve(Parameters):
    """One tabulated curve."""

    coordinate: Coordinate
    """What the curve is a function of; ``transmitted_torque`` is the drive's torque on the output,
    ``twist`` that of its torsion spring."""
    acts_on: Acting
    """What the values are: a torque on the motor, on the output, or on the torsion spring's twist (a spring
    has values of the sign opposite to the twist), or an angle at the output in the mesh, as a kinematic
    error is (over one of the two angles only)."""
    at: tuple[float, ...] = Field(min_length=2, max_length=400)
    """Corners in the coordinate's SI unit (rad, rad/s, N m, s), increasing."""
    values_nm: tuple[float, ...] | None = None
    """Torque at each corner, N m; for the torques."""
    values_rad: tuple[float, ...] | None = None
    """Angle at each corner, rad at the output; for ``mesh_angle``."""
    period: float | None = Field(None, gt=0)
    """Length after which the curve repeats, in the coordinate's unit (2 pi: one turn); for the two angles.
    The corners lie within one period, the last one not on the first one's repetition."""
    times_direction: bool = False
    """Whether the values are multiplied by the smoothed sign of the velocity, as of a friction: a torque that
    brakes in both directions has negative values."""
    smoothing_velocity_rad_per_s: float = Field(0.5, gt=0)
    """Motor speed w_s over which that sign is smoothed, rad/s."""

    @model_validator(mode="after")
    def _consistent(self) -> TableCurve:
        angle = self.acts_on == "mesh_angle"
        wanted, other = ("values_rad", "values_nm") if angle else ("values_nm", "values_rad")
        values = getattr(self, wanted)
        if values is None or getattr(self, other) is not None:
            raise ValueError(f"{self.acts_on} takes {wanted}, and no {other}")
        if len(values) != len(self.at):
            raise ValueError(
                f"{wanted} has {len(values)} numbers, at has {len(self.at)}; one for each corner"
            )
        if any(b <= a for a, b in pairwise(self.at)):
            raise ValueError("at must increase from corner to corner")
        turning = self.coordinate in ("motor_angle", "output_angle")
        if angle and not turning:
            raise ValueError("mesh_angle is a function of motor_angle or output_angle")
        if angle and self.times_direction:
            raise ValueError("times_direction is for torques")
        if self.period is not None:
            if not turning:
                raise ValueError("a period is for motor_angle and output_angle")
            if self.at[-1] - self.at[0] >= self.period or len(self.at) < 3:
                raise ValueError("a periodic curve has at least 3 corners within one period")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The values, N m or rad."""
        return self.values_nm or self.values_rad or ()

    def delayed(self, seconds: float) -> TableCurve:
        """The curve for a model whose time began ``seconds`` earlier."""
        if self.coordinate != "time":
            return self
        return self.model_copy(update={"at": tuple(t + seconds for t in self.at)})

    def contribute(self, build: Builder) -> None:
        """Add the curve."""
        edges, numbers = cells(self.at, self.values, self.period)
        tail = [self.period or 0.0, float(len(edges) - 1), *edges, *numbers]
        if self.acts_on == "mesh_angle":
            build.twist(tabulated_angle, [float(self.coordinate == "output_angle"), *tail])
            return
        row, speed = _ROWS[self.acts_on]
        smoothing = 0.0
        if self.times_direction:
            smoothing = self.smoothing_velocity_rad_per_s
            smoothing *= 1.0 if row == MOTOR_TORQUE else 1.0 / abs(build.ratio)
        column = _COLUMNS[self.coordinate]
        if self.times_direction or self.coordinate in ("motor_velocity", "output_velocity"):
            booking = _BRAKE
        elif column == speed - 1:
            booking = _STORE
        else:
            booking = _OUTSIDE if row == OUTPUT_TORQUE else _SOURCE
        build.element(tabulated_torque, [float(row), float(column), float(speed), smoothing, booking, *tail])


class Table(Effect):
    """T = f(x) on a body, or e = f(x) in the mesh: curves through given corners over a coordinate x.

    Between the corners the curve is a continuously differentiable cubic, linear in the values; beyond the
    ends it levels off within the width of the last cell. A torque over its own body's angle (or over the
    twist, for ``twist_torque``) is conservative: its potential is stored. One over a velocity, or with
    ``times_direction``, is heat where it brakes and supplied where it drives. Any other is work of a source:
    supplied on the motor's side, exchanged with the outside on the output's. An angle changes the kinematics;
    its reaction torques follow as those of the kinematic error.
    """

    title: ClassVar[str] = "tabulated curve"
    source: ClassVar[str] = (
        "none: an unidentified effect as a curve; interpolation: de Boor 2001, A Practical Guide to Splines, "
        "ch. IV; the default, the pull of a cable loop, is an estimate"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("output_angle", "velocity", "torque", "wave_generator_angle", "direction", "time"),
        channels=("motor_torque", "output_torque", "output_angle"),
    )
    #: A curve is no explanation: it takes no part in naming, and is fitted apart from the catalogue.
    fittings: ClassVar[tuple[Fitting, ...]] = ()

    curves: tuple[TableCurve, ...] = Field(
        (
            TableCurve(
                coordinate="output_angle",
                acts_on="output_torque",
                at=(-1.5, 0, 1.5),
                values_nm=(0.5, 0, -0.5),
            ),
        ),
        min_length=1,
    )
    """The curves; they add."""

    def delayed(self, seconds: float) -> Table:
        """The effect for a model whose time began ``seconds`` earlier."""
        return self.model_copy(update={"curves": tuple(curve.delayed(seconds) for curve in self.curves)})

    def contribute(self, build: Builder) -> None:
        """Add every curve."""
        for curve in self.curves:
            curve.contribute(build)
