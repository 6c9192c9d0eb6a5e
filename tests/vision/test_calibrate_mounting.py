"""A mounting from sightings and odometry: derivatives, truth inside the sigmas, what the motion leaves unknown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tests.vision.mounting_scene import DOWN, USUAL, Flight, fly
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.calibration.mounting import drift
from uasfly.vision.calibration.mounting.drift import Knots, Noise
from uasfly.vision.calibration.mounting.fit import Belief, MountingFit, fit_mounting
from uasfly.vision.calibration.mounting.missing import Missing, known, missing
from uasfly.vision.calibration.mounting.model import BUNDLES, MOUNTING, Unknowns, linearise
from uasfly.vision.calibration.mounting.observations import Sightings, Track

RUNS = 15
STEP = 1e-6


def some_unknowns(rng: np.random.Generator, flight: Flight) -> Unknowns:
    """Off by a bit, with everything at work."""
    return Unknowns(
        (Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)) * flight.camera_to_body).as_matrix(),
        rng.normal(0.0, 0.1, 3),
        0.05,
        0.02,
        rng.normal(0.0, 0.2, (1, 3)),
        Rotation.from_rotvec(rng.normal(0.0, 0.2, (1, 3))).as_matrix(),
    )


def fitted(flight: Flight, noise: Noise | None = USUAL) -> MountingFit:
    """With the disturbances given, which takes a third of the time."""
    return fit_mounting(flight.motion, flight.sightings, flight.belief(), noise)


def test_the_derivatives_are_those_of_the_residuals() -> None:
    """By every unknown and by the motion's errors, also away from the optimum."""
    rng = np.random.default_rng(5)
    flight = fly(1, duration_s=6.0, rate_hz=3.0)
    sightings, unknowns = flight.sightings, some_unknowns(rng, flight)
    track, errors = Track(flight.motion, sightings.time_s), rng.normal(0.0, 0.1, (len(sightings.time_s), 6))

    def residuals(at: Unknowns, motion: Array) -> Array:
        return linearise(at, track.at(at.offset_s), sightings, motion).residuals

    linear = linearise(unknowns, track.at(unknowns.offset_s), sightings, errors)
    for index in range(unknowns.size):
        step = np.zeros(unknowns.size)
        step[index] = STEP
        slope = (residuals(unknowns.moved(step), errors) - residuals(unknowns.moved(-step), errors)) / (2.0 * STEP)
        np.testing.assert_allclose(linear.by_unknowns[:, :, index], slope, atol=2e-6)
    for index in range(6):
        step = np.zeros(6)
        step[index] = STEP
        slope = (residuals(unknowns, errors + step) - residuals(unknowns, errors - step)) / (2.0 * STEP)
        np.testing.assert_allclose(linear.by_motion[:, :, index], slope, atol=2e-6)


def test_the_normal_equations_are_those_of_all_errors_at_once() -> None:
    """Step, information and likelihood as from dense matrices that know no knots, only their covariance."""
    rng = np.random.default_rng(6)
    flight = fly(2, duration_s=8.0, rate_hz=3.0)
    seen, unknowns, noise = flight.sightings, some_unknowns(rng, flight), Noise(0.8, 0.02, 0.01, 0.05, 0.02)
    count, size = len(seen.time_s), unknowns.size
    stretch = (seen.time_s > 4.0).astype(np.intp)  # the autopilot's estimate jumps once
    knots = Knots(seen.time_s, stretch)
    values, weights = rng.normal(0.0, 0.01, (len(knots.time_s), 6)), rng.uniform(0.3, 1.0, count)
    place = Track(flight.motion, seen.time_s).at(unknowns.offset_s)
    linear = linearise(unknowns, place, seen, knots.between(values))
    information, off = rng.uniform(1.0, 5.0, size), rng.normal(0.0, 0.1, size)

    def of(one: Noise) -> tuple[drift.Solved, Array, Array, float]:
        solved = drift.solve(linear, weights, one, knots, values, (information, off))
        diagonal, beside, _ = knots.prior(one)
        prior = np.diag(diagonal.ravel()) + np.diag(beside.ravel(), 6) + np.diag(beside.ravel(), -6)
        H = np.zeros((6 * count, 6 * len(values)))
        V = np.zeros((6 * count, 6 * count))
        for index in range(count):
            rows, first = slice(6 * index, 6 * index + 6), 6 * knots.index[index]
            H[rows, first : first + 6] = (1.0 - knots.share[index]) * linear.by_motion[index]
            H[rows, first + 6 : first + 12] = knots.share[index] * linear.by_motion[index]
            G = linear.by_attitude[index]
            S = one.sighting_scale**2 * linear.seen[index] + one.attitude_rad**2 * G @ G.T
            S[:3, :3] += one.position_m**2 * np.eye(3)
            V[rows, rows] = S / weights[index]
        V += H @ np.linalg.inv(prior) @ H.T
        J = linear.by_unknowns.reshape(-1, size)
        r = linear.residuals.ravel() - H @ values.ravel()  # as from knots at zero
        N = J.T @ np.linalg.solve(V, J) + np.diag(information)
        g = J.T @ np.linalg.solve(V, r) + information * off
        least = r @ np.linalg.solve(V, r) + information @ off**2 - g @ np.linalg.solve(N, g)
        likelihood = -0.5 * (least + np.linalg.slogdet(V)[1] + np.linalg.slogdet(N)[1])
        return solved, N, -np.linalg.solve(N, g), float(likelihood)

    solved, N, step, likelihood = of(noise)
    np.testing.assert_allclose(solved.information, N, rtol=1e-6, atol=1e-6 * np.abs(N).max())
    np.testing.assert_allclose(solved.step, step, rtol=1e-5, atol=1e-7)
    other = of(replace(noise, walk_m_sqrt_s=0.2, wander_rad=0.03, position_m=0.01))
    assert other[0].likelihood - solved.likelihood == pytest.approx(other[3] - likelihood, abs=1e-4)


def test_the_truth_is_inside_the_sigmas() -> None:
    """Over many flights the normalised error is chi-square distributed: mounting, time offset and heading."""
    errors, others = [], []
    for seed in range(RUNS):
        flight = fly(seed)
        fit = fitted(flight)
        error = flight.error(fit)
        errors.append(float(error @ np.linalg.solve(fit.covariance[MOUNTING, MOUNTING], error)))
        others.append((flight.offset_s - fit.unknowns.offset_s) / fit.offset_sigma_s)
        others.append((flight.heading_rad - fit.unknowns.heading_rad) / fit.heading_sigma_rad)
        assert known(*fit.worst_sigmas)
    low, high = chi2.ppf((0.005, 0.995), 6 * RUNS)
    assert low < sum(errors) < high
    low, high = chi2.ppf((0.005, 0.995), 2 * RUNS)
    assert low < sum(other**2 for other in others) < high


def test_the_log_itself_tells_how_large_drift_and_scatter_are() -> None:
    """From a guess that is wrong by factors; what is found is right to a quarter, and the mounting is known as well."""
    noise = Noise(0.5, 0.05, 0.0005, 0.15, 0.002)
    flight = fly(3, duration_s=50.0, noise=noise)
    fit = fitted(flight, None)
    for name in ("sighting_scale", "position_m", "walk_m_sqrt_s", "wander_rad"):
        assert getattr(fit.noise, name) == pytest.approx(getattr(noise, name), rel=0.25), name
    error = flight.error(fit)
    assert error @ np.linalg.solve(fit.covariance[MOUNTING, MOUNTING], error) < chi2.ppf(0.999, 6)


@pytest.mark.parametrize("turned_deg", [(0.0, 0.0, 175.0), (170.0, 0.0, 0.0), (100.0, 100.0, 0.0)])
def test_a_camera_that_looks_elsewhere_than_its_file_says_is_found(turned_deg: tuple[float, float, float]) -> None:
    """A file for a camera ahead, or for one that was turned about its axis, is no obstacle."""
    flight = fly(4)
    wrong = (Rotation.from_rotvec(turned_deg, degrees=True) * DOWN).as_matrix()
    fit = fit_mounting(flight.motion, flight.sightings, replace(flight.belief(), camera_to_body=wrong), USUAL)
    assert np.abs(flight.error(fit)[:3]).max() < math.radians(0.5)


def test_sightings_that_lie_are_left_out() -> None:
    """One in eight is turned and moved at random: the mounting is as before."""
    flight, rng = fly(5), np.random.default_rng(1)
    seen = flight.sightings
    liars = np.arange(3, len(seen.time_s), 8)
    position, rotation = seen.position.copy(), seen.rotation.copy()
    position[liars] += rng.normal(0.0, 0.5, (len(liars), 3))
    rotation[liars] = rotation[liars] @ Rotation.from_rotvec(rng.normal(0.0, 0.5, (len(liars), 3))).as_matrix()
    told = replace(flight, sightings=replace(seen, position=position, rotation=rotation))
    fit = fitted(told, None)
    assert set(np.flatnonzero(fit.weights == 0.0)) == set(liars)
    error = flight.error(fit)
    assert error @ np.linalg.solve(fit.covariance[MOUNTING, MOUNTING], error) < chi2.ppf(0.999, 6)


def test_a_jump_of_the_autopilots_position_is_no_matter() -> None:
    """Where its counter says so the position error begins anew; sightings at the jump itself are not used."""
    flight = fly(6)
    after = flight.motion.time_s > 14.95
    moved = flight.motion.position_in_world + after[:, None] * np.array((4.0, -3.0, 1.0))
    jumped = replace(flight, motion=replace(flight.motion, position_in_world=moved, resets=after.astype(np.intp)))
    before, fit = fitted(flight), fitted(jumped)
    assert np.count_nonzero(fit.weights) >= np.count_nonzero(before.weights) - 1
    difference = flight.error(fit) - flight.error(before)
    assert (np.abs(difference) < np.sqrt(np.diag(fit.covariance)[MOUNTING])).all()


def test_two_bundles_share_one_mounting() -> None:
    """Each has its own place; the numbers of bundles that are not used do not matter."""
    flight = fly(7)
    seen, other = flight.sightings, np.arange(len(flight.sightings.time_s)) % 2
    shift = Rotation.from_matrix(seen.rotation).apply((0.3, -0.2, 0.0)) * other[:, None]
    two = Sightings(seen.time_s, 2 * other, seen.position + shift, seen.rotation, seen.covariance, (3, 4, 9))
    fit = fit_mounting(flight.motion, two, flight.belief(), USUAL)
    assert fit.sightings.ids == (3, 9)
    assert fit.unknowns.size == BUNDLES + 12
    error = flight.error(fit)
    assert error @ np.linalg.solve(fit.covariance[MOUNTING, MOUNTING], error) < chi2.ppf(0.999, 6)


@pytest.mark.parametrize(
    ("motion", "lacks"),
    [
        ({"yaw_rad": 0.0, "tilt_rad": 0.0}, {"tilt"}),
        ({"tilt_rad": 0.0, "way_m": 0.0}, {"tilt"}),
        ({"yaw_rad": 0.0, "tilt_rad": 0.005}, {"tilt"}),
    ],
    ids=["neither turned nor tilted", "only turned", "hardly tilted"],
)
def test_what_the_motion_leaves_unknown_is_told(motion: dict[str, float], lacks: set[str]) -> None:
    """The sigmas are large, the truth is inside them, and the motion that is missing has a name."""
    flight = fly(8, **motion)  # type: ignore[arg-type]
    fit = fitted(flight)
    found = missing(fit)
    assert found is not None
    assert not known(*fit.worst_sigmas)
    assert lacks <= set(found.motions)
    assert found.turn_sigma_rad < fit.worst_sigmas[0]
    error = flight.error(fit)
    assert error @ np.linalg.solve(fit.covariance[MOUNTING, MOUNTING], error) < chi2.ppf(0.999, 6)


def test_without_any_turn_nothing_is_learnt_of_the_lever_arm() -> None:
    """It cannot be told from the bundle's place: its sigma stays what was believed. No tilt: nor can the heading."""
    fit = fitted(fly(9, yaw_rad=0.0, tilt_rad=0.0))
    np.testing.assert_allclose(fit.lever_sigma_m, fly(9).belief().lever_sigma_m, rtol=0.2)
    turned = fitted(fly(9, tilt_rad=0.0))
    assert turned.lever_sigma_m[:2].max() < 0.05
    assert turned.lever_sigma_m[2] > 0.3
    assert turned.turn_sigma_rad[2] > 0.7 * fly(9).belief().heading_sigma_rad
    assert turned.turn_sigma_rad[:2].max() < math.radians(0.5)


def test_a_vehicle_at_rest_calibrates_nothing() -> None:
    """However long it stands: scatter of its attitude looks like tilts, but is not taken for them."""
    fit = fitted(fly(13, yaw_rad=0.0, tilt_rad=0.0, way_m=0.0))
    belief = fly(13).belief()
    np.testing.assert_allclose(fit.turn_sigma_rad, belief.turn_sigma_rad, rtol=0.05)
    np.testing.assert_allclose(fit.lever_sigma_m, belief.lever_sigma_m, rtol=0.05)
    assert fit.offset_sigma_s > 0.5 * belief.offset_sigma_s


def test_what_is_known_already_counts() -> None:
    """A lever arm that was measured with a ruler is kept where the motion says nothing about it."""
    flight = fly(10, yaw_rad=0.0, tilt_rad=0.0)
    measured = Belief(flight.camera_to_body.as_matrix(), flight.lever).trusting(math.radians(0.5), 0.004)
    fit = fit_mounting(flight.motion, flight.sightings, measured, USUAL)
    assert known(*fit.worst_sigmas)
    assert np.abs(fit.unknowns.lever - flight.lever).max() < 0.004
    assert fit.worst_sigmas[1] == pytest.approx(0.004, rel=0.05)


def test_flying_what_was_missing_makes_the_mounting_known() -> None:
    """What is promised comes: a second flight with the missing motion is known about as well as was expected."""
    found = missing(fitted(fly(11, yaw_rad=1.0, tilt_rad=0.005)))
    assert found is not None
    assert found.enough
    assert found.motions == ("tilt",)
    fit = fitted(fly(11, yaw_rad=1.0, tilt_rad=math.radians(15.0)))
    assert known(*fit.worst_sigmas)
    assert found.lever_sigma_m == pytest.approx(fit.worst_sigmas[1], rel=0.5)


def test_a_motion_that_is_missing_is_told_in_words() -> None:
    """With what would be reached."""
    text = Missing(("turn", "tilt"), math.radians(0.5), 0.031).text
    assert "about the vertical, and roll" in text
    assert "0.5 deg and 3.1 cm" in text
    assert "longer" not in text
    assert "longer" in Missing(("turn",), math.radians(0.5), 0.3).text


def test_too_few_sightings_are_refused() -> None:
    """Also those that were seen while the vehicle told nothing of its motion."""
    flight = fly(12, duration_s=10.0)
    with pytest.raises(UasflyError, match=r"at least 30 sightings.*found 20 of 20"):
        fit_mounting(flight.motion, flight.sightings.part(np.arange(20)), flight.belief())
    gone = replace(flight.sightings, time_s=flight.sightings.time_s + 100.0)
    with pytest.raises(UasflyError, match="found 0 of"):
        fit_mounting(flight.motion, gone, flight.belief())
