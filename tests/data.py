"""Where tests find third-party data that the project must not contain."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def test_data(relative_path: str) -> Path:
    """Path of a file under UASFLY_TEST_DATA (it holds px4_recordings/ and data/); skips where it is not there."""
    root = os.environ.get("UASFLY_TEST_DATA")
    if not root:
        pytest.skip("UASFLY_TEST_DATA is not set: it names the folder that holds px4_recordings/ and data/")
    path = Path(root) / relative_path
    if not path.exists():
        pytest.skip(f"{relative_path} is not in the folder that UASFLY_TEST_DATA names")
    return path


test_data.__test__ = False  # type: ignore[attr-defined]
