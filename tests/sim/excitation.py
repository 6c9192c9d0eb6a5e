"""Flies a plant through doublets, as a vehicle is identified, and fits eq. 2 and 1, independently of the simulation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.signal import butter, lfilter, sosfiltfilt

from uasfly.frames import euler_from_quaternion, quaternion_from_euler, rotation_matrix
from uasfly.messages import Array, FlightMode
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario, Sensors
from uasfly.sim.vehicle import SimulatedVehicle

GRAVITY = 9.80665
PERIOD_S = 0.02  # between setpoints
STILL = Scenario(name="still", sensors=Sensors(position="mocap", position_noise_m=0.01))


@dataclass(frozen=True)
class Flight:
    """What a flight gave, one row a setpoint.

    Attributes:
        commands: (n, 3) roll [rad], pitch [rad], thrust 0..1, held until the next row.
        angles: (n, 2) true roll and pitch [rad].
        velocity: (n, 3) [m/s]. thrust_axis: (n, 3) body z in the world.
    """

    commands: Array
    angles: Array
    velocity: Array
    thrust_axis: Array


def take_off(vehicle: SimulatedVehicle, height_m: float, settle_s: float = 8.0) -> None:
    """Arm, take off and wait until the vehicle holds its height."""
    vehicle.advance_to(3.5)
    assert vehicle.arm()[0]
    vehicle.set_takeoff_height(height_m)
    assert vehicle.set_mode(FlightMode.TAKEOFF)[0]
    while vehicle.state().mode is not FlightMode.HOLD:
        vehicle.advance_to(vehicle.time_s + 0.2)
        assert vehicle.time_s < 60.0
    vehicle.advance_to(vehicle.time_s + settle_s)


def fly_doublets(plant: Plant, hover_thrust: float, seed: int, doublets: int = 12) -> Flight:
    """Doublets in roll, pitch and thrust in turn, in still air; between them a plain PD brings the vehicle back."""
    vehicle = SimulatedVehicle(plant, STILL, seed)
    take_off(vehicle, 12.0)
    rng = np.random.default_rng(seed)
    home = vehicle.truth().position_in_world
    vehicle.set_attitude_target(quaternion_from_euler(0.0, 0.0, 0.0), hover_thrust, 0.0)
    assert vehicle.set_mode(FlightMode.OFFBOARD)[0]
    commands, angles, velocities, axes = [], [], [], []
    for index in range(doublets):
        amplitude = rng.choice((-1.0, 1.0)) * (math.radians(rng.uniform(7.0, 13.0)) if index % 3 < 2 else 0.08)
        length = round(rng.uniform(0.5, 1.3) / 0.02)
        pattern = [amplitude] * length + [-amplitude] * length + [0.0] * round(1.2 / 0.02) + [None] * round(3.0 / 0.02)
        for value in pattern:
            truth = vehicle.truth()
            error, velocity = truth.position_in_world - home, truth.velocity_in_world
            back = np.clip(-0.08 * error - 0.12 * velocity, -0.15, 0.15) if value is None else np.zeros(3)
            command = [-back[1], back[0], hover_thrust * (1.0 - 0.06 * error[2] - 0.08 * velocity[2])]
            if value is not None:
                command[index % 3] += value
            vehicle.set_attitude_target(quaternion_from_euler(command[0], command[1], 0.0), command[2], 0.0)
            commands.append(command)
            angles.append(euler_from_quaternion(truth.quaternion_body_to_world)[:2])
            velocities.append(velocity)
            axes.append(rotation_matrix(truth.quaternion_body_to_world)[:, 2])
            vehicle.advance_to(vehicle.time_s + PERIOD_S)
    return Flight(np.array(commands), np.array(angles), np.array(velocities), np.array(axes))


def fit_attitude(command: Array, angle: Array) -> tuple[float, float, float]:
    """Least squares for tau [s], gain and dead time [s] of angle' = (gain * command(t - dead time) - angle) / tau."""

    def response(tau: float, dead: float) -> Array:
        # Exact for held commands: within a period the older one acts for the part of the dead time that is left over.
        whole = math.floor(dead / PERIOD_S)
        part = dead - whole * PERIOD_S
        late = np.concatenate((np.full(whole + 1, command[0]), command))
        newer, older = late[1 : 1 + len(command)], late[: len(command)]
        fresh = 1.0 - math.exp(-(PERIOD_S - part) / tau)
        decay = math.exp(-PERIOD_S / tau)
        push = fresh * newer + (1.0 - fresh - decay) * older
        return np.asarray(lfilter([0.0, 1.0], [1.0, -decay], push))

    def cost(guess: Array) -> float:
        unit = response(abs(guess[0]) + 1e-3, abs(guess[1]))
        gain = unit @ angle / (unit @ unit)
        return 1e4 * float(np.mean((gain * unit - angle) ** 2))

    best = minimize(cost, (0.15, 0.03), method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-8}).x
    tau, dead = abs(best[0]) + 1e-3, abs(best[1])
    unit = response(tau, dead)
    return tau, float(unit @ angle / (unit @ unit)), dead


def fit_translation(flight: Flight) -> tuple[float, float]:
    """Least squares for k_thrust [m/s^2] and horizontal drag [1/s] of v' = -drag v + k u z_body - g, all smoothed."""
    smooth = butter(2, 1.0, fs=1.0 / PERIOD_S, output="sos")

    def low_pass(values: Array) -> Array:
        return np.asarray(sosfiltfilt(smooth, values, axis=0))

    acceleration = low_pass(np.gradient(flight.velocity, PERIOD_S, axis=0)) + np.array((0.0, 0.0, GRAVITY))
    push = low_pass(flight.commands[:, 2:] * flight.thrust_axis)
    drag = -low_pass(flight.velocity)
    drag[:, 2] = 0.0
    rows = np.column_stack((push.ravel(), drag.ravel()))
    (k_thrust, damping), *_ = np.linalg.lstsq(rows, acceleration.ravel(), rcond=None)
    return float(k_thrust), float(damping)
