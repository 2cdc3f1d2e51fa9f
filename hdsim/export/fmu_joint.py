"""What an exported FMU runs: a scenario's joint behind the interface of pythonfmu and pythonfmu3.

The FMU holds a short script that derives its class from ``Joint`` and from the package's slave class, the
scenario, and the package itself; the Python of the importing program must have hdsim.
"""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement

from hdsim.errors import HdsimError

if TYPE_CHECKING:
    from hdsim.simulation.stepped import SteppedState

#: Files in the FMU's resources.
SCENARIO, SETTINGS = "scenario.yaml", "joint.json"
#: Outputs, those that are no input.
OUTPUTS = (
    "motor_angle",
    "motor_velocity",
    "motor_torque",
    "output_angle",
    "output_velocity",
    "output_torque",
    "load_torque",
    "transmission_error",
)
#: Exponents of the SI base units, as both versions of FMI want them.
_BASE_UNITS: dict[str, dict[str, int]] = {
    "s": {"s": 1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s^2": {"rad": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
}


class Joint:
    """Half of a slave; the other half, of either package, follows it in the list of bases.

    Class attributes:
        package: ``pythonfmu`` (FMI 2) or ``pythonfmu3``.
    """

    package: str
    vars: dict[int, Any]
    resources: str
    modelName: str  # noqa: N815 - the packages' name
    log: Any
    register_variable: Any

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        from hdsim.scenario import Scenario
        from hdsim.simulation.stepped import SteppedPlant

        self.fmi = import_module(self.package)
        home = Path(self.resources)
        settings = json.loads((home / SETTINGS).read_text(encoding="utf-8"))
        scenario = Scenario.from_yaml(home / SCENARIO)
        self.description = settings["description"]
        self.plant = plant = SteppedPlant(scenario, motor=settings["motor"], output=settings["output"])
        self.inputs = dict.fromkeys(plant.inputs, 0.0)
        self.names = [name for name in OUTPUTS if name in plant.outputs]
        self.now: dict[str, float] = {}
        self.version = f"hdsim {settings['hdsim']}"
        run = scenario.run
        self.default_experiment = self.fmi.DefaultExperiment(0.0, run.duration_s, 1e-3, run.rtol)
        self.units_of = {**plant.inputs, **{name: plant.outputs[name] for name in self.names}, "time": "s"}
        self._declare()

    @property
    def _is_third(self) -> bool:
        return hasattr(self.fmi, "Fmi3Slave")

    def _declare(self) -> None:
        """Register the variables: the inputs, the outputs, and with FMI 3 the time."""
        fmi = self.fmi
        if self._is_third:
            number, causality, variability = fmi.Float64, fmi.Fmi3Causality, fmi.Fmi3Variability
            initial = fmi.Fmi3Initial
        else:
            number, causality, variability = fmi.Real, fmi.Fmi2Causality, fmi.Fmi2Variability
            initial = fmi.Fmi2Initial
        steady = variability.continuous
        if self._is_third:
            time = number("time", causality=causality.independent, variability=steady)
            time.getter = lambda: self.plant.time_s
            self.register_variable(time)
        for name in self.inputs:
            about = self.plant.about[name]
            one = number(name, causality=causality.input, variability=steady, description=about)
            one.getter, one.setter = self._getter(name), self._setter(name)
            self.register_variable(one)
        for name in self.names:
            about = self.plant.about[name]
            kind = {"causality": causality.output, "variability": steady, "initial": initial.calculated}
            one = number(name, description=about, **kind)
            one.getter = self._getter(name)
            self.register_variable(one)

    def _getter(self, name: str) -> Any:
        if name in self.inputs:
            return lambda: self.inputs[name]

        def value() -> float:
            if not self.now:
                self.now = self.plant.values(self.names)
            return self.now[name]

        return value

    def _setter(self, name: str) -> Any:
        def put(value: float) -> None:
            self.inputs[name] = float(value)

        return put

    def exit_initialization_mode(self) -> None:
        """The first outputs follow from the inputs that are set by now."""
        self.plant.hold(self.inputs)
        self.now = {}

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance with the inputs held; False, with a line in the importer's log, when that fails."""
        self.now = {}
        try:
            self.plant.step(step_size, self.inputs)
        except HdsimError as error:
            status = self.fmi.enums.Fmi3Status if self._is_third else self.fmi.enums.Fmi2Status
            self.log(str(error), status.error)
            return False
        return True

    def _get_fmu_state(self) -> dict[str, Any]:
        return {"plant": self.plant.state, "inputs": dict(self.inputs)}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        kept: SteppedState = state["plant"]
        self.plant.reset(kept)
        self.inputs = dict(state["inputs"])
        self.now = {}

    def to_xml(self, *options: Any) -> Element:
        """The model description with units, and for FMI 2 with the outputs as initial unknowns."""
        root: Element = super().to_xml(*options)  # type: ignore[misc]
        definitions = Element("UnitDefinitions")
        for unit in dict.fromkeys(self.units_of[v.name] for v in self.vars.values()):
            powers = {base: str(power) for base, power in _BASE_UNITS[unit].items()}
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", powers)
        simulation = next(k for k, child in enumerate(root) if child.tag == "CoSimulation")
        root.insert(simulation + 1, definitions)
        for variable in root.find("ModelVariables") or ():
            holder = variable if self._is_third else variable[0]
            holder.set("unit", self.units_of[variable.attrib["name"]])
        structure, outputs = root.find("ModelStructure"), root.find("ModelStructure/Outputs")
        if structure is not None and outputs is not None:
            unknowns = SubElement(structure, "InitialUnknowns")
            for unknown in outputs:
                SubElement(unknowns, "Unknown", index=unknown.attrib["index"])
        return root
