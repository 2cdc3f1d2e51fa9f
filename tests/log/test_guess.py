"""A drafted mapping: what names say, what slopes show, what contradicts, and what stays open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hdsim.log.guess.base import base_scenario
from hdsim.log.guess.draft import draft
from hdsim.log.guess.findings import Draft, Ground
from hdsim.log.guess.relations import slope, step_of, turn_of, unwound
from hdsim.log.guess.text import to_text
from hdsim.log.guess.words import meaning
from hdsim.log.importing import import_recording
from hdsim.log.mapping import Mapping
from hdsim.log.units import unit_of
from hdsim.scenario import Scenario, load_model

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
TIME = np.arange(1500) * 1e-3
ANGLE = 0.9 * np.sin(2 * np.pi * 2 * TIME)
SPEED = 0.9 * 2 * np.pi * 2 * np.cos(2 * np.pi * 2 * TIME)


@pytest.mark.parametrize(
    ("name", "quantity", "side", "unit"),
    [
        ("Motordrehzahl [U/min]", "velocity", "motor", "U/min"),
        ("Abtriebsdrehmoment in Nm", "torque", "output", "Nm"),
        ("Antriebswinkel", "angle", "motor", ""),
        ("encoder_motorinc_3", "angle", "motor", ""),
        ("encoder_loadinc_3", "angle", "load", ""),
        ("joint_torque_current_3", "torque", "output", ""),
        ("TorqueSm4", "torque", "", ""),
        ("Getriebetemperatur (°C)", "temperature", "", "°C"),
        ("speedRpm", "velocity", "", "Rpm"),
        ("Q_CURRENT", "current", "", ""),
        ("tau_motor_Nm", "torque", "motor", "Nm"),
        ("Zeit / ms", "time", "", "ms"),
        ("φ_out [mrad]", "angle", "output", "mrad"),
        ("Kommentar", "", "", ""),
    ],
)
def test_names_say(name: str, quantity: str, side: str, unit: str) -> None:
    found = meaning(name)
    assert (found.quantity, found.side, found.unit) == (quantity, side, unit)


@pytest.mark.parametrize(
    "name", ["PositionCmptd4", "Sollwinkel", "target_joint_angles_3", "Drehzahlabweichung", "CONTROL_TORQUE"]
)
def test_names_of_what_was_not_measured(name: str) -> None:
    assert not meaning(name).measured


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("[°/s]", "deg/s"),
        ("U/min", "rpm"),
        ("N·m", "N m"),
        ("mNm", "mN m"),
        ("MNm", None),
        ("kN·m", "kN m"),
        ("in-lbf", "lbf in"),
        ("ft-lb", "lbf ft"),
        ("(µs)", "us"),
        ("x", None),
    ],
)
def test_units_as_people_write_them(text: str, unit: str | None) -> None:
    found = unit_of(text)
    assert (found[1] if found else None) == unit


def test_slopes_steps_and_turns() -> None:
    rng = np.random.default_rng(0)
    wound = 0.002 * np.cos(7 * TIME)
    found = slope(100 * ANGLE + wound * 40, ANGLE, wound)
    assert found is not None
    assert found.factor == pytest.approx(100, rel=1e-9)
    assert slope(rng.standard_normal(1500), ANGLE).explained < 0.1  # type: ignore[union-attr]
    assert step_of(np.round(ANGLE * 1024) / 1024) == pytest.approx(1 / 1024)
    assert step_of(ANGLE) is None
    turning = np.linspace(0, 2000, 4000)
    assert turn_of(turning % 360) == pytest.approx(360, rel=0.01)
    assert turn_of(turning) is None
    np.testing.assert_allclose(unwound(turning % 360, 360.0), turning, atol=1e-9)


def drafted(tmp_path: Path, columns: dict[str, np.ndarray], **said: str) -> Draft:
    path = tmp_path / "a.csv"
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", comments="", fmt="%.9g",
               header=",".join(columns))  # fmt: skip
    return draft(path, {key.replace("__", "."): value for key, value in said.items()})


def loaded(tmp_path: Path, found: Draft) -> Mapping:
    (tmp_path / "m.yaml").write_text(to_text(found), encoding="utf-8")
    return load_model(tmp_path / "m.yaml", Mapping)


@pytest.mark.parametrize(("of_time", "unit"), [(1.0, "s"), (1e3, "ms"), (1e6, "us")])
@pytest.mark.parametrize(
    ("of_speed", "velocity"), [(60 / 2 / np.pi, "rpm"), (180 / np.pi, "deg/s"), (1.0, "rad/s")]
)
def test_the_derivative_tells_the_units_of_speed_and_time(tmp_path, of_time, unit, of_speed, velocity):
    columns = {
        "time": of_time * TIME,
        "output_angle_deg": np.rad2deg(ANGLE),
        "output_speed": of_speed * SPEED,
    }
    found = drafted(tmp_path, columns)
    assert found.time["unit"].value == unit
    assert found.channels["output_velocity"].keys["unit"].value == velocity
    # A thousand times the time is a thousandth of the speed, which no unit of speed is.
    assert found.channels["output_velocity"].keys["unit"].ground == Ground.SHOWN


@pytest.mark.parametrize("ratio", [-100, 50, 161])
def test_the_ratio_is_the_slope_between_the_angles(tmp_path, ratio):
    columns = {
        "t_s": TIME,
        "motor_pos_rev": ratio * ANGLE / 2 / np.pi,
        "joint_pos_rad": ANGLE + 1e-4 * np.cos(9 * ANGLE),
    }
    found = drafted(tmp_path, columns)
    assert found.ratio is not None
    assert (found.ratio.value, found.ratio.ground) == (ratio, Ground.SHOWN)
    (tmp_path / "b.yaml").write_text(base_scenario(found) or "")
    assert Scenario.from_yaml(tmp_path / "b.yaml").drive.ratio == ratio


@pytest.mark.parametrize("names", [("output_angle_deg", "output_speed_deg_s"), ("angle_deg", "speed_deg_s")])
def test_a_unit_that_the_derivative_contradicts_stays_open(tmp_path, names):
    found = drafted(tmp_path, {"t_s": TIME, names[0]: ANGLE, names[1]: np.rad2deg(SPEED)})
    assert found.ratio is None
    text = " ".join(str(question) for question in found.open)
    assert f"the unit of {names[0]}: the file says deg, the numbers fit rad" in text or (
        f"the unit of {names[1]}: the file says deg/s, the numbers fit" in text
    )


def test_a_column_that_is_no_derivative_in_any_unit_is_told(tmp_path):
    columns = {"t_s": TIME, "output_angle_deg": np.rad2deg(ANGLE), "output_speed_rpm": 3.7 * SPEED}
    found = drafted(tmp_path, columns)
    assert any("output_speed_rpm contradicts output_angle_deg" in question.text for question in found.open)
    assert "output_velocity" not in found.channels


def test_an_angle_that_starts_anew_shows_its_unit(tmp_path):
    turning = 300 * TIME**2
    found = drafted(
        tmp_path, {"t_s": TIME, "motor_angle": np.rad2deg(turning) % 360, "motor_speed_rad_s": 600 * TIME}
    )
    keys = found.channels["motor_angle"].keys
    assert (keys["unit"].value, keys["unit"].ground) == ("deg", Ground.SHOWN)
    assert keys["unwrap"].value is True


def test_a_speed_that_counts_the_other_way_gets_a_sign(tmp_path):
    found = drafted(tmp_path, {"t_s": TIME, "output_angle_rad": ANGLE, "output_speed_rad_s": -SPEED})
    assert found.channels["output_velocity"].keys["sign"].value == -1


def test_torques_that_run_against_each_other_are_asked_about(tmp_path):
    torque = 12 * np.cos(5 * TIME)
    columns = {"t_s": TIME, "motor_angle_rad": -80 * ANGLE, "output_angle_rad": ANGLE,
               "motor_torque_Nm": torque / 90, "output_torque_Nm": torque}  # fmt: skip
    found = drafted(tmp_path, columns)
    assert found.ratio is not None
    assert found.ratio.value == -80
    assert [question.key for question in found.open] == ["output_torque_Nm.sign"]
    told = drafted(tmp_path, columns, output_torque_Nm__sign="-1")
    assert told.open == []
    assert loaded(tmp_path, told).channels.output_torque.sign == -1
    columns["motor_torque_Nm"] *= -1
    assert drafted(tmp_path, columns).open == []


def test_a_date_beside_the_time_of_day_and_a_gap(tmp_path):
    clock = [f"12:00:{k * 0.01 + (2 if k > 50 else 0):06.3f}" for k in range(100)]
    lines = [f"2024-07-11;{at};{k * k}" for k, at in enumerate(clock)]
    (tmp_path / "a.csv").write_text("\n".join(["Datum;Uhrzeit;Abtriebswinkel [°]", *lines]))
    found = draft(tmp_path / "a.csv")
    assert (found.time["column"].value, found.time["unit"].value) == ("Uhrzeit", "iso")
    assert loaded(tmp_path, found).longest_gap_s == 0.05


def test_what_nothing_tells_is_asked_and_the_rest_can_be_used(tmp_path):
    columns = {"t_s": TIME, "motor_angle_rad": 80 * ANGLE, "motor_current_A": np.cos(5 * TIME)}
    found = drafted(tmp_path, columns)
    assert [question.key for question in found.open] == ["motor_current_A.torque_constant_nm_per_a"]
    assert list(loaded(tmp_path, found).channels.given()) == ["motor_angle"]
    told = drafted(tmp_path, columns, motor_current_A__torque_constant_nm_per_a="0.12")
    assert told.open == []
    assert loaded(tmp_path, told).channels.motor_torque.torque_constant_nm_per_a == 0.12


def test_a_lone_angle_without_a_side_is_asked_for(tmp_path):
    found = drafted(tmp_path, {"t_s": TIME, "position_deg": np.rad2deg(ANGLE)})
    assert [question.key for question in found.open] == ["position_deg.channel"]
    columns = {"t_s": TIME, "position_deg": np.rad2deg(ANGLE)}
    assert drafted(tmp_path, columns, position_deg__channel="output_angle").open == []


def measured(*parts: str) -> Path:
    path = DATA.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"the measured data {path} are not here")
    return path


def test_lara8_by_its_two_encoders(tmp_path):
    found = draft(measured("lara8-joint3-dual-encoder", "joint3.csv"))
    mapping = loaded(tmp_path, found)
    assert (found.open, mapping.ratio, mapping.time.unit) == ([], 101, "s")
    given = mapping.channels
    assert (given.motor_angle.column, given.motor_angle.counts_per_turn) == ("encoder_motorinc_3", 2**24)
    assert (given.output_angle.column, given.output_angle.counts_per_turn) == ("encoder_loadinc_3", 2**24)
    assert (given.motor_torque.column, given.motor_torque.side) == ("joint_torque_current_3", "output")


@pytest.mark.parametrize("joint", range(1, 8))
def test_kinova_joints_by_the_one_that_moves(tmp_path, joint):
    path = measured("kinova-gen3-7dof", "jointwise_motion", f"joint_{joint}_trapez.csv")
    found = draft(path, {"ratio": "100"})
    mapping = loaded(tmp_path, found)
    assert found.open == []
    assert (mapping.time.unit, mapping.time.column) == ("ms", "Time")
    given = mapping.channels
    assert (given.output_angle.column, given.output_angle.unit) == (f"Position{joint}", "rad")
    assert (given.output_velocity.column, given.output_velocity.unit) == (f"Velocity{joint}", "rad/s")
    assert (given.motor_torque.column, given.motor_torque.side) == (f"TorqueCur{joint}", "output")
    assert given.temperature.column == f"Temp{joint}"
    # The torque sensor says nothing here.
    assert f"TorqueSm{joint}" in found.unused


def test_cycloidal_actuator_whose_side_its_file_does_not_tell(tmp_path):
    path = measured("cycloidal-backlash-hysteresis", "2024-07-11__15-47-12__torqueramp__base_runin1.csv")
    found = draft(path)
    assert {question.key for question in found.open} == {"POSITION.channel", "ratio"}
    # Its encoder has steps of 2^-16 of a turn.
    assert found.channels["output_angle"].keys["unit"].value == "rev"
    said = {"POSITION.channel": "motor_angle", "POSITION.side": "output", "ratio": "14"}
    mapping = loaded(tmp_path, draft(path, said))
    stored = load_model(
        Path(__file__).parents[2] / "scenarios" / "mappings" / "cycloidal_torque_ramp.yaml", Mapping
    )
    # One sample of the current jumps by 2.3 A and back.
    assert [(mask.type, mask.channels) for mask in mapping.masks] == [("outliers", ("motor_torque",))]
    own = {"description": "", "longest_gap_s": None, "masks": ()}
    assert mapping.model_copy(update=own) == stored.model_copy(update=own)


def spiked(noise: float, spikes: dict[int, float], seed: int = 3) -> np.ndarray:
    """A motor torque of friction and inertia, its reversals steep, with noise and spikes at some samples."""
    torque = 0.1 * np.tanh(SPEED / 0.02) + 0.2 * np.gradient(SPEED, TIME) / 100
    torque += noise * np.random.default_rng(seed).standard_normal(len(TIME))
    for at, size in spikes.items():
        torque[at] += size
    return torque


@pytest.mark.parametrize(
    ("noise", "spikes", "width"),
    [
        (0.002, {100: 0.5, 400: -0.4, 900: 3.0}, 1),
        (0.002, {100: 0.5, 101: 0.6, 800: -0.5}, 2),
        (0.0, {700: 0.2, 1200: 0.2}, 1),
    ],
)
def test_spikes_get_a_mask_that_takes_out_no_more(tmp_path, noise, spikes, width):
    columns = {"time [s]": TIME, "motor_angle [rad]": ANGLE, "motor_torque [Nm]": spiked(noise, spikes)}
    found = drafted(tmp_path, columns)
    (mask,) = found.masks
    assert mask.ground is Ground.SHOWN
    samples = "one sample" if width == 1 else f"up to {width} samples"
    assert f"{len(spikes) - (width - 1)} spikes of {samples}" in mask.why
    mapping = loaded(tmp_path, found)
    (read,) = mapping.masks
    assert (read.type, read.channels) == ("outliers", ("motor_torque",))
    recording = import_recording(tmp_path / "a.csv", mapping)
    assert set(np.flatnonzero(np.isnan(recording["motor_torque"]))) == set(spikes)


@pytest.mark.parametrize("seed", range(5))
def test_noise_steps_corners_and_wrapped_angles_get_no_mask(tmp_path, seed):
    rng = np.random.default_rng(seed)
    stairs = np.repeat(rng.normal(size=30), 50)
    columns = {
        "time [s]": TIME,
        "motor_angle [rad]": np.mod(20 * ANGLE, 2 * np.pi),
        "output_angle [deg]": np.round(np.degrees(ANGLE / 10), 3),
        "motor_torque [Nm]": spiked(0.002, {}, seed),
        "output_torque [Nm]": stairs + 1e-3 * rng.standard_normal(len(TIME)),
    }
    assert drafted(tmp_path, columns, ratio="100").masks == []
