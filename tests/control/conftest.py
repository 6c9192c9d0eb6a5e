"""Shared by the controller's tests: one compiled solver for all of them, in a cache of their own."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator

import pytest

from tests.control.vehicle import f550
from uasfly.airframe import Airframe
from uasfly.control.compiled import CompiledBackend
from uasfly.control.native_library import load_solver
from uasfly.control.problem import Problem
from uasfly.control.virtual_machine import VirtualMachineBackend
from uasfly.control.workspace import Backend, Workspace
from uasfly.native import NativeUnavailableError


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    before = os.environ.get("XDG_CACHE_HOME")
    os.environ["XDG_CACHE_HOME"] = str(tmp_path_factory.mktemp("cache"))
    yield
    if before is None:
        del os.environ["XDG_CACHE_HOME"]
    else:
        os.environ["XDG_CACHE_HOME"] = before


@pytest.fixture(scope="session")
def library(_own_cache: None) -> ctypes.PyDLL:
    """The compiled driver; skips where there is no C compiler."""
    try:
        return load_solver()
    except NativeUnavailableError as reason:
        pytest.skip(f"no compiled solver: {reason}")


@pytest.fixture(params=["c", "vm"])
def make_backend(request: pytest.FixtureRequest) -> Callable[[Problem, Workspace], Backend]:
    """Each backend in turn."""
    if request.param == "vm":
        return VirtualMachineBackend
    library = request.getfixturevalue("library")
    return lambda problem, workspace: CompiledBackend(problem, workspace, library=library)


@pytest.fixture(params=["c", "vm"])
def backend_name(request: pytest.FixtureRequest) -> str:
    """Each backend's name in turn, "c" only where it can be had."""
    if request.param == "c":
        request.getfixturevalue("library")
    return str(request.param)


@pytest.fixture(scope="session")
def airframe() -> Airframe:
    """The f550."""
    return f550()
