"""The compiled solver: C generated from the model, sizes, and the driver written by hand."""

from __future__ import annotations

import ctypes
from importlib import resources
from pathlib import Path
from typing import Any

import casadi as ca

from uasfly.control.references import input_reference_function, trim_function
from uasfly.control.riccati import FACTOR, PACKED, PACKED_INPUTS, stage_functions
from uasfly.control.transcription import linearisation_function
from uasfly.model import INPUTS, PARAMETERS, STATES
from uasfly.native import load_library


def driver_source() -> str:
    """The hand-written part, in the order of its files' names."""
    folder = resources.files("uasfly.control").joinpath("native")
    files = sorted((item for item in folder.iterdir() if item.name.endswith(".c")), key=lambda item: item.name)
    return "\n".join(item.read_text(encoding="utf-8") for item in files)


def library_source() -> str:
    """The whole C source: functions generated from the model, sizes, driver."""
    linearise, pattern = linearisation_function()
    options: dict[str, Any] = {"with_header": False, "casadi_real": "double", "casadi_int": "int", "with_mem": False}
    generator = ca.CodeGenerator("uasfly_generated", options)
    functions = (linearise, *stage_functions(pattern).all(), trim_function(), input_reference_function())
    for function in functions:
        generator.add(function)
    sizes = {
        "NX": STATES,
        "NU": INPUTS,
        "NP": PARAMETERS,
        "NJ": pattern.size,
        "NS": PACKED,
        "NH": PACKED_INPUTS,
        "NF": FACTOR,
    }
    defines = "".join(f"#define {name} {size}\n" for name, size in sizes.items())
    return f"{generator.dump()}\n{defines}\n{driver_source()}"


def load_solver() -> ctypes.PyDLL:
    """The compiled solver.

    `ctypes.PyDLL` keeps the interpreter's lock during a call: a call takes a tenth of a millisecond, while getting the
    lock back from a busy thread may take milliseconds.

    Raises:
        NativeUnavailableError: where it cannot be had; the text says why.
    """

    def load(path: Path) -> ctypes.PyDLL:
        return ctypes.PyDLL(str(path))

    return load_library(library_source(), "rti", load)
