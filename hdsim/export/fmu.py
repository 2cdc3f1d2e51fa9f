"""A scenario's joint as a functional mock-up unit for co-simulation, FMI 2 or 3 (https://fmi-standard.org)."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.errors import InputError
from hdsim.export.fmu_joint import SCENARIO, SETTINGS

if TYPE_CHECKING:
    from hdsim.scenario import Scenario
    from hdsim.simulation.inputs import MotorInput, OutputInput

#: Package and slave class by version of the standard.
_PACKAGES = {2: ("pythonfmu", "Fmi2Slave"), 3: ("pythonfmu3", "Fmi3Slave")}

# The compiled loader of pythonfmu 0.7 wants an ``__init__`` of the class itself: a process that loads an FMU
# twice crashes without.
_SCRIPT = '''\
"""A joint for co-simulation, exported by hdsim."""

from {package} import {slave}

from hdsim.export.fmu_joint import Joint


class {name}(Joint, {slave}):
    """{title}"""

    package = "{package}"

    def __init__(self, **arguments):
        super().__init__(**arguments)
'''


def export_fmu(
    scenario: Scenario,
    out: str | Path,
    *,
    fmi: int = 2,
    motor: MotorInput | None = None,
    output: OutputInput | None = None,
) -> Path:
    """Write a scenario's joint as an FMU.

    Inputs and outputs are those of ``hdsim.simulation.stepped.SteppedPlant``; inputs are held over a
    communication step. State can be got and set.

    Args:
        scenario: the joint.
        out: the file, ``.fmu``; its stem, made an identifier, is the model's.
        fmi: version of the standard, 2 or 3.
        motor: what drives the motor; see ``SteppedPlant``.
        output: what acts on the output; likewise.

    Returns:
        ``out``.

    Raises:
        InputError: pythonfmu or pythonfmu3 is not installed, the scenario has no such input, or ``out``
            cannot be written.
    """
    from hdsim.simulation.stepped import SteppedPlant

    out = Path(out)
    if fmi not in _PACKAGES:
        raise InputError(f"--fmi: found {fmi}, expected 2 or 3")
    package, slave = _PACKAGES[fmi]
    if importlib.util.find_spec(package) is None:
        raise InputError(f"an FMU of FMI {fmi} needs {package}: pip install 'hdsim[fmi]'")
    SteppedPlant(scenario, motor=motor, output=output)  # says what cannot be before anything is written
    name = re.sub(r"\W", "_", out.stem, flags=re.ASCII)
    name = f"joint_{name}" if not name or name[0].isdigit() else name
    title = " ".join(scenario.name.split()).replace("\\", " ").replace('"', "'") or name
    about = scenario.description.strip().split("\n")[0]
    settings = {"motor": motor, "output": output, "hdsim": version("hdsim"), "description": about or title}
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".fmu_") as folder:
            home = Path(folder)
            script = home / f"{name}.py"
            text = _SCRIPT.format(package=package, slave=slave, name=name, title=title)
            script.write_text(text, encoding="utf-8")
            (home / SCENARIO).write_text(scenario.to_yaml(), encoding="utf-8")
            (home / SETTINGS).write_text(json.dumps(settings, indent=1), encoding="utf-8")
            _build(package, script, [home / SCENARIO, home / SETTINGS])
            os.replace(home / "out" / f"{name}.fmu", out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror})") from error
    return out


def _build(package: str, script: Path, files: list[Path]) -> None:
    """Run the package's own command, in a process of its own: it imports the script, and leaves it behind."""
    home = str(Path(__file__).parents[2])
    found = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
    words = [sys.executable, "-m", package, "build", "--handle-state", "-f", script.name, "-d", "out"]
    done = subprocess.run(
        [*words, *(file.name for file in files)],
        cwd=script.parent,
        env=os.environ | {"PYTHONPATH": found},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = (done.stderr.strip() or "nothing was said").splitlines()[-1]
        raise InputError(f"{package} could not build the FMU: {said}")
