"""Torque ripple that passes a resonance: of a servo's closed loop, or of a structure."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Plausible
from hdsim.kernel import MOTOR_ANGLE, MOTOR_TORQUE, MOTOR_VELOCITY, SUPPLIED, element
from hdsim.parts import Builder, Effect, Parameters, Signature


@element
def resonant_ripple(
    inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any
) -> None:
    """Ripple over the motor's angle behind a second-order lag.

    Parameters: number, natural frequency w0 in rad/s, damping ratio, then order, amplitude, phase of each
    component.
    """
    angle = inputs[MOTOR_ANGLE]
    speed = inputs[MOTOR_VELOCITY]
    natural = parameters[1]
    damping = parameters[2]
    for i in range(int(parameters[0])):
        order = parameters[3 + 3 * i]
        sine = math.sin(order * angle + parameters[5 + 3 * i])
        cosine = math.cos(order * angle + parameters[5 + 3 * i])
        # H = 1 / (a + i b) at the frequency r times w0, r signed.
        r = order * speed / natural
        a = 1.0 - r * r
        b = 2.0 * damping * r
        size = parameters[4 + 3 * i] / (a * a + b * b)
        torque = size * (a * sine - b * cosine)
        torque_angle = size * order * (a * cosine + b * sine)
        # d(a a + b b)/dr over (a a + b b), and d(a sine - b cosine)/dr.
        growth = (8.0 * damping * damping * r - 4.0 * r * a) / (a * a + b * b)
        turned = -2.0 * r * sine - 2.0 * damping * cosine
        torque_speed = (size * turned - torque * growth) * order / natural
        outputs[MOTOR_TORQUE] += torque
        jacobian[MOTOR_TORQUE * columns + MOTOR_ANGLE] += torque_angle
        jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] += torque_speed
        outputs[SUPPLIED] += torque * speed
        jacobian[SUPPLIED * columns + MOTOR_ANGLE] += torque_angle * speed
        jacobian[SUPPLIED * columns + MOTOR_VELOCITY] += torque + torque_speed * speed


class ResonantComponent(Parameters):
    """One harmonic of the ripple."""

    order: float = Field(gt=0)
    """Periods per motor turn, as of ``motor_torque_ripple``."""
    amplitude_nm: Annotated[
        float,
        Plausible(5e-4, 0.1, "as cogging: 0.1 to some percent of a servo motor's", of="motor_rated_torque"),
    ] = Field(0.005, ge=0)
    """Amplitude far below the resonance, N m; at it 1/(2 zeta) times that."""
    phase_deg: float = 0.0
    """Phase at zero motor angle and low speed, degrees."""


class ResonantTorqueRipple(Effect):
    """T = sum Im[A e^{i (n theta_m + phase)} H(i n w_m)], H(s) = w0^2 / (s^2 + 2 zeta w0 s + w0^2).

    A ripple of the motor's angle that something passes on with a resonance: a servo's closed loop (the
    motor's current answers cogging through it) or a structural mode. Amplitude and phase change with speed:
    T is the plain ripple where n w_m is far below w0, A / (2 zeta) at w0, where it is a quarter of a period
    late, and falls beyond. It is the steady response to the speed of the moment, and has no states: it holds
    where that changes little within 1/(zeta w0). The power T w_m is supplied.

    A simulated controller answers a ``motor_torque_ripple`` with a resonance of its own: this effect stands
    for one that the model does not have. A delay of the torque's reading turns the phase, too, in proportion
    to the speed: whoever fits this effect must fit both. A diagnosis does not ask for it.
    """

    title: ClassVar[str] = "torque ripple through a resonance"
    source: ClassVar[str] = (
        "den Hartog, Mechanical Vibrations, ch. 2 (forced vibration with viscous damping); Kollmorgen, "
        "Cogging Suppression, 2014 (in velocity or position control torque ripple becomes a ripple of the "
        "current); default frequency and damping: fitted to a joint of a robot arm (docs/real-machines.md)"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "velocity"),
        channels=("motor_torque", "motor_velocity", "motor_angle"),
        orders=(12.0,),
        confused_with={
            "motor_torque_ripple": "keeps its amplitude and phase at every speed; this one is largest, "
            "and turns its phase, where its frequency passes the resonance",
            "kinematic_error": "grows in the current with speed squared and vanishes at low speed; shows "
            "in the transmission error",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = ()

    components: tuple[ResonantComponent, ...] = Field(
        (ResonantComponent(order=12, amplitude_nm=0.005),), min_length=1
    )
    """The harmonics."""
    natural_frequency_hz: Annotated[
        float, Plausible(20.0, 500.0, "estimate: bandwidths of velocity and current loops of servo drives")
    ] = Field(130.0, gt=0)
    """Natural frequency w0/(2 pi), Hz."""
    damping_ratio: Annotated[float, Plausible(0.02, 1.0, "estimate: structures to well-tuned loops")] = Field(
        0.4, gt=0
    )
    """Damping ratio zeta."""

    def contribute(self, build: Builder) -> None:
        """Add the ripple to the motor's torque."""
        numbers = [float(len(self.components)), 2 * math.pi * self.natural_frequency_hz, self.damping_ratio]
        for c in self.components:
            numbers += [c.order, c.amplitude_nm, math.radians(c.phase_deg)]
        build.element(resonant_ripple, numbers)
