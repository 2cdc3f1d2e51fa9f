"""Friction of the motor shaft that varies with the angle of the wave generator or of the output."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Fitting, Harmonic, Plausible
from hdsim.effects._kernels import Turn, factors, periodic_friction
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Parameters, Signature


class FrictionComponent(Parameters):
    """One harmonic of the friction."""

    order: float = Field(gt=0)
    """Periods per turn of ``per``."""
    amplitude_nm: Annotated[
        float,
        Plausible(0.001, 0.1, "estimate: up to the Coulomb friction itself", of="motor_rated_torque"),
    ] = Field(0.004, ge=0)
    """Amplitude A at the motor shaft, N m (half of peak to peak)."""
    phase_deg: float = 0.0
    """Phase at zero angle, degrees."""
    per: Turn = "wave_generator_turn"
    """What ``order`` counts: turns of the wave generator, of the output, or of the one against the other."""


def _way(label: str, per: Turn, orders: tuple[int, ...], refines: tuple[str, ...] = ()) -> Fitting:
    """Harmonics of a turn."""
    lives_in, turns = ("output_angle", 50.0) if per == "output_turn" else ("wave_generator_angle", 1.0)
    return Fitting(
        Harmonic.components("amplitude_nm", 0.002, len(orders)),
        label=label,
        turns=turns,
        settings={"components": [{"order": order, "per": per} for order in orders]},
        lives_in=(lives_in, "direction"),
        refines=refines,
    )


class PositionDependentFriction(Effect):
    """T = -sum A (1 + sin(order * angle + phase)) tanh(w_m/w_s) on the motor.

    Friction never drives: a component goes from none to 2 A, and its mean A is Coulomb friction like any
    other. What turns with the wave generator has orders 1 (its shaft, seal and bearing) and 2 (the lobes);
    what turns with the output has orders 1, 2 and 3 of that.
    """

    title: ClassVar[str] = "position-dependent friction"
    source: ClassVar[str] = (
        "Tuttle 1992, MIT AI-TR 1365 (the energy that a harmonic drive dissipates varies periodically with "
        "rotation); Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30:1083 (friction that "
        "depends on position); the numbers are estimates, an eighth of the Coulomb friction"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("wave_generator_angle", "output_angle", "direction"),
        channels=("motor_torque",),
        orders=(1.0, 2.0, 0.01, 0.02),
        confused_with={
            "motor_torque_ripple": "keeps its sign when the motion turns round, friction changes it: one "
            "direction alone cannot tell",
            "unbalance": "keeps its sign when the motion turns round",
            "input_coulomb_viscous": "the same at every angle",
            "load_dependent_loss": "follows the load, which may follow the angle: a second load tells",
        },
    )
    several: ClassVar[bool] = True
    fittings: ClassVar[tuple[Fitting, ...]] = (
        _way("", "wave_generator_turn", (1, 2)),
        _way("of the output", "output_turn", (1, 2, 3)),
    )
    finer: ClassVar[tuple[Fitting, ...]] = (
        _way("tight over a part of the turn", "wave_generator_turn", (1, 2, 3, 4, 6), ("",)),
        _way("of the output, tight over a part of its turn", "output_turn", (1, 2, 3, 4, 5, 6),
             ("of the output",)),
    )  # fmt: skip

    components: tuple[FrictionComponent, ...] = Field((FrictionComponent(order=2),), min_length=1)
    """The harmonics."""
    smoothing_velocity_rad_per_s: Annotated[float, FIXED] = Field(0.5, gt=0)
    """Motor speed w_s over which the sign is smoothed, rad/s."""

    def contribute(self, build: Builder) -> None:
        """Add the friction on the motor shaft."""
        numbers = [self.smoothing_velocity_rad_per_s, float(len(self.components))]
        for c in self.components:
            numbers += [c.amplitude_nm, *factors(c.order, c.per), math.radians(c.phase_deg)]
        build.element(periodic_friction, numbers)
