"""What makers print about strain-wave gears, number by number, each with where it was read.

Sizes 14, 17, 20 and 25 of the CSG series (cup type, high torque), whose ratings stand with those of other
sizes and series in ``hdsim.drive.ratings``. Figures that belong to the size and the ratio rather than to the
series (stiffness, accuracy) come from the same maker's actuators with these gears. A number that no source
gives is None: nothing is filled in here; ``hdsim.drive.presets`` does the estimating.
"""

from __future__ import annotations

from dataclasses import dataclass

from hdsim.drive.printed import Figure, Source
from hdsim.drive.printed_gear import printed_gear
from hdsim.drive.ratings import rated_gears, ratings

SIZES = (14, 17, 20, 25)
"""Sizes with stiffness, friction and inertia on record."""


@dataclass(frozen=True)
class FrictionFigures:
    """What is printed about friction at ratio 100; torques in N m, speeds in rpm at the input."""

    input_starting_torque: Figure
    running_torque: tuple[tuple[float, Figure], ...]
    back_driving_torque: Figure
    efficiency: Figure
    """At rated torque and 2000 rpm, 20 °C."""


@dataclass(frozen=True)
class CatalogueFigures:
    """What is printed about one drive; None where no source gives it.

    Torques in N m: output side unless the name says input. ``running_torque`` lists (input speed in rpm,
    torque at the input). Angles in rad, all upper limits: accuracy is peak to peak over one output turn,
    repeatability is half the band, hysteresis loss and lost motion are widths at the output.
    """

    name: str
    size: int
    ratio: int
    rated_torque: Figure
    average_torque: Figure | None
    repeated_peak_torque: Figure | None
    momentary_peak_torque: Figure | None
    ratcheting_torque: Figure | None
    buckling_torque: Figure | None
    torque_t1: Figure
    torque_t2: Figure
    stiffness_k1: Figure
    stiffness_k2: Figure
    stiffness_k3: Figure
    input_starting_torque: Figure | None
    running_torque: tuple[tuple[float, Figure], ...]
    back_driving_torque: Figure | None
    efficiency: Figure | None
    hysteresis_loss: Figure
    lost_motion: Figure
    accuracy: Figure
    repeatability: Figure
    wave_generator_inertia: Figure
    pitch_radius: Figure


SEED = Source(
    "Zhang et al. 2021, doi:10.21203/rs.3.rs-652069/v1, Table 2 (tooth counts, module, pressure angle) and "
    "section 4.3 (rated torque)",
    "read",
)
TPI = Source(
    "Schaeffler TPI 275, series RT1-H-CS, i = 100, 20 °C; zhulu248/harmonic-drive-twin catalogue.py", "copied"
)
CPL = Source(
    "Harmonic Drive AG, CPL20-2A, 3500 rpm, 20 °C; geez0x1/CompliantJointToolbox, early param/CE_Med_ds.m",
    "copied",
)
TPI_RADIUS = Source("Schaeffler TPI 275, pitch radius; zhulu248/harmonic-drive-twin catalogue.py", "copied")
_STARTING = {14: 21e-3, 17: 29e-3, 20: 37e-3, 25: 69e-3}
_RUNNING_2000 = {14: 35e-3, 17: 51e-3, 20: 105e-3, 25: 195e-3}
_BACK_DRIVING = {14: 2.21, 17: 3.06, 20: 3.89, 25: 7.26}
_EFFICIENCY = {14: 0.67, 17: 0.77, 20: 0.77, 25: 0.77}

_RADIUS_MM = {14: 17.78, 17: 21.59, 20: 25.40, 25: 31.75}

SIZES_AND_RATIOS = tuple((one.size, one.ratio) for one in rated_gears("csg") if one.size in SIZES)
"""The (size, ratio) pairs of the CSG series with ratings on record."""


def friction_figures(size: int) -> FrictionFigures:
    """What is printed about the friction of one size at ratio 100, 20 °C.

    Args:
        size: 14, 17, 20 or 25.

    Raises:
        KeyError: no figures on record for this size.
    """
    running = [(2000.0, Figure(_RUNNING_2000[size], TPI))]
    if size == 20:
        running.append((3500.0, Figure(160e-3, CPL)))
    return FrictionFigures(
        input_starting_torque=Figure(_STARTING[size], TPI),
        running_torque=tuple(running),
        back_driving_torque=Figure(_BACK_DRIVING[size], TPI),
        efficiency=Figure(_EFFICIENCY[size], TPI),
    )


def csg_figures(size: int, ratio: int) -> CatalogueFigures:
    """Everything printed about a CSG gear.

    Args:
        size: 14, 17, 20 or 25.
        ratio: one of the ratios on record for that size.

    Raises:
        KeyError: no ratings on record for this size and ratio.
    """
    limits = ratings(f"csg-{size}-{ratio}")
    if size not in SIZES or limits.rated_torque is None:
        raise KeyError(f"csg-{size}-{ratio}")
    friction = friction_figures(size) if ratio == 100 else None
    return CatalogueFigures(
        name=f"csg-{size}-{ratio}",
        size=size,
        ratio=ratio,
        rated_torque=limits.rated_torque,
        average_torque=limits.average_torque,
        repeated_peak_torque=limits.repeated_peak_torque,
        momentary_peak_torque=limits.momentary_peak_torque,
        ratcheting_torque=limits.ratcheting_torque,
        buckling_torque=limits.buckling_torque,
        input_starting_torque=friction.input_starting_torque if friction else None,
        running_torque=friction.running_torque if friction else (),
        back_driving_torque=friction.back_driving_torque if friction else None,
        efficiency=friction.efficiency if friction else None,
        pitch_radius=Figure(_RADIUS_MM[size] * 1e-3, TPI_RADIUS),
        **printed_gear(size, ratio),
    )
