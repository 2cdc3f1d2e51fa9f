"""The mapping: which columns or topics of a foreign recording are which channels, and in what units."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from hdsim.log.units import ANGLE_UNITS, CURRENT_UNITS, TORQUE_UNITS, TURN, VELOCITY_UNITS
from hdsim.parts import Parameters

Side = Literal["motor", "output"]


class Origin(Parameters):
    """Where numbers are found: a column of a table, or a field of a topic's messages."""

    column: str | int | None = None
    """Column of a table: its name, or its number from 1 (without quotation marks)."""
    topic: str | None = None
    """Topic in an MCAP file or a ROS bag."""
    field: str | None = None
    """Field of the topic's message, such as ``effort``, ``state.position[2]``."""
    joint: str | None = None
    """Joint of a sensor_msgs/JointState message whose ``field`` (position, velocity, effort) is meant."""

    @model_validator(mode="after")
    def _one_place(self) -> Origin:
        if (self.column is None) == (self.topic is None):
            raise ValueError("name either a column (of a table) or a topic (MCAP, ROS)")
        if self.topic is not None and self.field is None and self._needs_field:
            raise ValueError("a topic needs a field, the field of its messages that is meant")
        return self

    _needs_field: ClassVar[bool] = True


class _Channel(Origin):
    """A channel's origin, and how its numbers become SI."""

    si_unit: ClassVar[str]
    sign: Literal[1, -1] = 1
    """-1 where the recording counts in the other direction than the contract."""
    zero: float = 0.0
    """Recorded number that means zero, in the recorded unit."""

    def si(self, raw: Any) -> Any:
        """Recorded numbers in SI units, on the side where they were recorded."""
        return self.sign * (raw - self.zero) * self.factor

    @property
    def factor(self) -> float:
        """SI units in one recorded unit."""
        raise NotImplementedError


class _Sided(_Channel):
    side: Side | None = None
    """Side of the gear to which the numbers refer; the channel's own side when left out."""


class AngleChannel(_Sided):
    """An angle."""

    si_unit: ClassVar[str] = "rad"
    unit: Literal["rad", "mrad", "deg", "arcmin", "arcsec", "rev", "count"]
    """Unit of the recorded numbers."""
    counts_per_turn: float | None = Field(None, gt=0)
    """Counts of the encoder in one turn, for the unit count."""
    unwrap: bool = False
    """The recorded angle starts anew each turn of its side: join the turns."""

    @model_validator(mode="after")
    def _counts(self) -> AngleChannel:
        if (self.unit == "count") != (self.counts_per_turn is not None):
            raise ValueError("the unit count needs counts_per_turn, and no other unit has it")
        return self

    @property
    def factor(self) -> float:
        """Rad in one recorded unit."""
        return TURN / self.counts_per_turn if self.counts_per_turn else ANGLE_UNITS[self.unit]


class VelocityChannel(_Sided):
    """An angular velocity."""

    si_unit: ClassVar[str] = "rad/s"
    unit: Literal["rad/s", "deg/s", "rpm", "rev/s"]
    """Unit of the recorded numbers."""

    @property
    def factor(self) -> float:
        """Rad/s in one recorded unit."""
        return VELOCITY_UNITS[self.unit]


class TorqueChannel(_Sided):
    """A torque, or the motor current that makes it."""

    si_unit: ClassVar[str] = "N m"
    unit: Literal["N m", "mN m", "N cm", "kN m", "lbf in", "lbf ft", "A", "mA"]
    """Unit of the recorded numbers."""
    torque_constant_nm_per_a: float | None = Field(None, gt=0)
    """Torque of one ampere, on the side to which the numbers refer. Unit N m/A."""

    @model_validator(mode="after")
    def _current(self) -> TorqueChannel:
        if (self.unit in CURRENT_UNITS) != (self.torque_constant_nm_per_a is not None):
            raise ValueError("the units A and mA need torque_constant_nm_per_a, and no other unit has it")
        return self

    @property
    def factor(self) -> float:
        """N m in one recorded unit."""
        if self.torque_constant_nm_per_a is not None:
            return self.torque_constant_nm_per_a * CURRENT_UNITS[self.unit]
        return TORQUE_UNITS[self.unit]


class TemperatureChannel(_Channel):
    """A temperature."""

    si_unit: ClassVar[str] = "degC"
    unit: Literal["degC", "K", "degF"]
    """Unit of the recorded numbers."""

    def si(self, raw: Any) -> Any:
        """Temperature in degrees Celsius."""
        value = self.sign * (raw - self.zero)
        if self.unit == "K":
            return value - 273.15
        return (value - 32) / 1.8 if self.unit == "degF" else value


class Channels(Parameters):
    """What was measured; leave out what was not."""

    motor_angle: AngleChannel | None = None
    """Angle of the motor."""
    motor_velocity: VelocityChannel | None = None
    """Velocity of the motor."""
    motor_torque: TorqueChannel | None = None
    """Torque at the motor shaft."""
    output_angle: AngleChannel | None = None
    """Angle of the output."""
    output_velocity: VelocityChannel | None = None
    """Velocity of the output."""
    output_torque: TorqueChannel | None = None
    """Torque of the drive on the output, as a joint torque sensor reads it."""
    load_torque: TorqueChannel | None = None
    """Known external torque on the output."""
    temperature: TemperatureChannel | None = None
    """Temperature of the housing."""

    def given(self) -> dict[str, _Channel]:
        """The channels that there are, by name."""
        found = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: channel for name, channel in found.items() if channel is not None}


def _si_unit(annotation: Any) -> str:
    """Unit of the channel class in ``Class | None``."""
    return next(str(one.si_unit) for one in get_args(annotation) if hasattr(one, "si_unit"))


#: Every measured channel and its unit in a log: ``Channels`` is the one place where they are declared.
MEASURED = {name: _si_unit(field.annotation) for name, field in Channels.model_fields.items()}


class TimeSource(Parameters):
    """Where the time of a sample comes from."""

    column: str | int | None = None
    """Column that holds it, by its name or number."""
    topic: str | None = None
    """Topic whose messages give the samples; the others are interpolated to them. The first channel's topic
    when left out."""
    field: str | None = None
    """Field of that topic's message that holds the time; else its stamp."""
    stamp: Literal["log", "publish", "header"] = "log"
    """Time of a message: when it was logged, when it was published, or its header's stamp."""
    rate_hz: float | None = Field(None, gt=0)
    """Sample rate, where the recording has no time. Unit Hz."""
    unit: Literal["s", "ms", "us", "ns", "iso"] | None = None
    """Unit of the column or field; ``iso`` for dates or times of day, as ISO 8601 writes them."""
    wraps_at: float | None = Field(None, gt=0)
    """Recorded number at which a counter starts at 0 again."""
    quantised: bool = False
    """The clock is coarser than the samples: their constant rate is found, or, where there is none, samples
    that share a time are spread evenly up to the next."""

    @model_validator(mode="after")
    def _one_source(self) -> TimeSource:
        if self.column is not None and self.rate_hz is not None:
            raise ValueError("name either a column or a rate_hz")
        if (self.column is not None or self.field is not None) != (self.unit is not None):
            raise ValueError("a column or field of time needs its unit, and nothing else has one")
        if self.field is not None and self.topic is None:
            raise ValueError("a field of time needs its topic")
        return self


class Select(Parameters):
    """Rows to keep, by the numbers of a column or field."""

    column: str | int | None = None
    """Column that decides, by its name or number."""
    topic: str | None = None
    """Topic that decides."""
    field: str | None = None
    """Field of that topic."""
    at_least: float = -math.inf
    """Smallest number that is kept."""
    at_most: float = math.inf
    """Largest number that is kept."""

    model_config = {**Parameters.model_config, "allow_inf_nan": True}

    @property
    def origin(self) -> Origin:
        """Where the numbers are."""
        return Origin(column=self.column, topic=self.topic, field=self.field)

    @model_validator(mode="after")
    def _place(self) -> Select:
        _ = self.origin
        if self.at_least > self.at_most:
            raise ValueError("at_least is greater than at_most, so that no row is left")
        return self


class IntervalMask(Parameters):
    """A stretch of time whose numbers are not to be used."""

    type: Literal["interval"]
    start_s: float
    """Its beginning, counted from the first sample. Unit s."""
    end_s: float
    """Its end. Unit s."""
    channels: tuple[str, ...] = ()
    """Channels that it concerns; all when left out."""

    @model_validator(mode="after")
    def _forward(self) -> IntervalMask:
        if self.end_s <= self.start_s:
            raise ValueError("end_s must be greater than start_s")
        return self


class OutlierMask(Parameters):
    """Short spikes that stand out from their neighbours.

    A sample is masked when it is farther from where its neighbours put it (the median of the points halfway
    between pairs of them on either side) than ``threshold`` times the scaled median of such distances around
    it, after the Hampel identifier (Davies and Gather 1993, J. Am. Stat. Assoc. 88, 782), and farther than
    three steps of the converter.
    """

    type: Literal["outliers"]
    channels: tuple[str, ...] = Field(min_length=1)
    """Channels that it concerns."""
    width_samples: int = Field(3, ge=1, le=1000)
    """Samples that the widest spike lasts."""
    window_samples: int = Field(101, ge=3, le=100_001)
    """Samples around each one from which the usual distance is taken."""
    threshold: float = Field(8.0, gt=0)
    """Distance that is too far, in standard deviations of a normal distribution of the same spread."""
    isolated: bool = False
    """Only what comes back within ``width_samples``, and leaves the range of the five samples on either side
    by more than that range: steps and steep reversals stay."""


Mask = Annotated[IntervalMask | OutlierMask, Field(discriminator="type")]


class Form(Parameters):
    """How a file is to be read."""

    format: (
        Literal["csv", "parquet", "excel", "matlab", "hdf5", "tdms", "mdf", "mcap", "ros1", "ros2"] | None
    ) = None
    """Format of the file; by its ending when left out (a folder is a ROS 2 bag)."""
    separator: str | None = Field(None, min_length=1, max_length=1)
    """Character between the columns of a CSV file; found when left out."""
    decimal: Literal[".", ","] | None = None
    """Decimal mark of a CSV file; found when left out."""
    encoding: str | None = None
    """Encoding of a CSV file, such as ``utf-8`` or ``cp1252``; found when left out."""
    skip_lines: int = Field(0, ge=0)
    """Lines at the beginning of a CSV file that are not looked at."""


class Mapping(Form):
    """How a foreign recording becomes one of ours."""

    description: str = Field("", max_length=10_000)
    """What was measured, on which hardware, and where the file comes from."""
    ratio: float | None = None
    """Signed ratio, motor angle over output angle; negative where they turn against each other."""
    time: TimeSource
    """Time of the samples."""
    channels: Channels
    """What was measured."""
    joints: dict[str, AngleChannel] = {}
    """Angles of other joints of the same arm, by their names in its URDF; the side has no meaning."""
    select: tuple[Select, ...] = ()
    """Conditions that a row must meet, all of them."""
    longest_gap_s: float | None = Field(None, gt=0)
    """Longest time between two samples that is not noted as a gap. Unit s."""
    masks: tuple[Mask, ...] = ()
    """Numbers that are not to be used; they become NaN."""

    @model_validator(mode="after")
    def _complete(self) -> Mapping:
        given = self.channels.given()
        if not given:
            raise ValueError(f"no channel is mapped; there are: {', '.join(Channels.model_fields)}")
        if self.ratio is not None and not abs(self.ratio) >= 1:
            raise ValueError("the ratio is motor angle over output angle, at least 1 in size")
        for name, channel in given.items():
            side = getattr(channel, "side", None)
            if side is not None and side != side_of(name) and self.ratio is None:
                raise ValueError(f"{name} is recorded at the {side}: that needs the ratio")
        for mask in self.masks:
            unknown = [name for name in mask.channels if name not in given]
            if unknown:
                raise ValueError(f"a mask names {unknown[0]!r}; mapped are: {', '.join(given)}")
        return self

    def summary(self) -> str:
        """What it says, one line for time, ratio and each channel."""
        clock = self.time
        source = f"{clock.rate_hz:g} Hz" if clock.rate_hz else f"{clock.column or clock.topic or 'stamps'}"
        lines = [f"time {source}{f' in {clock.unit}' if clock.unit else ''}"]
        lines += [f"ratio {self.ratio:g}"] if self.ratio is not None else []
        for name, channel in self.channels.given().items():
            place = channel.column if channel.topic is None else f"{channel.topic} {channel.field}"
            side = getattr(channel, "side", None)
            lines.append(
                f"{name} from {place} in {getattr(channel, 'unit', '')}{f', at the {side}' if side else ''}"
            )
        return "\n".join(f"  {line}" for line in lines)


def side_of(channel: str) -> Side:
    """Side of the gear on which a channel of the contract is."""
    return "motor" if channel.startswith("motor") else "output"
