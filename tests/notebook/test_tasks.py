"""One line per task: what the functions take, and what they say of what they cannot take."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import hdsim
from hdsim.estimate.records import record_from
from hdsim.log.columns import import_columns
from hdsim.scenario import Scenario

ROOT = Path(__file__).parents[2]
MAPPING = {
    "ratio": -100.0,
    "time": {"column": "t", "unit": "ms"},
    "channels": {
        "motor_angle": {"column": "encoder", "unit": "deg"},
        "motor_torque": {"column": "current", "unit": "A", "torque_constant_nm_per_a": 0.05},
        "load_torque": {"column": "load", "unit": "N m"},
    },
}


@pytest.fixture(scope="module")
def base() -> Scenario:
    return hdsim.load_scenario(ROOT / "scenarios" / "sine_tracking.yaml").with_(
        {"run.duration_s": 1.0, "run.sample_rate_hz": 250, "effects": {}},
        drive={"preset": "csg-20-100", "mesh": {"model": "rigid"}},
    )


@pytest.fixture(scope="module")
def frame(base: Scenario) -> pandas.DataFrame:
    """What somebody measured, in units of their own."""
    run = hdsim.simulate(base)
    columns = {
        "t": 1e3 * run.time,
        "encoder": np.rad2deg(run["motor_angle"]),
        "current": run["motor_torque"] / 0.05,
        "load": run["load_torque"],
    }
    return pandas.DataFrame(columns)


def fitted(measured: object, scenario: object, **options: object) -> float:
    found = hdsim.fit(measured, scenario, free=["drive.friction.coulomb_nm"], **options)  # type: ignore[arg-type]
    return found.intervals[0].value


def test_a_fit_takes_frames_files_and_recordings_alike(
    base: Scenario, frame: pandas.DataFrame, tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    frame.to_csv(path, index=False)
    guess = base.with_({"drive.friction.coulomb_nm": 0.03})
    model = tmp_path / "base.yaml"
    model.write_text(guess.to_yaml(), encoding="utf-8")
    first = fitted(frame, guess, mapping=MAPPING)
    assert first == pytest.approx(base.drive.friction.coulomb_nm, rel=0.03)
    assert fitted(frame.set_index("t"), guess, mapping=MAPPING) == first  # the time may be the index
    # Text of a file has all digits of a number.
    assert fitted(path, model, mapping=MAPPING) == pytest.approx(first, rel=1e-6)
    recording = hdsim.import_recording(path, MAPPING)
    again = [fitted([record_from(recording, "a")], guess), fitted(recording, str(model))]
    assert again == [fitted(recording, guess)] * 2


def test_columns_become_what_their_file_becomes(frame: pandas.DataFrame, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    frame.to_csv(path, index=False)
    columns = {name: frame[name].to_numpy() for name in frame}
    here, there = import_columns(columns, MAPPING), hdsim.import_recording(path, MAPPING)
    assert list(here) == list(there)
    for name in here:
        assert here[name] == pytest.approx(there[name], rel=1e-12, abs=1e-15)
        assert here.unit(name) == there.unit(name)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"encoder": "encodre"}, "frame 1: no column 'encoder'; nearest: encodre"),
        ({}, "a data frame needs a mapping"),
    ],
)
def test_what_a_frame_lacks_is_named(
    base: Scenario, frame: pandas.DataFrame, change: dict[str, str], said: str
) -> None:
    with pytest.raises(hdsim.InputError) as caught:
        hdsim.diagnose(frame.rename(columns=change), base, mapping=MAPPING if change else None)
    assert said in str(caught.value)


def test_a_mapping_that_is_wrong_is_told_like_its_file(base: Scenario, frame: pandas.DataFrame) -> None:
    wrong = {**MAPPING, "time": {"column": "t", "unit": "hours"}}
    with pytest.raises(hdsim.InputError, match=r"mapping: time\.unit: found 'hours'"):
        hdsim.fit(frame, base, mapping=wrong)


def test_what_is_no_measurement_is_refused(base: Scenario) -> None:
    with pytest.raises(hdsim.InputError, match="found dict, expected a file, a recording"):
        hdsim.fit({"t": [1.0]}, base)  # type: ignore[arg-type]


def test_results_are_written_beside_a_file_only(
    base: Scenario, frame: pandas.DataFrame, tmp_path: Path
) -> None:
    with pytest.raises(hdsim.InputError, match="extends the scenario's file"):
        hdsim.diagnose(frame, base, mapping=MAPPING, out=tmp_path / "found")
    assert not (tmp_path / "found").exists()


def test_a_study_says_what_is_wrong_with_it(base: Scenario) -> None:
    with pytest.raises(hdsim.InputError, match="needs metrics"):
        hdsim.study(base, {"load.inertia_kg_m2": [0.1]})
    with pytest.raises(hdsim.InputError, match=r"expected 'load\.inertia_kg_m2'"):
        hdsim.study(base, {"load.inertia": [0.1]}, "tracking_error_max")


def test_the_facade_is_complete_and_light() -> None:
    """Functions stay functions when the packages behind them are loaded; nothing heavy comes along."""
    code = (
        "import sys, hdsim; heavy = {'numpy', 'numba', 'pandas', 'xarray', 'IPython'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "import hdsim.diagnosis.workflow, hdsim.studies.engine.study, hdsim.estimate\n"
        "assert {name for name in hdsim.__all__ if name[0].islower()} <= set(dir(hdsim))\n"
        "assert all(callable(getattr(hdsim, name)) for name in hdsim.__all__)\n"
        "assert not {'pandas', 'xarray', 'IPython'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
