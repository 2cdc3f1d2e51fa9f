"""Units of traces: the residual's size, but no more than is plausible in the drive."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hdsim.diagnosis.designs import traces
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.state import State, state_of
from hdsim.scenario import Scenario

STIFFNESS_K1 = 16000.0
BASE = Scenario.model_validate({
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": {"motor": {"type": "free"}},
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 1.0},
})  # fmt: skip


#: Field of a component's amplitude.
FIELDS = {
    "load_dependent_kinematic_error": "stiffness_nm_per_rad",
    "kinematic_error": "amplitude_arcmin",
}


def strength(state: State) -> float:
    """Amplitudes of the components of the effect that was added, together."""
    added = state.added[-1]
    return sum(float(one.get(FIELDS[added.effect], 0.0)) for one in added.settings()["components"])


@pytest.mark.parametrize(
    ("name", "wanted", "unit"),
    [
        ("load_dependent_kinematic_error", 2000.0, 2000.0),
        ("load_dependent_kinematic_error", 1e6, 0.2 * STIFFNESS_K1),  # beyond K1 the spring pushes
        ("kinematic_error", 1.0, 1.0),
        ("kinematic_error", 50.0, 3.0),
    ],
)
def test_a_trace_is_no_stronger_than_is_plausible(name: str, wanted: float, unit: float) -> None:
    """The channel changes by the components' amplitudes here."""
    state = state_of(BASE)
    assert state.drive.torsion.stiffness_k1_nm_per_rad == STIFFNESS_K1
    rows = np.ones(10)
    bench: Any = SimpleNamespace(
        predict_all=lambda states: [[strength(one) * rows] for one in states],
        trace=lambda before, now: now[0] - before[0],
    )
    (first, *_) = starts(name, catalogue()[name].fittings[0], (), {})
    ((added, columns),) = traces(bench, state, [0.0 * rows], [first], wanted)
    assert columns is not None
    assert added.fitting.terms[0].strengths()[f"components.0.{FIELDS[name]}"] == pytest.approx(unit)
