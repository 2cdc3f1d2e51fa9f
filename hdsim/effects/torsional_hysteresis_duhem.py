"""Torsional hysteresis as a Duhem equation, parallel to the torsion spring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, STORED, TWIST_RATE, TWIST_TORQUE, element
from hdsim.parts import Builder, DriveSize, Effect, Signature, State

_TORQUE = Amplitude({"saturation_torque_nm": 1.0})
#: Over less it would be a friction at the output, over more a spring.
_TWIST = Shape("saturation_twist_mrad", (0.1, 0.4), least=0.02, most=0.6)


@element
def duhem(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Hysteresis torque on the twist. Parameters: A, z_s, n; own state: z, N m."""
    stiffness = parameters[0]
    saturation = parameters[1]
    exponent = parameters[2]
    speed = inputs[TWIST_RATE]
    z = inputs[own]
    decay = stiffness / saturation
    if exponent != 1.0:
        decay *= abs(z / saturation) ** (exponent - 1.0)
    magnitude = abs(speed)
    direction = -1.0 if speed < 0.0 else 1.0
    heat = decay * z * z / stiffness
    outputs[TWIST_TORQUE] -= z
    jacobian[TWIST_TORQUE * columns + own] -= 1.0
    outputs[own] += stiffness * speed - decay * magnitude * z
    jacobian[own * columns + TWIST_RATE] += stiffness - decay * direction * z
    jacobian[own * columns + own] -= exponent * decay * magnitude
    outputs[DISSIPATED] += heat * magnitude
    jacobian[DISSIPATED * columns + TWIST_RATE] += heat * direction
    jacobian[DISSIPATED * columns + own] += (exponent + 1.0) * decay * z / stiffness * magnitude
    outputs[STORED] += 0.5 * z * z / stiffness


class TorsionalHysteresisDuhem(Effect):
    """tau = z, z' = A w - alpha |w| |z/z_s|^(n - 1) z, w the rate of twist; |z| saturates at z_s = A/alpha.

    Rate-independent: on a branch z approaches the saturation over the twist 1/alpha, with n = 1
    exponentially, with a larger n later and more suddenly (the exponent of Bouc and Wen). It stores
    z^2/(2 A), the rest, alpha |w| |z/z_s|^(n - 1) z^2 / A, is heat.
    """

    title: ClassVar[str] = "torsional hysteresis (Duhem)"
    source: ClassVar[str] = (
        "Dhaouadi, Ghorbel and Gandhi 2003, IEEE Trans. Industrial Electronics 50:1165; exponent: Wen 1976, "
        "J. Engineering Mechanics Division ASCE 102:249, his gamma 0; level as for Maxwell slip"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "time_since_reversal", "direction"),
        channels=("output_angle", "output_torque"),
        confused_with={
            "torsional_hysteresis_maxwell": "nested branches with return to the point of reversal; this one"
            " has a single exponential and minor loops that drift",
            "output_backlash": "backlash has no stiffness over a fixed gap, no loss in it, and vanishes "
            "under a bias",
            "input_coulomb_viscous": "absent with the wave generator locked",
        },
    )
    fittings: ClassVar[tuple[Fitting, ...]] = (Fitting((_TORQUE,), (_TWIST,)),)
    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (_TORQUE,),
            (_TWIST, Shape("exponent", (1.5, 3.0), least=1.0, most=10.0)),
            label="that saturates more suddenly",
        ),
    )

    stiffness_nm_per_rad: float = Field(5000.0, gt=0)
    """Stiffness A at a reversal from rest, N m/rad."""
    saturation_torque_nm: Annotated[
        float,
        Plausible(
            1e-3, 0.1, "hysteresis loss below 1 to 3 arcmin times K1: 4 % at size 20", of="rated_torque"
        ),
    ] = Field(2.0, gt=0)
    """Torque A/alpha at which z saturates, N m: half of the loop's width in torque."""
    saturation_twist_mrad: Annotated[
        float | None, Plausible(0.02, 0.6, "within the wind-up of the first stiffness")
    ] = Field(None, gt=0)
    """Twist 1/alpha of a branch, mrad; where it is given, A is the saturation torque over it."""
    exponent: Annotated[float, Plausible(1.0, 10.0, "beyond ten it is an ideal slider")] = Field(
        1.0, ge=1, le=100
    )
    """Exponent n: how suddenly a branch saturates; 1: exponentially."""

    @classmethod
    def sized(cls, given: Mapping[str, Any], size: DriveSize, reference: DriveSize) -> dict[str, Any]:
        """Saturation torque from the printed hysteresis loss and K1, stiffness A from K1."""
        wider = (size.hysteresis_loss_rad or reference.hysteresis_loss_rad) / reference.hysteresis_loss_rad
        stiffer = size.stiffness_k1_nm_per_rad / reference.stiffness_k1_nm_per_rad
        fields = cls.model_fields
        return {
            "saturation_torque_nm": fields["saturation_torque_nm"].default * wider * stiffer,
            "stiffness_nm_per_rad": fields["stiffness_nm_per_rad"].default * stiffer,
        }

    def contribute(self, build: Builder) -> None:
        """Add the hysteresis torque parallel to the torsion spring."""
        stiffness = self.stiffness_nm_per_rad
        if self.saturation_twist_mrad is not None:
            stiffness = 1e3 * self.saturation_torque_nm / self.saturation_twist_mrad
        state = State(
            "hysteresis_torque",
            "N m",
            0.0,
            self.saturation_torque_nm,
            "torque of the Duhem hysteresis",
            on_spring=True,
        )
        numbers = [stiffness, self.saturation_torque_nm, self.exponent]
        build.element(duhem, numbers, states=(state,))
