"""What a run asks of the gear: averages, life and safety against the formulas by hand."""

from __future__ import annotations

from typing import Any

import pytest

from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.simulate import simulate
from hdsim.studies.known_metrics import find_metric

NAMES = ("average_load_torque", "average_input_speed", "bearing_life", "ratcheting_safety", "buckling_safety")


def scenario(moves: list[dict[str, Any]], torque_nm: float, duration_s: float, **drive: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "drive": {"preset": "csg-20-100", "mesh": {"model": "rigid"}} | drive,
            "command": {"motor": {"type": "motion", "trajectory": {"type": "sequence", "moves": moves}}},
            "load": {"inertia_kg_m2": 1e-3, "torque": {"type": "hold", "torque_nm": -torque_nm}},
            "run": {"duration_s": duration_s, "sample_rate_hz": 1000},
        }
    )


def at(rpm: float, seconds: float) -> dict[str, Any]:
    return {"type": "ramp", "velocity_rpm": rpm, "duration_s": seconds}


def test_a_run_at_one_load_and_speed() -> None:
    steady = scenario([at(-1000.0, 2.0)], 26.0, 2.0)
    numbers = simulate(steady).metrics()
    found = {name: numbers[name].value for name in NAMES}
    assert found["average_load_torque"] == pytest.approx(26.0, rel=1e-3)
    assert found["average_input_speed"] == pytest.approx(1000.0, rel=1e-3)
    # Half the rated 52 N m at half of 2000 rpm: 8 times 2 times 10,000 h.
    assert found["bearing_life"] == pytest.approx(160_000, rel=5e-3)
    assert found["ratcheting_safety"] == pytest.approx(330 / 26, rel=1e-2)
    assert found["buckling_safety"] == pytest.approx(800 / 26, rel=1e-2)


def test_a_pause_halves_the_speed_and_leaves_the_torque() -> None:
    paused = scenario([at(-1000.0, 1.0), at(0.0, 1.0)], 26.0, 2.0)
    found = simulate(paused).metrics()
    assert found["average_load_torque"].value == pytest.approx(26.0, rel=5e-3)
    assert found["average_input_speed"].value == pytest.approx(500.0, rel=5e-3)


def test_a_drive_that_stands_still_has_no_life_to_tell() -> None:
    still = scenario([at(0.0, 1.0)], 26.0, 0.5)
    found = simulate(still)
    assert found.metrics()["average_input_speed"].value == 0.0
    with pytest.raises(InputError, match="needs a motor that turns"):
        find_metric("average_load_torque")(found, still)
    with pytest.raises(InputError, match="turns under load"):
        find_metric("bearing_life")(found, still)


def test_a_drive_of_ones_own_has_no_printed_limits() -> None:
    own = Scenario.model_validate(scenario([at(0.0, 1.0)], 1.0, 0.1).model_dump())
    data = own.model_dump(mode="json")
    data["drive"]["preset"] = None
    own = Scenario.model_validate(data)
    with pytest.raises(InputError, match="no preset"):
        find_metric("bearing_life")(simulate(own), own)
