"""Builds pydantic models from YAML files; what is wrong comes out as lines that a user can act on."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from hdsim.errors import HdsimError
from hdsim.scenario.complaints import complaints
from hdsim.scenario.extends import read
from hdsim.scenario.fields import Shape, shape_of, words
from hdsim.scenario.problems import Problem, ScenarioError, describe, dotted
from hdsim.scenario.reader import KeyPath, Source, problem_of_file

Model = TypeVar("Model", bound=BaseModel)


def load_model(path: str | Path, model: type[Model]) -> Model:
    """Read a YAML file (and what it extends) into ``model``.

    Relative paths of files (fields of type ``pathlib.Path``) are taken relative to the file in which they
    are written; where the field is a ``pydantic.FilePath`` the file must exist. Nothing depends on the
    environment; the working directory matters for ``path`` alone.

    Args:
        path: the YAML file.
        model: the class to build.

    Raises:
        ScenarioError: with every problem found, one line each.
    """
    return build(read(path), model)


def build(source: Source, model: type[Model]) -> Model:
    """Validate what was read as ``model``; see :func:`load_model`."""
    problems: list[Problem] = []
    data = _prepare(source.data, shape_of(model), (), source, problems)
    try:
        built = model.model_validate(data)
    except ValidationError as error:
        problems += complaints(error, model, source)
    except HdsimError as error:
        problems.append(Problem(source.mark(()), "", str(error)))
    else:
        if not problems:
            return built
    first_of_field: dict[str, Problem] = {}
    for problem in problems:
        first_of_field.setdefault(problem.field, problem)
    # What is wrong comes before what is missing (often a consequence), each in the file's order.
    in_order = sorted(first_of_field.values(), key=lambda problem: (problem.absent, problem.mark.line))
    raise ScenarioError(in_order)


def _prepare(value: Any, shape: Shape | None, path: KeyPath, source: Source, problems: list[Problem]) -> Any:
    """Copy the data with paths made absolute.

    Notes text and true/false where a number is wanted, and anything where true/false is wanted: pydantic
    would convert ``"3"`` and ``true`` silently, and a quoted number is more often a slip than meant.
    """
    if shape is None:
        return value
    shape = shape.narrowed(value)
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        children = {
            item: _prepare(each, shape.child(item), (*path, item), source, problems) for item, each in items
        }
        return children if isinstance(value, dict) else list(children.values())
    wants_number = bool(shape.choices) and all(choice in (int, float) for choice in shape.choices)
    wants_flag = shape.choices == (bool,) and value is not None
    if (wants_number and isinstance(value, str | bool)) or (wants_flag and not isinstance(value, bool)):
        text = f"found {describe(value)}, expected {words(shape)}"
        problems.append(Problem(source.mark(path), dotted(path), text))
    if isinstance(value, str) and shape.is_path:
        return _file(value, shape, path, source, problems)
    return value


def _file(value: str, shape: Shape, path: KeyPath, source: Source, problems: list[Problem]) -> str:
    """Absolute path of a file named in a scenario."""
    mark = source.mark(path)
    absolute = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(mark.file)), value))
    must_exist = any(getattr(extra, "path_type", None) == "file" for extra in shape.metadata)
    if must_exist and (problem := problem_of_file(Path(absolute))):
        problems.append(Problem(mark, dotted(path), f"{problem} (named {describe(value)})"))
    return absolute
