"""Sensors: what encoders and torque sensors make of the true motion; the parameters (see ``_readers``)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from hdsim.effects._fitting import Amplitude, Fitting, Harmonic, Periodic, Plausible
from hdsim.effects._kernels import ARCMIN
from hdsim.parts import Builder, Effect, Parameters, Signature

if TYPE_CHECKING:
    from hdsim.effects._readers import EncoderReader, LinearReader, Sensor


Turn = Literal["wave_generator_turn", "output_turn"]


class EncoderRipple(Parameters):
    """One harmonic of an encoder's error."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``."""
    per: Turn = "wave_generator_turn"
    """The shaft whose turns ``order`` counts: its own (an oval scale), or that of a wave generator beside it,
    whose lobes move the seat of the scale."""
    amplitude_arcsec: Annotated[
        float, Plausible(0.1, 120.0, "estimate: graduation and mounting errors of seconds to minutes of arc")
    ] = Field(0.0, ge=0, le=3600)
    """Amplitude, arcsec of the encoder's shaft."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""


class Encoder(Parameters):
    """An angular encoder with one reading head."""

    counts_per_turn: int | None = Field(None, ge=4)
    """Counts per turn of its shaft after interpolation (null: no quantisation)."""
    # A tenth of the track's radius cannot be read.
    eccentricity_arcmin: Annotated[
        float, Plausible(0.01, 20.0, "disc offsets of 1 to 100 um at tracks of 15 to 50 mm")
    ] = Field(0.0, ge=0, le=600)
    """Amplitude of the once-per-turn error, arcmin of its shaft: disc offset over track radius."""
    eccentricity_phase_deg: float = 0.0
    """Angle of the shaft at which that error crosses zero upward, degrees."""
    # A second old is another record.
    delay_s: Annotated[float, Plausible(2e-5, 1e-2, "a sample of a bus to ten of a slow one")] = Field(
        0.0, ge=0, le=1
    )
    """Age of a reading, s."""
    noise_arcsec: float = Field(0.0, ge=0)
    """Standard deviation of the noise before quantisation, arcsec."""
    ripple: tuple[EncoderRipple, ...] = ()
    """Further errors that are periodic in a shaft's angle."""


class VelocitySensor(Parameters):
    """A speed reading: the encoder's difference over a window, or a tachometer's."""

    method: Literal["differenced", "tachometer"] = "differenced"
    """``differenced`` uses the encoder given for the same shaft (an ideal one without)."""
    window_s: float = Field(1e-3, gt=0)
    """Window of the difference, s."""
    delay_s: float = Field(0.0, ge=0)
    """Age of a tachometer's reading, s."""
    noise_rad_per_s: float = Field(0.0, ge=0)
    """Standard deviation of a tachometer's noise, rad/s."""

    @model_validator(mode="after")
    def _only_its_own(self) -> VelocitySensor:
        if self.method == "differenced" and (self.delay_s > 0 or self.noise_rad_per_s > 0):
            raise ValueError(
                "delay_s and noise_rad_per_s belong to a tachometer; set them on the encoder instead"
            )
        return self


class SensorRipple(Parameters):
    """One harmonic of a torque sensor's ripple."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``."""
    per: Turn = "wave_generator_turn"
    """The shaft whose turns ``order`` counts."""
    amplitude_nm: Annotated[
        float, Plausible(2e-4, 0.05, "estimate: up to some percent of a sensor's range", of="rated_torque")
    ] = Field(0.0, ge=0)
    """Constant part of the amplitude, N m."""
    relative_amplitude: float = Field(0.0, ge=0)
    """Part of the amplitude that is proportional to the torque."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""


class TorqueSensor(Parameters):
    """A torque reading: strain gauges, or motor current times torque constant."""

    gain_error: float = Field(0.0, gt=-1)
    """Relative error of the sensitivity (of the torque constant)."""
    offset_nm: float = 0.0
    """Reading at zero torque, N m."""
    resolution_nm: float = Field(0.0, ge=0)
    """Step of the reading, N m (0: none)."""
    delay_s: float = Field(0.0, ge=0)
    """Age of a reading, s."""
    noise_nm: float = Field(0.0, ge=0)
    """Standard deviation of the noise, N m."""
    ripple: tuple[SensorRipple, ...] = ()
    """Errors that are periodic in a shaft's angle."""


class Sensors(Effect):
    """Sensors between the true channels and whoever reads them; a channel that is not named is read exactly.

    Encoder: count(theta(t - t_d) + a sin(theta - phi) + sum A sin(order * angle + phase) + noise). Speed: its
    difference over a window. Torque: (1 + g) tau + sum (A + r tau) sin(order * angle + phase) + offset +
    noise, rounded and delayed.
    """

    title: ClassVar[str] = "sensor errors"
    source: ClassVar[str] = (
        "eccentric disc: first-order geometry; torque-sensor ripple: Taghirad, Helmy and Belanger 1998, "
        "IEEE Trans. Instrumentation and Measurement (ripple of flexspline strain gauges as a harmonic "
        "oscillator)"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "output_angle", "velocity", "time"),
        channels=(
            "motor_angle",
            "output_angle",
            "motor_velocity",
            "output_velocity",
            "output_torque",
            "motor_torque",
        ),
        orders=(1.0, 0.01, 2.0, 4.0),
        confused_with={
            "kinematic_error": "encoder eccentricity moves with the encoder when it is re-clocked, needs no"
            " torque, and is divided by the ratio when it is the motor's",
            "load_dependent_loss": "an error of the torque constant is symmetric in the direction of power",
            "input_coulomb_viscous": "viscous wind-up shifts the transmission error with speed as a delay "
            "does, but it vanishes with the torque and changes with temperature; a"
            " delay turns the phase of order k by k w t_d without a change of "
            "amplitude",
        },
    )
    several: ClassVar[bool] = True
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Harmonic("output_angle.eccentricity_arcmin", "output_angle.eccentricity_phase_deg", 0.2),),
            label="output encoder eccentricity",
            lives_in=("output_angle",),
            needs=("output_angle",),
        ),
        Fitting(
            (
                Harmonic("output_angle.eccentricity_arcmin", "output_angle.eccentricity_phase_deg", 0.2),
                *(
                    Harmonic(
                        f"output_angle.ripple.{k}.amplitude_arcsec", f"output_angle.ripple.{k}.phase_deg", 6.0
                    )
                    for k in range(2)
                ),
            ),
            label="uneven scale of the output encoder",
            needs=("output_angle",),
            turns=50.0,
            settings={"output_angle": {"ripple": [{"order": n, "per": "output_turn"} for n in (2, 3)]}},
            lives_in=("output_angle",),
        ),
        Fitting(
            (Periodic("output_angle.ripple", "amplitude_arcsec", 2.0, "output_angle"),),
            label="ripple of the output encoder",
            needs=("output_angle",),
            lives_in=("wave_generator_angle",),
        ),
        # The motor's own reading is prescribed: what is wrong with it is found in what follows from it.
        Fitting(
            (Harmonic("motor_angle.eccentricity_arcmin", "motor_angle.eccentricity_phase_deg", 2.0),),
            label="motor encoder eccentricity",
            lives_in=("wave_generator_angle",),
            needs=("output_angle",),
            turns=1.0,
        ),
        Fitting(
            (Amplitude({"output_angle.delay_s": 5e-4}),),
            label="output encoder delay",
            lives_in=("velocity",),
            needs=("output_angle",),
        ),
        Fitting(
            (Periodic("output_torque.ripple", "amplitude_nm", 0.1, "output_torque"),),
            label="torque-sensor ripple",
            lives_in=("wave_generator_angle",),
            needs=("output_torque",),
        ),
    )

    motor_angle: Encoder | None = None
    """Encoder on the motor."""
    output_angle: Encoder | None = None
    """Encoder on the output."""
    motor_velocity: VelocitySensor | None = None
    """Speed reading of the motor."""
    output_velocity: VelocitySensor | None = None
    """Speed reading of the output."""
    motor_torque: TorqueSensor | None = None
    """Torque reading of the motor."""
    output_torque: TorqueSensor | None = None
    """Joint torque sensor on the output."""

    def contribute(self, build: Builder) -> None:
        """Register the sensors that are given."""
        for channel, sensor in self.readers(build.seed).items():
            build.sensor(channel, sensor)

    def readers(self, seed: int) -> dict[str, Sensor]:
        """The sensors by channel, their noise bound to ``seed``."""
        found: dict[str, Sensor] = {}
        for shaft, encoder, velocity in (
            ("motor", self.motor_angle, self.motor_velocity),
            ("output", self.output_angle, self.output_velocity),
        ):
            if encoder is not None:
                found[f"{shaft}_angle"] = _encoder(encoder, f"{shaft}_angle", seed)
            if velocity is not None:
                found[f"{shaft}_velocity"] = _velocity(velocity, encoder or Encoder(), shaft, seed)
        for channel, torque in (("motor_torque", self.motor_torque), ("output_torque", self.output_torque)):
            if torque is not None:
                found[channel] = _torque(torque, channel, seed)
        return found


def _counted(per: Turn) -> str:
    """Channel of the angle whose turns a ripple counts."""
    return "motor_angle" if per == "wave_generator_turn" else "output_angle"


def _encoder(given: Encoder, channel: str, seed: int) -> EncoderReader:
    from hdsim.effects._readers import EncoderReader, Noise, Ripple, step_of

    return EncoderReader(
        step=step_of(given.counts_per_turn),
        eccentricity=given.eccentricity_arcmin * ARCMIN,
        phase=math.radians(given.eccentricity_phase_deg),
        delay=given.delay_s,
        noise=Noise(given.noise_arcsec * ARCMIN / 60.0, seed, channel),
        ripples=tuple(
            Ripple(
                _counted(r.per), r.order, r.amplitude_arcsec * ARCMIN / 60.0, 0.0, math.radians(r.phase_deg)
            )
            for r in given.ripple
        ),
    )


def _velocity(given: VelocitySensor, encoder: Encoder, shaft: str, seed: int) -> Sensor:
    from hdsim.effects._readers import DifferencedReader, LinearReader, Noise

    if given.method == "tachometer":
        noise = Noise(given.noise_rad_per_s, seed, f"{shaft}_velocity")
        return LinearReader(gain_error=0.0, offset=0.0, step=0.0, delay=given.delay_s, noise=noise)
    channel = f"{shaft}_angle"
    return DifferencedReader(_encoder(encoder, channel, seed), channel, given.window_s)


def _torque(given: TorqueSensor, channel: str, seed: int) -> LinearReader:
    from hdsim.effects._readers import LinearReader, Noise, Ripple

    ripples = tuple(
        Ripple(
            channel=_counted(r.per),
            order=r.order,
            amplitude=r.amplitude_nm,
            relative=r.relative_amplitude,
            phase=math.radians(r.phase_deg),
        )
        for r in given.ripple
    )
    return LinearReader(
        gain_error=given.gain_error,
        offset=given.offset_nm,
        step=given.resolution_nm,
        delay=given.delay_s,
        noise=Noise(given.noise_nm, seed, channel),
        ripples=ripples,
    )
