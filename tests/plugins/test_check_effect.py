"""``check_effect`` finds what is wrong with an effect, and the template of a new one passes it."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, ClassVar

import pytest
from pydantic import Field

from hdsim import cli
from hdsim.kernel import DISSIPATED, OUTPUT_TORQUE, OUTPUT_VELOCITY, element
from hdsim.parts import Builder, Effect, Signature
from hdsim.testing import check_effect

ROOT = Path(__file__).parents[2]


@element
def drag(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """T = -b w; the other numbers spoil power, derivative and heat."""
    speed = inputs[OUTPUT_VELOCITY]
    outputs[OUTPUT_TORQUE] -= parameters[0] * speed
    jacobian[OUTPUT_TORQUE * columns + OUTPUT_VELOCITY] -= parameters[0] * parameters[1]
    outputs[DISSIPATED] += parameters[2] * parameters[0] * speed * speed
    jacobian[DISSIPATED * columns + OUTPUT_VELOCITY] += 2.0 * parameters[2] * parameters[0] * speed


@element
def five(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any) -> None:
    """An argument short."""


class Drag(Effect):
    """T = -b w_o on the output."""

    title: ClassVar[str] = "drag"
    source: ClassVar[str] = "made up"
    signature: ClassVar[Signature] = Signature(lives_in=("velocity",), channels=("motor_torque",))
    damping_nm_s_per_rad: float = 0.5
    """Damping b, N m s/rad."""
    slope: float = 1.0
    """Factor on the derivative."""
    heat: float = 1.0
    """Share of the power that becomes heat."""
    backwards: float = 0.0
    """Where it is not zero: wind-up that falls with the torque."""

    def contribute(self, build: Builder) -> None:
        build.element(drag, [self.damping_nm_s_per_rad, self.slope, self.heat])
        if self.backwards:
            build.series_compliance(lambda torque: -self.backwards * torque)


class NoUnit(Drag):
    damping: float = 0.5
    """Damping, N m."""


class Wordless(Drag):
    other: float = Field(1.0)


class Elsewhere(Drag):
    signature: ClassVar[Signature] = Signature(lives_in=("speed",), channels=("motor_torque",))


class Short(Drag):
    def contribute(self, build: Builder) -> None:
        build.element(five, [0.0])


def test_a_sound_effect_passes() -> None:
    check_effect(Drag)
    check_effect(Drag, damping_nm_s_per_rad=20.0)


@pytest.mark.parametrize(
    ("kind", "parameters", "said"),
    [
        (Drag, {"slope": 0.99}, r"Drag: d outputs\[2\] / d inputs\[5\] is .*, differences give"),
        (Drag, {"heat": 0.5}, "Drag: the powers do not balance"),
        (Drag, {"damping_nm_s_per_rad": -0.5}, r"Drag: element \d: heat of -.* W, at inputs"),
        (Drag, {"backwards": 1e-5}, "Drag: a wind-up that does not rise"),
        (NoUnit, {}, "NoUnit.damping is in N m, which its name does not say"),
        (Wordless, {}, "Wordless.other has no docstring"),
        (Elsewhere, {}, r"signature.lives_in: \{'speed'\}; there are: \['direction'"),
        (Short, {}, "five> takes 5 arguments, its contract has 6"),
    ],
)
def test_what_is_wrong_is_said(kind: type[Effect], parameters: dict[str, Any], said: str) -> None:
    with pytest.raises(AssertionError, match=said):
        check_effect(kind, **parameters)


def run(folder: Path, *arguments: str, path: Path | None = None) -> str:
    paths = os.pathsep.join(map(str, [*([path] if path else []), ROOT]))
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_new_effect_is_installed_tested_and_run(tmp_path: Path) -> None:
    said = run(tmp_path, "hdsim", "new", "effect", "bearing_drag")
    home, target = tmp_path / "hdsim-bearing-drag", tmp_path / "target"
    assert "next: pip install -e hdsim-bearing-drag" in said
    assert tomllib.loads((home / "pyproject.toml").read_text())["project"]["name"] == "hdsim-bearing-drag"
    options = ["--disable-pip-version-check", "--no-deps", "--no-build-isolation", "--target", str(target)]
    run(tmp_path, "pip", "install", *options, str(home))
    run(home, "pytest", "-p", "no:cacheprovider", path=target)
    (tmp_path / "drag.yaml").write_text(
        "drive: {preset: csg-20-100, mesh: {model: lumped}}\n"
        "effects: {bearing_drag: {damping_nm_s_per_rad: 3}}\n"
        "command: {motor: {type: torque, torque: {type: ramp, rate_nm_per_s: 5, duration_s: 0.04}}}\n"
        "load: {inertia_kg_m2: 0.5}\n"
        "run: {duration_s: 0.05}\n"
    )
    said = run(tmp_path, "hdsim", "run", "drag.yaml", "--no-plot", path=target)
    assert "verified yes" in said
    assert "hdsim-bearing-drag" in run(tmp_path, "hdsim", "effects", path=target).replace("\n", "")


def test_a_name_that_cannot_be_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hdsim-taken").mkdir()
    for arguments, said in [
        (["Drag"], "small letters"),
        (["lambda"], "small letters"),
        (["lugre_friction"], "there is one of this name already"),
        (["taken"], "hdsim-taken is there already"),
        ([], "expected a name"),
    ]:
        with pytest.raises(SystemExit) as stopped:
            cli.main(["new", "effect", *arguments])
        assert stopped.value.code == 2
        assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["hdsim-taken"]
