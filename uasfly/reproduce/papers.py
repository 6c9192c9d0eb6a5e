"""Which papers can be reproduced. Each is a module (or package) of this room with

def reproduce(seed: int, progress: Progress) -> Reproduction
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping

from uasfly.errors import UasflyError, shortened
from uasfly.reproduce.rows import Progress, Reproduction

PAPERS: Mapping[str, str] = {
    "asignacion2022": "Asignacion et al., Frequency-Based Wind Gust Estimation for Quadrotors, RA-L 7(4)",
    "kalaitzakis2023": "Kalaitzakis & Vitzilaios, UAS Control under GNSS Degraded and Windy Conditions, Robotics 12(5)",
    "waslander2009": "Waslander & Wang, Wind Disturbance Estimation and Rejection for Quadrotor Position Control, AIAA",
}


def check_paper(name: str) -> None:
    """An error that lists the papers, where there is none of this name."""
    if name not in PAPERS:
        raise UasflyError(f"paper: expected one of {', '.join(PAPERS)}, found {shortened(name)!r}")


def reproduce(name: str, seed: int, progress: Progress) -> Reproduction:
    """Fly a paper's experiments.

    Args:
        name: one of `PAPERS`.
        seed: of everything that is random.
        progress: told what is being flown.
    """
    check_paper(name)
    module = importlib.import_module(f"uasfly.reproduce.{name}")
    result: Reproduction = module.reproduce(seed, progress)
    return result
