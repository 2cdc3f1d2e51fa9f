"""The task of a researcher in a notebook: that of the documentation in a real kernel, first cell to last."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "tutorials" / "notebook.ipynb"

#: A last cell, which tells the numbers of the ones before and what the tab key offers.
QUESTIONS = """
import json
from IPython.core.completer import provisionalcompleter

def offered(text):
    with provisionalcompleter():
        return [one.text.lstrip(".") for one in get_ipython().Completer.completions(text, len(text))]

print(json.dumps({
    "named": [effect.name for effect in found.verdict.effects],
    "ripples": [
        {one.order: one.amplitude_nm for one in model.effects.position_dependent_friction.components}
        for model in (better, joint)
    ],
    "coulomb": [fit.intervals[0].low, base.drive.friction.coulomb_nm, fit.intervals[0].high],
    "speeds": speeds.tolist(),
    "gain": -gains[0][1],
    "reached": float(response.outputs[0, -1]),
    "inertias": study.to_pandas()["load.inertia_kg_m2"].tolist(),
    "facade": offered("hdsim.dia"),
    "attributes": offered("result.output_t"),
    "keys": offered('result["output_t'),
}))
"""


@pytest.fixture(scope="module")
def cells() -> list[Any]:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell(QUESTIONS))
    where = {"metadata": {"path": str(NOTEBOOK.parent)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=where).execute()
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="module")
def told(cells: list[Any]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(cells[-1].outputs[-1].text)
    return found


def test_the_notebook_is_stored_without_outputs() -> None:
    stored = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(stored)
    assert [cell.outputs for cell in stored.cells if cell.cell_type == "code" and cell.outputs] == []


@pytest.mark.slow
def test_every_object_is_shown_with_its_numbers_and_a_picture(cells: list[Any]) -> None:
    outputs = [output.data for cell in cells for output in cell.outputs if "data" in output]
    pages = [data["text/html"] for data in outputs if "class='hdsim'" in data.get("text/html", "")]
    titles = [page.split("<h3>")[1].split("</h3>")[0] for page in pages]
    assert titles == ["joint", "joint", "The model is missing position-dependent friction.", "Fit", "inertia"]
    for page in pages:
        assert page.count("data:image/png;base64,") == 1
        assert len(page) < 250_000


@pytest.mark.slow
def test_names_complete(told: dict[str, Any]) -> None:
    assert told["facade"] == ["diagnose"]
    assert told["attributes"] == told["keys"] == ["output_torque"]


@pytest.mark.slow
def test_what_was_hidden_is_found_and_added(told: dict[str, Any]) -> None:
    assert told["named"] == ["position_dependent_friction"]
    found, hidden = told["ripples"]
    assert hidden.keys() == {"2.0"}
    assert found["2.0"] == pytest.approx(hidden["2.0"], rel=0.1)
    assert all(amplitude < 0.1 * hidden["2.0"] for order, amplitude in found.items() if order != "2.0")
    low, true, high = told["coulomb"]
    assert low < true < high


@pytest.mark.slow
def test_loops_of_ones_own_reach_what_they_should(told: dict[str, Any]) -> None:
    # A heavier load gains less speed from the same torque in the same time.
    first, last = np.abs(told["speeds"])
    assert first > 1.05 * last
    # A proportional gain stops where friction holds it: within the friction over the gain.
    held = told["coulomb"][1] / told["gain"]
    assert 0.0 < abs(told["reached"] - 5.0) < 1.2 * held


@pytest.mark.slow
def test_the_study_varied_what_it_was_told(told: dict[str, Any]) -> None:
    assert told["inertias"] == [0.2, 0.5, 1.0]
