"""The anemometer: wind now, its mean over ten seconds and its gusts, from velocity and attitude.

Fed with every odometry sample, which is only kept; five times a second those since then are looked at together. How
much the wind changes is not known beforehand: the force's own changes over a second tell it, and choose the kernel.
Velocity and attitude alone tell the wind of a third of a second ago; where an accelerometer feels the air, it is told
as it is just now.

The force is the thrust-free one of PX4's velocity and attitude, not the observer's state: that lags 0.12 s behind
gusts, is noisier in weak wind, and contains the thrust's errors times the tilt; its velocity lags behind gusts too. The
observer says which samples are to be believed, and how well the velocity is known.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import replace

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Limits, WindSettings
from uasfly.messages import AccelerometerSample, Array, OdometrySample, Sample, StateEstimate
from uasfly.wind.direct_kernel import LEVELS, direct_kernel, level_of
from uasfly.wind.drag_curve import DragCurve
from uasfly.wind.felt_force import LONGEST_GAP_S, FeltForce
from uasfly.wind.force_kernel import LAG_S, SAMPLES, STEP_S, WINDOW_S, ForceKernel, kernels
from uasfly.wind.from_force import Pair, Uncertainty, air_relative, wind_covariance
from uasfly.wind.thrust_free import impulses, slopes, thrust
from uasfly.wind_messages import WindEstimate

INTERVAL_S = 0.2
MEAN_S = 10.0
LEAST_MEAN_S = 1.0  # of wind, before anything is told
GUST_S = 3.0  # WMO-No. 8: the gust is the largest mean over 3 s,
GUST_WINDOW_S = 600.0  # here of the last ten minutes (ICAO Annex 3)
LONGEST_PAUSE_S = 0.3  # between samples; after a longer one the meter starts again
SHORTEST_STEP_S = 1e-3
BELIEVED_M_S = 0.5  # a velocity farther from the estimate than this, and three sigmas, is an error of PX4's
UNKNOWN_VELOCITY_M_S = 0.5  # with a velocity that is known no better the vehicle only believes what it knew of the wind
CONTRADICTION_M_S2 = 0.3  # accelerometer against motion, over the window: several times its bias and the tilt's error
CHANGE = 5  # intervals over which the force's change is looked at: a second
CHANGE_MEMORY_S = 5.0
FIRST_DENSITY = 0.5  # m/s^2/sqrt(s)
VERTICAL_SHARE = 0.5  # vertical over horizontal gusts near the ground (MIL-F-8785C at 2 m)
UNSTEADY_SHARE = 0.02  # of the airspeed, one axis: what true velocity and attitude leave open in Dryden gusts
IN_MEAN = 0.3  # what is left of errors as long as gusts, a second, in the mean of ten
_GUST_BIN = 10  # intervals: of two seconds only the strongest gust is kept


class WindMeter:
    """Wind from the estimates of a flying vehicle.

    Args:
        settings: identified drag and its sigmas.
        limits: tilt and thrust, for what can be held.
        feels: whether the accelerometer is used, where there is one: with it the wind is told as it is now.
    """

    def __init__(self, settings: WindSettings, limits: Limits, feels: bool = True) -> None:
        self._feels = feels
        self._settings = settings
        self._limits = limits
        self._curve = DragCurve(settings.drag_1_s, settings.drag_1_m)
        self._kernels = kernels()
        if feels:  # here, not in flight
            for kernel, level in itertools.product(self._kernels, range(LEVELS)):
                direct_kernel(kernel.density, level)
        self._steps = np.log2([kernel.density for kernel in self._kernels])
        self._arrived: list[OdometrySample] = []
        self._fresh: list[OdometrySample] = []
        self._felt = FeltForce()
        self._latest: WindEstimate | None = None
        self._next_s = -math.inf
        self._begin()

    def add(self, sample: Sample) -> None:
        """Take in a sample, before the step of its cycle; kinds that say nothing of the wind are ignored."""
        if isinstance(sample, OdometrySample):
            self._arrived.append(sample)
        elif self._feels and isinstance(sample, AccelerometerSample):
            self._felt.add(sample)

    def step(
        self, time_s: float, estimate: StateEstimate | None, in_air: bool, k_thrust_m_s2: float
    ) -> WindEstimate | None:
        """The wind, renewed five times a second; None on the ground and until it is known.

        Args:
            time_s: now.
            estimate: the observer's, for now.
            in_air: whether the vehicle flies.
            k_thrust_m_s2: thrust acceleration at full thrust.
        """
        if not in_air or estimate is None:
            self._arrived.clear()
            self._felt.forget()
            if self._fresh or self._latest is not None:
                self._begin()
            return None
        self._sort_out(estimate)
        if time_s >= self._next_s:
            due_s = self._next_s + INTERVAL_S
            self._next_s = due_s if due_s > time_s else time_s + INTERVAL_S
            self._latest = self._look(estimate, k_thrust_m_s2)
        return self._latest

    def _begin(self) -> None:
        """Forget all but how much the wind changes."""
        self._fresh.clear()
        self._newest_s = -math.inf
        self._latest = None
        self._felt.forget()
        self._times: Array = np.empty(0)  # of the last seconds: time, integral of the force, slope, velocity
        self._integral: Array = np.empty((0, 2))
        self._slopes: Array = np.empty((0, 2))
        self._velocities: Array = np.empty((0, 3))
        self._density = FIRST_DENSITY
        self._forces: deque[tuple[float, float]] = deque(maxlen=CHANGE + 1)
        self._winds: deque[tuple[float, float]] = deque(maxlen=round(MEAN_S / INTERVAL_S))
        self._gusts: deque[float] = deque(maxlen=round(GUST_WINDOW_S / INTERVAL_S / _GUST_BIN))
        self._looks = 0

    def _look(self, estimate: StateEstimate, k_thrust_m_s2: float) -> WindEstimate | None:
        """Work off the samples since the last time."""
        worst = max(estimate.velocity_sigma_m_s.tolist())
        if not worst < UNKNOWN_VELOCITY_M_S:
            self._begin()
            return None
        self._take()
        if not len(self._times) or estimate.time_s - float(self._times[-1]) > LONGEST_PAUSE_S:
            self._begin()
            return None
        end_s = float(self._times[-1])
        if end_s - float(self._times[0]) < WINDOW_S:
            return None
        kernel = self._kernels[int(np.abs(self._steps - math.log2(self._density)).argmin())]
        up_h = float(kernel.weights @ self._on_grid(self._velocities[:, 2], end_s))
        then_s, force, variance = self._force_now(end_s, kernel.density) or self._force_then(end_s, kernel)
        index = int(np.searchsorted(self._times, then_s))
        east_s, north_s = self._slopes[index].tolist()
        east_v, north_v, up_v = self._velocities[index].tolist()
        slope = (east_s, north_s)
        curve = self._curve.under_thrust(thrust(up_h, slope))
        (east, north), speed = air_relative(force, slope, up_v, curve)
        self._follow_changes(force)
        self._winds.append((east + east_v, north + north_v))
        self._looks += 1
        if len(self._winds) * INTERVAL_S < LEAST_MEAN_S:
            return None
        return self._tell(then_s, force, slope, speed, worst, variance, k_thrust_m_s2)

    def _force_now(self, end_s: float, density: float) -> tuple[float, Pair, float] | None:
        """Time, force and its variance at the accelerometer's newest sample; None where it tells too little."""
        newest_s = self._felt.newest_s(end_s)
        level = None if newest_s is None else level_of(self._felt.sigma_m_s2(density))
        if newest_s is None or level is None or newest_s - WINDOW_S < self._times[0]:
            return None
        kernel, felt = direct_kernel(density, level), self._felt.up_to(newest_s)
        integral = np.column_stack([self._on_grid(self._integral[:, axis], newest_s) for axis in range(2)])
        if np.abs(felt.mean(axis=0) - (integral[-1] - integral[0]) / WINDOW_S).max() > CONTRADICTION_M_S2:
            return None
        east, north = (kernel.of_integral @ integral + kernel.of_felt @ felt).tolist()
        return newest_s, (east, north), kernel.variance

    def _force_then(self, end_s: float, kernel: ForceKernel) -> tuple[float, Pair, float]:
        """The same LAG_S ago, without the accelerometer."""
        east, north = (float(kernel.weights @ self._on_grid(self._integral[:, axis], end_s)) for axis in range(2))
        return end_s - LAG_S, (east, north), kernel.variance

    def _on_grid(self, values: Array, end_s: float) -> Array:
        return np.asarray(np.interp(end_s - WINDOW_S + STEP_S * np.arange(SAMPLES), self._times, values))

    def _sort_out(self, estimate: StateEstimate) -> None:
        """Keep what follows in time and is near the estimate; after a pause begin again."""
        if not self._arrived:
            return
        east, north, up = estimate.velocity_in_world.tolist()
        bound = BELIEVED_M_S + 3.0 * max(estimate.velocity_sigma_m_s.tolist())
        for sample in self._arrived:
            x, y, z = sample.velocity_in_world.tolist()
            near = abs(x - east) < bound and abs(y - north) < bound and abs(z - up) < bound
            if not near or not math.isfinite(sum(sample.quaternion_body_to_world.tolist())):
                continue
            if not self._newest_s + SHORTEST_STEP_S < sample.time_s < estimate.time_s + LONGEST_PAUSE_S:
                continue
            if sample.time_s - self._newest_s > LONGEST_PAUSE_S:
                self._begin()
            self._newest_s = sample.time_s
            self._fresh.append(sample)
        self._arrived.clear()

    def _take(self) -> None:
        """Lengthen what is kept by the fresh samples."""
        fresh, self._fresh = self._fresh, []
        if not fresh:
            return
        times = np.array([sample.time_s for sample in fresh])
        velocities = np.array([sample.velocity_in_world for sample in fresh])
        quaternions = np.array([sample.quaternion_body_to_world for sample in fresh])
        slopes_of = slopes(quaternions)
        self._felt.take(times, quaternions)
        if len(self._times):
            times = np.concatenate((self._times[-1:], times))
            velocities = np.concatenate((self._velocities[-1:], velocities))
            slopes_of = np.concatenate((self._slopes[-1:], slopes_of))
        start = self._integral[-1:] if len(self._integral) else np.zeros((1, 2))
        integral = np.concatenate((start, start + np.cumsum(impulses(times, velocities, slopes_of), axis=0)))
        start_s = times[-1] - WINDOW_S - LONGEST_GAP_S  # what is felt may be so much behind
        keep = slice(max(0, int(np.searchsorted(self._times, start_s)) - 1), max(0, len(self._times) - 1))
        self._times = np.concatenate((self._times[keep], times))
        self._velocities = np.concatenate((self._velocities[keep], velocities))
        self._slopes = np.concatenate((self._slopes[keep], slopes_of))
        self._integral = np.concatenate((self._integral[keep], integral))

    def _follow_changes(self, force: tuple[float, float]) -> None:
        """Density of the force's walk from its change over a second, forgetting."""
        self._forces.append(force)
        if len(self._forces) > CHANGE:
            east, north = self._forces[0]
            squared = 0.5 * ((force[0] - east) ** 2 + (force[1] - north) ** 2) / (CHANGE * INTERVAL_S)
            weight = INTERVAL_S / CHANGE_MEMORY_S
            self._density = math.sqrt(max((1.0 - weight) * self._density**2 + weight * squared, 1e-6))

    def _tell(
        self,
        time_s: float,
        force: tuple[float, float],
        slope: tuple[float, float],
        speed: float,
        velocity_sigma: float,
        force_variance: float,
        k_thrust_m_s2: float,
    ) -> WindEstimate:
        settings, curve = self._settings, self._curve
        winds = np.array(self._winds)
        mean = winds.mean(axis=0)
        variability = math.sqrt(float(winds.var(axis=0).mean()))
        vertical = VERTICAL_SHARE * variability
        sigma = Uncertainty(
            force_m_s2=math.sqrt(force_variance),
            velocity_m_s=velocity_sigma,
            tilt_rad=settings.tilt_sigma_rad,
            drag_share=settings.drag_sigma_share,
            vertical_m_s=vertical,
            unsteady_share=UNSTEADY_SHARE,
        )
        slow = replace(
            sigma,
            force_m_s2=0.0,
            velocity_m_s=0.0,
            vertical_m_s=vertical * IN_MEAN,
            unsteady_share=UNSTEADY_SHARE * IN_MEAN,
        )
        east, north = mean.tolist()
        mean_speed = math.hypot(east, north)
        ratio = curve.ratio(mean_speed)
        mean_covariance = wind_covariance((ratio * east, ratio * north), slope, mean_speed, curve, slow)
        gust = self._gust(winds)
        holdable = self._holdable_force(k_thrust_m_s2)
        at_limit = self._steady_curve(holdable)
        along, across = _along_and_across(mean_covariance, east, north)
        known = mean_speed > math.sqrt(along)
        return WindEstimate(
            time_s=time_s,
            velocity_in_world=winds[-1],
            covariance=wind_covariance(force, slope, speed, curve, sigma),
            mean_in_world=mean,
            mean_covariance=mean_covariance,
            averaged_s=len(winds) * INTERVAL_S,
            mean_speed_m_s=mean_speed,
            mean_from_deg=math.degrees(math.atan2(-east, -north)) % 360.0 if known else math.nan,
            mean_speed_sigma_m_s=math.sqrt(along),
            mean_from_sigma_deg=math.degrees(math.sqrt(across) / mean_speed) if known else math.nan,
            gust_m_s=gust,
            variability_m_s=variability,
            holdable_m_s=at_limit.airspeed(holdable),
            margin=1.0 - at_limit.force(max(gust, mean_speed)) / holdable,
        )

    def _gust(self, winds: Array) -> float:
        east, north = winds[-round(GUST_S / INTERVAL_S) :].mean(axis=0).tolist()
        speed = math.hypot(east, north)
        if self._looks % _GUST_BIN == 0 or not self._gusts:
            self._gusts.append(speed)
        else:
            self._gusts[-1] = max(self._gusts[-1], speed)
        return max(self._gusts)

    def _holdable_force(self, k_thrust_m_s2: float) -> float:
        """Largest steady horizontal force [m/s^2] that tilt and thrust balance at a constant height."""
        strongest = k_thrust_m_s2 * self._limits.thrust_max
        by_thrust = math.sqrt(max(strongest**2 - GRAVITY_M_S2**2, 1e-6))
        return min(GRAVITY_M_S2 * math.tan(self._limits.tilt_rad), by_thrust)

    def _steady_curve(self, force_m_s2: float) -> DragCurve:
        """The curve while a horizontal force [m/s^2] is balanced."""
        return self._curve.under_thrust(math.hypot(GRAVITY_M_S2, force_m_s2))


def _along_and_across(covariance: Array, east: float, north: float) -> tuple[float, float]:
    """Variances along and across a vector; of none, the largest for both."""
    size = math.hypot(east, north)
    if size < 1e-9:
        largest = float(np.linalg.eigvalsh(covariance)[-1])
        return largest, largest
    (xx, xy), (_, yy) = covariance.tolist()
    e, n = east / size, north / size
    return e * e * xx + 2.0 * e * n * xy + n * n * yy, n * n * xx - 2.0 * e * n * xy + e * e * yy
