"""What makers print about strain-wave gears, number by number, each with where it was read.

Ratings are those of the CSG series (cup type, high torque) in sizes 14, 17, 20 and 25. Figures that belong to
the size and the ratio rather than to the series (stiffness, accuracy) come from the same maker's actuators
with these gears. A number that no source gives is None: nothing is filled in here; ``hdsim.drive.presets``
does the estimating.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Confidence = Literal["read", "copied", "quoted"]
"""How a number came here: ``read`` on the maker's or author's own page; ``copied`` from somebody else's copy
of the maker's page, which was read; ``quoted`` as commonly quoted from the catalogue, not read again."""

ARCMIN = 2.908882086657216e-4
"""One minute of arc, rad."""

SIZES = (14, 17, 20, 25)
"""Sizes with stiffness, friction and inertia on record."""


@dataclass(frozen=True)
class Source:
    """Where a number was found.

    Args:
        citation: document, page or table.
        confidence: how directly it was seen.
    """

    citation: str
    confidence: Confidence


@dataclass(frozen=True)
class Figure:
    """A number in SI units with its source."""

    value: float
    source: Source


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
CHA = Source("Harmonic Drive AG, CHA manual 1018854 08/2018 V03, p. 54, Tables 54.1 and 54.3", "read")
TPI = Source(
    "Schaeffler TPI 275, series RT1-H-CS, i = 100, 20 °C; zhulu248/harmonic-drive-twin catalogue.py", "copied"
)
CPL = Source(
    "Harmonic Drive AG, CPL20-2A, 3500 rpm, 20 °C; geez0x1/CompliantJointToolbox, early param/CE_Med_ds.m",
    "copied",
)
TPI_RADIUS = Source("Schaeffler TPI 275, pitch radius; zhulu248/harmonic-drive-twin catalogue.py", "copied")
RATCHETING = Source("Harmonic Drive LLC, CSF/CSG catalogue, p. 14, not re-read", "quoted")
INERTIA_COMPONENT = Source(
    "Harmonic Drive LLC, CSF rating table, moment of inertia; row copied in a public table-extraction test",
    "copied",
)
GEAR_DB = Source(
    "Harmonic Drive CSG and SHG (same ratings) data; copied, naming no document, in a robot model's gear_db",
    "copied",
)
PRODUCT_PAGE = Source(
    "harmonicdrive.net, CSG-2UH product page of this size and ratio; copied, with the link, in a repository",
    "copied",
)
PROJECT = Source("Harmonic Drive CSG data of this size and ratio; copied in a public robot project", "copied")
QUOTED = Source("Harmonic Drive LLC, CSF/CSG catalogue, CSG rating table (p. 10), not re-read", "quoted")

_STIFFNESS_LIMITS = {14: (2.0, 6.9), 17: (3.9, 12.0), 20: (7.0, 25.0), 25: (14.0, 48.0)}
_STIFFNESS_50 = {
    14: (3.4e3, 4.7e3, 5.7e3),
    17: (8.1e3, 11e3, 13e3),
    20: (13e3, 18e3, 23e3),
    25: (25e3, 34e3, 44e3),
}
_STIFFNESS_ABOVE = {
    14: (4.7e3, 6.1e3, 7.1e3),
    17: (10e3, 14e3, 16e3),
    20: (16e3, 25e3, 29e3),
    25: (31e3, 50e3, 57e3),
}
_ACCURACY_ARCMIN = {14: (1.2, 1.0), 17: (1.2, 1.0), 20: (1.0, 0.8), 25: (1.0, 0.8)}  # ratio 50, above 50

_STARTING = {14: 21e-3, 17: 29e-3, 20: 37e-3, 25: 69e-3}
_RUNNING_2000 = {14: 35e-3, 17: 51e-3, 20: 105e-3, 25: 195e-3}
_BACK_DRIVING = {14: 2.21, 17: 3.06, 20: 3.89, 25: 7.26}
_EFFICIENCY = {14: 0.67, 17: 0.77, 20: 0.77, 25: 0.77}

_INERTIA = {
    14: (0.033e-4, INERTIA_COMPONENT),
    17: (0.079e-4, INERTIA_COMPONENT),
    20: (0.193e-4, GEAR_DB),
    25: (0.413e-4, GEAR_DB),
}
_RADIUS_MM = {14: 17.78, 17: 21.59, 20: 25.40, 25: 31.75}

# Rated, average, repeated peak, momentary peak torque in N m, each with its source. Where the copied gear_db
# contradicts itself or the catalogue as quoted, the value that fits the quoted one is taken: momentary peaks
# of 17-50 (127 there, which is size 20), 17-100 (109 for CSG, 143 for SHG) and 17-120 (143 for SHG), average
# torque of 17-80 (38 for CSG, 39.93 for SHG), peaks of 14-100 (the same as 14-80 there).
_P, _C, _R, _Q = PRODUCT_PAGE, GEAR_DB, PROJECT, QUOTED
_RATINGS: dict[tuple[int, int], tuple[tuple[float, Source], ...]] = {
    (14, 50): ((7.0, _Q), (9.0, _Q), (23.0, _Q), (46.0, _Q)),
    (14, 80): ((10.0, _C), (14.0, _C), (30.0, _C), (61.0, _C)),
    (14, 100): ((10.0, _C), (14.0, _C), (36.0, _Q), (70.0, _Q)),
    (17, 50): ((21.0, _C), (34.0, _C), (44.0, _C), (91.0, _Q)),
    (17, 80): ((29.0, _C), (35.0, _Q), (56.0, _C), (113.0, _C)),
    (17, 100): ((31.0, _C), (51.0, _C), (70.0, _C), (143.0, _C)),
    (17, 120): ((31.0, _C), (51.0, _C), (70.0, _C), (112.0, _Q)),
    (20, 50): ((33.0, _C), (44.0, _C), (73.0, _C), (127.0, _C)),
    (20, 80): ((44.0, _Q), (61.0, _Q), (96.0, _Q), (165.0, _Q)),
    (20, 100): ((52.0, _P), (64.0, _P), (107.0, _P), (191.0, _P)),
    (20, 120): ((52.0, _Q), (64.0, _Q), (113.0, _Q), (191.0, _Q)),
    (20, 160): ((52.0, _R), (64.0, _Q), (120.0, _R), (191.0, _R)),
    (25, 50): ((51.0, _P), (72.0, _P), (127.0, _P), (242.0, _P)),
    (25, 80): ((82.0, _Q), (113.0, _Q), (178.0, _Q), (332.0, _R)),
    (25, 100): ((87.0, _R), (140.0, _Q), (204.0, _R), (369.0, _R)),
    (25, 120): ((87.0, _Q), (140.0, _Q), (217.0, _Q), (395.0, _Q)),
    (25, 160): ((87.0, _Q), (140.0, _Q), (229.0, _Q), (408.0, _Q)),
}

_RATCHETING = {(20, 100): 330.0}

SIZES_AND_RATIOS = tuple(_RATINGS)
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
    rated, average, repeated, momentary = (Figure(*cell) for cell in _RATINGS[size, ratio])
    column = 0 if ratio == 50 else 1
    k1, k2, k3 = (_STIFFNESS_50 if ratio == 50 else _STIFFNESS_ABOVE)[size]
    t1, t2 = _STIFFNESS_LIMITS[size]
    ratcheting = _RATCHETING.get((size, ratio))
    friction = friction_figures(size) if ratio == 100 else None
    return CatalogueFigures(
        name=f"csg-{size}-{ratio}",
        size=size,
        ratio=ratio,
        rated_torque=rated,
        average_torque=average,
        repeated_peak_torque=repeated,
        momentary_peak_torque=momentary,
        ratcheting_torque=None if ratcheting is None else Figure(ratcheting, RATCHETING),
        torque_t1=Figure(t1, CHA),
        torque_t2=Figure(t2, CHA),
        stiffness_k1=Figure(k1, CHA),
        stiffness_k2=Figure(k2, CHA),
        stiffness_k3=Figure(k3, CHA),
        input_starting_torque=friction.input_starting_torque if friction else None,
        running_torque=friction.running_torque if friction else (),
        back_driving_torque=friction.back_driving_torque if friction else None,
        efficiency=friction.efficiency if friction else None,
        hysteresis_loss=Figure(ARCMIN, CHA),
        lost_motion=Figure(ARCMIN, CHA),
        accuracy=Figure(_ACCURACY_ARCMIN[size][column] * ARCMIN, CHA),
        repeatability=Figure(0.1 * ARCMIN, CHA),
        wave_generator_inertia=Figure(*_INERTIA[size]),
        pitch_radius=Figure(_RADIUS_MM[size] * 1e-3, TPI_RADIUS),
    )
