"""The error-state Kalman filter as the flight sees it: samples in at their own times, an estimate out at any time.

Kalaitzakis & Vitzilaios 2023, section 2.3, with the measurements put where they belong in time.
"""

from __future__ import annotations

import numpy as np

from uasfly.airframe import Airframe
from uasfly.frames import rotation_matrix
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    HealthSample,
    MarkerSample,
    OdometrySample,
    RotorSample,
    Sample,
    Setpoint,
    StateEstimate,
    VehicleSample,
)
from uasfly.observer import states as s
from uasfly.observer.counters import Counters
from uasfly.observer.diagnosis import Diagnosis
from uasfly.observer.door import checked_odometry, checked_sighting
from uasfly.observer.drive import Drive
from uasfly.observer.expected import expected_marker
from uasfly.observer.gnss import Outage
from uasfly.observer.intake import LONGEST_GAP_S, Intake
from uasfly.observer.moment import Moment
from uasfly.observer.moved import MoveWatch
from uasfly.observer.sightings import MarkerEstimate, marker_estimate
from uasfly.observer.step import Stepper

SILENT_AFTER_S = 0.15  # without odometry for this long estimates are predicted with their uncertainty,
TICK_BEHIND_S = 0.1  # and the filter itself to this long before now
EXPECTED_WITHIN_S = 0.5  # of where the filter stands: beyond it nothing is said about where a marker is to be seen


class Observer:
    """Estimates position, velocity, attitude, wind force, GNSS bias and marker poses.

    The filter stands at the newest measurement; `estimate` extrapolates from there by the model alone, which costs next
    to nothing. A measurement that comes late is put in where it belongs and the filter runs again from there.

    Args:
        airframe: model and noise.
        prepared_markers: for how many markers the functions are compiled at once; more are generated in flight when
            seen, which takes a tenth of a second each.

    Attributes:
        counters: what was refused. statistics: of the last innovation, by sensor: its normalised square, its dof.
        retakes_moved: whether a marker that has been moved is forgotten here, and taken anew where it is seen then; it
            is otherwise left to whoever flies by it (`marker`, `trust`, `forget`).
    """

    def __init__(self, airframe: Airframe, prepared_markers: int = 0) -> None:
        self.counters = Counters()
        self.retakes_moved = False
        self._drive = Drive(airframe, self.counters)
        self._stepper = Stepper(airframe, self._drive.thrust)
        for markers in range(1, prepared_markers + 1):
            self._stepper.prepare(markers, in_flight=False)
        self._intake = Intake(airframe, self._stepper, self._drive, self.counters)
        self.statistics = self._intake.statistics
        self._moves = MoveWatch()
        self._outage = Outage(airframe.observer.velocity_sigma_m_s)

    def add(self, sample: Sample) -> None:
        """Take in a sample, whenever it comes; kinds that say nothing about the state are ignored."""
        if isinstance(sample, OdometrySample):
            self._move(sample)
        elif isinstance(sample, AccelerometerSample):
            self._intake.feel(sample)
        elif isinstance(sample, RotorSample):
            if self._intake.timeline is not None:
                self._drive.turn(sample, self._intake.timeline.newest.time_s)
        elif isinstance(sample, MarkerSample):
            self._see(sample)
        elif isinstance(sample, AttitudeTargetSample):
            self._drive.hear_target(sample)
        elif isinstance(sample, HealthSample):
            self._outage.hear(sample)
        elif isinstance(sample, VehicleSample):
            self._drive.hear(sample)

    def sent(self, setpoint: Setpoint, in_offboard: bool) -> None:
        """A setpoint left at its `time_s`; it drives the model only while PX4 follows it (`in_offboard`)."""
        if in_offboard:
            self._drive.sent(setpoint)

    def set_k_thrust(self, k_thrust_m_s2: float) -> None:
        """Thrust acceleration at full thrust [m/s^2], for commands from now on (it falls with the battery)."""
        self._drive.set_k_thrust(k_thrust_m_s2)

    def correct_thrust(self, commands: float, rotors: float = 1.0) -> None:
        """Commands and rotors so far gave so many times the thrust reckoned with; the force makes up for what acts.

        Thrust and force together, and with them motion and attitude, stay what they were: nothing is learnt again.
        Commands to come go by `set_k_thrust`, as ever.
        """
        timeline = self._intake.timeline
        if timeline is not None:
            more = self._drive.missing_thrust(timeline.newest.time_s, commands, rotors)
            up_in_world = rotation_matrix(timeline.newest.packed[s.QUATERNION])[:, 2]
            timeline.shift_force(-more * up_in_world)
        self._drive.rescale(commands, rotors)

    @property
    def carried(self) -> bool:
        """Whether something else than the air has just carried the vehicle, although PX4 calls it in the air."""
        return self._drive.carried

    @property
    def rotor_ratio(self) -> float | None:
        """Thrust by rotor speeds over thrust by commands, over seconds; None where the filter flies by commands."""
        moment = self.moment
        return None if moment is None else self._drive.rotor_ratio(moment.time_s)

    @property
    def rotor_excess_m_s2(self) -> float:
        """By how much the thrust is just now more than commanded, by the rotors; nil where that is not known."""
        return 0.0 if self.rotor_ratio is None else self._drive.rotor_excess_m_s2

    def estimate(self, time_s: float) -> StateEstimate | None:
        """State at `time_s`; the sigmas are those of the newest measurement, or of `time_s` after SILENT_AFTER_S.

        Returns:
            None before the first odometry sample, and where the filter stands more than LONGEST_GAP_S back.
        """
        timeline = self._intake.timeline
        if timeline is None or not time_s - timeline.newest.time_s < LONGEST_GAP_S:
            return None
        if time_s - timeline.newest.odometry_s > SILENT_AFTER_S:
            if time_s - timeline.newest.time_s > SILENT_AFTER_S:
                timeline.append(time_s - TICK_BEHIND_S, None, self._drive.flies)
            moment, _ = self._stepper.advance(timeline.newest, time_s, None, self._drive.flies)
            core = moment.packed[: s.CORE_NOMINAL].copy()
        else:
            moment = timeline.at(time_s)
            core = self._stepper.extrapolated(moment, max(time_s, moment.time_s))
        if self._intake.glide.active(time_s):
            core[s.POSITION] += self._intake.glide.offset(time_s)
        layout = moment.layout
        diagonal = slice(layout.covariance.start, layout.covariance.stop, layout.errors + 1)
        sigmas = np.sqrt(moment.packed[diagonal])
        return StateEstimate(
            time_s=time_s,
            position_in_world=core[s.POSITION],
            velocity_in_world=core[s.VELOCITY],
            quaternion_body_to_world=core[s.QUATERNION],
            angular_rate_in_body=np.array(moment.rate),
            force_in_world=core[s.FORCE],
            gnss_bias_in_world=core[s.BIAS],
            position_sigma_m=sigmas[s.D_POSITION],
            velocity_sigma_m_s=sigmas[s.D_VELOCITY],
            force_sigma_m_s2=sigmas[s.D_FORCE],
        )

    def diagnose(self, time_s: float, window_s: float = 1.0) -> Diagnosis:
        """What the filter thinks of its own work at `time_s`; the window [s] must be the same in every call.

        Raises:
            LookupError: before the first odometry sample.
        """
        moment = self.moment
        if moment is None:
            raise LookupError("the observer has nothing to diagnose before the first odometry sample")
        drift_m_s, agrees = self._intake.drift.speed_m_s, self._intake.agreement.agrees
        return self._intake.journal.diagnose(time_s, moment, window_s, drift_m_s, agrees, self.counters.restarts)

    def expected(self, time_s: float, marker_id: int) -> MarkerPrediction | None:
        """Where a marker is to be seen at `time_s`; None where the filter does not know it, or stands far from then."""
        timeline = self._intake.timeline
        if timeline is None or not abs(time_s - timeline.newest.time_s) < EXPECTED_WITHIN_S:
            return None
        moment = timeline.at(time_s)
        core = self._stepper.extrapolated(moment, max(time_s, moment.time_s))
        return expected_marker(moment, core, marker_id)

    def marker(self, time_s: float, marker_id: int | None = None) -> MarkerEstimate | None:
        """A marker as the filter has it, None where it does not know it; without an id the first that it has seen."""
        moment = self.moment
        if moment is None or not moment.markers:
            return None
        wanted = moment.markers[0] if marker_id is None else marker_id
        return marker_estimate(moment, wanted, self._intake.sightings.contradiction(wanted, time_s))

    def trust(self, marker_id: int, trusted: bool) -> None:
        """Whether sightings of a marker are used; where not, they are still looked at, see `marker`."""
        if trusted:
            self._stepper.distrusted.discard(marker_id)
        else:
            self._stepper.distrusted.add(marker_id)

    def forget(self, marker_id: int) -> None:
        """Take a marker out of the filter: its next sighting is the first."""
        self._intake.forget(marker_id)

    def take_moved(self) -> list[tuple[int, float]]:
        """Markers that have been moved since the last call, and how far [m] each was away from its place."""
        return self._moves.take()

    @property
    def moment(self) -> Moment | None:
        """The filter where it stands (nominal state, markers, time); None before the first odometry sample."""
        return self._intake.timeline.newest if self._intake.timeline else None

    @property
    def accelerometer_bias(self) -> tuple[float, float]:
        """Bias of the accelerometer as learnt, along the body's x and y [m/s^2]."""
        return self._intake.bias.x, self._intake.bias.y

    @property
    def covariance(self) -> Array:
        """Covariance (n, n) of the error state (states.D_*, then six a marker) where the filter stands.

        Raises:
            LookupError: before the first odometry sample.
        """
        moment = self.moment
        if moment is None:
            raise LookupError("the observer has no covariance before the first odometry sample")
        return moment.packed[moment.layout.covariance].reshape(moment.layout.errors, -1).copy()

    def _move(self, sample: OdometrySample) -> None:
        odometry = checked_odometry(sample)
        if odometry is None or not odometry.complete:
            self.counters.non_finite += 1
        if odometry is not None:
            drive, outage, intake = self._drive, self._outage, self._intake
            drive.look_for_contact(odometry)
            intake.bias.move(odometry)
            intake.measure(outage.usable(odometry) if drive.in_air and outage.active else odometry)

    def _see(self, sample: MarkerSample) -> None:
        sighting = checked_sighting(sample)
        if sighting is None:
            self.counters.non_finite += 1
            return
        verdicts = self._intake.measure(sighting)
        if self.retakes_moved and verdicts and self._moves.look(sighting.marker_id, verdicts[0]):
            self.forget(sighting.marker_id)
