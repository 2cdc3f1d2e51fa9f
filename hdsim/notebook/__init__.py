"""What a notebook calls and shows: one line per task, results as pages, as pandas and as xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.notebook.pages import diagnosis_html as diagnosis_html
    from hdsim.notebook.pages import fit_html as fit_html
    from hdsim.notebook.pages import recording_html as recording_html
    from hdsim.notebook.pages import scenario_html as scenario_html
    from hdsim.notebook.pages import study_html as study_html
    from hdsim.notebook.tables import study_to_pandas as study_to_pandas
    from hdsim.notebook.tables import to_pandas as to_pandas
    from hdsim.notebook.tables import to_xarray as to_xarray

_HOMES = {
    "diagnosis_html": "pages",
    "fit_html": "pages",
    "recording_html": "pages",
    "scenario_html": "pages",
    "study_html": "pages",
    "study_to_pandas": "tables",
    "to_pandas": "tables",
    "to_xarray": "tables",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
