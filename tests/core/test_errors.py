"""Errors between processes."""

from __future__ import annotations

import pickle

import pytest

from uasfly.errors import MOST_PROBLEMS, FileError


@pytest.mark.parametrize("count", [1, MOST_PROBLEMS, MOST_PROBLEMS + 5])
def test_a_file_error_comes_back_from_another_process_as_it_was(count: int) -> None:
    """Path, problems and text are the same, however many problems there are."""
    error = FileError("mission.yaml", [f"line {k}: expected a number" for k in range(count)])
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, FileError)
    assert (again.path, again.problems, str(again)) == (error.path, error.problems, str(error))
