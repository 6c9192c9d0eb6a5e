from __future__ import annotations

import pytest

from tests.sim.plants import hover_speed, plant
from uasfly.sim.battery import Battery


def test_full_speed_at_reference_voltage_is_the_files() -> None:
    """At the reference voltage the motors' law gives the full speed of the file."""
    for name in ("f550", "aurelia_x6", "iris"):
        figures = plant(name)
        battery = Battery(figures)
        battery.voltage_v = figures.battery.reference_voltage_v
        assert battery.full_speed_rad_s() == pytest.approx(figures.rotors.full_speed_rad_s)


def test_load_lowers_the_voltage_and_the_full_speed() -> None:
    """Hover current through the internal resistance costs voltage, and with it full thrust, by a power of 1.6 to 2."""
    figures = plant("f550")
    battery = Battery(figures)
    fresh, fresh_voltage = battery.full_speed_rad_s(), battery.voltage_v
    assert fresh_voltage == 16.8
    battery.draw([hover_speed(figures)] * 6, 0.04)
    battery.draw([hover_speed(figures)] * 6, 0.04)
    assert 8.0 < battery.current_a < 30.0
    assert battery.voltage_v == pytest.approx(16.8 - 0.025 * battery.current_a, abs=0.01)
    battery.charge = 0.2
    battery.draw([hover_speed(figures)] * 6, 0.04)
    thrust = (battery.full_speed_rad_s() / fresh) ** 2
    voltage = battery.voltage_v / fresh_voltage
    assert voltage**2.0 < thrust < voltage**1.6


def test_charge_is_counted() -> None:
    """An hour at one ampere takes an ampere hour."""
    figures = plant("f550", {"battery.avionics_current_a": 1.0, "battery.resistance_ohm": 0.0})
    battery = Battery(figures)
    for _ in range(3600):
        battery.draw([0.0] * 6, 1.0)
    assert battery.charge == pytest.approx(1.0 - 1.0 / 4.0)
    assert battery.current_a == pytest.approx(1.0)


def test_a_hexacopter_hovers_for_a_quarter_of_an_hour() -> None:
    """Hover drains the f550's battery in 10 to 25 minutes, and the voltage falls all the way."""
    figures = plant("f550")
    battery = Battery(figures)
    minutes, voltages = 0, []
    while battery.charge > 0.0 and minutes < 60:
        for _ in range(60):
            battery.draw([hover_speed(figures)] * 6, 1.0)
        minutes += 1
        voltages.append(battery.voltage_v)
    assert 10 <= minutes <= 25
    assert voltages == sorted(voltages, reverse=True)
    assert battery.charge == 0.0


def test_the_sih_battery_drains_as_recorded_and_leaves_the_thrust_alone() -> None:
    """PX4's simulator went from 16.20 V to 16.04 V in 94 s of hover; its thrust does not depend on it."""
    figures = plant("px4_sih")
    battery = Battery(figures)
    for _ in range(94 * 25):
        battery.draw([hover_speed(figures)] * 4, 0.04)
    assert battery.voltage_v == pytest.approx(16.04, abs=0.03)
    assert battery.full_speed_rad_s() == figures.rotors.full_speed_rad_s
