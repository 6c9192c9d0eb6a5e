"""Messages as JSON and back, without loss: what a log holds is what flowed, bit for bit.

Floats are written with Python's shortest repr, which reads back to the same bits. JSON has no NaN or infinity:
such values are written as null and read back as NaN.
"""

from __future__ import annotations

import dataclasses
import enum
import json
import math
import types
import typing
from typing import Any

import numpy as np

from uasfly import messages


def to_json(value: object) -> bytes:
    """JSON text of a message (UTF-8, no spaces)."""
    try:
        return _encoder.encode(to_plain(value)).encode()
    except ValueError:  # a NaN or infinity somewhere: rare, so only then is every number looked at
        return _encoder.encode(_without_non_finite(to_plain(value))).encode()


def to_plain(value: object) -> Any:
    """Plain data of a message, array, enum or number; numbers that are not finite are left as they are."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if value is None or isinstance(value, (float, bool, int, str)):
        return value
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, (tuple, list)):
        return [to_plain(item) for item in value]
    if dataclasses.is_dataclass(value):
        return {name: to_plain(getattr(value, name)) for name in _field_names(type(value))}
    raise TypeError(f"cannot log a {type(value).__name__}")


def from_json(message_type: type[Any], data: bytes) -> Any:
    """The message of `message_type` that `to_json` wrote.

    Raises:
        ValueError: when the text is no JSON or does not fit the type.
    """
    return _from_plain(message_type, json.loads(data))


def json_schema(message_type: type[Any]) -> dict[str, Any]:
    """JSON Schema of a message type, as viewers (Foxglove, PlotJuggler) want it."""
    properties = {name: _schema_of(kind) for name, kind in _field_types(message_type).items()}
    return {"title": message_type.__name__, "type": "object", "properties": properties}


_encoder = json.JSONEncoder(separators=(",", ":"), allow_nan=False)
_names: dict[type[Any], tuple[str, ...]] = {}
_types: dict[type[Any], dict[str, Any]] = {}


def _field_names(kind: type[Any]) -> tuple[str, ...]:
    names = _names.get(kind)
    if names is None:
        names = _names[kind] = tuple(field.name for field in dataclasses.fields(kind))
    return names


def _field_types(kind: type[Any]) -> dict[str, Any]:
    found = _types.get(kind)
    if found is None:
        hints = typing.get_type_hints(kind)
        found = _types[kind] = {name: hints[name] for name in _field_names(kind)}
    return found


def _without_non_finite(plain: Any) -> Any:
    if isinstance(plain, list):
        return [_without_non_finite(item) for item in plain]
    if isinstance(plain, dict):
        return {key: _without_non_finite(item) for key, item in plain.items()}
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain


def _is_array(kind: Any) -> bool:
    return kind is messages.Array or typing.get_origin(kind) is np.ndarray


def _from_plain(kind: Any, plain: Any) -> Any:
    origin = typing.get_origin(kind)
    if _is_array(kind):
        return np.array(plain, dtype=np.float64)
    if origin in (types.UnionType, typing.Union):
        options = [option for option in typing.get_args(kind) if option is not type(None)]
        return None if plain is None else _from_plain(options[0], plain)
    if origin is tuple:
        arguments = typing.get_args(kind)
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return tuple(_from_plain(arguments[0], item) for item in plain)
        return tuple(_from_plain(item_kind, item) for item_kind, item in zip(arguments, plain, strict=True))
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        if not isinstance(plain, dict):
            raise ValueError(f"expected an object for {kind.__name__}, found {plain!r}")
        fields = _field_types(kind)
        return kind(**{name: _from_plain(fields[name], plain[name]) for name in fields if name in plain})
    if kind is float:
        return math.nan if plain is None else float(plain)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return kind(plain)
    return plain


def _schema_of(kind: Any) -> dict[str, Any]:
    origin = typing.get_origin(kind)
    if _is_array(kind):
        return {"type": "array", "items": {"type": "number"}}
    if origin in (types.UnionType, typing.Union):
        options = [option for option in typing.get_args(kind) if option is not type(None)]
        return _schema_of(options[0])
    if origin is tuple:
        return {"type": "array", "items": _schema_of(typing.get_args(kind)[0])}
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return {"type": "object", "properties": {n: _schema_of(k) for n, k in _field_types(kind).items()}}
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return {"type": "string"}
    return {"type": {float: "number", int: "integer", bool: "boolean"}.get(kind, "string")}
