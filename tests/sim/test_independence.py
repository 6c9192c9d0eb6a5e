from __future__ import annotations

import subprocess
import sys


def test_the_plant_knows_nothing_of_the_controllers_model() -> None:
    """Importing the simulated vehicle loads neither model, observer nor control: results are no flattery."""
    script = "import sys, uasfly.sim.vehicle; print(*(name for name in sys.modules if name.startswith('uasfly.')))"
    output = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=60)
    loaded = output.stdout.split()
    assert "uasfly.sim.vehicle" in loaded
    forbidden = ("uasfly.model", "uasfly.observer", "uasfly.control", "uasfly.identify", "uasfly.flight")
    assert not [name for name in loaded if name.startswith(forbidden)]
