"""Compiling once, keeping safely, doing without."""

from __future__ import annotations

import ctypes
import multiprocessing
import shutil
from pathlib import Path

import casadi as ca
import pytest

from uasfly import native
from uasfly.native import (
    NativeUnavailableError,
    cache_folder,
    compile_functions,
    compiled,
    find_compiler,
)

TINY = "int answer(void) { return 42; }\n"

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler (cc, gcc, clang)"
)


def _load(source: str, folder: Path) -> ctypes.PyDLL:
    return native.load_library(source, "tiny", lambda path: ctypes.PyDLL(str(path)), folder=folder)


def _answer(library: ctypes.PyDLL) -> int:
    return int(library.answer())


def _load_in_a_process(folder: str) -> int:
    return _answer(_load(TINY, Path(folder)))


@needs_compiler
def test_a_library_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second load takes the file of the first; nothing but that file is left in the folder."""
    assert _answer(_load(TINY, tmp_path)) == 42
    (kept,) = tmp_path.iterdir()
    monkeypatch.setattr(native, "_compile", lambda *_: pytest.fail("compiled again"))
    assert _answer(_load(TINY, tmp_path)) == 42
    assert [kept] == list(tmp_path.iterdir())
    assert kept.stat().st_mode & 0o077 == 0


@needs_compiler
def test_source_and_flags_make_another_library(tmp_path: Path) -> None:
    """What is in a library decides its name: another source or other flags never meet an old file."""
    _load(TINY, tmp_path)
    _load(TINY + "\n", tmp_path)
    native.load_library(TINY, "tiny", lambda path: ctypes.PyDLL(str(path)), (*native.FLAGS, "-g"), folder=tmp_path)
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
    _load(TINY, tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.unlink()  # a new file: this process has the old one loaded
    kept.write_bytes(b"not a library")
    kept.chmod(0o700)
    assert _answer(_load(TINY, tmp_path)) == 42


@needs_compiler
def test_a_file_that_others_may_write_is_not_loaded(tmp_path: Path) -> None:
    """Someone else could have put code there."""
    _load(TINY, tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.chmod(0o722)
    with pytest.raises(NativeUnavailableError, match="others may write"):
        _load(TINY, tmp_path)


@needs_compiler
def test_a_compile_error_is_told_in_one_line(tmp_path: Path) -> None:
    """The compiler's first line is the reason; nothing is left behind."""
    with pytest.raises(NativeUnavailableError, match=r"failed: .*error") as caught:
        _load("int answer(void) { return nonsense; }\n", tmp_path)
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


def test_the_compiler_that_cc_names_comes_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With its options; one that does not exist is told by its name."""
    compiler = tmp_path / "my-cc"
    compiler.write_text("#!/bin/sh\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", f"{compiler} -m64")
    assert find_compiler() == [str(compiler), "-m64"]
    with pytest.raises(NativeUnavailableError, match="does not run"):
        _load(TINY, tmp_path)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(NativeUnavailableError, match="no-such-compiler"):
        find_compiler()


def test_flags_keep_checks_for_nan_and_other_machines_working() -> None:
    """No -ffast-math, no -march=native."""
    assert not [flag for flag in native.FLAGS if "fast-math" in flag or "march" in flag or "mcpu" in flag]


def _square() -> ca.Function:
    x = ca.SX.sym("x", 2)
    return ca.Function("square", [x], [x * x, ca.sum1(x)])


@needs_compiler
def test_compiled_functions_compute_what_they_are_compiled_from(tmp_path: Path) -> None:
    """A CasADi function goes in and one of the same name, arguments and values comes out, now and from the cache."""
    for _ in range(2):
        (square,) = compile_functions([_square()], "square", folder=tmp_path)
        assert square.class_name() == "External"
        results = square([3.0, 4.0])
        assert [float(value) for value in (results[0][0], results[0][1], results[1])] == [9.0, 16.0, 7.0]
    assert len(list(tmp_path.iterdir())) == 1


@needs_compiler
def test_damaged_compiled_functions_are_made_anew(tmp_path: Path) -> None:
    """The same holds for libraries that CasADi opens."""
    compile_functions([_square()], "square", folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.unlink()
    kept.write_bytes(b"not a library")
    kept.chmod(0o700)
    (square,) = compile_functions([_square()], "square", folder=tmp_path)
    assert float(square([1.0, 2.0])[1]) == 3.0


def test_functions_stay_as_they_are_without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """The virtual machine takes them."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    square = _square()
    assert compiled([square], "square") == [square]
    with pytest.raises(NativeUnavailableError, match="no C compiler"):
        compile_functions([square], "square")
