"""A torsion spring that is softer when the drive is warm."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible
from hdsim.kernel import SUPPLIED, TRANSMITTED_TORQUE, TWIST_RATE, TWIST_TORQUE, element
from hdsim.number import FIXED
from hdsim.parts import Builder, Effect, Signature


@element
def softening(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Part of the spring's torque that is gone, on the twist.

    Parameters: the temperature's column (0: none), T, T_0, beta; sign of the torque at a positive twist.
    """
    column = int(parameters[0])
    above = (inputs[column] if column > 0 else parameters[1]) - parameters[2]
    load = inputs[TRANSMITTED_TORQUE]
    rate = inputs[TWIST_RATE]
    side = parameters[4]
    share = parameters[3] * above * side
    torque = share * load
    outputs[TWIST_TORQUE] += torque
    jacobian[TWIST_TORQUE * columns + TRANSMITTED_TORQUE] += share
    outputs[SUPPLIED] += torque * rate
    jacobian[SUPPLIED * columns + TRANSMITTED_TORQUE] += share * rate
    jacobian[SUPPLIED * columns + TWIST_RATE] += torque
    if column > 0:
        by_temperature = parameters[3] * side * load
        jacobian[TWIST_TORQUE * columns + column] += by_temperature
        jacobian[SUPPLIED * columns + column] += by_temperature * rate


class ThermalStiffness(Effect):
    """K = K_0 (1 - beta (T - T_0)): every section of the drive's torsion spring, in proportion.

    The temperature is the measured one (in a diagnosis), else the state of ``thermal_friction``, else
    ``temperature_degc``. What the spring stores less it takes from the drive's heat and gives back: that
    exchange is accounted for as supplied, and is nothing over a cycle at one temperature. Wind-up at a
    constant torque grows by beta for every kelvin: 2.8 arcsec over 20 K for 7.2 arcmin. Springs that effects
    add in series change with it, and a hysteresis parallel to it. A rigid mesh has no spring.
    """

    title: ClassVar[str] = "temperature-dependent stiffness"
    source: ClassVar[str] = (
        "Young's modulus of carbon steel, ASME B31.3 Table C-6: 29.5e6 psi at 70 degF, 27.7e6 psi at 400 "
        "degF, 3.3e-4 per kelvin; what fits and preloads add to that is not known"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("temperature", "torque"),
        channels=("output_angle", "output_torque", "temperature"),
        confused_with={
            "thermal_friction": "shows in the motor's torque at constant speed, not in the wind-up",
            "base_flexibility": "the same at any temperature",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting((Amplitude({"stiffness_coefficient_per_k": 3.3e-4}),), follows=("temperature",)),
    )

    # At a hundred kelvin from the reference the spring still has the sign of a spring.
    stiffness_coefficient_per_k: Annotated[
        float, Plausible(1e-4, 3e-3, "steel's modulus alone to ten times as much, the latter an estimate")
    ] = Field(3.3e-4, ge=0, le=0.01)
    """Relative decay of the stiffness, beta, 1/K."""
    reference_degc: Annotated[float, FIXED] = Field(20.0, ge=-60, le=150)
    """Temperature T_0 at which the drive's stiffness is given, degC."""
    temperature_degc: Annotated[float, FIXED] = Field(40.0, ge=-60, le=150)
    """Temperature of the drive where nothing else says it, degC."""

    def contribute(self, build: Builder) -> None:
        """Take away what the warm spring lacks."""
        column = build.external("temperature") or build.state_index("temperature") or 0
        numbers = [
            float(column),
            self.temperature_degc,
            self.reference_degc,
            self.stiffness_coefficient_per_k,
            build.twist_sign,
        ]
        build.element(softening, numbers)
