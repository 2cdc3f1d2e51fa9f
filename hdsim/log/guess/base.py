"""A base scenario for a drafted mapping: the plainest drive of its ratio, for a diagnosis to begin with."""

from __future__ import annotations

from hdsim.log.guess.findings import Draft

#: Torsion of a drive from its rated torque, of CSG-20-100 (40 N m): stiffness per rated torque in 1/rad, and
#: the ends of the segments. Harmonic Drive LLC, CSF/CSG catalogue.
_STIFFNESS = (400.0, 625.0, 725.0)
_ENDS = (0.175, 0.625)
#: Damping of that spring over its stiffness, s: an estimate.
_DAMPING = 6e-4
#: Input inertias of that drive, kg m^2 per (N m)^(5/3): mass goes with the cube of the size, as torque does.
_INERTIA = (3e-5 / 40 ** (5 / 3), 1e-5 / 40 ** (5 / 3))


def base_scenario(draft: Draft) -> str | None:
    """YAML of a scenario; None where the ratio is not known or is that of no drive with two-lobed teeth."""
    ratio = draft.ratio.value if draft.ratio is not None else None
    if ratio is None or abs(2 * ratio - round(2 * ratio)) > 1e-9:
        return None
    # Both arrangements have a difference of two teeth: with the circular spline held the output turns against
    # the motor, at flexspline teeth over two; with the flexspline held along with it, at circular spline
    # teeth over two.
    larger = round(2 * abs(ratio))
    teeth = (larger - 2, larger) if ratio > 0 else (larger, larger + 2)
    held = "flexspline_fixed" if ratio > 0 else "circular_spline_fixed"
    peak = draft.peak_output_nm
    rated = _rounded(peak / 2.0 if peak else 40.0)
    said = (
        f"half of the largest torque seen, {peak:.3g} N m" if peak else "an estimate, for no torque was seen"
    )
    k1, k2, k3 = (f"{_rounded(k * rated):g}" for k in _STIFFNESS)
    t1, t2 = (f"{_rounded(t * rated):g}" for t in _ENDS)
    motor, generator = (f"{_rounded(i * rated ** (5 / 3)):.2e}" for i in _INERTIA)
    both = {"motor_angle", "output_angle"} <= set(draft.channels)
    # With both angles the twist between them is seen, and needs a spring.
    mesh = "  mesh: {model: lumped}" if both else "  mesh: {model: rigid}"
    damping = f"{_rounded(_DAMPING * _STIFFNESS[1] * rated):g}"
    return f"""# The plainest model for {draft.title}, by hdsim mapping: no friction, no play.
# Only the ratio is the recording's. The other numbers are those of a CSG drive of this rated torque, scaled:
# put your drive's own here, or a preset (hdsim presets).
name: base for {_plain(draft.title)}
drive:
  rated_torque_nm: {rated:g}  # {said}
  arrangement: {held}
  geometry: {{flexspline_teeth: {teeth[0]}, circular_spline_teeth: {teeth[1]}}}
  torsion:
    stiffness_k1_nm_per_rad: {k1}
    stiffness_k2_nm_per_rad: {k2}
    stiffness_k3_nm_per_rad: {k3}
    torque_t1_nm: {t1}
    torque_t2_nm: {t2}
    damping_nm_s_per_rad: {damping}
  inertia: {{motor_kg_m2: {motor}, wave_generator_kg_m2: {generator}}}
{mesh}
command:
  motor: {{type: free}}
load: {{inertia_kg_m2: 1.0e-4}}
run: {{duration_s: 1.0}}
"""


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _plain(title: str) -> str:
    return "".join(c if c.isalnum() or c in " ._-" else " " for c in title)
