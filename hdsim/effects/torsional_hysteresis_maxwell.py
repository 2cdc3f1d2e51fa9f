"""Torsional hysteresis as Maxwell slip: springs in series with sliders, parallel to the torsion spring."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from hdsim.effects._fitting import Amplitude, Fitting, Plausible, Shape
from hdsim.kernel import DISSIPATED, STORED, TWIST_RATE, TWIST_TORQUE, element
from hdsim.number import FIXED
from hdsim.parts import Builder, DriveSize, Effect, Parameters, Signature, State


@element
def maxwell_slip(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """Slip elements on the twist. Parameters: number, p, then k, W of each; own states: torques F, N m."""
    power = parameters[1]
    speed = inputs[TWIST_RATE]
    for i in range(int(parameters[0])):
        state = own + i
        stiffness = parameters[2 + 2 * i]
        force = inputs[state]
        slip = 0.0
        slip_force = 0.0
        if force * speed > 0.0:
            # From 0 below W (1 - 1/p) to 1 at W, with a continuous slope.
            into = 1.0 + power * (abs(force) / parameters[3 + 2 * i] - 1.0)
            if into >= 1.0:
                slip = 1.0
            elif into > 0.0:
                slip = into * into * (3.0 - 2.0 * into)
                slip_force = 6.0 * into * (1.0 - into) * power / math.copysign(parameters[3 + 2 * i], force)
        outputs[TWIST_TORQUE] -= force
        jacobian[TWIST_TORQUE * columns + state] -= 1.0
        outputs[state] += stiffness * speed * (1.0 - slip)
        jacobian[state * columns + TWIST_RATE] += stiffness * (1.0 - slip)
        jacobian[state * columns + state] -= stiffness * speed * slip_force
        outputs[DISSIPATED] += force * speed * slip
        jacobian[DISSIPATED * columns + TWIST_RATE] += force * slip
        jacobian[DISSIPATED * columns + state] += speed * (slip + force * slip_force)
        outputs[STORED] += 0.5 * force * force / stiffness


#: Over less it would be a friction at the output, over more a spring. Shifted by one, the elements that slip
#: at 0.1, 0.3 and 0.8 mrad almost cover one another.
_SCALE = Shape("slip_twist_scale", (0.5, 1.0), least=0.1, most=2.0, apart=math.sqrt(8.0))


class SlipElement(Parameters):
    """A spring in series with a slider."""

    stiffness_nm_per_rad: float = Field(gt=0)
    """Stiffness k while it sticks, N m/rad."""
    slip_torque_nm: float = Field(gt=0)
    """Torque W at which it slips, N m."""


class TorsionalHysteresisMaxwell(Effect):
    """tau = sum F_i, dF/dt = k w (1 - s), w the rate of twist; s rises from 0 to 1 as |F| nears W.

    On the way up (F w > 0) s is the smooth step of 1 + p (|F|/W - 1): nothing slips below W (1 - 1/p), all
    of it at W; on the way back s = 0. Rate-independent. As p grows an element becomes the ideal one, elastic
    up to W, then slipping. The law keeps |F| < W, stores F^2/(2 k) and turns F w s into heat. Below
    W (1 - 1/p) an element is exactly elastic, so loops close and a bias stays, however often it is cycled:
    what an element can lose is 1/p of its torque. (Without that threshold, as in Bouc-Wen's |F/W|^p, every
    cycle under a bias takes a part of it.)

    Without ``elements``, ``slip_torque_nm`` is shared by elements that slip at ``slip_twists_mrad`` times
    ``slip_twist_scale``: equally, or in proportion to the ``share_exponent``-th power of these twists. Every
    law whose branches are nested is such a distribution (Iwan 1966); Segalman's (2005) power law of sliders,
    phi^chi dphi, has chi = share_exponent - 2 where the twists are a geometric series.
    The elements stiffen the drive on reversal by sum k_i; a catalogue stiffness contains that already.

    The defaults are those of size 20. The loop's width at zero torque is about 2 W/K1, and a catalogue prints
    that angle, the hysteresis loss h (1 arcmin for every size): so for another drive W = 2 N m (h/1 arcmin)
    K1/(16 kN m/rad), and the twists at which elements slip grow with h.
    """

    title: ClassVar[str] = "torsional hysteresis (Maxwell slip)"
    source: ClassVar[str] = (
        "Tjahjowidodo, Al-Bender and Van Brussel 2013, Mechatronics 23:497 (spring plus Maxwell slip); "
        "no slip below a threshold: Iwan 1966, J. Appl. Mech. 33:893 (elements of ideal friction); power law "
        "of their torques: Segalman 2005, J. Appl. Mech. 72:752; level: "
        "catalogue hysteresis loss below 1 arcmin times K1, 2 sum W <= 4.6 N m for size 20"
    )
    signature: ClassVar[Signature] = Signature(
        lives_in=("torque", "time_since_reversal", "direction"),
        channels=("output_angle", "output_torque"),
        confused_with={
            "torsional_hysteresis_duhem": "one exponential instead of nested branches (Masing): compare "
            "minor loops",
            "output_backlash": "backlash has no stiffness over a fixed gap, no loss in it, and vanishes "
            "under a bias",
            "load_side_friction": "grows with no displacement: its loop is full at the smallest amplitude",
            "input_coulomb_viscous": "absent with the wave generator locked",
            "lugre_friction": "absent with the wave generator locked",
        },
    )
    printed: ClassVar[bool] = True
    fittings: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"slip_torque_nm": 1.0}),),
            (_SCALE,),
        ),
    )
    finer: ClassVar[tuple[Fitting, ...]] = (
        Fitting(
            (Amplitude({"slip_torque_nm": 1.0}),),
            (_SCALE, Shape("share_exponent", (-1.0, 1.0), linear=True)),
            settings={"slip_twists_mrad": (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.56, 0.8)},
            label="that slips at many twists",
        ),
    )

    elements: tuple[SlipElement, ...] | None = Field(None, min_length=1)
    """Slip elements; without them they follow from the next two."""
    slip_torque_nm: Annotated[
        float,
        Plausible(
            1e-3, 0.1, "hysteresis loss below 1 to 3 arcmin times K1: 4 % at size 20", of="rated_torque"
        ),
    ] = Field(2.0, gt=0)
    """Total torque of all sliders, N m: half of the loop's width in torque, at full slip."""
    slip_twists_mrad: tuple[float, ...] = Field((0.1, 0.3, 0.8), min_length=1)
    """Twists at which equal shares of the torque slip, from rest, mrad."""
    slip_twist_scale: Annotated[
        float, Plausible(0.1, 2.0, "the last twist within the wind-up of the first stiffness")
    ] = Field(1.0, gt=0)
    """Factor on ``slip_twists_mrad``: of a stiffer or a softer drive."""
    share_exponent: Annotated[float, Plausible(-3.0, 3.0, "beyond that one element has nearly all")] = Field(
        0.0, ge=-5, le=5
    )
    """Exponent of an element's share of the torque as a power of its twist; 0: equal shares."""
    # Beyond a thousand a solver sees a corner.
    sharpness: Annotated[float, FIXED] = Field(200.0, ge=1, le=1000)
    """Inverse p of the share of W over which an element begins to slip."""

    @model_validator(mode="after")
    def _positive(self) -> TorsionalHysteresisMaxwell:
        if min(self.slip_twists_mrad) <= 0:
            raise ValueError(f"slip_twists_mrad must be above 0, found {min(self.slip_twists_mrad)}")
        return self

    @classmethod
    def sized(cls, given: Mapping[str, Any], size: DriveSize, reference: DriveSize) -> dict[str, Any]:
        """Slip torque and twists from the printed hysteresis loss and K1."""
        if given.get("elements") is not None:
            return {}
        wider = (size.hysteresis_loss_rad or reference.hysteresis_loss_rad) / reference.hysteresis_loss_rad
        stiffer = size.stiffness_k1_nm_per_rad / reference.stiffness_k1_nm_per_rad
        torque = cls.model_fields["slip_torque_nm"].default
        return {"slip_torque_nm": torque * wider * stiffer, "slip_twist_scale": wider}

    def slip_elements(self) -> tuple[SlipElement, ...]:
        """The elements in use, given or shared out."""
        if self.elements is not None:
            return self.elements
        last = max(self.slip_twists_mrad)
        parts = [(x / last) ** self.share_exponent for x in self.slip_twists_mrad]
        shares = [self.slip_torque_nm * part / sum(parts) for part in parts]
        return tuple(
            SlipElement(stiffness_nm_per_rad=share / (1e-3 * self.slip_twist_scale * x), slip_torque_nm=share)
            for x, share in zip(self.slip_twists_mrad, shares, strict=True)
        )

    def contribute(self, build: Builder) -> None:
        """Add the elements parallel to the torsion spring."""
        elements = self.slip_elements()
        numbers = [float(len(elements)), self.sharpness]
        for e in elements:
            numbers += [e.stiffness_nm_per_rad, e.slip_torque_nm]
        states = [
            State(
                f"slip_element_{i}_torque",
                "N m",
                0.0,
                e.slip_torque_nm,
                f"torque of Maxwell slip element {i}",
                on_spring=True,
            )
            for i, e in enumerate(elements, 1)
        ]
        build.element(maxwell_slip, numbers, states=states)
