"""Raw sensors of the simulated vehicle: inertial unit, magnetometer, barometer, GNSS receiver, speeds of the rotors.

World ENU, body FLU. White noise as PX4's simulator adds it, biases that stay for the flight, the rotors' vibration as
flight logs have it.
Nothing in the vehicle flies by these; a ground station looks at them, and uasfly may use the accelerometer.
"""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass

import numpy as np

from uasfly.frames import rotation_matrix
from uasfly.messages import AccelerometerSample, Array, RotorSample
from uasfly.sim.body import GRAVITY_M_S2
from uasfly.sim.estimate import Estimate
from uasfly.sim.noise_rows import NoiseRows
from uasfly.sim.scenario import Sensors

HOME_LATITUDE_DEG = 47.397742  # where PX4's simulator starts
HOME_LONGITUDE_DEG = 8.545594
HOME_ALTITUDE_M = 489.4
_EARTH_RADIUS_M = 6371000.0
_MAGNETIC_FIELD_GAUSS = (0.012, 0.213, -0.428)  # east, north, up as the recorded vehicle measured it there

_GYRO_NOISE_RAD_S = 0.01
_GYRO_BIAS_RAD_S = 0.003
_MAGNETOMETER_NOISE_GAUSS = 0.02
_BAROMETER_NOISE_M = 0.1
_BAROMETER_BIAS_M = 0.3
_GNSS_NOISE_M = 0.2
_GNSS_HEIGHT_NOISE_M = 0.5
_GNSS_VELOCITY_NOISE_M_S = 0.06
_ROTOR_SPEED = slice(13, None)  # in the plant's state
_RPM = 60.0 / (2.0 * math.pi)  # of 1 rad/s; whole ones are told
_SHAKING = slice(16, 19)
_WIDTH = 19
_READINGS = 4  # in one sample of the accelerometer, as the link takes their mean


@dataclass(frozen=True, slots=True)
class InertialSample:
    """Inertial unit, magnetometer and barometer at `time_s`.

    Attributes:
        acceleration_in_body: (3,) specific force [m/s^2]; at rest (0, 0, 9.81).
        angular_rate_in_body: (3,) [rad/s]. magnetic_field_in_body: (3,) [gauss].
        pressure_altitude_m: height above sea level by the barometer.
    """

    time_s: float
    acceleration_in_body: Array
    angular_rate_in_body: Array
    magnetic_field_in_body: Array
    pressure_altitude_m: float


@dataclass(frozen=True, slots=True)
class GnssSample:
    """GNSS receiver at `time_s`; without a fix the position is the last one and the accuracies are 100 m.

    Attributes:
        fix: 3 with a position, 0 without. satellites: in use.
        latitude_deg, longitude_deg, altitude_m: position, above sea level.
        velocity_in_world: (3,) [m/s]. horizontal_accuracy_m, vertical_accuracy_m: of the position.
    """

    time_s: float
    fix: int
    satellites: int
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    velocity_in_world: Array
    horizontal_accuracy_m: float
    vertical_accuracy_m: float


def geographic_position(position_in_world: tuple[float, float, float]) -> tuple[float, float, float]:
    """Latitude [deg], longitude [deg] and height above sea level [m] of a point of the local world, on PX4's sphere."""
    east, north, up = position_in_world
    latitude = HOME_LATITUDE_DEG + math.degrees(north / _EARTH_RADIUS_M)
    shrink = math.cos(math.radians(HOME_LATITUDE_DEG))
    return latitude, HOME_LONGITUDE_DEG + math.degrees(east / (_EARTH_RADIUS_M * shrink)), HOME_ALTITUDE_M + up


class RawSensors:
    """Sensors of one vehicle.

    Args:
        rng: source of their noise and biases.
        plant_state, acceleration: the plant's memory (see `dynamics.PlantDynamics`).
        estimate: has GNSS or not, and its slow errors.
        settings: noise, bias and vibration of the accelerometer.
        hover_speed_rad_s: of a rotor; the vibration grows with the square of the speed, as imbalance does.
        rotor_rng: source of the noise of the rotors' speeds.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        plant_state: array[float],
        acceleration: array[float],
        estimate: Estimate,
        settings: Sensors,
        hover_speed_rad_s: float,
        rotor_rng: np.random.Generator,
    ) -> None:
        self._settings = settings
        self._hover_speed_rad_s = hover_speed_rad_s
        self._state = plant_state
        self._acceleration = acceleration
        self._estimate = estimate
        self._acceleration_bias = settings.accelerometer_bias_m_s2 * rng.standard_normal(3)
        self._gyro_bias = _GYRO_BIAS_RAD_S * rng.standard_normal(3)
        self._barometer_bias = _BAROMETER_BIAS_M * rng.standard_normal()
        self._noise = NoiseRows(rng, _WIDTH)
        self._row_before = self._noise.row
        self._rotor_noise = NoiseRows(rotor_rng, max(1, len(plant_state) - _ROTOR_SPEED.start))
        self._steps_behind = self._rotor_steps_behind = 0
        self._last_fix = geographic_position((plant_state[0], plant_state[1], plant_state[2]))

    def advance(self) -> None:
        """Go to the noise of the next step; it is drawn only when somebody reads."""
        self._steps_behind += 1
        self._rotor_steps_behind += 1

    def inertial(self, time_s: float) -> InertialSample:
        """What inertial unit, magnetometer and barometer read now."""
        state, noise = self._state, np.array(self._row())
        to_body = rotation_matrix(np.array(state[6:10])).T
        shaken = np.array(noise[_SHAKING]) - np.array(self._row_before[_SHAKING])
        return InertialSample(
            time_s,
            self._specific_force(to_body)
            + self._settings.accelerometer_noise_m_s2 * noise[0:3]
            + self._vibration_m_s2() / math.sqrt(2.0) * shaken,
            np.array(state[10:13]) + self._gyro_bias + _GYRO_NOISE_RAD_S * noise[3:6],
            to_body @ np.array(_MAGNETIC_FIELD_GAUSS) + _MAGNETOMETER_NOISE_GAUSS * noise[6:9],
            float(HOME_ALTITUDE_M + state[2] + self._barometer_bias + _BAROMETER_NOISE_M * noise[9]),
        )

    def accelerometer(self, time_s: float) -> AccelerometerSample:
        """Mean of the accelerometer's last four readings.

        Shaking is the change of something between readings, so that consecutive ones take it back: as in flight logs a
        quarter of it is left in the mean of four, where white noise leaves a half.
        """
        noise = np.array(self._row())
        to_body = rotation_matrix(np.array(self._state[6:10])).T
        return AccelerometerSample(
            time_s,
            self._specific_force(to_body)
            + self._settings.accelerometer_noise_m_s2 / math.sqrt(_READINGS) * noise[0:3]
            + self._vibration_m_s2() / _READINGS * noise[_SHAKING],
        )

    def _specific_force(self, to_body: Array) -> Array:
        force = np.array(self._acceleration)
        force[2] += GRAVITY_M_S2
        return np.asarray(to_body @ force) + self._acceleration_bias

    def _vibration_m_s2(self) -> float:
        speeds = self._state[13:]
        turning = sum(speed * speed for speed in speeds) / max(1, len(speeds))
        return self._settings.vibration_m_s2 * turning / self._hover_speed_rad_s**2

    def rotors(self, time_s: float) -> RotorSample | None:
        """Speeds of the rotors in whole rpm, none below zero; None where nobody tells them."""
        if not self._settings.rotor_speeds:
            return None
        while self._rotor_steps_behind:
            self._rotor_noise.advance()
            self._rotor_steps_behind -= 1
        sigma = self._settings.rotor_noise_rad_s
        told = [
            round(_RPM * max(0.0, speed + sigma * noise)) / _RPM if speed > sigma else 0.0
            for speed, noise in zip(self._state[_ROTOR_SPEED], self._rotor_noise.row, strict=True)
        ]
        return RotorSample(time_s, np.array(told))

    def gnss(self, time_s: float) -> GnssSample:
        """What the GNSS receiver reads now."""
        state, noise = self._state, self._row()
        if not self._estimate.gnss_available:
            return GnssSample(time_s, 0, 0, *self._last_fix, np.zeros(3), 100.0, 100.0)
        bias = self._estimate.position_bias
        self._last_fix = geographic_position(
            (
                state[0] + bias[0] + _GNSS_NOISE_M * noise[10],
                state[1] + bias[1] + _GNSS_NOISE_M * noise[11],
                state[2] + bias[2] + _GNSS_HEIGHT_NOISE_M * noise[12],
            )
        )
        velocity = np.array(state[3:6]) + _GNSS_VELOCITY_NOISE_M_S * np.array(noise[13:16])
        return GnssSample(time_s, 3, 10, *self._last_fix, velocity, 0.9, 1.78)

    def _row(self) -> list[float]:
        while self._steps_behind:
            self._row_before = self._noise.row
            self._noise.advance()
            self._steps_behind -= 1
        return self._noise.row
