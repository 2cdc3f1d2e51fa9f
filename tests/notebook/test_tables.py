"""Recordings as pandas' and xarray's tables."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

import hdsim
from hdsim.recording import Column, Recording, Table


@pytest.fixture
def recording() -> Recording:
    fast, slow = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 1.0, 3)
    state = {
        "output_angle": Column(np.sin(fast), "rad", "output and load"),
        "energy": Column(fast**2, "J"),
    }
    teeth = {
        "normal_force": Column(np.arange(12.0).reshape(3, 4), "N", "on each tooth"),
        "energy": Column(slow, "J"),
    }
    return Recording(
        {"state": Table(fast, state), "teeth": Table(slow, teeth)},
        static={"tooth_half_gap": Column(np.arange(4.0), "m", "of each tooth")},
        metadata={"scenario_name": "made up"},
    )


def test_a_data_frame_has_the_channels_over_time_and_their_units(recording: Recording) -> None:
    frame = recording.to_pandas()
    assert frame.index.name == "time"
    assert frame.index.tolist() == recording.time.tolist()
    assert frame["output_angle"].tolist() == recording["output_angle"].tolist()
    assert frame.attrs["units"] == {"time": "s", "output_angle": "rad", "energy": "J"}
    assert frame.attrs["scenario_name"] == "made up"


def test_the_teeth_are_a_second_level_of_columns(recording: Recording) -> None:
    frame = recording.to_pandas("teeth")
    assert frame.columns.names == ["channel", "tooth"]
    assert frame["normal_force"][2].tolist() == [2.0, 6.0, 10.0]
    assert frame["normal_force"].shape == (3, 4)


def test_a_dataset_has_the_teeth_as_a_dimension_and_goes_through_a_file(
    recording: Recording, tmp_path: Path
) -> None:
    data = recording.to_xarray()
    assert dict(data.sizes) == {"time": 11, "teeth_time": 3, "tooth": 4}
    assert data["normal_force"].dims == ("teeth_time", "tooth")
    assert data["tooth_half_gap"].dims == ("tooth",)
    assert data["normal_force"].sel(teeth_time=0.5, tooth=1).item() == 5.0
    assert {name: one.attrs["units"] for name, one in data.data_vars.items()} == {
        "output_angle": "rad",
        "energy": "J",
        "normal_force": "N",
        "teeth_energy": "J",  # the state has one of that name
        "tooth_half_gap": "m",
    }
    assert data["time"].attrs["units"] == "s"
    path = tmp_path / "run.nc"
    data.to_netcdf(path, engine="scipy")
    with xarray.open_dataset(path, engine="scipy") as again:
        assert again.identical(data)


def test_a_table_that_there_is_not_is_named(recording: Recording) -> None:
    with pytest.raises(hdsim.InputError, match="no table 'tooth'; there are: state, teeth"):
        recording.to_pandas("tooth")


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_an_absent_package_is_told_with_the_extra_that_brings_it(
    recording: Recording, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(
        hdsim.InputError, match=rf"needs the package {package}: pip install 'hdsim\[notebook\]'"
    ):
        getattr(recording, f"to_{package}")()


def test_channels_are_attributes_and_complete(recording: Recording) -> None:
    assert recording.output_angle is recording["output_angle"]  # type: ignore[attr-defined]
    assert {"output_angle", "energy", "to_xarray"} <= set(dir(recording))
    assert recording._ipython_key_completions_() == ["output_angle", "energy"]
    assert recording.tables["teeth"]._ipython_key_completions_() == ["normal_force", "energy"]
    with pytest.raises(AttributeError, match="no channel or attribute 'output_angel'"):
        _ = recording.output_angel  # type: ignore[attr-defined]
