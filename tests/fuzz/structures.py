"""Plain data of files: made from a schema within its bounds but odd, or damaged in one place."""

from __future__ import annotations

import copy
import json
import math
from typing import Any

from pydantic import BaseModel

from tests.fuzz.harness import Rng
from tests.fuzz.odd import choice, odd_data, odd_number

Data = Any


class SchemaMaker:
    """Makes values that a model's JSON Schema allows; what only its validators know is left to them."""

    def __init__(self, model: type[BaseModel]) -> None:
        self.schema = model.model_json_schema(mode="validation")
        self._definitions = self.schema.get("$defs", {})

    def make(self, rng: Rng, schema: dict[str, Any]) -> Data:
        """A value of a schema."""
        schema = self.resolved(schema)
        if "const" in schema:
            return schema["const"]
        if "enum" in schema:
            return choice(rng, schema["enum"])
        for union in ("oneOf", "anyOf"):
            if union in schema:
                return self.make(rng, choice(rng, schema[union]))
        match schema.get("type"):
            case "object":
                return self._object(rng, schema)
            case "array":
                return self._array(rng, schema)
            case "number":
                return _number(rng, schema)
            case "integer":
                return round(_number(rng, schema))
            case "string":
                return (
                    choice(rng, ("a", "f550", "x_y-1", "calm"))
                    if "pattern" in schema
                    else choice(rng, ("a", "é b", "0"))
                )
            case "boolean":
                return bool(rng.integers(2))
            case "null":
                return None
        return odd_data(rng)

    def resolved(self, schema: dict[str, Any]) -> dict[str, Any]:
        """A schema without a reference."""
        while "$ref" in schema:
            schema = self._definitions[schema["$ref"].rsplit("/", 1)[1]]
        return schema

    def _object(self, rng: Rng, schema: dict[str, Any]) -> Data:
        if "properties" not in schema:
            return {}
        required = set(schema.get("required", ()))
        return {
            name: self.make(rng, field)
            for name, field in schema["properties"].items()
            if name in required or rng.random() < 0.4
        }

    def _array(self, rng: Rng, schema: dict[str, Any]) -> Data:
        if "prefixItems" in schema:
            return [self.make(rng, item) for item in schema["prefixItems"]]
        least = schema.get("minItems", 0)
        count = least + int(rng.integers(4) if rng.random() < 0.95 else rng.integers(60))
        return [self.make(rng, schema["items"]) for _ in range(min(count, schema.get("maxItems", count)))]

    def schema_at(self, path: tuple[str | int, ...], data: Data) -> dict[str, Any] | None:
        """Schema of a place in data; None where the data is none of the schema's."""
        schema = self.schema
        for part in path:
            schema = self._narrowed(schema, data)
            if isinstance(part, int):
                items = schema.get("prefixItems")
                step = items[part] if items and part < len(items) else schema.get("items")
            else:
                step = schema.get("properties", {}).get(part)
            if not isinstance(step, dict):
                return None
            schema, data = step, data[part]
        return schema

    def _narrowed(self, schema: dict[str, Any], data: Data) -> dict[str, Any]:
        schema = self.resolved(schema)
        for union in ("oneOf", "anyOf"):
            for member in map(self.resolved, schema.get(union, ())):
                tags = {n: f["const"] for n, f in member.get("properties", {}).items() if "const" in f}
                if isinstance(data, dict) and tags and all(data.get(name) == tag for name, tag in tags.items()):
                    return member
                if isinstance(data, list) and member.get("type") == "array":
                    return member
        return schema


def _number(rng: Rng, schema: dict[str, Any]) -> float:
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    kind = rng.integers(5)
    if low is None and high is None:
        return odd_number(rng)
    if kind == 0 and low is not None:
        return float(low) if "minimum" in schema else math.nextafter(low, math.inf)
    if kind == 1 and high is not None:
        return float(high) if "maximum" in schema else math.nextafter(high, -math.inf)
    low = -1e4 if low is None else float(low)
    if high is None:
        return low + abs(odd_number(rng))
    if kind == 2:
        return float(low + (high - low) * 10.0 ** rng.uniform(-9.0, 0.0))
    return float(rng.uniform(low, high))


def places(data: Data, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Every place in plain data."""
    found = [path]
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += places(value, (*path, key))
    return found


def changed(rng: Rng, data: Data, maker: SchemaMaker, damage: float) -> Data:
    """Data with some places made anew within the schema, or with the probability `damage` out of it."""
    data = copy.deepcopy(data)
    for _ in range(1 + int(rng.geometric(0.4))):
        path: tuple[str | int, ...] = choice(rng, places(data)[1:] or [()])
        if not path:
            return odd_data(rng)
        parent = data
        for part in path[:-1]:
            parent = parent[part]
        if rng.random() < damage:
            _damage(rng, parent, path[-1])
            continue
        schema = maker.schema_at(path, data)
        if schema is not None:
            parent[path[-1]] = maker.make(rng, schema)
    return data


def _damage(rng: Rng, parent: Data, key: str | int) -> None:
    kind = rng.integers(4)
    if kind == 0:
        del parent[key]
    elif kind == 1 and isinstance(parent, list) and isinstance(key, int):
        parent += [copy.deepcopy(parent[key])] * int(rng.integers(1, 30))
    elif kind == 2 and isinstance(parent, dict):
        parent[choice(rng, ("x", "name", "__init__", "\x1b", "", "type", "kind", "v" * 400))] = parent.pop(key)
    else:
        parent[key] = odd_data(rng)


def as_yaml(data: Data) -> str:
    """Data as YAML in flow style, which is JSON but for numbers that are not finite."""
    if isinstance(data, dict):
        return "{" + ", ".join(f"{json.dumps(str(key))}: {as_yaml(value)}" for key, value in data.items()) + "}"
    if isinstance(data, list):
        return "[" + ", ".join(map(as_yaml, data)) + "]"
    if isinstance(data, float) and not math.isfinite(data):
        return ".nan" if math.isnan(data) else ".inf" if data > 0.0 else "-.inf"
    return json.dumps(data)
