"""Compiling once, keeping safely, doing without."""

from __future__ import annotations

import ctypes
import multiprocessing
import shutil
from pathlib import Path

import pytest

from tests.control.programs import small_problem
from uasfly.control import native_library
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.native_library import (
    NativeUnavailableError,
    cache_folder,
    driver_source,
    find_compiler,
    library_source,
    load_library,
)
from uasfly.control.qp import SolveStatus
from uasfly.control.riccati import stage_functions
from uasfly.control.transcription import linearisation_function

TINY = "int answer(void) { return 42; }\n"

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler (cc, gcc, clang)"
)


def _answer(library: ctypes.PyDLL) -> int:
    return int(library.answer())


def _load_in_a_process(folder: str) -> int:
    return _answer(load_library(TINY, folder=Path(folder)))


@needs_compiler
def test_a_library_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second load takes the file of the first; nothing but that file is left in the folder."""
    assert _answer(load_library(TINY, folder=tmp_path)) == 42
    (kept,) = tmp_path.iterdir()
    monkeypatch.setattr(native_library, "_compile", lambda *_: pytest.fail("compiled again"))
    assert _answer(load_library(TINY, folder=tmp_path)) == 42
    assert [kept] == list(tmp_path.iterdir())
    assert kept.stat().st_mode & 0o077 == 0


@needs_compiler
def test_source_and_flags_make_another_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is in a library decides its name: another source or other flags never meet an old file."""
    load_library(TINY, folder=tmp_path)
    load_library(TINY + "\n", folder=tmp_path)
    monkeypatch.setattr(native_library, "FLAGS", (*native_library.FLAGS, "-g"))
    load_library(TINY, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


@needs_compiler
def test_several_processes_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    """Two start together on an empty cache; each gets a working library and one file remains."""
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(_load_in_a_process, [str(tmp_path)] * 2) == [42, 42]
    assert len(list(tmp_path.iterdir())) == 1


@needs_compiler
def test_a_damaged_file_is_made_anew(tmp_path: Path) -> None:
    """A library that does not load is replaced, once, by a good one."""
    load_library(TINY, folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.unlink()  # a new file: this process has the old one loaded
    kept.write_bytes(b"not a library")
    kept.chmod(0o700)
    assert _answer(load_library(TINY, folder=tmp_path)) == 42


@needs_compiler
def test_a_file_that_others_may_write_is_not_loaded(tmp_path: Path) -> None:
    """Someone else could have put code there."""
    load_library(TINY, folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.chmod(0o722)
    with pytest.raises(NativeUnavailableError, match="others may write"):
        load_library(TINY, folder=tmp_path)


@needs_compiler
def test_a_compile_error_is_told_in_one_line(tmp_path: Path) -> None:
    """The compiler's first line is the reason; nothing is left behind."""
    with pytest.raises(NativeUnavailableError, match=r"failed: .*error") as caught:
        load_library("int answer(void) { return nonsense; }\n", folder=tmp_path)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_the_cache_follows_xdg_and_is_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """XDG_CACHE_HOME names its place, else the home; only the user may enter what is made."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = cache_folder()
    assert folder == tmp_path / "cache" / "uasfly" / "native"
    assert folder.stat().st_mode & 0o077 == 0
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "uasfly" / "native"


def test_a_cache_that_others_may_write_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Libraries are code: a folder open to others is not used."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cache_folder().chmod(0o777)
    with pytest.raises(NativeUnavailableError, match="others may write"):
        cache_folder()


def test_a_cache_that_cannot_be_made_leaves_the_virtual_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file where the folder should be: the solver works all the same and says why it is slower."""
    (tmp_path / "uasfly").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(native_library, "find_compiler", lambda: ["cc"])
    rti = RealTimeIteration(small_problem())
    assert rti.backend.name == "vm"
    assert "cache folder cannot be used" in rti.announcement
    assert rti.solve(0.0) is SolveStatus.CONVERGED or rti.plan_start_s is None


def test_without_a_compiler_the_virtual_machine_flies(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler on the path: announced, and only an explicit "c" is an error."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    rti = RealTimeIteration(small_problem())
    assert rti.backend.name == "vm"
    assert "no C compiler is found" in rti.announcement
    with pytest.raises(NativeUnavailableError, match="no C compiler"):
        RealTimeIteration(small_problem(), "c")


def test_the_compiler_that_cc_names_comes_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With its options; one that does not exist is told by its name."""
    compiler = tmp_path / "my-cc"
    compiler.write_text("#!/bin/sh\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", f"{compiler} -m64")
    assert find_compiler() == [str(compiler), "-m64"]
    with pytest.raises(NativeUnavailableError, match="does not run"):
        load_library(TINY, folder=tmp_path)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(NativeUnavailableError, match="no-such-compiler"):
        find_compiler()


def test_flags_keep_checks_for_nan_and_other_machines_working() -> None:
    """No -ffast-math, no -march=native."""
    assert not [flag for flag in native_library.FLAGS if "fast-math" in flag or "march" in flag or "mcpu" in flag]


def test_the_generated_functions_need_no_work_memory() -> None:
    """The driver hands in none; each function's code must keep its values on the stack."""
    linearise, pattern = linearisation_function()
    names = [linearise.name(), *(function.name() for function in stage_functions(pattern).all())]
    source = library_source()
    assert driver_source() in source
    assert all(f" {name}(" in source for name in names)
    generated = source[: source.index("#define NX")]
    assert "w[" not in generated
    assert "w+" not in generated
