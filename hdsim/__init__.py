"""hdsim: dynamics of harmonic drives, from the rough tooth flank to the log.

>>> import hdsim
>>> scenario = hdsim.load_scenario("scenarios/seed_move.yaml")
>>> result = hdsim.simulate(scenario)
>>> result["transmission_error"], result.unit("transmission_error")
>>> result.plot().savefig("seed_move.png")
>>> result.save("logs/seed_move.mcap")
>>> heavier = hdsim.simulate(scenario.with_({"load.inertia_kg_m2": 0.8}))
>>> hdsim.diagnose("log.csv", "base.yaml", mapping="mapping.yaml")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hdsim.errors import HdsimError, InputError, PhysicsError

if TYPE_CHECKING:
    from pathlib import Path

    from hdsim.log import open_log
    from hdsim.log.importing import import_recording
    from hdsim.notebook.tasks import diagnose, fit, plant, plants, study
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario
    from hdsim.scenario.examples import example
    from hdsim.simulation.ensemble import simulate_all
    from hdsim.simulation.linear import io_system, linearize
    from hdsim.simulation.simulate import simulate

__all__ = [
    "HdsimError",
    "InputError",
    "PhysicsError",
    "Recording",
    "Scenario",
    "diagnose",
    "example",
    "fit",
    "import_recording",
    "io_system",
    "linearize",
    "load_scenario",
    "open_log",
    "plant",
    "plants",
    "simulate",
    "simulate_all",
    "study",
]

# Loaded when first used: importing hdsim imports neither numpy nor numba.
_HOMES = {
    "Recording": "hdsim.recording",
    "Scenario": "hdsim.scenario",
    "diagnose": "hdsim.notebook.tasks",
    "example": "hdsim.scenario.examples",
    "fit": "hdsim.notebook.tasks",
    "import_recording": "hdsim.log.importing",
    "io_system": "hdsim.simulation.linear",
    "linearize": "hdsim.simulation.linear",
    "open_log": "hdsim.log",
    "plant": "hdsim.notebook.tasks",
    "plants": "hdsim.notebook.tasks",
    "simulate": "hdsim.simulation.simulate",
    "simulate_all": "hdsim.simulation.ensemble",
    "study": "hdsim.notebook.tasks",
}


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario and everything that it extends.

    Raises:
        InputError: with one line for every mistake: file, line, field, what was found, what is allowed.
    """
    from hdsim.scenario import Scenario

    return Scenario.from_yaml(path)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
