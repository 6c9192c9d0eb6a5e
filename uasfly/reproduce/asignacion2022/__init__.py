"""Asignacion, Suzuki, Noda, Nakata & Liu 2022: Frequency-Based Wind Gust Estimation for Quadrotors, RA-L 7(4).

A quadrotor flies an upward spiral through gusts; two designs of the disturbance observer watch it, DP1 with a cut-off
frequency of 1 Hz, DP2 with 10 Hz. Then the observer is compared with two others, and shown noise as in the experiment.
"""

from __future__ import annotations

from uasfly.reproduce.asignacion2022.results import reproduce

__all__ = ["reproduce"]
