"""Battery and motors' power: open-circuit voltage by charge, internal resistance, sag, and what it does to full speed.

A motor is a direct-current motor with speed constant K [rad/s/V] and resistance R: at full command its speed w solves
V = w / K + R K Q(w); its current is K Q(w), with Q the rotor's drag torque. Polarisation (slow sag) is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from uasfly.sim.plant import Plant


class Battery:
    """A battery under load.

    Attributes:
        charge: 0..1. voltage_v: at the terminals. current_a: drawn.
    """

    def __init__(self, plant: Plant) -> None:
        self._pack = plant.battery
        self._rotors = plant.rotors
        self.charge = plant.battery.initial_charge
        self.voltage_v = self.open_circuit_voltage_v()
        self.current_a = 0.0
        speed_constant = plant.motor_speed_constant
        assert speed_constant is not None  # checked on load
        self._speed_constant = speed_constant

    def open_circuit_voltage_v(self) -> float:
        """Voltage without load at the present charge [V]."""
        curve = self._pack.open_circuit
        for (low, low_v), (high, high_v) in pairwise(curve):
            if self.charge <= high:
                return low_v + (high_v - low_v) * max(0.0, self.charge - low) / (high - low)
        return curve[-1][1]

    def draw(self, speeds_rad_s: Sequence[float], duration_s: float) -> None:
        """Run the rotors at these speeds [rad/s] for a while [s]."""
        power = sum(self._motor_power_w(speed) for speed in speeds_rad_s)
        # The last voltage stands for the present one: it changes far more slowly than this is called.
        self.current_a = power / max(self.voltage_v, 1.0) + self._pack.avionics_current_a
        self.charge = max(0.0, self.charge - self.current_a * duration_s / (3600.0 * self._pack.capacity_ah))
        self.voltage_v = max(0.0, self.open_circuit_voltage_v() - self._pack.resistance_ohm * self.current_a)

    def full_speed_rad_s(self) -> float:
        """Rotor speed at full command and the present voltage [rad/s]."""
        rotors = self._rotors
        if not self._pack.lowers_thrust:
            return rotors.full_speed_rad_s
        resistive = rotors.motor_resistance_ohm * self._speed_constant * self._torque_coefficient()
        back = 1.0 / self._speed_constant
        if rotors.speed_exponent == 1 or resistive * self.voltage_v < 1e-12 * back * back:
            return self.voltage_v / (back + resistive)  # the difference below would cancel to zero
        return (math.sqrt(back * back + 4.0 * resistive * self.voltage_v) - back) / (2.0 * resistive)

    def _torque_coefficient(self) -> float:
        return self._rotors.torque_per_thrust_m * self._rotors.thrust_coefficient

    def _motor_power_w(self, speed: float) -> float:
        torque = self._torque_coefficient() * speed**self._rotors.speed_exponent
        current = self._speed_constant * torque
        return torque * speed + self._rotors.motor_resistance_ohm * current * current
