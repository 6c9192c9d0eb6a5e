"""Solves for a mounting: Levenberg-Marquardt with Huber's weights, in turn with how large the disturbances are.

The disturbances' figures are those of the largest restricted likelihood (Harville 1977), with a broad prior on their
logarithms, so that the sigmas hold what the log itself shows of drift and scatter, not what somebody has assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.calibration.mounting import drift
from uasfly.vision.calibration.mounting.drift import Knots, Noise
from uasfly.vision.calibration.mounting.model import (
    HEADING,
    LEVER,
    OFFSET,
    TURN,
    Linearised,
    Unknowns,
    bundles_seen,
    linearise,
)
from uasfly.vision.calibration.mounting.observations import Motion, Sightings, Track, followed
from uasfly.vision.calibration.mounting.pretence import known_covariance, pretended
from uasfly.vision.calibration.mounting.start import first_rotation

FEWEST = 30  # sightings
GUESSED_RAD = 0.35  # a rotation that is believed no better may also be all wrong
MOST = 3000  # more than these are thinned out evenly
_GATE = 22.46  # chi-square of 6 degrees of freedom, 99.9 %
_REJECTED = 4.0 * _GATE
_ROUNDS = 4
_STEPS = 25
_CONVERGED = 1e-7  # of metres, radians and seconds
_NOISE_SPREAD = 1.5  # sigma of the prior of the disturbances' logarithms
_NOISE_STEP = 1e-3
_NOISE_SETTLED = 0.05
_NOISE_RANGE = 5.0
_DAMPING, _MOST_DAMPING = 1e-3, 1e4
_NO_GAIN = 1e-6  # of the cost, in squared sigmas
_SURE_RAD, _SURE_M = 1e-5, 1e-5
_VAGUE_BUNDLE = 1e-8  # information of a bundle's place and rotation


@dataclass(frozen=True, slots=True)
class Belief:
    """What is known without the log.

    Attributes:
        camera_to_body: (3, 3), lever: (3,) m: where to begin.
        turn_sigma_rad, lever_sigma_m: how well they are known, an axis.
        heading_sigma_rad: of the autopilot's constant heading error. offset_sigma_s: of the camera's latency.
    """

    camera_to_body: Array
    lever: Array
    turn_sigma_rad: float = GUESSED_RAD
    lever_sigma_m: float = 0.5
    heading_sigma_rad: float = math.radians(3.0)
    offset_sigma_s: float = 0.1

    def trusting(self, turn_sigma_rad: float, lever_sigma_m: float) -> Belief:
        """With other sigmas of the mounting; smaller ones than can be measured count as those."""
        return replace(
            self,
            turn_sigma_rad=max(turn_sigma_rad, _SURE_RAD),
            lever_sigma_m=max(lever_sigma_m, _SURE_M),
        )


@dataclass(frozen=True, slots=True, eq=False)
class MountingFit:
    """A mounting and how well it is known.

    Attributes:
        unknowns: at the optimum.
        covariance: (8, 8) of mounting, heading and time offset, in the order of `model`.
        noise: disturbances that the log shows.
        sightings: those that were used; place, knots, values: the motion there and its errors.
        residuals: (n, 6) m, body axes, and rad, bundle axes, with the motion's errors taken off.
        distance: (n,) squared length of the residuals in sigmas. weights: (n,), 0 for what was left out.
        information: (size,) of the unknowns before the log was looked at.
        pretence: (size, size) information that is none, see `pretence`.
    """

    unknowns: Unknowns
    covariance: Array
    noise: Noise
    sightings: Sightings
    track: Track
    knots: Knots
    values: Array
    residuals: Array
    distance: Array
    weights: Array
    information: Array
    pretence: Array

    @property
    def turn_sigma_rad(self) -> Array:
        """(3,) of the rotation about the body's axes."""
        return self._sigmas(TURN)

    @property
    def lever_sigma_m(self) -> Array:
        """(3,) of the lever arm, body axes."""
        return self._sigmas(LEVER)

    @property
    def heading_sigma_rad(self) -> float:
        """Of the autopilot's heading error."""
        return math.sqrt(float(self.covariance[HEADING, HEADING]))

    @property
    def offset_sigma_s(self) -> float:
        """Of the time offset."""
        return math.sqrt(float(self.covariance[OFFSET, OFFSET]))

    @property
    def worst_sigmas(self) -> tuple[float, float]:
        """Standard deviations of rotation [rad] and lever arm [m] in the direction that is known worst."""
        return worst_sigmas(self.covariance)

    @property
    def errors(self) -> Array:
        """(n, 6) of the motion at the sightings: position [m, world], attitude [rad, body]."""
        return self.knots.between(self.values)

    def _sigmas(self, part: slice) -> Array:
        return np.asarray(np.sqrt(np.diag(self.covariance)[part]), dtype=float)


def worst_sigmas(covariance: Array) -> tuple[float, float]:
    """Of rotation [rad] and lever arm [m] in the direction that is known worst, of the unknowns' covariance."""
    blocks = (covariance[TURN, TURN], covariance[LEVER, LEVER])
    turn, lever = (math.sqrt(float(np.linalg.eigvalsh(block)[-1])) for block in blocks)
    return turn, lever


def fit_mounting(motion: Motion, sightings: Sightings, belief: Belief, noise: Noise | None = None) -> MountingFit:
    """Calibrate.

    Args:
        motion: of the vehicle.
        sightings: of bundles that stay where they are.
        belief: where to begin, and what is known already.
        noise: disturbances; found from the log where not given.

    Raises:
        UasflyError: too few sightings, or none that the motion is known for.
    """
    good, stretch = followed(motion, sightings.time_s) if len(motion.time_s) > 1 else (np.zeros(0, bool), None)
    if stretch is None or good.sum() < FEWEST:
        raise UasflyError(
            f"expected at least {FEWEST} sightings between samples of the vehicle's odometry, "
            f"found {int(good.sum())} of {len(sightings.time_s)}; record for longer with the bundle in sight"
        )
    chosen = np.flatnonzero(good)
    if len(chosen) > MOST:
        chosen = chosen[np.linspace(0, len(chosen) - 1, MOST).round().astype(np.intp)]
    kept, used = np.unique(sightings.bundle[chosen], return_inverse=True)
    seen = replace(
        sightings.part(chosen), bundle=used.astype(np.intp), ids=tuple(sightings.ids[index] for index in kept)
    )
    problem = _Problem(seen, Track(motion, seen.time_s), Knots(seen.time_s, stretch[chosen]), belief)
    return problem.solved(noise)


class _Problem:
    def __init__(self, sightings: Sightings, track: Track, knots: Knots, belief: Belief) -> None:
        self._sightings, self._track, self._knots, self._belief = sightings, track, knots, belief
        place, turned = track.at(0.0), belief.camera_to_body
        if belief.turn_sigma_rad >= GUESSED_RAD:
            turned = first_rotation(turned, place, sightings)
            self._belief = replace(belief, camera_to_body=turned)
        bundles = bundles_seen(turned, belief.lever, place, sightings)
        self._unknowns = Unknowns(turned, belief.lever, 0.0, 0.0, *bundles)
        self._values = np.zeros((len(knots.time_s), 6))
        self._weights = np.ones(len(sightings.time_s))
        self._noise = Noise()
        sigmas = np.repeat((belief.turn_sigma_rad, belief.lever_sigma_m), 3)
        known = np.concatenate((sigmas, (belief.heading_sigma_rad, belief.offset_sigma_s)))
        self._information = np.concatenate((known**-2.0, np.full(6 * len(sightings.ids), _VAGUE_BUNDLE)))

    def solved(self, noise: Noise | None) -> MountingFit:
        """At the optimum."""
        self._noise = Noise() if noise is None else noise
        self._descend()
        for number in range(_ROUNDS):
            self._weigh(reject=number > 0 or noise is not None)
            self._descend()
            if noise is None:
                before = self._noise.logarithms
                self._noise = self._likeliest()
                if number > 0 and np.abs(self._noise.logarithms - before).max() < _NOISE_SETTLED:
                    break
        self._descend()
        linear, result = self._normal(self._unknowns, self._values)
        place, errors = self._track.at(self._unknowns.offset_s), self._knots.between(self._values)
        pretence = pretended(linear, self._unknowns, place, self._sightings, errors, self._weights, self._noise)
        return MountingFit(
            self._unknowns,
            known_covariance(result.information, pretence, self._information),
            self._noise,
            self._sightings,
            self._track,
            self._knots,
            self._values,
            linear.residuals,
            result.distance,
            self._weights,
            self._information,
            pretence,
        )

    def _weigh(self, *, reject: bool) -> None:
        """Huber's weights; what is far outside counts nothing."""
        distance = self._normal(self._unknowns, self._values)[1].distance
        self._weights = np.minimum(1.0, np.sqrt(_GATE / np.maximum(distance, 1e-9)))
        if reject:
            self._weights[distance > _REJECTED] = 0.0
            if np.count_nonzero(self._weights) < FEWEST:
                raise UasflyError(
                    f"{np.count_nonzero(self._weights)} of {len(distance)} sightings agree with one mounting and "
                    "bundles at rest; expected most: look at the bundle's file, and whether the bundle was moved"
                )

    def _descend(self) -> None:
        """Levenberg-Marquardt with the present weights and noise."""
        damping = _DAMPING
        _, result = self._normal(self._unknowns, self._values, damping)
        for _ in range(_STEPS):
            if result.cost - result.least < _NO_GAIN:
                return
            unknowns, values = self._unknowns.moved(result.step), self._values + result.knots
            tried = self._normal(unknowns, values)[1]
            if tried.cost <= result.cost * (1.0 + 1e-12):
                self._unknowns, self._values = unknowns, values
                if np.abs(result.step).max() < _CONVERGED:
                    return
                damping *= 0.1
            else:
                damping *= 10.0
                if damping > _MOST_DAMPING:
                    return
            _, result = self._normal(self._unknowns, self._values, damping)

    def _likeliest(self) -> Noise:
        """The disturbances of the largest restricted likelihood around the present optimum."""
        start = Noise().logarithms
        linear = self._linear(self._unknowns, self._values)
        off = self._off(self._unknowns)

        def unlikely(values: Array) -> float:
            noise = Noise.of_logarithms(values)
            result = drift.solve(linear, self._weights, noise, self._knots, self._values, (self._information, off))
            return -result.likelihood + 0.5 * float((((values - start) / _NOISE_SPREAD) ** 2).sum())

        bounds = [(value - _NOISE_RANGE, value + _NOISE_RANGE) for value in start]
        result = minimize(
            unlikely, self._noise.logarithms, method="L-BFGS-B", bounds=bounds,
            options={"eps": _NOISE_STEP, "ftol": 1e-7, "maxiter": 30},
        )  # fmt: skip
        return Noise.of_logarithms(np.asarray(result.x, dtype=float))

    def _normal(self, unknowns: Unknowns, values: Array, damping: float = 0.0) -> tuple[Linearised, drift.Solved]:
        linear = self._linear(unknowns, values)
        prior = self._information, self._off(unknowns)
        return linear, drift.solve(linear, self._weights, self._noise, self._knots, values, prior, damping)

    def _linear(self, unknowns: Unknowns, values: Array) -> Linearised:
        place = self._track.at(unknowns.offset_s)
        return linearise(unknowns, place, self._sightings, self._knots.between(values))

    def _off(self, unknowns: Unknowns) -> Array:
        """How far the unknowns are from what is believed, (size,)."""
        off = np.zeros(unknowns.size)
        off[TURN] = Rotation.from_matrix(unknowns.camera_to_body @ self._belief.camera_to_body.T).as_rotvec()
        off[LEVER] = unknowns.lever - self._belief.lever
        off[HEADING], off[OFFSET] = unknowns.heading_rad, unknowns.offset_s
        return off
