"""Turns pydantic's validation errors into problems: where, which field, what was found, what is allowed."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, ValidationError

from hdsim.scenario.fields import Shape, listed, shape_of, words
from hdsim.scenario.problems import Problem, describe, dotted, shorten
from hdsim.scenario.reader import KeyPath, Source


class _Union(NamedTuple):
    """The place where pydantic tried several types without a discriminator."""

    path: KeyPath
    shape: Shape
    data: Any


class _Complaint(NamedTuple):
    """One entry of pydantic's list, located in the data."""

    detail: Mapping[str, Any]
    path: KeyPath
    shape: Shape | None
    data: Any
    parent: Shape | None
    union: _Union | None
    branch: str

    @property
    def kind(self) -> str:
        return str(self.detail["type"])

    @property
    def unknown_key(self) -> bool:
        return self.kind == "extra_forbidden"

    @property
    def missing(self) -> bool:
        return self.kind in ("missing", "union_tag_not_found")


def complaints(error: ValidationError, model: type[BaseModel], source: Source) -> list[Problem]:
    """Every problem that pydantic found, at most one a place."""
    places: dict[KeyPath, list[_Complaint]] = {}
    for detail in error.errors(include_url=False):
        complaint = _locate(detail, model, source)
        group = complaint.union.path if complaint.union else complaint.path
        places.setdefault(group, []).append(complaint)
    suggested: set[KeyPath] = set()
    chosen = [each for group in places.values() for each in _likeliest_branch(group)]
    for complaint in chosen:
        if complaint.unknown_key and (near := _nearest(complaint)):
            suggested.add((*complaint.path[:-1], near))
    # A missing field that an unknown key's line already names needs no line of its own.
    return [_problem(each, source) for each in chosen if not (each.missing and each.path in suggested)]


def _locate(detail: Mapping[str, Any], model: type[BaseModel], source: Source) -> _Complaint:
    """Follow pydantic's location, which holds the labels of chosen union members between keys and indices."""
    path: KeyPath = ()
    shape: Shape | None = shape_of(model)
    data: Any = source.data
    parent: Shape | None = None
    union: _Union | None = None
    branch = ""
    for item in detail["loc"]:
        if shape is not None and len(shape.choices) > 1:
            if shape.discriminator is None and union is None:
                union, branch = _Union(path, shape, data), str(item)
            shape = _choose(shape, str(item))
            continue
        child = shape.child(item) if shape is not None else None
        written = _has(data, item)
        if child is None and not written:
            continue  # a label such as function-after[...]
        data = data[item] if written else None
        path, parent, shape = (*path, item), shape, child
    return _Complaint(detail, path, shape, data, parent, union, branch)


def _has(data: Any, item: str | int) -> bool:
    if isinstance(data, Mapping):
        return item in data
    return isinstance(data, list) and isinstance(item, int) and item < len(data)


def _choose(shape: Shape, label: str) -> Shape:
    """The member of a union that a label of pydantic's means."""
    if shape.discriminator:
        model = shape.models.get(label)
        return shape._replace(choices=(model,) if model else (), discriminator=None)
    names = {str(choice) if get_args(choice) else choice.__name__: choice for choice in shape.choices}
    if label not in names:
        label = next((name for name in sorted(names, key=len, reverse=True) if name in label), label)
    return shape._replace(choices=(names[label],) if label in names else ())


def _likeliest_branch(group: list[_Complaint]) -> list[_Complaint]:
    """Of the members of a union, the complaints of the one that the user most likely meant."""
    branches: dict[str, list[_Complaint]] = {}
    for complaint in group:
        branches.setdefault(complaint.branch, []).append(complaint)
    union = group[0].union
    if union is None or len(branches) == 1:
        return group
    inside = [
        errors for errors in branches.values() if all(len(error.path) > len(union.path) for error in errors)
    ]
    if inside and isinstance(union.data, dict | list):
        return min(inside, key=len)
    merged = {**group[0].detail, "type": "union"}
    return [group[0]._replace(detail=merged, path=union.path, shape=union.shape, data=union.data)]


def _problem(complaint: _Complaint, source: Source) -> Problem:
    path, shape, found = complaint.path, complaint.shape, describe(complaint.data)
    context = complaint.detail.get("ctx", {})
    expected = words(shape) if shape is not None and shape.choices else ""
    match complaint.kind:
        case "extra_forbidden":
            text = _unknown_key(complaint)
        case "missing":
            text = f"found nothing, expected {expected or 'a value'}"
        case "union_tag_invalid" | "union_tag_not_found":
            return _wrong_tag(complaint, source)
        case "literal_error" | "enum":
            text = f"found {found}, expected {expected or context.get('expected', 'another value')}"
            text += _did_you_mean(complaint.data, _allowed(shape))
        case "value_error" | "assertion_error":
            message = shorten(" ".join(str(context.get("error", complaint.detail["msg"])).split()), 400)
            says_it = "found" in message or isinstance(complaint.data, dict)
            text = message if says_it else f"found {found}, but {message}"
        case _ if expected:
            text = f"found {found}, expected {expected}"
        case _:
            text = f"found {found}, but {complaint.detail['msg']}"
    return Problem(source.mark(path), dotted(path), text, complaint.missing)


def _unknown_key(complaint: _Complaint) -> str:
    known = _keys(complaint.parent)
    if near := _nearest(complaint):
        return f"found an unknown key, expected {near!r} (allowed: {listed(known, 20)})"
    return f"found an unknown key, expected one of {listed(known, 20)}" if known else "found an unknown key"


def _wrong_tag(complaint: _Complaint, source: Source) -> Problem:
    """A mapping whose discriminator is missing or names no known model, or no mapping at all."""
    shape, data = complaint.shape, complaint.data
    key = str(complaint.detail.get("ctx", {}).get("discriminator", "")).strip("'")
    if shape is None or not isinstance(data, Mapping):
        text = f"found {describe(data)}, expected {words(shape) if shape is not None else 'a mapping'}"
        return Problem(source.mark(complaint.path), dotted(complaint.path), text)
    allowed = list(shape.models)
    path = (*complaint.path, key)
    found = describe(data[key]) if key in data else "nothing"
    text = f"found {found}, expected one of {listed(allowed, 30)}{_did_you_mean(data.get(key), allowed)}"
    return Problem(source.mark(path), dotted(path), text, complaint.missing)


def _keys(shape: Shape | None) -> list[str]:
    return (
        []
        if shape is None
        else list(dict.fromkeys(name for m in shape.models.values() for name in m.model_fields))
    )


def _nearest(complaint: _Complaint) -> str | None:
    near = get_close_matches(str(complaint.path[-1]), _keys(complaint.parent), 1, cutoff=0.55)
    return near[0] if near else None


def _allowed(shape: Shape | None) -> list[str]:
    values = [] if shape is None else [value for choice in shape.choices for value in get_args(choice)]
    return [value for value in values if isinstance(value, str)]


def _did_you_mean(value: Any, allowed: list[str]) -> str:
    near = get_close_matches(value, allowed, 1) if isinstance(value, str) else []
    return f"; did you mean {near[0]!r}?" if near else ""
