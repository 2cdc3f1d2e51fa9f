"""Numbers, names and units as they are written."""

import pytest

from hdsim.effects import catalogue
from hdsim.effects._fitting import Amplitude, Harmonic, Inverse
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.state import state_of
from hdsim.tell.words import below, named_number, of_ten, shown

#: Unit of every number that a fit of the catalogue or of a model may report, written down by hand.
EXPECTED = {
    "base_flexibility.natural_frequency_hz": "Hz",
    "base_flexibility.stiffness_nm_per_rad": "N m/rad",
    "damaged_tooth.amplitude_arcmin": "arcmin",
    "damaged_tooth.position_deg": "deg",
    "damaged_tooth.width_deg": "deg",
    "flank_wear.growth": "",
    "flexspline_stiffening.coefficient_per_nm": "1/(N m)",
    "flexspline_stiffening.stiffness_nm_per_rad": "N m/rad",
    "input_coulomb_viscous.coulomb_nm": "N m",
    "input_coulomb_viscous.viscous_nm_s_per_rad": "N m s/rad",
    "kinematic_error.components.amplitude_arcmin": "arcmin",
    "kinematic_error.components.order": "",
    "kinematic_error.components.phase_deg": "deg",
    "load_dependent_kinematic_error.components.phase_deg": "deg",
    "load_dependent_kinematic_error.components.stiffness_nm_per_rad": "N m/rad",
    "load_dependent_loss.back_driving_coefficient": "",
    "load_dependent_loss.coefficient": "",
    "load_dependent_loss.load_exponent": "",
    "load_side_friction.coulomb_nm": "N m",
    "load_side_friction.viscous_nm_s_per_rad": "N m s/rad",
    "lugre_friction.coulomb_nm": "N m",
    "lugre_friction.static_nm": "N m",
    "lugre_friction.stiffness_nm_per_rad": "N m/rad",
    "lugre_friction.stribeck_exponent": "",
    "lugre_friction.stribeck_velocity_rad_per_s": "rad/s",
    "mesh_preload.interference_arcmin": "arcmin",
    "motor_torque_ripple.components.cogging_nm": "N m",
    "motor_torque_ripple.components.order": "",
    "motor_torque_ripple.components.phase_deg": "deg",
    "nonlinear_viscous_friction.drag_nm": "N m",
    "nonlinear_viscous_friction.speed_exponent": "",
    "output_backlash.backlash_arcmin": "arcmin",
    "output_backlash.components.amplitude_arcmin": "arcmin",
    "output_backlash.components.phase_deg": "deg",
    "output_backlash.gap_spread": "",
    "output_backlash.film_share": "",
    "output_backlash.uptake_torque_nm": "N m",
    "output_backlash.coefficient_per_nm": "1/(N m)",
    "output_eccentricity.eccentricity_um": "µm",
    "output_eccentricity.phase_deg": "deg",
    "position_dependent_friction.components.amplitude_nm": "N m",
    "position_dependent_friction.components.phase_deg": "deg",
    "sensors.motor_angle.eccentricity_arcmin": "arcmin",
    "sensors.motor_angle.eccentricity_phase_deg": "deg",
    "sensors.output_angle.delay_s": "s",
    "sensors.output_angle.eccentricity_arcmin": "arcmin",
    "sensors.output_angle.eccentricity_phase_deg": "deg",
    "sensors.output_angle.ripple.amplitude_arcsec": "arcsec",
    "sensors.output_angle.ripple.order": "",
    "sensors.output_angle.ripple.phase_deg": "deg",
    "sensors.output_torque.ripple.amplitude_nm": "N m",
    "sensors.output_torque.ripple.order": "",
    "sensors.output_torque.ripple.phase_deg": "deg",
    "stiffness_nonlinearity.cubic_nm_per_rad3": "N m/rad³",
    "stribeck_friction.extra_static_nm": "N m",
    "stribeck_friction.stribeck_exponent": "",
    "stribeck_friction.stribeck_velocity_rad_per_s": "rad/s",
    "thermal_friction.heat_capacity_j_per_k": "J/K",
    "thermal_friction.viscosity_coefficient_per_k": "1/K",
    "thermal_stiffness.stiffness_coefficient_per_k": "1/K",
    "torsional_hysteresis_duhem.exponent": "",
    "torsional_hysteresis_duhem.saturation_torque_nm": "N m",
    "torsional_hysteresis_duhem.saturation_twist_mrad": "mrad",
    "torsional_hysteresis_maxwell.share_exponent": "",
    "torsional_hysteresis_maxwell.slip_torque_nm": "N m",
    "torsional_hysteresis_maxwell.slip_twist_scale": "",
    "unbalance.motor_kg_m": "kg m",
    "unbalance.motor_phase_deg": "deg",
    "unbalance.output_kg_m": "kg m",
    "unbalance.output_phase_deg": "deg",
    "wave_generator_bearing.ball_to_pitch_diameter": "",
    "wave_generator_bearing.components.friction_nm": "N m",
    "wave_generator_bearing.components.phase_deg": "deg",
    "wave_generator_compliance.coefficient_per_nm": "1/(N m)",
    "wave_generator_compliance.stiffness_nm_per_rad": "N m/rad",
    "wave_generator_eccentricity.eccentricity_um": "µm",
    "wave_generator_eccentricity.phase_deg": "deg",
    "tooth_error.shift_um": "µm",
    "tooth_error.tooth": "",
}
OF_THE_MODEL = {
    "drive.inertia.motor_kg_m2": "kg m²",
    "load.inertia_kg_m2": "kg m²",
    "load.gravity.mass_kg": "kg",
    "drive.torsion.stiffness_k1_nm_per_rad": "N m/rad",
    "drive.torsion.damping_nm_s_per_rad": "N m s/rad",
    "drive.friction.coulomb_nm": "N m",
    "drive.friction.viscous_nm_s_per_rad": "N m s/rad",
    "drive.friction.load_coefficient": "",
    "motor_torque_gain": "",
    "output_torque_gain": "",
    "motor_torque_delay_s": "s",
    "output_torque_delay_s": "s",
}


def fitted_fields() -> set[str]:
    """Paths of all numbers that fittings of the catalogue report, without the places in lists."""
    found = set()
    for name, effect in catalogue().items():
        for fitting in (*getattr(effect, "fittings", ()), *effect.finer):
            paths = [shape.path for shape in fitting.shapes]
            for term in fitting.terms:
                if isinstance(term, Amplitude):
                    paths += term.units
                elif isinstance(term, Inverse):
                    paths.append(term.path)
                elif isinstance(term, Harmonic):
                    paths += [term.amplitude, term.phase]
                else:
                    paths += [f"{term.section}.{last}" for last in (term.amplitude, "phase_deg", "order")]
            found |= {
                ".".join([name, *(part for part in path.split(".") if not part.isdigit())]) for path in paths
            }
    return found


def test_every_fitted_field_is_in_the_list():
    assert fitted_fields() == set(EXPECTED)


@pytest.mark.parametrize("path", [*EXPECTED, *OF_THE_MODEL])
def test_every_fitted_field_has_its_unit(path):
    words, unit = named_number(path)
    assert unit == (EXPECTED | OF_THE_MODEL)[path]
    assert "_" not in words
    assert not words.endswith(" per")


def test_the_model_has_no_other_numbers(base):
    import hdsim

    state = state_of(hdsim.load_scenario(base))
    names = {free.name for free in base_freedoms(state, ("motor_torque", "output_torque"))}
    assert names <= set(OF_THE_MODEL)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (16000.0, "16000"),
        (0.0245, "0.0245"),
        (5.198e-05, "5.198e-5"),
        (-126.44, "-126.4"),
        (2e7, "2e7"),
    ],
)
def test_numbers_are_shown_without_needless_exponents(value, text):
    assert shown(value) == text
    assert float(text) == pytest.approx(value, rel=1e-3)


def test_paths_become_words_and_units():
    assert named_number("drive.torsion.damping_nm_s_per_rad") == ("torsional damping", "N m s/rad")
    components = {"components": [{"order": 2, "per": "output_turn"}]}
    assert named_number("components.0.amplitude_arcmin", components) == (
        "order 2 per output turn, amplitude",
        "arcmin",
    )
    assert named_number("curves.1.values_nm") == ("curves, no. 2, values", "N m")


@pytest.mark.parametrize(
    ("probability", "text"),
    [(0.6, "6 in 10"), (0.89, "9 in 10"), (0.95, "19 in 20"), (0.98, "49 in 50"), (0.9999, "over 99 in 100"),
     (0.0, "0 in 10")],
)  # fmt: skip
def test_a_probability_is_so_many_of_ten_or_of_more(probability, text):
    assert of_ten(probability) == text


def test_a_certain_chance_is_a_hundred_per_cent():
    assert [below(chance) for chance in (1.0, 0.126, 0.0123, 0.005)] == [
        "100\u00a0%",
        "13\u00a0%",
        "1.2\u00a0%",
        "less than 0.5\u00a0%",
    ]
