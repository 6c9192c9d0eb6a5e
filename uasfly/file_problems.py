"""Turns validation errors of pydantic into sentences: where, what was expected, what was found, how to mend it."""

from __future__ import annotations

import difflib
import math
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import annotated_types
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from uasfly.errors import LONGEST_NAME, MOST_PROBLEMS
from uasfly.yaml_text import DataPath, dotted

_COUNT = ("no", "one", "two", "three", "four", "five", "six")
_NAMES: Mapping[object, tuple[str, str]] = {
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    str: ("a text", "texts"),
    bool: ("true or false", "true or false values"),
    object: ("a value", "values"),
}


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is most like `name`, or None when none is like it."""
    matches = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return matches[0] if matches else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Half a sentence that names the nearest known name, or all of them."""
    names = list(known)
    match = nearest(name, names)
    return f"did you mean {match}?" if match else f"known: {', '.join(names)}"


def found(value: object) -> str:
    """A value as an error shows it: short, on one line."""
    if isinstance(value, Mapping):
        return "a block of fields"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return f"{value:g} (not a finite number)"
    if isinstance(value, (int, float)):
        return repr(value)[:40]
    text = str(value)
    return repr(text if len(text) <= LONGEST_NAME else text[: LONGEST_NAME - 3] + "...")


def describe_problems(error: ValidationError, model: type[BaseModel], where: Callable[[DataPath], str]) -> list[str]:
    """One sentence a problem.

    Args:
        error: what pydantic found.
        model: the model that was checked.
        where: text in front of a problem for the path of the field (its line, or the flag that set it).
    """
    problems: dict[DataPath, str] = {}
    for details in error.errors(include_url=False):
        if details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]:
            continue  # pydantic counts the valid items only; the invalid ones have errors of their own
        if len(problems) > MOST_PROBLEMS:
            break  # no more are shown, and looking for a like name takes its time
        path, text = _describe(details, model)
        problems.setdefault(path, f"{where(path)}{text}")
    return list(dict.fromkeys(problems.values()))


def _describe(details: ErrorDetails, model: type[BaseModel]) -> tuple[DataPath, str]:
    place = _Place(model)
    for part in details["loc"]:
        place.enter(part)
    path, kind, context = place.path, details["type"], details.get("ctx", {})
    field = dotted(path) or "the file"
    if kind == "missing" and path and isinstance(path[-1], int):
        path = path[:-1]
        return path, f"{dotted(path)}: expected {describe_type(place.parent)}, found {found(details['input'])}"
    if kind == "missing":
        about = f" ({place.description})" if place.description else ""
        return path, f"{field} is missing; expected {describe_type(place.annotation)}{about}"
    if kind == "extra_forbidden":
        return path, f"{field} is not a known field; {did_you_mean(str(path[-1]), place.siblings())}"
    if kind == "union_tag_not_found":
        tag = str(context["discriminator"]).strip("'")
        return (*path, tag), f"{dotted((*path, tag))} is missing; expected one of {', '.join(place.tags(tag))}"
    if kind == "union_tag_invalid":
        tag, value = str(context["discriminator"]).strip("'"), str(context["tag"])
        known = place.tags(tag)
        expected = f"expected one of {', '.join(known)}"
        return (*path, tag), f"{dotted((*path, tag))}: {expected}, found {found(value)}{_mend(value, known)}"
    if kind in ("value_error", "assertion_error"):
        return path, f"{field}: {context['error']}"
    value, mend = details["input"], ""
    options = [str(v) for t in members(place.annotation) if get_origin(t) is Literal for v in get_args(t)]
    if isinstance(value, str) and options:
        mend = _mend(value, options)
    expected = describe_type(place.annotation)
    text = f"expected {expected}, found {found(value)}" if expected else f"{details['msg']}, found {found(value)}"
    return path, f"{field}: {text}{mend}"


def _mend(value: str, known: list[str]) -> str:
    match = nearest(value, known)
    return f"; did you mean {match}?" if match else ""


class _Place:
    """Walks pydantic's location through the types, leaving out the tags of unions that are no part of the data."""

    def __init__(self, model: type[BaseModel]) -> None:
        self.path: DataPath = ()
        self.annotation: object = model
        self.parent: object = None
        self.description = ""

    def enter(self, part: str | int) -> None:
        models = [member for member in members(self.annotation) if _is_model(member)]
        if len(models) > 1:
            self.annotation = next((m for m in models if part in (m.__name__, *_tags(m))), None)
            return
        if models:
            self._enter_field(models[0], part)
        elif isinstance(part, int):
            self._step(part, _item_type(self.annotation, part))
        elif part != "[key]" and (mapping := [m for m in members(self.annotation) if get_origin(m) is dict]):
            self._step(part, get_args(mapping[0])[1])

    def _enter_field(self, model: type[BaseModel], part: str | int) -> None:
        field = model.model_fields.get(str(part))
        self._step(part, None if field is None else _field_type(field), model)
        self.description = (field.description or "") if field else ""

    def _step(self, part: str | int, annotation: object, parent: object = None) -> None:
        self.parent = parent if parent is not None else self.annotation
        self.path, self.annotation = (*self.path, part), annotation

    def siblings(self) -> list[str]:
        """Fields of the block that the last step went into."""
        parent: Any = self.parent
        return list(parent.model_fields) if _is_model(parent) else []

    def tags(self, discriminator: str | None = None) -> list[str]:
        """Values of the discriminating field of the union at this place."""
        return [tag for member in members(self.annotation) if _is_model(member) for tag in _tags(member, discriminator)]


def _is_model(annotation: object) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _tags(model: Any, discriminator: str | None = None) -> list[str]:
    return [
        str(value)
        for name, field in model.model_fields.items()
        if get_origin(field.annotation) is Literal and discriminator in (None, name)
        for value in get_args(field.annotation)
    ]


def _field_type(field: FieldInfo) -> object:
    return Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation


def _item_type(annotation: object, index: int) -> object:
    for member in members(annotation):
        arguments = get_args(member)
        if get_origin(member) is tuple and Ellipsis not in arguments:
            return arguments[index] if index < len(arguments) else None
        if get_origin(member) in (list, tuple) and arguments:
            return arguments[0]
    return None


def members(annotation: object) -> Iterator[Any]:
    """Members of a union without None; the annotation itself when it is no union; Annotated is looked through."""
    if isinstance(annotation, TypeVar):
        return
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from members(get_args(annotation)[0])
    elif origin in (Union, types.UnionType):
        for member in get_args(annotation):
            yield from members(member)
    elif annotation is not None and annotation is not type(None):
        yield annotation


def describe_type(annotation: object, plural: bool = False) -> str:
    """What a value of this type is, in words: "a number greater than 0", "a list of three numbers"."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _with_bounds(describe_type(arguments[0], plural), _flat(arguments[1:]))
    if origin in (Union, types.UnionType):
        models = [member for member in members(annotation) if _is_model(member)]
        if len(models) > 1:
            return "blocks of fields" if plural else "a block of fields"
        return " or ".join(dict.fromkeys(describe_type(m, plural) for m in arguments if m is not type(None)))
    if origin is Literal:
        return f"{'' if plural else 'one of '}{', '.join(str(value) for value in arguments)}"
    if origin in (tuple, list) and arguments:
        alike = all(argument in (arguments[0], Ellipsis) for argument in arguments)
        item = describe_type(arguments[0] if alike else _without_bounds(arguments[0]), plural=True)
        count = "" if origin is list or Ellipsis in arguments else f"{_count(len(arguments))} "
        return f"{'lists' if plural else 'a list'} of {count}{item}"
    if _is_model(annotation) or origin is dict:
        return "blocks of fields" if plural else "a block of fields"
    return _NAMES[annotation][plural] if annotation in _NAMES else ""


def _without_bounds(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def _count(number: int) -> str:
    return _COUNT[number] if number < len(_COUNT) else str(number)


def _flat(metadata: Iterable[object]) -> Iterator[object]:
    for item in metadata:
        if isinstance(item, FieldInfo):
            yield from item.metadata
        else:
            yield item


def _with_bounds(text: str, metadata: Iterable[object]) -> str:
    bounds = []
    for item in metadata:
        if isinstance(item, annotated_types.Gt):
            bounds.append(f"above {item.gt:g}")
        elif isinstance(item, annotated_types.Ge):
            bounds.append(f"not below {item.ge:g}")
        elif isinstance(item, annotated_types.Lt):
            bounds.append(f"below {item.lt:g}")
        elif isinstance(item, annotated_types.Le):
            bounds.append(f"not above {item.le:g}")
        elif isinstance(item, annotated_types.MinLen):
            bounds.append(f"not shorter than {item.min_length}")
        elif isinstance(item, annotated_types.MaxLen):
            bounds.append(f"not longer than {item.max_length}")
        elif pattern := getattr(item, "pattern", None):
            bounds.append(f"matching {pattern}")
    return f"{text}, {' and '.join(bounds)}" if bounds else text
