"""C from the model: generated, compiled once by the compiler that is there, kept in the user's cache, loaded.

The library's name is a digest of everything that decides what is in it (source, compiler, flags, machine), so a change
of the model, of CasADi or of the compiler makes a new one. It is written beside its final name and moved there in one
step: several processes may start at once, and one that is killed leaves nothing half done.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import casadi as ca

from uasfly.control.references import input_reference_function, trim_function
from uasfly.control.riccati import FACTOR, PACKED, PACKED_INPUTS, stage_functions
from uasfly.control.transcription import linearisation_function
from uasfly.errors import UasflyError
from uasfly.model import INPUTS, PARAMETERS, STATES

# Not -ffast-math: the checks for NaN would be optimised away. Not -march=native: a home may be shared between machines.
FLAGS = ("-O2", "-std=c99", "-fPIC", "-shared", "-fno-math-errno")
COMPILE_TIMEOUT_S = 180.0


class NativeUnavailableError(UasflyError):
    """There is no compiled solver here; the text says why. The virtual machine takes its place."""


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


def find_compiler() -> list[str]:
    """Command of the C compiler: CC from the environment, else cc, gcc or clang.

    Raises:
        NativeUnavailableError: where none is found.
    """
    named = os.environ.get("CC")
    if named:
        command = shlex.split(named)
        if not command or shutil.which(command[0]) is None:
            raise NativeUnavailableError(f"the compiler that CC names, {named!r}, is not found")
        return command
    for name in ("cc", "gcc", "clang"):
        path = shutil.which(name)
        if path is not None:
            return [path]
    raise NativeUnavailableError("no C compiler is found (cc, gcc, clang, or the one that CC names)")


def cache_folder() -> Path:
    """Private folder of compiled libraries, made if need be: uasfly/native in $XDG_CACHE_HOME or ~/.cache.

    Raises:
        NativeUnavailableError: where it cannot be made or is not private: who can write there can run code as the user.
    """
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(named) if named and Path(named).is_absolute() else Path.home() / ".cache"
        folder = base / "uasfly" / "native"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_private(folder)
    except (OSError, RuntimeError) as error:
        raise NativeUnavailableError(f"the cache folder cannot be used: {error}") from error
    return folder


def load_library(
    source: str | None = None, compiler: Sequence[str] | None = None, folder: Path | None = None
) -> ctypes.PyDLL:
    """The compiled driver, from the cache or compiled now (once, some seconds).

    `ctypes.PyDLL` keeps the interpreter's lock during a call: a call takes a tenth of a millisecond, while getting the
    lock back from a busy thread may take milliseconds.

    Raises:
        NativeUnavailableError: where it cannot be had; the text says why.
    """
    source = source if source is not None else library_source()
    command = list(compiler) if compiler is not None else find_compiler()
    folder = folder if folder is not None else cache_folder()
    path = folder / f"rti-{_digest(source, command)}.so"
    try:
        if path.exists():
            _check_private(path)
            try:
                return ctypes.PyDLL(str(path))
            except OSError:  # a damaged file: make it anew
                path.unlink()
        _compile(source, command, path)
        return ctypes.PyDLL(str(path))
    except OSError as error:
        raise NativeUnavailableError(f"the compiled solver cannot be stored or loaded: {error}") from error


def _check_private(path: Path) -> None:
    status = path.stat()
    if status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise NativeUnavailableError(f"{path} belongs to another user or others may write to it")


def _digest(source: str, command: list[str]) -> str:
    try:
        version = subprocess.run([*command, "--version"], check=True, capture_output=True, timeout=COMPILE_TIMEOUT_S)
    except (OSError, subprocess.SubprocessError) as error:
        raise NativeUnavailableError(f"the compiler {shlex.join(command)} does not run: {error}") from error
    parts = (
        source,
        shlex.join(command),
        version.stdout.decode(errors="replace"),
        shlex.join(FLAGS),
        platform.machine(),
    )
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


def _compile(source: str, command: list[str], path: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="build-", dir=path.parent) as build:
        code, library = Path(build) / "rti.c", Path(build) / "rti.so"
        code.write_text(source, encoding="utf-8")
        try:
            subprocess.run(
                [*command, *FLAGS, str(code), "-o", str(library), "-lm"],
                check=True,
                capture_output=True,
                timeout=COMPILE_TIMEOUT_S,
            )
        except subprocess.CalledProcessError as error:
            lines = error.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
            raise NativeUnavailableError(f"the compiler {shlex.join(command)} failed: {lines[0]}") from error
        except subprocess.TimeoutExpired as error:
            raise NativeUnavailableError(f"the compiler took longer than {COMPILE_TIMEOUT_S:.0f} s") from error
        library.chmod(0o700)
        library.replace(path)
