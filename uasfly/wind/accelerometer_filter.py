"""Kalman filter for the wind and the accelerometer's bias, from accelerometer, attitude and positions.

Waslander & Wang 2009 invert the accelerometer for the wind and fail on its bias: inversion cannot tell the two apart.
This filter has the bias as a state, and the tilt error of the attitude that it is handed, because the two hide behind
each other. What is observable when, a horizontal axis each, D the drag coefficient, delta the tilt error:

- Standing, the accelerometer shows gravity alone: b - g delta. Its vertical part is the bias itself; of the horizontal
  part bias and tilt (of the ground, or of the attitude) cannot be told apart beyond what is known of the tilt.
- In flight at one heading, the accelerometer gives D w + b, and position, attitude and thrust give D w + g delta (how
  far it leans for how fast it gets). Their difference is b - g delta again: the ground has said that already. Wind and
  bias then are as well known as the tilt: 0.3 deg are 0.05 m/s^2 are 0.15 m/s of wind at 0.35 1/s.
- Turning, the bias goes around with the body while wind and tilt error stay in the world: half a turn separates all
  three, without any knowledge of the ground's tilt.

The vehicle's motion is predicted from eq. 28 at the wind estimate, and the accelerometer is a measurement of it: so
its noise enters once, and a vehicle without an accelerometer would estimate the wind with the same filter, slower.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import skew
from uasfly.messages import Array
from uasfly.wind.accelerometer_model import AccelerometerModel

POSITION = slice(0, 3)  # m, world
VELOCITY = slice(3, 6)  # m/s, world
WIND = slice(6, 9)  # m/s, world
BIAS = slice(9, 12)  # m/s^2, body: measured minus true specific force
TILT = slice(12, 14)  # rad, world x and y: the true attitude is the one handed in, turned by this
STATES = 14

_MOST_ITERATIONS = 6
_SETTLED_M_S = 0.3  # of the wind; drag is linear enough over that
_GRAVITY = np.array((0.0, 0.0, GRAVITY_M_S2))


@dataclass(frozen=True, slots=True)
class AccelerometerFilterNoise:
    """Standard deviations and densities; triples along x, y, z.

    Attributes:
        accelerometer_m_s2: of a sample [m/s^2].
        wind_density: random walk of the wind [m/s/sqrt(s)].
        acceleration_density: motion that eq. 28 does not explain [m/s^2/sqrt(Hz)].
        tilt_density: random walk of the attitude's tilt error: the gyro's noise [rad/sqrt(s)].
        initial_bias_m_s2, initial_tilt_rad, initial_wind_m_s: what is known at the beginning. Tiny for the bias means
            that it is held to be none, as the paper does.
    """

    accelerometer_m_s2: float
    wind_density: tuple[float, float, float]
    acceleration_density: float
    tilt_density: float
    initial_bias_m_s2: float
    initial_tilt_rad: float
    initial_wind_m_s: float


class AccelerometerWindFilter:
    """Extended Kalman filter; call `standing` while on the ground, `take_off`, then `predict` and measurements.

    Attributes:
        state: (14,) see the slices of this module. covariance: (14, 14).
    """

    def __init__(self, model: AccelerometerModel, noise: AccelerometerFilterNoise) -> None:
        self._model = model
        self._noise = noise
        self.state = np.zeros(STATES)
        sigmas = np.zeros(STATES)
        sigmas[BIAS], sigmas[TILT] = noise.initial_bias_m_s2, noise.initial_tilt_rad
        self.covariance: Array = np.diag(sigmas**2)

    @property
    def wind_in_world(self) -> Array:
        """(3,) [m/s]."""
        return self.state[WIND].copy()

    @property
    def bias_in_body(self) -> Array:
        """(3,) accelerometer bias [m/s^2]."""
        return self.state[BIAS].copy()

    def rotation(self, body_to_world: Array) -> Array:
        """The attitude (3, 3) handed in, corrected by the tilt error."""
        return np.asarray(_turn(self.state[TILT]) @ body_to_world)

    def standing(self, specific_force: Array, body_to_world: Array) -> None:
        """Take a sample (3,) [m/s^2] of the vehicle at rest on the ground, motors off."""
        H = np.zeros((3, STATES))
        H[:, BIAS] = np.eye(3)
        H[:, TILT] = (body_to_world.T @ skew(_GRAVITY))[:, :2]
        expected = self.rotation(body_to_world).T @ _GRAVITY + self.state[BIAS]
        R = self._noise.accelerometer_m_s2**2 * np.eye(3)
        self._update(H, R, specific_force - expected)

    def take_off(self, position: Array, position_sigma_m: float, velocity_sigma_m_s: float) -> None:
        """Begin the flight at a position (3,) [m], slowly; the wind is unknown, bias and tilt stay as they are."""
        self.state[POSITION], self.state[VELOCITY], self.state[WIND] = position, 0.0, 0.0
        P = self.covariance
        P[: BIAS.start, :], P[:, : BIAS.start] = 0.0, 0.0
        for block, sigma in (
            (POSITION, position_sigma_m),
            (VELOCITY, velocity_sigma_m_s),
            (WIND, self._noise.initial_wind_m_s),
        ):
            P[block, block] = sigma**2 * np.eye(3)

    def predict(self, elapsed_s: float, body_to_world: Array, static_thrust_m_s2: float) -> None:
        """Go on by a short time [s] under an attitude (3, 3) and a thrust in still air over the mass [m/s^2]."""
        acceleration, by_state = self.acceleration(body_to_world, static_thrust_m_s2)
        A = np.zeros((STATES, STATES))
        A[POSITION, VELOCITY] = np.eye(3)
        A[VELOCITY] = by_state
        step = elapsed_s * A
        F = np.eye(STATES) + step + 0.5 * step @ step
        self.state[POSITION] += elapsed_s * self.state[VELOCITY] + 0.5 * elapsed_s**2 * acceleration
        self.state[VELOCITY] += elapsed_s * acceleration
        self.covariance = F @ self.covariance @ F.T + self._process_noise(elapsed_s)

    def acceleration(self, body_to_world: Array, static_thrust_m_s2: float) -> tuple[Array, Array]:
        """Acceleration (3,) of the vehicle in the world [m/s^2] and its derivative (3, 14) by the state."""
        rotation, force, by_air, air_in_world = self._force(body_to_world, static_thrust_m_s2)
        through = rotation @ by_air @ rotation.T
        by_state = np.zeros((3, STATES))
        by_state[:, VELOCITY], by_state[:, WIND] = -through, through
        by_state[:, TILT] = (through @ skew(air_in_world) - skew(rotation @ force))[:, :2]
        return rotation @ force - _GRAVITY, by_state

    def specific_force(self, body_to_world: Array, static_thrust_m_s2: float) -> tuple[Array, Array]:
        """What the accelerometer should read (3,) [m/s^2], bias included, and its derivative (3, 14) by the state."""
        rotation, force, by_air, air_in_world = self._force(body_to_world, static_thrust_m_s2)
        through = by_air @ rotation.T
        H = np.zeros((3, STATES))
        H[:, VELOCITY], H[:, WIND], H[:, BIAS] = -through, through, np.eye(3)
        H[:, TILT] = (through @ skew(air_in_world))[:, :2]
        return force + self.state[BIAS], H

    def accelerometer(self, specific_force: Array, body_to_world: Array, static_thrust_m_s2: float) -> None:
        """Take a sample (3,) [m/s^2] in flight.

        Iterated (Gauss-Newton) while the answer moves: right after take-off the wind is unknown, and drag that is taken
        as linear about none would lie to bias and tilt for good.
        """
        prior, P = self.state, self.covariance
        R = self._noise.accelerometer_m_s2**2 * np.eye(3)
        for _ in range(_MOST_ITERATIONS):
            before = self.state
            expected, H = self.specific_force(body_to_world, static_thrust_m_s2)
            innovation = specific_force - expected - H @ (prior - before)
            self.state = prior + np.linalg.solve(H @ P @ H.T + R, H @ P).T @ innovation
            if np.abs(self.state[WIND] - before[WIND]).max() < _SETTLED_M_S:
                break
        self.state = prior
        self._update(H, R, innovation)

    def position(self, position: Array, sigma_m: Array) -> None:
        """Take a position (3,) [m] with standard deviations (3,)."""
        H = np.zeros((3, STATES))
        H[:, POSITION] = np.eye(3)
        self._update(H, np.diag(sigma_m**2), position - self.state[POSITION])

    def height(self, height_m: float, sigma_m: float) -> None:
        """Take a height of a barometer or a sonar."""
        H = np.zeros((1, STATES))
        H[0, POSITION.start + 2] = 1.0
        self._update(H, np.array(((sigma_m**2,),)), np.array((height_m - self.state[2],)))

    def _force(self, body_to_world: Array, static_thrust_m_s2: float) -> tuple[Array, Array, Array, Array]:
        rotation = self.rotation(body_to_world)
        air_in_world = self.state[WIND] - self.state[VELOCITY]
        force, by_air = self._model.with_jacobian(rotation.T @ air_in_world, static_thrust_m_s2)
        return rotation, force, by_air, air_in_world

    def _process_noise(self, elapsed_s: float) -> Array:
        """Discrete noise (14, 14) of the random walks; the acceleration's reaches the position too."""
        noise, Q = self._noise, np.zeros((STATES, STATES))
        power = noise.acceleration_density**2 * np.eye(3)
        Q[VELOCITY, VELOCITY] = power * elapsed_s
        Q[POSITION, VELOCITY] = Q[VELOCITY, POSITION] = power * elapsed_s**2 / 2.0
        Q[POSITION, POSITION] = power * elapsed_s**3 / 3.0
        Q[WIND, WIND] = np.diag(noise.wind_density) ** 2 * elapsed_s
        Q[TILT, TILT] = noise.tilt_density**2 * elapsed_s * np.eye(2)
        return Q

    def _update(self, H: Array, R: Array, innovation: Array) -> None:
        """Joseph form."""
        P = self.covariance
        K = np.linalg.solve(H @ P @ H.T + R, H @ P).T
        self.state = self.state + K @ innovation
        left = np.eye(STATES) - K @ H
        P = left @ P @ left.T + K @ R @ K.T
        self.covariance = 0.5 * (P + P.T)


def _turn(tilt_rad: Array) -> Array:
    """Rotation (3, 3) by small angles about the world's x and y, to second order."""
    x, y = tilt_rad.tolist()
    cross = skew(np.array((x, y, 0.0)))
    return np.asarray(np.eye(3) + cross + 0.5 * cross @ cross)
