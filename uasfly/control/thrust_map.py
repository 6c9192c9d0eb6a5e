"""Thrust against battery voltage: an emptying battery turns the same command into less thrust."""

from __future__ import annotations

import math

from uasfly.airframe import Airframe

FILTER_TIME_S = 1.0  # the voltage sags and recovers with every change of thrust; the map must not chase that
SMALLEST_SCALE, LARGEST_SCALE = 0.6, 1.3  # beyond these the voltage, or the reference voltage in the file, is wrong


class ThrustMap:
    """k_thrust [m/s^2 at full command] = k_thrust of the file * (voltage / reference voltage) ** exponent * (1 + trim).

    The voltage is low-passed over a second and the scale bounded; a voltage that is missing, zero or not finite leaves
    everything as it was.

    Attributes:
        trim: what file and voltage do not know of, see `thrust_trim`.
    """

    def __init__(self, airframe: Airframe) -> None:
        self._nominal = airframe.model.k_thrust_m_s2
        self._battery = airframe.battery
        self.trim = 0.0
        self._voltage_v: float | None = None
        self._time_s: float | None = None

    def update(self, time_s: float, voltage_v: float | None) -> float:
        """Take a voltage at a time [s] and return the present k_thrust [m/s^2]."""
        if voltage_v is not None and math.isfinite(voltage_v) and voltage_v > 0.0:
            if self._voltage_v is None or self._time_s is None:
                self._voltage_v = voltage_v
            else:
                elapsed = max(0.0, time_s - self._time_s)
                self._voltage_v += (1.0 - math.exp(-elapsed / FILTER_TIME_S)) * (voltage_v - self._voltage_v)
            self._time_s = time_s
        return self.k_thrust_m_s2()

    def k_thrust_m_s2(self, voltage_v: float | None = None) -> float:
        """k_thrust [m/s^2] at the filtered voltage; before the first `update`, at `voltage_v`, or the file's."""
        voltage = self._voltage_v if self._voltage_v is not None else voltage_v
        if voltage is None or not (math.isfinite(voltage) and voltage > 0.0):
            return self._nominal * (1.0 + self.trim)
        scale: float = (voltage / self._battery.reference_voltage_v) ** self._battery.thrust_exponent
        return self._nominal * min(max(scale, SMALLEST_SCALE), LARGEST_SCALE) * (1.0 + self.trim)
