"""Truth that obeys the filter's assumptions exactly: eq. 1 in white noise, many flights at once, code of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.frames import quaternion_inverse, quaternion_product, rotation_vector_from_quaternion
from uasfly.messages import Array, FlightMode, MarkerSample, OdometrySample, Setpoint, VehicleSample
from uasfly.observer import Observer
from uasfly.observer import states as s

SUBSTEP_S = 0.005


def products(left: Array, right: Array) -> Array:
    """Hamilton products of two arrays of quaternions (runs, 4)."""
    w1, x1, y1, z1 = left.T
    w2, x2, y2, z2 = right.T
    return np.stack(
        (
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ),
        axis=1,
    )


def exponentials(rotations: Array) -> Array:
    """Quaternions (runs, 4) of rotation vectors (runs, 3)."""
    angle = np.linalg.norm(rotations, axis=1, keepdims=True)
    return np.concatenate((np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * rotations), axis=1)


def body_z(quaternions: Array) -> Array:
    """Body z axes (runs, 3) in the world."""
    w, x, y, z = quaternions.T
    return np.stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)), axis=1)


def conjugates(quaternions: Array) -> Array:
    """Inverse quaternions (runs, 4)."""
    return np.asarray(quaternions * np.array((1.0, -1.0, -1.0, -1.0)))


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Vectors (runs, 3) turned by quaternions (runs, 4)."""
    pure = np.concatenate((np.zeros((len(vectors), 1)), vectors), axis=1)
    return products(products(quaternions, pure), conjugates(quaternions))[:, 1:]


def turn_rate(time_s: float) -> Array:
    """Angular rate (3,) [rad/s] that every flight is given: gentle rocking in roll and pitch, a slow turn in yaw."""
    return np.array((0.4 * np.cos(2.1 * time_s), 0.3 * np.cos(1.7 * time_s + 0.5), 0.3 * np.cos(0.5 * time_s)))


def thrust_command(time_s: float) -> float:
    """Thrust command 0..1 that every flight is given, constant over 20 ms."""
    return float(0.3436 * (1.0 + 0.05 * np.sin(3.0 * round(time_s / 0.02) * 0.02)))


def fly_commands(observer: Observer, duration_s: float) -> None:
    """Tell an observer that it is in the air, and every thrust command of a flight in advance."""
    observer.add(VehicleSample(-1.0, FlightMode.OFFBOARD, armed=True, in_air=True))
    for k in range(-5, round(duration_s / 0.02) + 2):
        observer.sent(Setpoint(0.02 * k, 0.0, 0.0, 0.0, 0.0, thrust_command(0.02 * k)), in_offboard=True)


@dataclass
class Flights:
    """Many flights at one time; every array has one row a flight."""

    time_s: float
    position: Array
    velocity: Array
    quaternion: Array
    force: Array
    bias: Array
    velocity_wander: Array
    attitude_wander: Array

    def advance(self, airframe: Airframe, until_s: float, rng: np.random.Generator) -> None:
        """Integrate eq. 1 with the airframe's noise densities to `until_s`."""
        noise, model = airframe.observer, airframe.model
        steps = round((until_s - self.time_s) / SUBSTEP_S)
        if steps == 0:
            return
        h, root = SUBSTEP_S, SUBSTEP_S**0.5
        drag = np.array(model.drag_1_s)
        shape = self.position.shape
        for _ in range(steps):
            middle_s = self.time_s + 0.5 * h
            # The command before the delay, taken well inside its 20 ms.
            begun_s = np.floor((middle_s - model.command_delay_s) / 0.02 + 1e-6) * 0.02
            thrust = model.k_thrust_m_s2 * thrust_command(begun_s)
            turn = turn_rate(middle_s) * h + noise.attitude_density * root * rng.standard_normal(shape)
            end = products(self.quaternion, exponentials(turn))
            direction = 0.5 * (body_z(self.quaternion) + body_z(end))
            acceleration = direction * thrust + self.force - drag * self.velocity - (0.0, 0.0, GRAVITY_M_S2)
            velocity = self.velocity + h * acceleration + noise.acceleration_density * root * rng.standard_normal(shape)
            self.position = self.position + 0.5 * h * (self.velocity + velocity)
            self.velocity, self.quaternion = velocity, end
            self.force = self.force + noise.force_density * root * rng.standard_normal(shape)
            self.bias = self.bias + noise.gnss_bias_density * root * rng.standard_normal(shape)
            keep = np.exp(-h / noise.wander_time_s)
            fresh = (1.0 - keep**2) ** 0.5
            drawn = noise.velocity_wander_m_s * rng.standard_normal(shape)
            self.velocity_wander = keep * self.velocity_wander + fresh * drawn
            drawn = noise.attitude_wander_rad * rng.standard_normal(shape)
            self.attitude_wander = keep * self.attitude_wander + fresh * drawn
            self.time_s += h
        self.time_s = until_s

    def odometry(self, airframe: Airframe, rng: np.random.Generator) -> list[OdometrySample]:
        """One sample a flight, with the airframe's configured noise."""
        noise, shape = airframe.observer, self.position.shape
        position = self.position + self.bias + noise.position_sigma_m * rng.standard_normal(shape)
        velocity = self.velocity + self.velocity_wander + noise.velocity_sigma_m_s * rng.standard_normal(shape)
        turn = noise.attitude_sigma_rad * rng.standard_normal(shape)
        quaternion = products(products(self.quaternion, exponentials(self.attitude_wander)), exponentials(turn))
        rate = turn_rate(self.time_s)
        return [
            OdometrySample(self.time_s, position[k], velocity[k], quaternion[k], rate.copy())
            for k in range(len(position))
        ]

    def sightings(self, marker: Array, covariance: Array, rng: np.random.Generator) -> list[MarkerSample]:
        """One sighting a flight of the marker with pose (7,) in the world."""
        runs = len(self.position)
        inverse = conjugates(self.quaternion)
        noise = rng.multivariate_normal(np.zeros(6), covariance, runs)
        position = rotated(inverse, marker[:3] - self.position) + noise[:, :3]
        turn = products(inverse, np.tile(marker[3:], (runs, 1)))
        quaternion = products(turn, exponentials(noise[:, 3:]))
        return [MarkerSample(self.time_s, 7, position[k], quaternion[k], covariance) for k in range(runs)]

    def error(self, observer: Observer, run: int, marker: Array | None = None) -> Array:
        """Error (n,) of one flight's observer where it stands, along the manifold: truth minus estimate."""
        moment = observer.moment
        assert moment is not None
        assert abs(moment.time_s - self.time_s) < 1e-9
        nominal = moment.packed
        parts = [
            self.position[run] - nominal[s.POSITION],
            self.velocity[run] - nominal[s.VELOCITY],
            turn_between(nominal[s.QUATERNION], self.quaternion[run]),
            self.force[run] - nominal[s.FORCE],
            self.bias[run] - nominal[s.BIAS],
            self.velocity_wander[run] - nominal[s.VELOCITY_WANDER],
            self.attitude_wander[run] - nominal[s.ATTITUDE_WANDER],
        ]
        if moment.markers and marker is not None:
            pose = nominal[s.marker_nominal(0)]
            parts += [marker[:3] - pose[:3], turn_between(pose[3:], marker[3:])]
        return np.concatenate(parts)


def turn_between(start: Array, end: Array) -> Array:
    """Rotation vector (3,) with start * exp(turn) == end."""
    return rotation_vector_from_quaternion(quaternion_product(quaternion_inverse(start), end))


def flights(airframe: Airframe, runs: int, rng: np.random.Generator) -> Flights:
    """Flights at time 0 with a wind force and wanders drawn from the filter's prior and no GNSS bias."""
    level = np.zeros((runs, 4))
    level[:, 0] = 1.0
    zeros = np.zeros((runs, 3))
    noise = airframe.observer
    return Flights(
        0.0,
        zeros + np.array((0.0, 0.0, 2.0)),
        zeros,
        level,
        rng.standard_normal((runs, 3)),
        zeros,
        noise.velocity_wander_m_s * rng.standard_normal((runs, 3)),
        noise.attitude_wander_rad * rng.standard_normal((runs, 3)),
    )


def nees(error: Array, covariance: Array) -> float:
    """Normalised estimation error squared."""
    return float(error @ np.linalg.solve(covariance, error))
