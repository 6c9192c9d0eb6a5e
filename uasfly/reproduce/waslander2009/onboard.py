"""The paper's sensors aboard a simulated flight, and what is estimated from them, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.control.thrust_map import ThrustMap
from uasfly.frames import rotation_matrix
from uasfly.messages import Array, StateEstimate
from uasfly.reproduce.waslander2009.sensors import IMU_PERIOD_S, PaperSensors, SensorErrors
from uasfly.wind.accelerometer_filter import (
    POSITION,
    VELOCITY,
    AccelerometerFilterNoise,
    AccelerometerWindFilter,
)
from uasfly.wind.accelerometer_model import AccelerometerModel, wind_from_specific_force

AIRBORNE_M = 0.5
POSITIONS_EVERY = 5  # inertial samples: 10 Hz
SMOOTHING_S = 1.0 / 1.5  # of the inverted wind: the fastest gust is 1.5 rad/s
NO_BIAS_M_S2 = 1e-6  # standard deviation of a bias that is held to be none
UNKNOWN_BIAS_M_S2 = 0.2
ACCELERATION_DENSITY = 0.05  # m/s^2/sqrt(Hz), as the shipped airframes have it
_GRAVITY = np.array((0.0, 0.0, GRAVITY_M_S2))


@dataclass(frozen=True, slots=True)
class Winds:
    """Wind (3,) [m/s] in the world at one time, estimated in three ways, and the filter's bias (3,) [m/s^2, body]."""

    inverted: Array  # eq. 30, as the paper does it
    inverted_after_ground: Array  # with what the accelerometer showed on the ground taken off
    filtered: Array
    bias: Array


class Onboard:
    """Sensors, inversion and Kalman filter of one flight.

    Args:
        airframe: thrust by command and voltage. rotor_lag_s: from command to thrust.
        model: eq. 28 as it is known aboard.
        errors: of the sensors.
        rng: source of the errors. quaternion: (4,) attitude at rest.
        wind_density: of the gusts, see `AccelerometerFilterNoise`. treats_bias: whether the filter may find one.
    """

    def __init__(
        self,
        airframe: Airframe,
        rotor_lag_s: float,
        model: AccelerometerModel,
        errors: SensorErrors,
        rng: np.random.Generator,
        quaternion: Array,
        *,
        wind_density: tuple[float, float, float],
        treats_bias: bool = True,
    ) -> None:
        self._airframe, self._model, self._errors = airframe, model, errors
        self._thrust_map = ThrustMap(airframe)
        self._share = 1.0 - math.exp(-IMU_PERIOD_S / rotor_lag_s)
        self.sensors = PaperSensors(errors, rng, quaternion)
        noise = AccelerometerFilterNoise(
            accelerometer_m_s2=errors.accelerometer_m_s2,
            wind_density=wind_density,
            acceleration_density=ACCELERATION_DENSITY,
            tilt_density=errors.gyro_rad_s * math.sqrt(IMU_PERIOD_S),
            initial_bias_m_s2=UNKNOWN_BIAS_M_S2 if treats_bias else NO_BIAS_M_S2,
            initial_tilt_rad=errors.tilt_rad,
            initial_wind_m_s=5.0,
        )
        self.filter = AccelerometerWindFilter(model, noise)
        self.flying = False
        self._samples = 0
        self._thrust = 0.0
        self._ground_sum, self._ground_count = np.zeros(3), 0
        self._smooth_force, self._smooth_thrust = np.zeros(3), 0.0
        self._inverted, self._after_ground = np.zeros(3), np.zeros(3)
        self._force, self._rate, self._time_s = np.zeros(3), np.zeros(3), 0.0

    def sample(
        self, time_s: float, state: Sequence[float], acceleration: Array, command: float, voltage_v: float, armed: bool
    ) -> None:
        """Take one inertial sample (and every fifth time positions) of the true state and acceleration.

        Args:
            time_s: now.
            state: of the plant: position, velocity, quaternion first.
            acceleration: (3,) true [m/s^2, world].
            command: thrust 0..1.
            voltage_v: of the battery.
            armed: motors turn.
        """
        true_position, quaternion = np.array(state[0:3]), np.array(state[6:10])
        sensors, errors, wind = self.sensors, self._errors, self.filter
        self._time_s = time_s
        self._rate = sensors.turn(quaternion)
        self._force = force = sensors.specific_force(acceleration, quaternion)
        body_to_world = rotation_matrix(sensors.quaternion)
        asked = self._thrust_map.k_thrust_m_s2(voltage_v) * command
        self._thrust += self._share * (asked - self._thrust)
        self._samples += 1
        positions_due = self._samples % POSITIONS_EVERY == 0
        if not self.flying:
            if not armed:
                wind.standing(force, body_to_world)
                self._ground_sum += force - body_to_world.T @ _GRAVITY
                self._ground_count += 1
            elif positions_due:
                self._begin(sensors.gps(true_position))
            return
        wind.predict(IMU_PERIOD_S, body_to_world, self._thrust)
        wind.accelerometer(force, body_to_world, self._thrust)
        if positions_due:
            wind.position(sensors.gps(true_position), np.array(errors.gps_m))
            wind.height(sensors.barometer(float(true_position[2])), errors.barometer_m)
        self._invert(force, body_to_world)

    def _begin(self, position: Array) -> None:
        if position[2] > AIRBORNE_M:
            self.filter.take_off(position, self._errors.gps_m[2], 1.0)
            self._smooth_force, self._smooth_thrust = self._force.copy(), self._thrust
            self.flying = True

    def _invert(self, force: Array, body_to_world: Array) -> None:
        """Eq. 30 on smoothed readings: single ones have more noise than wind."""
        share = 1.0 - math.exp(-IMU_PERIOD_S / SMOOTHING_S)
        self._smooth_force = self._smooth_force + share * (force - self._smooth_force)
        self._smooth_thrust += share * (self._thrust - self._smooth_thrust)
        velocity = self.filter.state[VELOCITY]
        ground = self._ground_sum / max(1, self._ground_count)
        thrust = self._smooth_thrust
        self._inverted = wind_from_specific_force(
            self._model, self._smooth_force, thrust, body_to_world, velocity, self._inverted
        )
        self._after_ground = wind_from_specific_force(
            self._model, self._smooth_force - ground, thrust, body_to_world, velocity, self._after_ground
        )

    def winds(self) -> Winds:
        """The estimates now."""
        return Winds(
            self._inverted.copy(), self._after_ground.copy(), self.filter.wind_in_world, self.filter.bias_in_body
        )

    def measured_acceleration(self) -> Array:
        """Acceleration (3,) [m/s^2, world] by the accelerometer, through the filter: a sample has 1 m/s^2 of noise."""
        return self.filter.acceleration(rotation_matrix(self.sensors.quaternion), self._thrust)[0]

    def force(self) -> Array:
        """What the wind does (3,) [m/s^2, world] by eq. 28 at the filter's wind: drag, flapping, change of thrust.

        As uasfly's force it is without the still-air drag of the vehicle's own motion: the controllers reckon with that
        themselves.
        """
        wind = self.filter
        body_to_world = wind.rotation(rotation_matrix(self.sensors.quaternion))
        velocity = wind.state[VELOCITY]
        air_in_body = body_to_world.T @ (wind.wind_in_world - velocity)
        specific = self._model.specific_force(air_in_body, self._thrust)
        specific[2] -= self._thrust
        return np.asarray(body_to_world @ specific + np.array(self._airframe.model.drag_1_s) * velocity)

    def with_motion(self, observed: StateEstimate) -> StateEstimate:
        """The observer's estimate with position, velocity and attitude by the paper's sensors in their places."""
        wind = self.filter
        sigmas = np.sqrt(np.diag(wind.covariance))
        return replace(
            observed,
            time_s=self._time_s,
            position_in_world=wind.state[POSITION].copy(),
            velocity_in_world=wind.state[VELOCITY].copy(),
            quaternion_body_to_world=self.sensors.quaternion,
            angular_rate_in_body=self._rate,
            position_sigma_m=sigmas[POSITION],
            velocity_sigma_m_s=sigmas[VELOCITY],
        )
