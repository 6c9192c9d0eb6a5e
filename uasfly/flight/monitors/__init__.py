"""Monitors: what is watched in flight, and what is to be done about it. They find; the step acts."""

from uasfly.flight.monitors.monitors import Monitors
from uasfly.flight.monitors.watched import Watched

__all__ = ["Monitors", "Watched"]
