"""The error-state Kalman filter and its measurements."""

from uasfly.observer.counters import Counters
from uasfly.observer.observer import Observer

__all__ = ["Counters", "Observer"]
