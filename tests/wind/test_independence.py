"""The room of the wind stands on little."""

from __future__ import annotations

import subprocess
import sys

MESSAGES = {"uasfly.message_class", "uasfly.messages", "uasfly.sensor_messages", "uasfly.wind_messages"}
BELOW = {"uasfly", "uasfly.airframe", "uasfly.errors", "uasfly.frames", *MESSAGES}


def test_the_wind_imports_airframe_frames_and_messages_alone() -> None:
    """No observer of uasfly's own, no model, no plant: each of them may use the wind, not the other way round."""
    script = (
        "import importlib, pkgutil, sys, uasfly.wind as room\n"
        "[importlib.import_module(f'uasfly.wind.{module.name}') for module in pkgutil.iter_modules(room.__path__)]\n"
        "print(*(name for name in sys.modules if name.split('.')[0] == 'uasfly'))"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    names = {name for name in result.stdout.split() if not name.startswith("uasfly.wind")}
    assert names <= BELOW
