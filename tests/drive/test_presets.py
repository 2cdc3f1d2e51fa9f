"""Presets against the printed tables, and against solutions that do not share their code."""

import math
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdsim.drive.catalogue import SIZES_AND_RATIOS
from hdsim.drive.presets import catalogue_figures, friction_from_catalogue, preset, preset_names
from hdsim.drive.printed import ARCMIN, Figure
from hdsim.drive.printed_gear import printed_gear
from hdsim.errors import PhysicsError

SIZES = (14, 17, 20, 25)


def printed_friction(name):
    figures = catalogue_figures(name)
    assert figures.input_starting_torque is not None
    return figures


def test_every_preset_is_a_valid_drive():
    from hdsim.drive.parameters import Drive

    for name in preset_names():
        drive = Drive.model_validate({"preset": name})
        figures = catalogue_figures(name)
        assert drive.rated_torque_nm == figures.rated_torque.value
        assert drive.ratio == -figures.ratio
        assert drive.friction.coulomb_nm > 0.0
        assert drive.mesh.model == "teeth"


def test_what_the_user_gives_wins_over_the_preset_and_the_rest_stays():
    from hdsim.drive.parameters import Drive

    drive = Drive.model_validate(
        {
            "preset": "seed-2021",
            "torsion": {"stiffness_k1_nm_per_rad": 1.5e4},
            "mesh": {"pitch_error_m": 2e-6},
        }
    )
    assert drive.torsion.stiffness_k1_nm_per_rad == 1.5e4
    assert drive.torsion.stiffness_k2_nm_per_rad == 2.5e4
    assert drive.mesh.pitch_error_m == 2e-6
    assert Drive.model_validate({"preset": "seed-2021", "mesh": {"model": "lumped"}}).mesh.model == "lumped"


def test_seed_drive_as_printed():
    data = preset("seed-2021")
    geometry = data["geometry"]
    assert data["rated_torque_nm"] == 52.0
    assert (geometry["flexspline_teeth"], geometry["circular_spline_teeth"]) == (200, 202)
    assert geometry["pitch_radius_m"] == pytest.approx(0.25e-3 * 200 / 2)  # module 0.25 mm
    assert geometry["pressure_angle_deg"] == 10.0
    # Eq. 21: 60 pairs share 52 N m; the paper prints 34.67 N, so its d is the radius
    assert data["rated_torque_nm"] / (0.30 * 200 * geometry["pitch_radius_m"]) == pytest.approx(
        34.67, rel=1e-3
    )


def test_only_one_preset_has_the_roughness_as_printed():
    from hdsim.drive.parameters import Drive
    from hdsim.surface.parameters import RoughFlanks

    default = RoughFlanks()
    for name in preset_names():
        for model in ("teeth", "tabulated"):
            flanks = Drive.model_validate({"preset": name, "mesh": {"model": model}}).mesh.flanks
            assert (flanks == default) == (name != "seed-2021-printed-roughness"), (name, model)
    printed = preset("seed-2021-printed-roughness")
    assert flanks_of(printed, "circular_spline") == (2.4272, 1.245e-10)
    assert flanks_of(printed, "flexspline") == (2.643, 1.8648e-10)
    # Nothing else differs from the seed drive.
    del printed["mesh"]["flanks"]
    assert printed == preset("seed-2021")
    assert vars(catalogue_figures("seed-2021-printed-roughness")) == vars(catalogue_figures("seed-2021")) | {
        "name": "seed-2021-printed-roughness"
    }


def flanks_of(data, name):
    flank = data["mesh"]["flanks"][name]
    return flank["fractal_dimension"], flank["fractal_roughness_m"]


def test_a_table_of_the_teeth_is_made_from_the_presets_own():
    from hdsim.drive.parameters import Drive

    teeth = Drive.model_validate({"preset": "csg-14-100"}).mesh.model_dump(exclude={"model"})
    table = Drive.model_validate({"preset": "csg-14-100", "mesh": {"model": "tabulated"}}).mesh.model_dump()
    assert table | teeth == table
    assert teeth["tooth_bending_stiffness_n_per_m"] == pytest.approx(14e9 * 0.4 * 1.27e-3 * 14)


def test_stiffness_table_of_the_maker():
    # CHA manual 1018854, p. 54: K3, K2, K1 in 1e3 N m/rad; columns size 14, 17, 20, 25 times ratio 50, > 50
    rows = {
        "stiffness_k3": "5.7 7.1 13 16 23 29 44 57",
        "stiffness_k2": "4.7 6.1 11 14 18 25 34 50",
        "stiffness_k1": "3.4 4.7 8.1 10 13 16 25 31",
    }
    limits = {14: (2.0, 6.9), 17: (3.9, 12.0), 20: (7.0, 25.0), 25: (14.0, 48.0)}
    for size, ratio in SIZES_AND_RATIOS:
        figures = catalogue_figures(f"csg-{size}-{ratio}")
        assert (figures.torque_t1.value, figures.torque_t2.value) == limits[size]
        column = 2 * SIZES.index(size) + (ratio > 50)
        for field, row in rows.items():
            assert getattr(figures, field).value == pytest.approx(1e3 * float(row.split()[column]))


def test_stiffness_of_the_large_sizes_as_the_maker_prints_it():
    # CHA p. 54: K3, K2, K1 in 1e3 N m/rad; sizes 32, 40, 50, 58 times ratio 50, > 50
    rows = {
        "stiffness_k3": "98 120 180 230 340 440 540 710",
        "stiffness_k2": "78 110 140 200 280 400 440 610",
        "stiffness_k1": "54 67 100 130 200 250 310 400",
    }
    limits = {32: (29, 108), 40: (54, 196), 50: (108, 382), 58: (168, 598)}
    for column, size in enumerate(limits):
        for above in (False, True):
            gear = printed_gear(size, 100 if above else 50)
            assert (gear["torque_t1"].value, gear["torque_t2"].value) == limits[size]
            for field, row in rows.items():
                assert gear[field].value == pytest.approx(1e3 * float(row.split()[2 * column + above]))


def test_angles_of_the_catalogue_follow_from_its_stiffness():
    # CSF/CSG catalogue p. 50, Table 42, ratio 50: angle at T1 in 1e-4 rad, sizes 14 to 65, two digits.
    angles = [5.8, 4.9, 5.2, 5.5, 5.5, 5.2, 5.2, 5.5, 5.2, 5.2]
    for size, angle in zip((14, 17, 20, 25, 32, 40, 45, 50, 58, 65), angles, strict=True):
        gear = printed_gear(size, 50)
        assert 1e4 * gear["torque_t1"].value / gear["stiffness_k1"].value == pytest.approx(angle, rel=0.06)


def test_similar_gears_stiffness_grows_as_the_cube_of_the_size():
    sizes = (20, 25, 32, 40, 45, 50, 58, 65)
    for ratio in (50, 100):
        for name in ("stiffness_k1", "stiffness_k2", "stiffness_k3"):
            scaled = [printed_gear(size, ratio)[name].value / size**3 for size in sizes]
            assert max(scaled) < 1.35 * min(scaled)


def test_accuracy_table_of_the_maker():
    # same page: arcmin, ratio 50 and above
    printed = {14: (1.2, 1.0), 17: (1.2, 1.0), 20: (1.0, 0.8), 25: (1.0, 0.8)}
    for size, ratio in SIZES_AND_RATIOS:
        figures = catalogue_figures(f"csg-{size}-{ratio}")
        assert figures.accuracy.value / ARCMIN == pytest.approx(printed[size][ratio > 50])
        assert figures.hysteresis_loss.value == pytest.approx(math.radians(1 / 60))


def test_rated_torques_of_the_series():
    printed = {
        14: {50: 7.0, 80: 10, 100: 10},
        17: {50: 21, 80: 29, 100: 31, 120: 31},
        20: {50: 33, 80: 44, 100: 52, 120: 52, 160: 52},
        25: {50: 51, 80: 82, 100: 87, 120: 87, 160: 87},
    }
    assert {(s, r) for s, row in printed.items() for r in row} == set(SIZES_AND_RATIOS)
    for size, row in printed.items():
        for ratio, torque in row.items():
            assert catalogue_figures(f"csg-{size}-{ratio}").rated_torque.value == torque


def test_order_of_the_torques_and_stiffnesses():
    for name in preset_names():
        f = catalogue_figures(name)
        assert f.stiffness_k1.value < f.stiffness_k2.value < f.stiffness_k3.value
        assert f.torque_t1.value < f.torque_t2.value
        torques = [f.rated_torque, f.average_torque, f.repeated_peak_torque, f.momentary_peak_torque]
        values = [t.value for t in torques]
        assert values == sorted(values)
        assert len(set(values)) == 4


@pytest.mark.parametrize("ratio", [50, 80, 100])
def test_torque_stiffness_inertia_and_friction_grow_with_size(ratio):
    drives = [preset(f"csg-{size}-{ratio}") for size in SIZES]
    for section, key in [
        ("torsion", "stiffness_k1_nm_per_rad"),
        ("torsion", "damping_nm_s_per_rad"),
        ("inertia", "motor_kg_m2"),
        ("inertia", "wave_generator_kg_m2"),
        ("inertia", "ring_kg_m2"),
        ("friction", "coulomb_nm"),
        ("friction", "viscous_nm_s_per_rad"),
        ("mesh", "tooth_bending_stiffness_n_per_m"),
    ]:
        values = [drive[section][key] for drive in drives]
        assert values == sorted(values), (section, key)
        assert values[0] < values[-1]
    assert sorted(d["rated_torque_nm"] for d in drives) == [d["rated_torque_nm"] for d in drives]


@pytest.mark.parametrize("size", SIZES)
def test_friction_agrees_with_every_printed_figure_within_ten_percent(size):
    name = f"csg-{size}-100"
    figures = printed_friction(name)
    f = preset(name)["friction"]
    torque, slope, load = f["coulomb_nm"], f["viscous_nm_s_per_rad"], f["load_coefficient"]
    assert torque == pytest.approx(figures.input_starting_torque.value, rel=0.1)
    for rpm, running in figures.running_torque:
        assert torque + slope * rpm * 2 * math.pi / 60 == pytest.approx(running.value, rel=0.1)
    assert 100 * torque / (1 - load) == pytest.approx(figures.back_driving_torque.value, rel=0.1)
    output = figures.rated_torque.value
    power_in = (output / 100 * (1 + load) + torque + slope * 2000 * 2 * math.pi / 60) * 100
    assert output / power_in == pytest.approx(figures.efficiency.value, rel=0.1)


def test_closure_agrees_with_a_general_least_squares_solver():
    from scipy.optimize import least_squares

    w = {rpm: rpm * math.pi / 30 for rpm in (2000.0, 3500.0)}

    def relative_errors(x):
        t, b, c = x[0], x[1], x[2]
        return [
            t / 0.037 - 1,
            (t + b * w[2000.0]) / 0.105 - 1,
            (t + b * w[3500.0]) / 0.160 - 1,
            (0.52 * (1 + c) + t + b * w[2000.0]) * 0.77 / 0.52 - 1,
            100 * t / 3.89 - (1 - c),
        ]

    expected = least_squares(relative_errors, [0.03, 3e-4, 0.1], x_scale=[1e-2, 1e-4, 1e-1], xtol=1e-14).x
    found = friction_from_catalogue(100, 0.037, {2000: 0.105, 3500: 0.160}, 3.89, 0.77, 52.0, 2000)
    assert list(found.values()) == pytest.approx(list(expected), rel=1e-5)


@given(
    coulomb=st.floats(1e-3, 1.0),
    viscous=st.floats(1e-6, 1e-2),
    load=st.floats(0.01, 0.5),
    ratio=st.floats(30, 320),
    rated=st.floats(1.0, 1000.0),
)
def test_closure_recovers_the_law_that_made_the_figures(coulomb, viscous, load, ratio, rated):
    speed = 2000 * math.pi / 30
    efficiency = rated / (rated * (1 + load) + ratio * (coulomb + viscous * speed))
    running = {rpm: coulomb + viscous * rpm * math.pi / 30 for rpm in (500.0, 2000.0, 3500.0)}
    back = ratio * coulomb / (1 - load)
    found = friction_from_catalogue(ratio, coulomb, running, back, efficiency, rated, 2000.0)
    assert found["coulomb_nm"] == pytest.approx(coulomb, rel=1e-6)
    assert found["viscous_nm_s_per_rad"] == pytest.approx(viscous, rel=1e-5)
    assert found["load_coefficient"] == pytest.approx(load, rel=1e-5)


def test_contradictory_friction_figures_are_refused():
    with pytest.raises(PhysicsError, match="contradict"):
        friction_from_catalogue(100, 0.2, {2000: 0.05, 3500: 0.02}, 20.0, 0.77, 52.0, 2000)


@pytest.mark.parametrize("name", ["seed-2021", "csg-14-50", "csg-20-100", "csg-25-160"])
def test_two_mass_mode_is_lightly_damped(name):
    data = preset(name)
    ratio = data["geometry"]["flexspline_teeth"] / 2
    inertia = data["inertia"]
    mass = np.diag([ratio**2 * (inertia["motor_kg_m2"] + inertia["wave_generator_kg_m2"]), 0.5])
    coupling = np.array([[1.0, -1.0], [-1.0, 1.0]])
    k = data["torsion"]["stiffness_k2_nm_per_rad"] * coupling
    c = data["torsion"]["damping_nm_s_per_rad"] * coupling
    inverse = np.linalg.inv(mass)
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ k, -inverse @ c]])
    root = max(np.linalg.eigvals(a), key=lambda z: z.imag)
    assert -root.real / abs(root) == pytest.approx(0.03, rel=1e-6)


def test_ring_inertia_agrees_with_a_hollow_cylinder():
    data = preset("csg-20-100")
    r, b, t = 0.0254, 0.4 * 0.0254, 0.048 * 0.0254
    outer, inner = r + t / 2, r - t / 2
    cylinder = 0.5 * 7850 * math.pi * b * (outer**4 - inner**4)
    assert data["inertia"]["ring_kg_m2"] == pytest.approx(cylinder, rel=1e-2)


def test_pitch_radius_follows_the_size_in_tenths_of_an_inch():
    for size, ratio in SIZES_AND_RATIOS:
        radius = preset(f"csg-{size}-{ratio}")["geometry"]["pitch_radius_m"]
        assert radius == pytest.approx(size / 10 * 0.0254 / 2)


def test_every_figure_has_a_citation_and_a_confidence():
    for name in preset_names():
        figures = catalogue_figures(name)
        found = [getattr(figures, f.name) for f in fields(figures)]
        found = [x for x in found if isinstance(x, Figure)] + [x for _, x in figures.running_torque]
        assert len(found) >= 15
        for figure in found:
            assert figure.value > 0.0
            assert len(figure.source.citation) > 20
            assert figure.source.confidence in ("read", "copied", "quoted")


def test_unknown_name_lists_the_known_and_the_nearest():
    with pytest.raises(ValueError, match=r"'seed-2012'; did you mean 'seed-2021'\?.*csg-20-100"):
        preset("seed-2012")
    with pytest.raises(ValueError, match=r"did you mean 'csg-14-50' or 'csg-14-80' or 'csg-14-100'\?"):
        preset("csg-14")
    with pytest.raises(ValueError, match="known are seed-2021"):
        catalogue_figures("%")


def test_a_preset_is_a_fresh_copy():
    preset("seed-2021")["torsion"].clear()
    assert preset("seed-2021")["torsion"]


def test_presets_need_no_heavy_library():
    code = (
        "import sys; from hdsim.drive.presets import preset, preset_names\n"
        "[preset(n) for n in preset_names()]\n"
        "sys.exit(bool({'scipy', 'numba', 'control', 'matplotlib'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
