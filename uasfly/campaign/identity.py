"""What a flight depends on beside its plan: the code. And the id that tells one flight from every other."""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path

from pydantic import BaseModel

from uasfly import __version__

# Neither what is shown nor how flights are handed out changes how one goes.
_BESIDE_THE_FLIGHT = {"cli", "campaign"}
ID_DIGITS = 20


@functools.cache
def code_digest() -> str:
    """Digest of the code that decides how a flight goes; two machines with the same one fly the same.

    The version alone would not do: while uasfly is being worked on it stays the same.
    """
    folder = Path(__file__).parent.parent
    digest = hashlib.sha256(__version__.encode())
    for path in sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".c")):
        name = path.relative_to(folder)
        if name.parts[0] not in _BESIDE_THE_FLIGHT:
            digest.update(f"\0{name.as_posix()}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:ID_DIGITS]


def model_digest(model: BaseModel) -> str:
    """Digest of all values of a file, however it is written."""
    text = json.dumps(model.model_dump(mode="json"), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def flight_id(digests: list[str], controller: str, seed: int) -> str:
    """Id of a flight: equal for two flights only where everything that decides them is.

    Args:
        digests: of airframe, mission, scenario and plant.
        controller: its name.
        seed: of everything random.
    """
    text = json.dumps([code_digest(), *digests, controller, seed])
    return hashlib.sha256(text.encode()).hexdigest()[:ID_DIGITS]


def facts() -> dict[str, str]:
    """What must be the same on all machines of a campaign, so that its rows are."""
    from importlib.metadata import version

    from uasfly.control.native_library import load_solver
    from uasfly.native import NativeUnavailableError

    try:
        load_solver()  # compiled here and now, where it is not yet, and not by all workers at once
        solver = "compiled"
    except NativeUnavailableError:
        solver = "virtual machine"
    return {
        "uasfly": __version__,
        "code": code_digest(),
        "solver": solver,
        **{name: version(name) for name in ("numpy", "scipy", "casadi")},
    }
