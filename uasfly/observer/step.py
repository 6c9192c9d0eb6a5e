"""One step of the filter, from one moment to the next: prediction, then whatever was measured there.

A pure function of the moment before, the measurement, and the thrust that acted in between, so that the history can be
run again when a measurement comes late.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from uasfly.airframe import Airframe
from uasfly.messages import Array
from uasfly.observer import functions
from uasfly.observer import states as s
from uasfly.observer.accelerometer import nothing_learnt
from uasfly.observer.door import Measurement, Odometry, Sighting, SpecificForce
from uasfly.observer.gusts import AS_CONFIGURED, Gusts
from uasfly.observer.markers import MarkerAlgebra
from uasfly.observer.moment import Moment, Verdict
from uasfly.observer.rotors import RotorThrust
from uasfly.observer.thrust import ThrustHistory
from uasfly.observer.update import SIGMA_FACTOR_MIN

MAX_STEP_S = 0.04  # longest single prediction; thrust is averaged over it
RATE_VALID_S = 0.15  # after this long without telemetry the turn of the vehicle is unknown
UNKNOWN_TURN_DENSITY = 0.3  # rad/s/sqrt(Hz), attitude noise while it is
GROUND_ACCELERATION_DENSITY = 1.0  # m/s^2/sqrt(Hz): on the ground the model knows no acceleration
INITIAL_FORCE_SIGMA = 1.0  # m/s^2, before anything is known of the wind (P0 of Kalaitzakis 2023)
# For this long after an accepted sighting the GNSS bias counts as observable: nothing but time makes position and bias
# less known, the velocity's integral beside the position with its bias tells how they part.
MARKER_FRESH_S = 20.0
MEAN_TIME_S = 0.25  # time constant of the mean innovation that tells a jump from noise
RUNAWAY_DENSITY = 0.5  # m/sqrt(s), walk of the GNSS bias while GNSS runs away
VERTICAL_VARIANCE = 1e6  # m^2/s^4: along the thrust the accelerometer is not used
GREATEST_VARIANCE = 1e4  # m^2/s^4, of the accelerometer: as good as not used
_NO_RATE = (0.0, 0.0, 0.0)
_GROUND_NOISE = (0.0,) * 3 + (GROUND_ACCELERATION_DENSITY**2,) * 3
SHORTEST_INTERVAL_S = 1e-3  # between samples
LONGEST_INTERVAL_S = 0.1  # a sample after a pause weighs no more in the matching than after this


class Stepper:
    """The steps of one airframe's filter.

    Args:
        airframe: model and noise.
        thrust: which thrust acts when.
    """

    def __init__(self, airframe: Airframe, thrust: ThrustHistory | RotorThrust) -> None:
        noise = airframe.observer
        self._thrust = thrust
        self._noise = noise
        self.bias_free = False  # whether GNSS runs away from everything else: its bias takes what it says
        self.agrees = True  # whether measured position and velocity tell the same motion
        self.distrusted: set[int] = set()  # markers whose sightings are looked at, but not used
        self._window_s = noise.matching_window_s
        self._correlations_s = (
            noise.attitude_correlation_s,
            noise.position_correlation_s,
            noise.velocity_correlation_s,
        )
        self._inputs = np.zeros(s.ACCELEROMETER_INPUTS)
        self._inputs[s.IN_DRAG] = airframe.model.drag_1_s
        self._inputs[s.IN_WANDER_RATE] = 1.0 / noise.wander_time_s
        self._inputs[s.IN_VELOCITY_WANDER_DENSITY] = 2.0 * noise.velocity_wander_m_s**2 / noise.wander_time_s
        self._inputs[s.IN_ATTITUDE_WANDER_DENSITY] = 2.0 * noise.attitude_wander_rad**2 / noise.wander_time_s
        self._inputs[s.IN_VARIANCE] = (
            noise.attitude_sigma_rad**2,
            noise.position_sigma_m**2,
            noise.velocity_sigma_m_s**2,
        )
        self._outputs = np.empty(s.ODOMETRY_OUTPUTS)
        self._least_variance = (SIGMA_FACTOR_MIN * (noise.accelerometer_sigma_m_s2 or 0.0)) ** 2
        self._force_outputs = np.empty(s.ACCELEROMETER_OUTPUTS)
        self._accelerometer_steps: dict[int, functions.Caller] = {}
        self._predictions: dict[int, functions.Caller] = {}
        self._odometry_steps: dict[int, functions.Caller] = {}
        self._extrapolation = functions.Caller(functions.compiled_extrapolation())
        self._marker_algebra = MarkerAlgebra()
        self.prepare(0, in_flight=False)

    def prepare(self, markers: int, in_flight: bool) -> None:
        """Have the functions for `markers` markers ready.

        Args:
            markers: how many.
            in_flight: takes some tenths of a second; otherwise they are compiled, which may take some seconds.
        """
        if markers not in self._predictions:
            generated = functions.steps(markers) if in_flight else functions.compiled_steps(markers)
            calls = [functions.Caller(step) for step in generated]
            self._predictions[markers], self._odometry_steps[markers], self._accelerometer_steps[markers] = calls

    def start(self, odometry: Odometry, airborne: bool) -> Moment:
        """The first moment, from a complete odometry sample: force, GNSS bias and wanders zero.

        The bias starts as exactly zero: the world frame is PX4's local frame as it lies at this moment, and the bias is
        how far GNSS has drifted since.
        """
        layout = s.Layout(0)
        variances = self._inputs[s.IN_VARIANCE].tolist()
        packed = np.zeros(layout.size)
        packed[s.POSITION] = odometry.position
        packed[s.VELOCITY] = odometry.velocity
        packed[s.QUATERNION] = odometry.quaternion
        diagonal = np.zeros(s.CORE_ERROR)
        diagonal[s.D_POSITION] = variances[s.POSITION_SENSOR]
        diagonal[s.D_VELOCITY] = variances[s.VELOCITY_SENSOR]
        diagonal[s.D_ATTITUDE] = variances[s.ATTITUDE_SENSOR]
        diagonal[s.D_FORCE] = INITIAL_FORCE_SIGMA**2
        P = np.diag(diagonal)
        wanders = (
            (s.D_VELOCITY, s.D_VELOCITY_WANDER, self._noise.velocity_wander_m_s),
            (s.D_ATTITUDE, s.D_ATTITUDE_WANDER, self._noise.attitude_wander_rad),
        )
        for true, wander, sigma in wanders:  # what is measured is the sum of the two
            shared = sigma**2 * np.eye(3)
            P[true, true] += shared
            P[wander, wander] = shared
            P[true, wander] = P[wander, true] = -shared
        packed[layout.covariance] = P.ravel()
        packed[layout.matched] = np.concatenate([np.eye(3).ravel() * variance for variance in variances])
        rate, time_s = tuple(odometry.rate or (0.0, 0.0, 0.0)), odometry.time_s
        memory = nothing_learnt(self._noise.accelerometer_sigma_m_s2 or 0.0)
        return Moment(time_s, packed, (), (), airborne, rate, time_s, time_s, (), odometry, AS_CONFIGURED, memory)

    def advance(
        self, before: Moment, time_s: float, measured: Measurement | None, airborne: bool
    ) -> tuple[Moment, tuple[Verdict, ...]]:
        """The moment at `time_s` >= `before.time_s`, with what the gates said of the measurement there."""
        if airborne != before.airborne:
            before = replace(before, packed=_without_force(before), airborne=airborne, gusts=AS_CONFIGURED)
        if isinstance(measured, Odometry):
            return self._odometry(before, measured)
        if isinstance(measured, SpecificForce):
            return self._specific_force(before, measured)
        moved = replace(before, time_s=time_s, packed=self._predicted(before, time_s, before.rate), measured=measured)
        return self._sighting(moved, measured) if measured else (moved, ())

    def extrapolated(self, moment: Moment, time_s: float) -> Array:
        """Nominal core state (22,) at `time_s` >= `moment.time_s`, by the model alone."""
        result = np.empty(s.CORE_NOMINAL)
        self._prepare_prediction(moment, moment.time_s, time_s, moment.rate)
        self._extrapolation((moment.packed, self._inputs), (result,))
        return result

    def _prepare_prediction(self, moment: Moment, start_s: float, end_s: float, rate: tuple[float, ...]) -> None:
        known = end_s - moment.rate_s <= RATE_VALID_S
        noise = self._noise
        self._inputs[s.IN_MOTION] = (
            end_s - start_s,
            self._thrust.mean(start_s, end_s),
            *(rate if known else _NO_RATE),
            moment.airborne,
            max(noise.gnss_bias_density, RUNAWAY_DENSITY if self.bias_free else 0.0) ** 2,
            noise.attitude_density**2 if known else UNKNOWN_TURN_DENSITY**2,
            *(self._motion_noise(moment.gusts) if moment.airborne else _GROUND_NOISE),
        )

    def _motion_noise(self, gusts: Gusts) -> tuple[float, ...]:
        return gusts.motion_noise(self._noise.force_density, self._noise.acceleration_density)

    @staticmethod
    def _sees_a_marker(moment: Moment, time_s: float) -> bool:
        return any(time_s - sighted_s < MARKER_FRESH_S for sighted_s in moment.sighted_s)

    def _predicted(self, moment: Moment, time_s: float, rate: tuple[float, ...]) -> Array:
        """Packed state predicted to `time_s`, in steps of at most MAX_STEP_S."""
        packed, start_s = moment.packed, moment.time_s
        steps = math.ceil((time_s - start_s) / MAX_STEP_S)
        for step in range(steps):
            end_s = start_s + (time_s - start_s) / (steps - step)
            self._prepare_prediction(moment, start_s, end_s, rate)
            result = np.empty(packed.size)
            self._predictions[len(moment.markers)]((packed, self._inputs), (result,))
            packed, start_s = result, end_s
        return packed

    def _odometry(self, before: Moment, odometry: Odometry) -> tuple[Moment, tuple[Verdict, ...]]:
        time_s, inputs = odometry.time_s, self._inputs
        rate, measured_rate = before.rate, before.rate
        if odometry.rate is not None:
            (old_x, old_y, old_z), (x, y, z) = rate, odometry.rate
            rate, measured_rate = (0.5 * (old_x + x), 0.5 * (old_y + y), 0.5 * (old_z + z)), (x, y, z)
        steps = max(1, math.ceil((time_s - before.time_s) / MAX_STEP_S))
        last_s = time_s - (time_s - before.time_s) / steps
        packed = self._predicted(before, last_s, rate) if steps > 1 else before.packed
        self._prepare_prediction(before, last_s, time_s, rate)
        interval_s = max(time_s - before.odometry_s, SHORTEST_INTERVAL_S)
        counted_s = min(interval_s, LONGEST_INTERVAL_S)
        sees_a_marker = self._sees_a_marker(before, time_s)
        inputs[s.IN_MEASURED] = (
            *odometry.quaternion,
            *odometry.position,
            *odometry.velocity,
            *odometry.use,
            *self._factors(interval_s, odometry.velocity_factor),
        )
        inputs[s.IN_WEIGHTS] = (
            counted_s,
            self._matching_weight(counted_s),
            1.0 - math.exp(-counted_s / MEAN_TIME_S),
            self.bias_free or sees_a_marker,
            sees_a_marker,
            self.agrees,
        )
        result = np.empty(packed.size)
        self._odometry_steps[len(before.markers)]((packed, inputs), (result, self._outputs))
        nis, accepted = self._outputs[s.OUT_NIS].tolist(), self._outputs[s.OUT_ACCEPTED].tolist()
        verdicts = tuple(
            [
                Verdict(name, value, s.SENSOR_DOF, taken > 0.5)
                for name, value, taken, used in zip(s.SENSORS, nis, accepted, odometry.use, strict=True)
                if used
            ]
        )
        moment = Moment(
            time_s,
            result,
            before.markers,
            before.scales,
            before.airborne,
            measured_rate,
            time_s if odometry.rate is not None else before.rate_s,
            time_s,
            before.sighted_s,
            odometry,
            self._gusts(before, time_s, result, odometry),
            before.accelerometer,
        )
        return moment, verdicts

    def _specific_force(self, before: Moment, measured: SpecificForce) -> tuple[Moment, tuple[Verdict, ...]]:
        time_s, inputs, memory = measured.time_s, self._inputs, before.accelerometer
        steps = max(1, math.ceil((time_s - before.time_s) / MAX_STEP_S))
        last_s = time_s - (time_s - before.time_s) / steps
        packed = self._predicted(before, last_s, before.rate) if steps > 1 else before.packed
        self._prepare_prediction(before, last_s, time_s, before.rate)
        variance = min(max(memory.variance, self._least_variance), GREATEST_VARIANCE)
        inputs[s.IN_ACCELEROMETER] = (*measured.force, variance, variance, VERTICAL_VARIANCE)
        result = np.empty(packed.size)
        self._accelerometer_steps[len(before.markers)]((packed, inputs), (result, self._force_outputs))
        nis, accepted, sample = self._force_outputs.tolist()
        memory = memory.after(time_s, sample, self._window_s)
        verdict = Verdict(s.ACCELEROMETER_SENSOR, nis, s.SENSOR_DOF, accepted > 0.5)
        moment = Moment(  # `replace` would take four times as long
            time_s,
            result,
            before.markers,
            before.scales,
            before.airborne,
            before.rate,
            before.rate_s,
            before.odometry_s,
            before.sighted_s,
            measured,
            before.gusts,
            memory,
        )
        return moment, (verdict,)

    def _gusts(self, before: Moment, time_s: float, packed: Array, odometry: Odometry) -> Gusts:
        """What is known of the gusts after a step; a velocity that model and position deny says nothing of them."""
        denied = odometry.use[s.VELOCITY_SENSOR] and self._outputs[s.OUT_ACCEPTED][s.VELOCITY_SENSOR] < 0.5
        if not before.airborne or (denied and not self.agrees):
            return before.gusts
        x, y, z = packed[s.FORCE].tolist()
        return before.gusts.after(time_s, (x, y, z), self._noise.force_density)

    def _factors(self, interval_s: float, velocity_factor: float) -> tuple[float, ...]:
        """Factors on the variances of attitude, position and velocity."""
        attitude_s, position_s, velocity_s = self._correlations_s
        return (
            correlation_factor(interval_s, attitude_s),
            correlation_factor(interval_s, position_s),
            correlation_factor(interval_s, velocity_s) * velocity_factor,
        )

    def _sighting(self, moment: Moment, sighting: Sighting) -> tuple[Moment, tuple[Verdict, ...]]:
        """The moment after the sighting; `moment` is already predicted to its time."""
        count = len(moment.markers)
        distrusted = sighting.marker_id in self.distrusted
        if sighting.marker_id not in moment.markers:
            if distrusted:
                return moment, ()
            self.prepare(count + 1, in_flight=True)
            grown = replace(
                moment,
                packed=self._marker_algebra.first_sight(moment.packed, count, sighting),
                markers=(*moment.markers, sighting.marker_id),
                scales=(*moment.scales, 1.0),
                sighted_s=(*moment.sighted_s, sighting.time_s),
            )
            return grown, ()
        index = moment.markers.index(sighting.marker_id)
        interval_s = min(sighting.time_s - moment.sighted_s[index], LONGEST_INTERVAL_S)
        result = self._marker_algebra.sighting(
            moment.packed, count, index, sighting, moment.scales[index], self._matching_weight(interval_s)
        )
        away, turned = result.innovation[:3], result.innovation[3:]
        verdict = Verdict(
            s.MARKER_SENSOR,
            result.nis,
            s.MARKER_DOF,
            result.accepted,
            math.sqrt(float(away @ away)),
            math.sqrt(float(turned @ turned)),
        )
        if distrusted:
            return moment, (verdict,)
        scales = (*moment.scales[:index], result.scale, *moment.scales[index + 1 :])
        updated = replace(moment, packed=result.packed, scales=scales)
        if result.accepted:
            sighted_s = (*moment.sighted_s[:index], sighting.time_s, *moment.sighted_s[index + 1 :])
            updated = replace(updated, sighted_s=sighted_s)
        return updated, (verdict,)

    def _matching_weight(self, interval_s: float) -> float:
        """Weight of a new innovation in an exponential mean with half the window as time constant."""
        return 1.0 - math.exp(-2.0 * interval_s / self._window_s)


def correlation_factor(interval_s: float, correlation_s: float) -> float:
    """Factor on the variance of samples whose errors are correlated in time, so that white noise carries as little.

    PX4's position and velocity are its own filter's output: at a higher rate the same errors are only told more often.
    With rho = exp(-interval / correlation time) samples of variance r tell as much of a mean as white ones of variance
    r (1 + rho) / (1 - rho). At rates beyond the correlation the information a second no longer depends on the rate.
    The gate and the matching keep to r itself, which is what innovations show.

    It is meant for correlations shorter than the filter's own memory (tenths of a second). The errors of PX4's estimate
    are slower (2 to 5 s in its own simulation, 0.1 mm and 0.5 mm/s from sample to sample): they look like motion, and
    taking them for noise would only blind the filter to the wind. For those leave the correlation at 0.
    """
    return 1.0 / math.tanh(0.5 * interval_s / correlation_s) if correlation_s > 0.0 else 1.0


def _without_force(moment: Moment) -> Array:
    """Packed state with the force forgotten: zero, its prior sigma, no correlation (take-off and landing)."""
    layout = moment.layout
    packed = moment.packed.copy()
    packed[s.FORCE] = 0.0
    P = packed[layout.covariance].reshape(layout.errors, layout.errors)
    P[s.D_FORCE, :] = 0.0
    P[:, s.D_FORCE] = 0.0
    P[s.D_FORCE, s.D_FORCE] = np.eye(3) * INITIAL_FORCE_SIGMA**2
    return packed
