"""Campaign files: which airframes, missions, scenarios, controllers and seeds are combined, and what is varied."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from uasfly.airframe import FileModel, Positive
from uasfly.drivers.plan import ControllerName
from uasfly.errors import FileError, shortened
from uasfly.files import split_key

MOST_FLIGHTS = 100_000
MOST_SWEPT = 1000
KINDS = ("airframe", "mission", "scenario", "plant")

Names = Annotated[list[Annotated[str, Field(min_length=1)]], Field(min_length=1, max_length=100)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Number = Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]


class Seeds(FileModel):
    """Seeds of everything random: `count` of them from `first` on, or `values`; a plain list means `values`."""

    first: Seed = 1
    count: Annotated[int | None, Field(ge=1, le=MOST_FLIGHTS)] = None
    values: Annotated[list[Seed] | None, Field(min_length=1, max_length=MOST_FLIGHTS)] = None

    @model_validator(mode="before")
    @classmethod
    def _list_means_values(cls, data: Any) -> Any:
        return {"values": data} if isinstance(data, list) else data

    @model_validator(mode="after")
    def _one_of_both(self) -> Seeds:
        if (self.count is None) == (self.values is None):
            raise ValueError(
                "expected either count (with first) or values, for example {first: 1, count: 20} or [1, 2]"
            )
        _refuse_repeated(self.values or [])
        return self

    def all(self) -> list[int]:
        """The seeds in their order."""
        if self.values is not None:
            return list(self.values)
        assert self.count is not None
        return list(range(self.first, self.first + self.count))


class Scatter(FileModel):
    """What every distribution may say."""

    relative: Annotated[bool, Field(description="the draw multiplies the value in the file, all of a list alike")] = (
        False
    )
    least: Annotated[Number | None, Field(description="what is drawn below becomes this")] = None
    most: Annotated[Number | None, Field(description="what is drawn above becomes this")] = None


class Normal(Scatter):
    """Normal distribution."""

    distribution: Literal["normal"]
    mean: Number
    sigma: Annotated[float, Field(ge=0.0, le=1e9)]


class Uniform(Scatter):
    """Uniform distribution."""

    distribution: Literal["uniform"]
    low: Number
    high: Number

    @model_validator(mode="after")
    def _in_order(self) -> Uniform:
        if self.high < self.low:
            raise ValueError(f"high must not be below low = {self.low:g}, found {self.high:g}; exchange them")
        return self


class LogNormal(Scatter):
    """Lognormal distribution: `sigma` is that of the natural logarithm (0.1 is about 10 %)."""

    distribution: Literal["lognormal"]
    median: Positive
    sigma: Annotated[float, Field(ge=0.0, le=5.0)]


Distribution = Annotated[Normal | Uniform | LogNormal, Field(discriminator="distribution")]


class Overrides(FileModel):
    """Fields that are changed, named as with `--set`: `airframe.` is what uasfly knows, `plant.` what is true."""

    fixed: Annotated[dict[str, object], Field(default_factory=dict, description="one value in all flights")]
    swept: Annotated[
        dict[str, Annotated[list[object], Field(min_length=1, max_length=MOST_SWEPT)]],
        Field(default_factory=dict, description="every value with every other: flights are multiplied"),
    ]
    scattered: Annotated[dict[str, Distribution], Field(default_factory=dict, description="drawn once a seed")]

    @field_validator("fixed", "swept", "scattered")
    @classmethod
    def _keys_are_fields(cls, fields: dict[str, Any]) -> dict[str, Any]:
        for key in fields:
            kind, _, rest = key.partition(".")
            if kind not in KINDS or not rest:
                known = ", ".join(f"{kind}." for kind in KINDS)
                raise ValueError(f"expected fields that begin with {known}, found {shortened(key)!r} (plant.mass_kg)")
            try:
                split_key(rest)
            except FileError as error:
                raise ValueError(error.problems[0]) from None
        return fields

    @field_validator("swept")
    @classmethod
    def _values_differ(cls, fields: dict[str, list[object]]) -> dict[str, list[object]]:
        for values in fields.values():
            _refuse_repeated(values)
        return fields

    @model_validator(mode="after")
    def _each_field_once(self) -> Overrides:
        keys = [*self.fixed, *self.swept, *self.scattered]
        for key in keys:
            if keys.count(key) > 1:
                raise ValueError(f"{shortened(key)} appears twice; keep it in one of fixed, swept and scattered")
        return self

    def keys(self) -> list[str]:
        """All fields in the order in which they are put in."""
        return [*self.fixed, *self.swept, *self.scattered]


class Success(FileModel):
    """When a flight counts as a success: it was completed, and what stands here holds too."""

    tracking_rms_m: Annotated[Positive | None, Field(description="largest RMS of truth minus reference")] = None


class Campaign(FileModel):
    """One campaign file. Every airframe flies every mission in every scenario with every controller, value and seed."""

    description: str = ""
    airframes: Names
    missions: Names
    scenarios: Names
    controllers: Annotated[list[ControllerName], Field(default_factory=lambda: ["nmpc"], min_length=1)]
    seeds: Seeds
    overrides: Annotated[Overrides, Field(default_factory=Overrides)]
    success: Success = Success()

    @field_validator("airframes", "missions", "scenarios", "controllers")
    @classmethod
    def _names_differ(cls, names: list[str]) -> list[str]:
        _refuse_repeated(names)
        return names

    @model_validator(mode="after")
    def _not_too_many(self) -> Campaign:
        if self.flights > MOST_FLIGHTS:
            raise ValueError(
                f"{self.flights} flights ({self.arithmetic()}); expected at most {MOST_FLIGHTS}: "
                "use fewer seeds or values, or several campaigns"
            )
        return self

    @property
    def flights(self) -> int:
        """How many flights these are."""
        count = len(self.airframes) * len(self.missions) * len(self.scenarios) * len(self.controllers)
        for values in self.overrides.swept.values():
            count *= len(values)
        return count * (self.seeds.count or len(self.seeds.values or []))

    def arithmetic(self) -> str:
        """Where that number comes from."""
        parts = [
            (len(self.airframes), "airframe"),
            (len(self.missions), "mission"),
            (len(self.scenarios), "scenario"),
            (len(self.controllers), "controller"),
            *((len(values), f"value of {key}") for key, values in self.overrides.swept.items()),
            (self.seeds.count or len(self.seeds.values or []), "seed"),
        ]
        return " x ".join(f"{count} {_plural(what, count)}" for count, what in parts)


def _plural(what: str, count: int) -> str:
    if count == 1:
        return what
    return what.replace("value of", "values of", 1) if what.startswith("value of") else f"{what}s"


def _refuse_repeated(items: Any) -> None:
    seen: set[str] = set()
    for item in items:
        text = json.dumps(item)
        if text in seen:
            raise ValueError(f"{shortened(text)} appears twice; remove one")
        seen.add(text)
