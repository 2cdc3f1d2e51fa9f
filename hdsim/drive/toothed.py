"""The teeth of one drive: gaps, pitch errors, contact, engagement, and the structure behind them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from hashlib import sha256
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.contact.parameters import ContactParameters, TableLawParameters
from hdsim.drive import _mesh_layout as place
from hdsim.drive import _teeth, spring
from hdsim.drive.parameters import ClearanceEngagement, Drive, TabulatedMesh, ToothedMesh, WindowEngagement
from hdsim.drive.tabulated import potential_table
from hdsim.errors import PhysicsError

if TYPE_CHECKING:
    from hdsim.contact.kernel_table import ContactTable
    from hdsim.contact.law import ContactLaw
    from hdsim.surface.flank import Flank

Array = NDArray[np.float64]

#: Nodes of the gap along a tooth's flank, over half a turn of the wave generator.
FLANK_CELLS = 64
#: Angles of the wave generator over which an average is taken, within one tooth pitch and beyond.
PROBES = 24


def _series_law(contact: ContactParameters, surface: Flank, bending: float | None) -> ContactLaw:
    from hdsim.contact import SeriesLaw

    law = contact.build(surface)
    return law if bending is None else SeriesLaw(law, bending)


# A contact depends on D, G and material, not on the random phases: drives of one design share it.
_kept_law = lru_cache(maxsize=32)(_series_law)


#: Force of the most loaded tooth at the momentary peak torque, over the mean one at rated torque (estimate:
#: that torque is up to 6.6 times the rated one, and a cosine-squared share of it 1.7 times the mean).
_PEAK_OVER_RATED = 11.0


@lru_cache(maxsize=32)
def _kept_table(law: ContactLaw, largest_force_n: float) -> ContactTable:
    """Table of a law; laws are compared by identity, so this is for those that ``_kept_law`` shares."""
    from hdsim.contact import ValidityWarning, tabulate

    with warnings.catch_warnings():
        # The table's end is no force that a tooth reaches.
        warnings.simplefilter("ignore", ValidityWarning)
        return tabulate(law, largest_force_n, measure_error=False)


class Teeth:
    """All teeth of a drive as numbers for the compiled meshes.

    Args:
        drive: the drive.
        mesh: its mesh section.
        wind_ups: springs that effects put in series, torque (N m) to twist (rad) at the output.
        extra_half_gap_rad: half-gap beyond the surfaces' (wear), or less than theirs (preload), rad at the
            output.
        seed: seed of surfaces and pitch errors.
        gap_growth: part of its own gap by which each tooth's is wider than when it was calibrated.

    Attributes:
        parameters: the compiled mesh's numbers.
        fingerprint: of all that the teeth's potential depends on.
        half_gaps_m: shape (teeth,), average half-gap of each tooth, m.
        pitch_errors_m: shape (teeth,), m.
        law: contact of one tooth pair, bending included.
        table_error: for a tabulated mesh, the largest torque error found at points between the nodes, as a
            share of the rated torque; else None.
    """

    def __init__(
        self,
        drive: Drive,
        mesh: ToothedMesh,
        wind_ups: Sequence[Callable[[Array], Array]],
        *,
        extra_half_gap_rad: float,
        seed: int,
        gap_growth: float = 0.0,
    ) -> None:
        self.drive = drive
        self.mesh = mesh
        geometry = drive.geometry
        self.count = geometry.flexspline_teeth
        self.radius_m = geometry.pitch_radius_m
        self.lever_m = self.radius_m * float(np.cos(np.radians(geometry.pressure_angle_deg)))
        fixed = drive.arrangement == "circular_spline_fixed"
        gain = 1.0 if fixed else -geometry.circular_spline_teeth / self.count
        self.scale = abs(gain)
        self.rated_tooth_force_n = drive.rated_torque_nm / (mesh.engagement.share * self.count * self.lever_m)
        self.law = self._law()
        self.pitch_errors_m = self._pitch_errors(seed)
        self.table_error: float | None = None

        header = np.zeros(place.HEADER)
        header[place.TEETH] = self.count
        header[place.GAIN] = gain
        header[place.OUTPUT_SHARE] = 0.0 if fixed else 1.0
        header[place.KAPPA] = 1.0 if fixed else 0.0
        header[place.INVERSE_RATIO] = 1 / drive.ratio
        header[place.LEVER] = self.lever_m
        header[place.SMOOTHING] = mesh.gap_smoothing_m
        header[place.LARGEST_PITCH_ERROR] = float(np.max(np.abs(self.pitch_errors_m)))
        self._blocks: list[Array] = [header]
        self._length = place.HEADER
        self._so_far = np.zeros(0)
        self._header = header
        self._place_contact()
        self._place_gaps(seed)
        # Twice over, so that any run of neighbouring teeth is contiguous.
        header[place.PITCH_ERROR_AT] = self._place(np.tile(self.pitch_errors_m, 2))
        # The wear comes last: the catalogue's stiffness belongs to the new drive, preload and all.
        extra_gap = extra_half_gap_rad * self.scale * self.lever_m
        header[place.EXTRA_GAP] = min(extra_gap, 0.0)
        self._place_engagement()
        new = header.copy()
        teeth = [*self._blocks]
        self._place_structure(wind_ups)
        self._grow_gaps(gap_growth)
        header[place.EXTRA_GAP] = new[place.EXTRA_GAP] = extra_gap
        alone = np.concatenate([new, *teeth[1:]])
        self.fingerprint = sha256(alone.tobytes()).hexdigest()
        if isinstance(mesh, TabulatedMesh):
            self._place_table(mesh, alone)
        self.parameters = np.concatenate(self._blocks)

    def _place(self, values: Array) -> int:
        at = self._length
        self._blocks.append(np.asarray(values, dtype=np.float64).ravel())
        self._length += values.size
        return at

    def warn(self) -> None:
        """Warn where the contact's law is not valid at loads that the drive sees."""
        self.law.warn_beyond_validity(_PEAK_OVER_RATED * self.rated_tooth_force_n)

    def _law(self) -> ContactLaw:
        """Contact in series with the bending of the tooth."""
        mesh = self.mesh
        if isinstance(mesh.contact, TableLawParameters):
            # Its file may change between two drives of one process.
            return _series_law(mesh.contact, mesh.flanks.equivalent(), mesh.tooth_bending_stiffness_n_per_m)
        return _kept_law(mesh.contact, mesh.flanks.equivalent(), mesh.tooth_bending_stiffness_n_per_m)

    def _pitch_errors(self, seed: int) -> Array:
        errors = np.random.default_rng([seed, 2]).normal(0.0, 1.0, self.count) * self.mesh.pitch_error_m
        return np.asarray(errors - errors.mean())

    def _place_contact(self) -> None:
        table = _kept_table(self.law, 20 * self.rated_tooth_force_n)
        header = self._header
        header[place.CONTACT_STEP] = table.step_m
        header[place.CONTACT_CELLS] = table.count
        header[place.CONTACT_AT] = self._place(table.coefficients)

    def _place_gaps(self, seed: int) -> None:
        """Each tooth's half-gap as cells over the angle from the major axis (one cell: a constant)."""
        mesh = self.mesh
        header = self._header
        before = len(self._blocks)
        if mesh.half_gap_m is not None or not mesh.gap_along_flank:
            if mesh.half_gap_m is not None:
                self.half_gaps_m = np.full(self.count, mesh.gap_factor * mesh.half_gap_m)
            else:
                self.half_gaps_m = mesh.gap_factor * mesh.flanks.half_gaps(self.count, seed)
            cells = np.zeros((self.count, 1, 4))
            cells[:, 0, 0] = self.half_gaps_m
            if isinstance(mesh.engagement, WindowEngagement) and mesh.gap_smoothing_m == 0.0:
                header[place.CONSTANT_GAPS_AT] = self._place(np.tile(self.half_gaps_m, 2))
        else:
            from scipy.interpolate import PchipInterpolator

            nodes = np.linspace(-np.pi / 2, np.pi / 2, FLANK_CELLS + 1)
            gaps = mesh.gap_factor * mesh.flanks.sliding_half_gaps(self.count, FLANK_CELLS + 1, seed)
            # Half a turn on, the tooth meets the other lobe at the same place of its flank.
            gaps[:, 0] = gaps[:, -1] = 0.5 * (gaps[:, 0] + gaps[:, -1])
            # Monotone pieces: a spline would overshoot to negative gaps.
            curve = PchipInterpolator(nodes, gaps, axis=1)
            cells = np.moveaxis(curve.c[::-1], (0, 1, 2), (2, 1, 0))
            self.half_gaps_m = gaps.mean(axis=1)
        header[place.GAP_CELLS] = cells.shape[1]
        header[place.GAP_AT] = self._place(np.ascontiguousarray(cells))
        self._gap_blocks = self._blocks[before:]

    def _place_engagement(self) -> None:
        header = self._header
        engagement = self.mesh.engagement
        if isinstance(engagement, WindowEngagement):
            half = engagement.share * np.pi / 2
            edge = engagement.edge_teeth * np.pi / self.count
            if edge > half or half + edge > np.pi / 2:
                raise PhysicsError(
                    f"edge_teeth = {engagement.edge_teeth:g} does not fit an arc of "
                    f"{half * self.count / np.pi:.1f} teeth within half a turn"
                )
            header[place.PLATEAU], header[place.BORDER] = half - edge, half + edge
            return
        header[place.KIND] = 1.0
        if engagement.clearance_m is not None:
            header[place.CLEARANCE] = engagement.clearance_m
        else:
            header[place.CLEARANCE] = self._calibrated_clearance(engagement)

    def _calibrated_clearance(self, engagement: ClearanceEngagement) -> float:
        """Clearance at which the wanted share of teeth touches at rated torque, by bisection."""
        from scipy.optimize import brentq

        def excess(logarithm: float) -> float:
            self._header[place.CLEARANCE] = np.exp(logarithm)
            _, share = self.loaded(self.drive.rated_torque_nm / self.scale)
            return share - engagement.share

        low, high = np.log(1e-8), np.log(1e-2)
        if excess(low) < 0 or excess(high) > 0:
            raise PhysicsError(
                f"no clearance between 1e-8 and 1e-2 m engages {engagement.share:.0%} of the teeth"
            )
        return float(np.exp(brentq(excess, low, high, xtol=1e-4)))

    def _grow_gaps(self, growth: float) -> None:
        """Widen each tooth's own gap by a part of itself."""
        for block in self._gap_blocks:
            block *= 1.0 + growth
        self.half_gaps_m = (1.0 + growth) * self.half_gaps_m

    def close_gaps(self, numbers: Array) -> None:
        """Close the surfaces' gaps in a built mesh; the structure keeps the stiffness that it was calibrated
        to.

        Args:
            numbers: the compiled mesh's numbers, changed in place. The potential of a tabulated mesh is not.
        """
        first, length = int(numbers[place.GAP_AT]), self.count * int(numbers[place.GAP_CELLS]) * 4
        numbers[first : first + length] = 0.0
        if constant := int(numbers[place.CONSTANT_GAPS_AT]):
            numbers[constant : constant + 2 * self.count] = 0.0

    def remove_pitch_errors(self, numbers: Array) -> None:
        """Take the pitch errors out of a built mesh; see ``close_gaps``."""
        first = int(numbers[place.PITCH_ERROR_AT])
        numbers[first : first + 2 * self.count] = 0.0
        numbers[place.LARGEST_PITCH_ERROR] = 0.0

    def torque(self, twist: float) -> tuple[float, float]:
        """Mean over the wave generator's angle of mesh torque (N m) and engaged share at a twist (rad)."""
        # Called hundreds of times while the drive is built: the numbers so far are put together once.
        if len(self._so_far) != self._length:
            self._so_far = np.concatenate(self._blocks)
        self._so_far[: place.HEADER] = self._header
        angles = np.arange(PROBES) * np.pi / PROBES * (1 + 1 / self.count)
        samples = _teeth.potentials(self._so_far, self.lever_m * twist, angles)
        return float(samples[:, 1].mean() * self.lever_m), float(samples[:, 6].mean() / self.count)

    def loaded(self, torque_nm: float) -> tuple[float, float]:
        """Mesh twist (rad, at the ring) and engaged share at a mean mesh torque (N m)."""
        from scipy.optimize import brentq

        low, high = 0.0, 1e-5
        while self.torque(high)[0] < torque_nm:
            high *= 2
            if high > 1.0:
                raise PhysicsError(f"the mesh does not reach {torque_nm:g} N m at a twist of {high:g} rad")
        # Pitch errors press teeth against each other even at no twist.
        while self.torque(low)[0] > torque_nm:
            low = min(-1e-5, 2 * low)
            if low < -1.0:
                raise PhysicsError(f"the mesh does not reach {torque_nm:g} N m at a twist of {low:g} rad")
        twist = float(brentq(lambda angle: self.torque(angle)[0] - torque_nm, low, high, xtol=1e-13))
        return twist, self.torque(twist)[1]

    def wind_up(self, torque_nm: float) -> float:
        """Twist (rad) of the mesh by a torque (N m), both at the output.

        Pitch errors also shift its zero; with them it is half of that between plus and minus the torque.
        """
        twist = self.loaded(torque_nm / self.scale)[0]
        if self._header[place.LARGEST_PITCH_ERROR] > 0.0:
            twist = 0.5 * (twist - self.loaded(-torque_nm / self.scale)[0])
        return twist / self.scale

    def _place_structure(self, wind_ups: Sequence[Callable[[Array], Array]]) -> None:
        torsion = self.drive.torsion
        rated = self.drive.rated_torque_nm

        self.structure_wind_up = spring.structure_wind_up(torsion, rated, self.wind_up)
        step, numbers = spring.spring_numbers(
            [self.structure_wind_up, *wind_ups],
            [torsion.torque_t1_nm, torsion.torque_t2_nm, rated],
            spring.TABLE_REACH * rated,
            scale=self.scale,
        )
        header = self._header
        header[place.SPRING_STEP] = step
        header[place.SPRING_CELLS] = spring.CELLS
        header[place.SPRING_AT] = self._place(numbers)

    def _place_table(self, mesh: TabulatedMesh, teeth: Array) -> None:
        """The teeth's potential as a table, and its measured error."""
        reach = self.lever_m * self.loaded(4 * self.drive.rated_torque_nm / self.scale)[0]
        table = potential_table(teeth, reach, mesh.twist_nodes, mesh.angle_nodes)
        header = self._header
        header[place.TABLE_TWIST_STEP] = table.step_m
        header[place.TABLE_TWIST_START] = table.start_m
        header[place.TABLE_TWIST_NODES] = len(table.coefficients)
        header[place.TABLE_ANGLE_NODES] = mesh.angle_nodes
        header[place.TABLE_AT] = self._place(table.coefficients)
        self.table_error = table.force_error_n * self.lever_m * self.scale / self.drive.rated_torque_nm

    def chain(self) -> dict[str, float]:
        """Compliance budget at rated torque: share of the wind-up in contact and gap, bending, structure."""
        rated = self.drive.rated_torque_nm
        total = float(spring.catalogue_wind_up(self.drive.torsion, np.array(rated)))
        mesh = self.wind_up(rated)
        bending = self.mesh.tooth_bending_stiffness_n_per_m
        bent = 0.0 if bending is None else self.rated_tooth_force_n / bending / self.lever_m / self.scale
        wave_generator = self.drive.torsion.wave_generator_stiffness_nm_per_rad
        turned = 0.0 if wave_generator is None else rated / wave_generator
        return {
            "contact and gap": (mesh - bent) / total,
            "tooth bending": bent / total,
            "wave-generator bearing": turned / total,
            "cup torsion": (total - mesh - turned) / total,
        }
