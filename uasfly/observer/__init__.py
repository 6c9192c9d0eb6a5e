"""The error-state Kalman filter and its measurements."""

from uasfly.observer.observer import Counters, Observer

__all__ = ["Counters", "Observer"]
