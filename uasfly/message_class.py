"""How a message is made: the decorator of all dataclasses that flow between the rooms, and the type of their arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Message = TypeVar("Message")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def message(kind: type[Message]) -> type[Message]:
    """A dataclass with slots that nobody changes once it is made: the type checker sees to it.

    With frozen=True the interpreter would see to it too, at more than twice the steps to make one, and a control cycle
    makes a dozen.
    """
    return dataclass(slots=True, unsafe_hash=True)(kind)
