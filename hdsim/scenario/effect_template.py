"""A package with one effect, to start one's own from: ``hdsim new effect NAME``."""

from __future__ import annotations

import keyword
import re
from pathlib import Path
from string import Template

from hdsim.errors import InputError
from hdsim.scenario.examples import write

_PROJECT = Template("""\
[build-system]
requires = ["hatchling>=1.24"]
build-backend = "hatchling.build"

[project]
name = "hdsim-$dashed"
version = "0.1.0"
description = "The effect $name for hdsim"
requires-python = ">=3.11"
dependencies = ["hdsim"]

[project.entry-points."hdsim.effects"]
$name = "hdsim_$name:$kind"

[tool.hatch.build.targets.wheel]
packages = ["hdsim_$name"]
""")

_EFFECT = Template('''\
"""Viscous drag on the output: replace it by your law; hdsim's docs/extending.md has the rules of a kernel."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from hdsim.kernel import DISSIPATED, OUTPUT_TORQUE, OUTPUT_VELOCITY, element
from hdsim.parts import Builder, Effect, Signature


@element
def drag(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -b w on the output. Parameter: b, N m s/rad."""
    speed = inputs[OUTPUT_VELOCITY]
    outputs[OUTPUT_TORQUE] -= parameters[0] * speed
    outputs[DISSIPATED] += parameters[0] * speed * speed
    jacobian[OUTPUT_TORQUE * columns + OUTPUT_VELOCITY] -= parameters[0]
    jacobian[DISSIPATED * columns + OUTPUT_VELOCITY] += 2.0 * parameters[0] * speed


class $kind(Effect):
    """T = -b w_o on the output."""

    title: ClassVar[str] = "$words"
    source: ClassVar[str] = "Newton's law of viscosity; the number is an estimate"
    signature: ClassVar[Signature] = Signature(
        lives_in=("velocity",),
        channels=("motor_torque", "output_torque"),
        confused_with={"load_side_friction": "does not vanish at low speed"},
    )

    damping_nm_s_per_rad: float = Field(0.5, ge=0)
    """Damping b, N m s/rad."""

    def contribute(self, build: Builder) -> None:
        """Add the drag on the output."""
        build.element(drag, [self.damping_nm_s_per_rad])
''')

_TEST = Template("""\
from hdsim_$name import $kind

from hdsim.testing import check_effect


def test_it_is_an_effect():
    check_effect($kind)
    check_effect($kind, damping_nm_s_per_rad=20.0)
""")


def new_effect(name: str, folder: Path | None = None) -> list[Path]:
    """Write an installable package with an effect that works and a test that passes.

    Args:
        name: of the effect in scenarios, in small letters, digits and _.
        folder: where; ``hdsim-NAME`` in the current one when None.

    Returns:
        The files that were written.

    Raises:
        InputError: a name that cannot be one, one that is taken, or a folder that is there already.
    """
    from hdsim.effects import catalogue

    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or keyword.iskeyword(name):
        raise InputError(
            f"effect {name!r}: expected a name of small letters, digits and _, such as brake_drag"
        )
    if name in catalogue():
        raise InputError(f"effect {name!r}: there is one of this name already")
    words = name.replace("_", " ").strip()
    dashed = name.replace("_", "-").strip("-")
    home = Path(f"hdsim-{dashed}") if folder is None else folder
    if home.exists():
        raise InputError(f"{home} is there already; give another folder")
    kind = "".join(word.capitalize() for word in words.split())
    filled = {"name": name, "dashed": dashed, "kind": kind, "words": words}
    texts = {
        home / "pyproject.toml": _PROJECT,
        home / f"hdsim_{name}" / "__init__.py": _EFFECT,
        home / "tests" / f"test_{name}.py": _TEST,
    }
    return [write(path, text.substitute(filled)) for path, text in texts.items()]
