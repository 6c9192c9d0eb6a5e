"""C compiled once by the compiler that is there, kept in the user's cache, loaded.

A library's name is a digest of everything that decides what is in it (source, compiler, flags, machine), so a change
of the model, of CasADi or of the compiler makes a new one. It is written beside its final name and moved there in one
step: several processes may start at once, and one that is killed leaves nothing half done.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import casadi as ca

from uasfly.errors import UasflyError

# Not -ffast-math: the checks for NaN would be optimised away. Not -march=native: a home may be shared between machines.
FLAGS = ("-O2", "-std=c99", "-fPIC", "-shared", "-fno-math-errno")
COMPILE_TIMEOUT_S = 180.0

Library = TypeVar("Library")


class NativeUnavailableError(UasflyError):
    """Nothing can be compiled here; the text says why. CasADi's virtual machine takes its place."""


def compiled(functions: Sequence[ca.Function], name: str) -> list[ca.Function]:
    """The functions, compiled; where that cannot be had, as they are: CasADi's virtual machine is 10-20 times slower.

    Args:
        functions: with distinct names.
        name: of the library's file.
    """
    try:
        return compile_functions(functions, name)
    except NativeUnavailableError:
        return list(functions)


def compile_functions(
    functions: Sequence[ca.Function], name: str, compiler: Sequence[str] | None = None, folder: Path | None = None
) -> list[ca.Function]:
    """The functions, compiled.

    Raises:
        NativeUnavailableError: where that cannot be had; the text says why.
    """
    options: dict[str, Any] = {"with_mem": False}
    generator = ca.CodeGenerator(name, options)
    for function in functions:
        generator.add(function)

    def load(path: Path) -> list[ca.Function]:
        try:
            return [ca.external(function.name(), str(path)) for function in functions]
        except RuntimeError as error:
            raise OSError(str(error).splitlines()[0]) from error

    return load_library(generator.dump(), name, load, FLAGS, compiler, folder)


def find_compiler() -> list[str]:
    """Command of the C compiler: CC from the environment, else cc, gcc or clang.

    `CC="cc -march=native"` makes code for this very processor.

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
    source: str,
    name: str,
    load: Callable[[Path], Library],
    flags: Sequence[str] = FLAGS,
    compiler: Sequence[str] | None = None,
    folder: Path | None = None,
) -> Library:
    """What `load` makes of the library, from the cache or compiled now (once, some seconds).

    Args:
        source: C.
        name: of the library's file, beside the digest.
        load: opens the file; an OSError means that it is damaged, and it is made anew once.
        flags: for the compiler.
        compiler: command; by default the one that is found.
        folder: of the cache; by default the user's.

    Raises:
        NativeUnavailableError: where it cannot be had; the text says why.
    """
    command = tuple(compiler) if compiler is not None else tuple(find_compiler())
    folder = folder if folder is not None else cache_folder()
    path = folder / f"{name}-{_digest(source, command, flags)}.so"
    try:
        if path.exists():
            _check_private(path)
            try:
                return load(path)
            except OSError:  # a damaged file: make it anew
                path.unlink()
        _compile(source, command, flags, path)
        return load(path)
    except OSError as error:
        raise NativeUnavailableError(f"what was compiled cannot be stored or loaded: {error}") from error


def _check_private(path: Path) -> None:
    status = path.stat()
    if status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise NativeUnavailableError(f"{path} belongs to another user or others may write to it")


def _digest(source: str, command: tuple[str, ...], flags: Sequence[str]) -> str:
    words = shlex.join((*command, *flags))
    parts = (source, words, _version(command), platform.machine(), _processor() if "native" in words else "")
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def _processor() -> str:
    """What tells processors apart that cannot run each other's code, where the user asks for such code."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.node()
    return "\n".join(sorted({line for line in lines if line.startswith(("model name", "flags", "Features", "CPU"))}))


@lru_cache(maxsize=4)
def _version(command: tuple[str, ...]) -> str:
    try:
        version = subprocess.run([*command, "--version"], check=True, capture_output=True, timeout=COMPILE_TIMEOUT_S)
    except (OSError, subprocess.SubprocessError) as error:
        raise NativeUnavailableError(f"the compiler {shlex.join(command)} does not run: {error}") from error
    return version.stdout.decode(errors="replace")


def _compile(source: str, command: tuple[str, ...], flags: Sequence[str], path: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="build-", dir=path.parent) as build:
        code, library = Path(build) / "source.c", Path(build) / "library.so"
        code.write_text(source, encoding="utf-8")
        try:
            subprocess.run(
                [*command, *flags, str(code), "-o", str(library), "-lm"],
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
