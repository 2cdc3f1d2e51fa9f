"""The sections of a scenario that say how a run is made and what is kept of it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from hdsim.parts import Parameters

#: Integration methods, by name: hdsim's own and those of ``scipy.integrate.solve_ivp``.
Method = Literal["rodas4", "RK45", "DOP853", "Radau", "BDF", "LSODA"]

#: What a run can stand to have changed: it moves no body and stores no energy.
LIVE_SECTIONS = ("load.torque.", "command.motor.controller.", "command.motor.torque.")


class Start(Parameters):
    """State at the start; the drive's own twist follows from it."""

    motor_angle_rad: float = 0.0
    """Angle of motor and wave generator, rad."""
    motor_velocity_rad_per_s: float = 0.0
    """Velocity of motor and wave generator, rad/s; ring and output start at the ideal gear's velocity."""
    output_twist_rad: float = Field(0.0, ge=-1, le=1)
    """How far the output lags behind the ideal gear, rad."""


class Run(Parameters):
    """How long and how exactly the model is integrated, and how often it is sampled."""

    duration_s: float = Field(gt=0, le=1e6)
    """Simulated time, s."""
    method: Method = "rodas4"
    """Integration method: hdsim's own (the fast one), or one of SciPy's by its name."""
    rtol: float = Field(1e-6, gt=1e-14, le=1e-2)
    """Relative tolerance of the integration."""
    atol: float | None = Field(None, gt=0)
    """Absolute tolerance of every state in its SI unit; when left out, rtol times each state's own size."""
    max_step_s: float | None = Field(None, gt=0)
    """Longest step of the integration, s; no limit when left out."""
    sample_rate_hz: float = Field(1000.0, gt=0, le=1e6)
    """Samples of the state per simulated second, Hz."""
    teeth_rate_hz: float = Field(50.0, ge=0, le=1e6)
    """Samples of every tooth's force per simulated second, Hz; 0 keeps none."""
    seed: int = Field(0, ge=0, lt=2**63)
    """Seed of the rough flanks and of every noise."""
    start: Start = Start()
    """State at the start."""

    @model_validator(mode="after")
    def _bounded_size(self) -> Run:
        if self.duration_s * max(self.sample_rate_hz, self.teeth_rate_hz) > 1e9:
            raise ValueError("duration_s times the sample rates must stay below 1e9 samples")
        return self


class Evaluation(Parameters):
    """What the numbers that are taken of a run are held against."""

    settling_band_arcsec: float = Field(30.0, gt=0, le=1e6)
    """Half-width of the band about its target in which the output counts as settled, arcsec. The default is
    half an arcmin, half of what catalogues allow a gear."""


class LogOptions(Parameters):
    """What the log of a run contains besides the state."""

    compression: Literal["zstd", "none"] = "zstd"
    """Compression of the log's chunks."""
    scene: bool = True
    """Write the three-dimensional scene that Foxglove shows."""


class LiveOptions(Parameters):
    """What viewers may do to a run that is watched while it is simulated."""

    parameters: tuple[str, ...] = ()
    """Numbers that may be changed while it runs, by their dotted names, such as load.torque.torque_nm or
    command.motor.controller.velocity_gain_nm_s_per_rad: of the external torque, the controller, or the
    commanded torque."""

    @model_validator(mode="after")
    def _allowed(self) -> LiveOptions:
        for name in self.parameters:
            if not name.startswith(LIVE_SECTIONS):
                allowed = ", ".join(section + "..." for section in LIVE_SECTIONS)
                raise ValueError(f"{name!r} may not be changed while it runs; allowed: {allowed}")
        return self
