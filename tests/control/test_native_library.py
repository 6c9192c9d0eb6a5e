"""The compiled solver, and doing without it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.control.programs import small_problem
from uasfly import native
from uasfly.control.iteration import RealTimeIteration
from uasfly.control.native_library import driver_source, library_source
from uasfly.control.qp import SolveStatus
from uasfly.control.riccati import stage_functions
from uasfly.control.transcription import linearisation_function
from uasfly.native import NativeUnavailableError


def test_a_cache_that_cannot_be_made_leaves_the_virtual_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file where the folder should be: the solver works all the same and says why it is slower."""
    (tmp_path / "uasfly").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(native, "find_compiler", lambda: ["cc"])
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
