"""Compiled code: kept where it can be written, and waited for with a word."""

from __future__ import annotations

import importlib.util
import os
import pty
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import hdsim._compile as compiling


def twice(folder: Path) -> Callable[[float], float]:
    """A function of a package whose folder for compiled code cannot be made: a file is in its place."""
    folder.mkdir()
    (folder / "__pycache__").write_text("")
    path = folder / "code.py"
    path.write_text("def twice(x):\n    return 2.0 * x\n")
    spec = importlib.util.spec_from_file_location("code_of_a_package", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Any = module.twice
    return found


def test_code_of_a_read_only_package_is_kept_in_the_users_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert compiling.compiled(twice(tmp_path / "package"))(3.0) == 6.0
    assert [path.suffix for path in sorted((tmp_path / "cache").rglob("*.nb?"))] == [".nbc", ".nbi"]


def test_without_any_folder_it_is_compiled_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "cache"))
    monkeypatch.setattr(compiling, "_spare_folder", cache(compiling._spare_folder.__wrapped__))
    with pytest.warns(RuntimeWarning, match="every process compiles anew.*NUMBA_CACHE_DIR"):
        function = compiling.compiled(twice(tmp_path / "package"))
    with warnings.catch_warnings():  # it is said once
        warnings.simplefilter("error")
        again = compiling.compiled(twice(tmp_path / "another"))
    assert function(3.0) == again(3.0) == 6.0


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="who owns a folder is asked where that has an answer")
def test_without_a_users_cache_it_is_kept_among_the_temporary_files_of_this_user_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(compiling, "_spare_folder", cache(compiling._spare_folder.__wrapped__))
    assert compiling.compiled(twice(tmp_path / "package"))(3.0) == 6.0
    (folder,) = (tmp_path / "temporary").iterdir()
    assert folder.stat().st_mode & 0o777 == 0o700
    assert {path.suffix for path in folder.rglob("*.nb?")} == {".nbc", ".nbi"}
    folder.chmod(0o777)  # others could put code there
    monkeypatch.setattr(compiling, "_spare_folder", cache(compiling._spare_folder.__wrapped__))
    with pytest.warns(RuntimeWarning, match="every process compiles anew"):
        assert compiling.compiled(twice(tmp_path / "another"))(3.0) == 6.0


CODE = """
from hdsim._compile import compiled

@compiled
def half(x):
    return 0.5 * x

assert half(3.0) == 1.5
"""


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_is_told_that_something_is_compiled(terminal: bool, tmp_path: Path) -> None:
    (tmp_path / "code.py").write_text(CODE)
    ours, theirs = pty.openpty() if terminal else os.pipe()
    subprocess.run([sys.executable, tmp_path / "code.py"], stderr=theirs, check=True)
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # the end of a terminal
        pass
    os.close(ours)
    assert (compiling.COMPILING.encode() in said) is terminal
    assert terminal or said == b""


def test_python_m_hdsim_is_hdsim() -> None:
    arguments = [sys.executable, "-m", "hdsim", "effect"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: No command 'effect'. Did you mean 'effects'?")
    assert "hdsim --help" in done.stderr
