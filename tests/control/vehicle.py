"""An independent point-mass vehicle for closed loops: its own equations, dead time, wind force and yaw loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from uasfly.airframe import (
    Airframe,
    Backup,
    Battery,
    ControllerSettings,
    FirstOrder,
    Limits,
    ModelParameters,
    ObserverNoise,
    Pid,
    Weights,
)
from uasfly.control.protocol import Controller, ControlResult, ReferenceAt
from uasfly.frames import quaternion_from_euler, wrap_angle
from uasfly.messages import Array, ReferenceHorizon, Setpoint, StateEstimate

GRAVITY = 9.80665
TICK_S = 0.005


def f550(*, delay_s: float = 0.03, nodes: int = 25, weights: Weights | None = None, rate_hz: float = 50.0) -> Airframe:
    """The f550 of REFERENCE.md with limits sized for wind."""
    horizontal = Pid(kp=4.0, ki=1.5, kd=3.0, integral_limit=3.0)
    vertical = Pid(kp=6.0, ki=2.0, kd=4.0, integral_limit=3.0)
    return Airframe(
        name="f550",
        mass_kg=1.8,
        rotors=6,
        plant="f550",
        model=ModelParameters(
            k_thrust_m_s2=28.54209,
            drag_1_s=(0.26057, 0.26057, 0.0),
            roll=FirstOrder(tau_s=0.14115, gain=0.99386),
            pitch=FirstOrder(tau_s=0.14199, gain=1.00199),
            command_delay_s=delay_s,
        ),
        limits=Limits(
            wind_m_s=12.0,
            tilt_deg=30.0,
            thrust_min=0.15,
            thrust_max=0.75,
            speed_m_s=5.0,
            climb_m_s=2.0,
            descent_m_s=1.5,
            acceleration_m_s2=3.0,
            yaw_rate_deg_s=60.0,
        ),
        controller=ControllerSettings(
            rate_hz=rate_hz,
            horizon_s=3.0,
            nodes=nodes,
            first_interval_s=0.02,
            weights=weights
            or Weights(
                position=(25, 25, 17), velocity=(11, 11, 11), tilt=(1, 1), roll=135, pitch=135, thrust=750, terminal=10
            ),
        ),
        yaw_pid=Pid(kp=1.5, ki=0.0, kd=0.1, integral_limit=0.2),
        backup=Backup(horizontal=horizontal, vertical=vertical),
        observer=ObserverNoise(
            acceleration_density=0.1,
            attitude_density=0.01,
            force_density=0.5,
            gnss_bias_density=0.05,
            position_sigma_m=0.01,
            attitude_sigma_rad=0.01,
            velocity_sigma_m_s=0.05,
            matching_window_s=2.0,
        ),
        battery=Battery(reference_voltage_v=14.8, thrust_exponent=2.0),
    )


@dataclass
class PointMass:
    """Eq. 1 and 2 in plain numbers; setpoints act `delay_s` after they were sent, yaw as PX4 closes it."""

    airframe: Airframe
    delay_s: float
    position: Array = field(default_factory=lambda: np.zeros(3))
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    yaw_rate: float = 0.0
    time_s: float = 0.0
    k_thrust: float = 0.0
    waiting: list[tuple[float, Setpoint]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.k_thrust = self.k_thrust or self.airframe.model.k_thrust_m_s2
        hover = self.airframe.model.hover_thrust
        self.acting = Setpoint(0.0, self.roll, self.pitch, self.yaw, 0.0, hover)

    def send(self, setpoint: Setpoint) -> None:
        """Take a setpoint that will act later."""
        self.waiting.append((self.time_s + self.delay_s, setpoint))

    def tick(self, force: Array) -> None:
        """One small step under a force [m/s^2]."""
        while self.waiting and self.waiting[0][0] <= self.time_s + 1e-9:
            self.acting = self.waiting.pop(0)[1]
        model, command = self.airframe.model, self.acting
        before = self._acceleration(force, self.velocity)
        share_roll, share_pitch = (1.0 - math.exp(-TICK_S / axis.tau_s) for axis in (model.roll, model.pitch))
        self.roll += share_roll * (model.roll.gain * command.roll_rad - self.roll)
        self.pitch += share_pitch * (model.pitch.gain * command.pitch_rad - self.pitch)
        self.yaw_rate = 2.8 * wrap_angle(command.yaw_rad - self.yaw) + command.yaw_rate_rad_s
        self.yaw = wrap_angle(self.yaw + TICK_S * self.yaw_rate)
        after = self._acceleration(force, self.velocity + TICK_S * before)
        change = 0.5 * TICK_S * (before + after)
        self.position = self.position + TICK_S * (self.velocity + 0.5 * change)
        self.velocity = self.velocity + change
        self.time_s += TICK_S

    def _acceleration(self, force: Array, velocity: Array) -> Array:
        thrust = self.k_thrust * self.acting.thrust
        tilted = (math.sin(self.pitch) * math.cos(self.roll), -math.sin(self.roll))
        cos_yaw, sin_yaw = math.cos(self.yaw), math.sin(self.yaw)
        direction = (
            cos_yaw * tilted[0] - sin_yaw * tilted[1],
            sin_yaw * tilted[0] + cos_yaw * tilted[1],
            math.cos(self.pitch) * math.cos(self.roll),
        )
        drag = np.array(self.airframe.model.drag_1_s) * velocity
        return np.asarray(thrust * np.array(direction) - drag - np.array((0.0, 0.0, GRAVITY)) + force)

    def estimate(self, force: Array) -> StateEstimate:
        """The truth as an estimate, with a force estimate."""
        ones = np.ones(3)
        rates = (0.0, math.sin(self.roll) * self.yaw_rate, math.cos(self.roll) * math.cos(self.pitch) * self.yaw_rate)
        return StateEstimate(
            time_s=self.time_s,
            position_in_world=self.position,
            velocity_in_world=self.velocity,
            quaternion_body_to_world=quaternion_from_euler(self.roll, self.pitch, self.yaw),
            angular_rate_in_body=np.array(rates),
            force_in_world=force,
            gnss_bias_in_world=np.zeros(3),
            position_sigma_m=ones,
            velocity_sigma_m_s=ones,
            force_sigma_m_s2=ones,
        )


def hold_at(position: tuple[float, float, float], yaw_rad: float = 0.0) -> ReferenceAt:
    """Reference that stands still."""

    def reference(times: Array) -> ReferenceHorizon:
        count = times.size
        zero = np.zeros((count, 3))
        return ReferenceHorizon(
            times, np.tile(np.array(position), (count, 1)), zero, zero, np.full(count, yaw_rad), np.zeros(count)
        )

    return reference


def circle(radius_m: float = 1.0, period_s: float = 8.0, *, facing_centre: bool = True) -> ReferenceAt:
    """Reference on a circle at 1 m height, facing its centre."""
    omega = 2.0 * math.pi / period_s

    def reference(times: Array) -> ReferenceHorizon:
        cos, sin, zero = np.cos(omega * times), np.sin(omega * times), np.zeros_like(times)
        position = np.stack((radius_m * cos, radius_m * sin, zero + 1.0), axis=1)
        velocity = radius_m * omega * np.stack((-sin, cos, zero), axis=1)
        acceleration = -radius_m * omega**2 * np.stack((cos, sin, zero), axis=1)
        yaw = omega * times + math.pi if facing_centre else zero
        rate = np.full_like(times, omega) if facing_centre else zero
        return ReferenceHorizon(times, position, velocity, acceleration, yaw, rate)

    return reference


@dataclass
class Flight:
    """What a closed loop recorded, one row a control cycle."""

    time_s: Array
    position: Array
    reference: Array
    yaw: Array
    results: list[ControlResult]

    @property
    def error(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.asarray(np.linalg.norm(self.position - self.reference, axis=1))

    def rms(self, from_s: float = 0.0) -> float:
        """Root mean square error [m] from a time on."""
        return float(np.sqrt(np.mean(self.error[self.time_s >= from_s] ** 2)))

    @property
    def commands(self) -> Array:
        """Thrust, roll and pitch setpoints (n, 3)."""
        points = [result.setpoint for result in self.results]
        return np.array([(point.thrust, point.roll_rad, point.pitch_rad) for point in points])


def fly(
    vehicle: PointMass,
    controller: Controller,
    reference_at: ReferenceAt,
    duration_s: float,
    *,
    force: Callable[[float], Array] = lambda _: np.zeros(3),
    force_lag_s: float = 0.25,
    force_error: tuple[float, float, float] = (0.0, 0.0, 0.0),
    disturb: Callable[[float, StateEstimate], StateEstimate] = lambda _, estimate: estimate,
    voltage_v: float | None = None,
    force_known: bool = True,
) -> Flight:
    """Close the loop; the force estimate follows the true force with a lag and a constant error."""
    period = 1.0 / vehicle.airframe.controller.rate_hz
    ticks = round(period / TICK_S)
    estimated = force(0.0).copy() if force_known else np.zeros(3)
    controller.reset(vehicle.time_s, vehicle.acting)
    times, positions, references, yaws, results = [], [], [], [], []
    for cycle in range(round(duration_s / period)):
        now = cycle * period
        vehicle.time_s = now
        estimate = disturb(now, vehicle.estimate(estimated + np.array(force_error)))
        result = controller.step(now, estimate, reference_at, voltage_v)
        vehicle.send(result.setpoint)
        times.append(now)
        positions.append(vehicle.position)
        references.append(reference_at(np.array((now,))).position_in_world[0])
        yaws.append(vehicle.yaw)
        results.append(result)
        for _ in range(ticks):
            acting_force = force(vehicle.time_s)
            estimated = estimated + (1.0 - math.exp(-TICK_S / force_lag_s)) * (acting_force - estimated)
            vehicle.tick(acting_force)
    return Flight(np.array(times), np.array(positions), np.array(references), np.array(yaws), results)
