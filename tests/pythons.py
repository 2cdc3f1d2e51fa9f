"""The wheel in every Python that can be had: installed from nothing, then the quick tests of a user's tasks.

    python tests/pythons.py [PYTHON ...]

Without arguments: the interpreters of ``VERSIONS`` on the PATH, of pyenv, and of uv. What there is not is
said and is no failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
#: Of the development set: no part of a test.
_LINT = ("ruff", "mypy", "types-", "hatchling", "pin>=", "scikit-learn", "mujoco", "FMPy", "websockets")
#: Test files, from the folder of the tests.
TESTS = ("tasks", "cli/test_command_line.py", "scenario/test_scenario.py", "simulation/test_stepped.py")


def interpreter(version: str) -> str | None:
    """A Python of that version that starts; None without."""
    found = [shutil.which(f"python{version}")]
    homes = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found += [str(path) for path in sorted(homes.glob(f"{version}.*/bin/python{version}"), reverse=True)]
    if shutil.which("uv"):
        told = subprocess.run(["uv", "python", "find", version], capture_output=True, text=True, check=False)
        found.append(told.stdout.strip())
    for python in filter(None, found):
        code = "import sys, venv; print('%d.%d' % sys.version_info[:2])"
        told = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
        if told.stdout.strip() == version:
            return python
    return None


def run(*command: str | Path, cwd: Path) -> str:
    """Run; returns what was printed, with the status in front where that is not zero."""
    told = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [*map(str, command)], cwd=cwd, env=told, capture_output=True, text=True, check=False
    )
    return done.stdout if done.returncode == 0 else f"FAILED\n{done.stdout[-6000:]}{done.stderr[-3000:]}"


def tested(python: str, wheel: Path, folder: Path) -> str:
    """Last line of the tests of a wheel in a fresh environment; begins with FAILED where they do not pass."""
    home = folder / "venv"
    told = run(python, "-m", "venv", home, cwd=folder)
    if told.startswith("FAILED"):
        return told
    own = home / ("Scripts" if os.name == "nt" else "bin") / "python"
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    needs = [name for name in tomllib.loads(text)["dependency-groups"]["dev"] if not name.startswith(_LINT)]
    told = run(own, "-m", "pip", "install", "--quiet", wheel, *needs, cwd=folder)
    if told.startswith("FAILED"):
        return told
    words = ["-m", "pytest", "--disable-warnings", "-p", "no:cacheprovider", "-m", "not slow"]
    words += ["-c", ROOT / "pyproject.toml"]
    told = run(own, *words, *(ROOT / "tests" / name for name in TESTS), cwd=folder)
    return told if told.startswith("FAILED") else told.strip().splitlines()[-1]


def main() -> int:
    """Test each; the number of those that failed."""
    given = sys.argv[1:]
    pythons = {name: name for name in given} or {version: interpreter(version) for version in VERSIONS}
    failed = 0
    with tempfile.TemporaryDirectory(prefix="hdsim_pythons_") as name:
        folder = Path(name)
        build = ["-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, ROOT]
        told = run(sys.executable, *build, cwd=folder)
        if told.startswith("FAILED"):
            print(told)
            return 1
        (wheel,) = folder.glob("hdsim-*.whl")
        for version, python in pythons.items():
            if python is None:
                print(f"{version}: not found", flush=True)
                continue
            home = folder / version.replace(os.sep, "_")
            home.mkdir()
            said = tested(python, wheel, home)
            failed += said.startswith("FAILED")
            print(f"{version} ({python}): {said}", flush=True)
            shutil.rmtree(home)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
