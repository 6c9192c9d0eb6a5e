"""The error-state Kalman filter as the flight sees it: samples in at their own times, an estimate out at any time.

Kalaitzakis & Vitzilaios 2023, section 2.3, with the measurements put where they belong in time.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import Airframe
from uasfly.frames import rotation_matrix
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    FlightMode,
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
from uasfly.observer.accelerometer import BiasWatch
from uasfly.observer.agreement import Agreement
from uasfly.observer.clock_watch import JUMP_AHEAD_S, ClockWatch
from uasfly.observer.contact import LIGHT_M_S2, GroundContact
from uasfly.observer.counters import Counters
from uasfly.observer.diagnosis import Diagnosis, Journal
from uasfly.observer.door import Odometry, Sighting, checked_accelerometer, checked_odometry, checked_sighting
from uasfly.observer.expected import expected_marker
from uasfly.observer.glide import Glide
from uasfly.observer.gnss import DriftWatch, Outage
from uasfly.observer.moment import Moment, Verdict
from uasfly.observer.moved import MoveWatch
from uasfly.observer.rotors import RotorThrust
from uasfly.observer.sightings import MarkerEstimate, SightingLog, marker_estimate
from uasfly.observer.step import Stepper, hover_thrust_history
from uasfly.observer.timeline import Timeline

OWN_COMMAND_S = 0.5  # for this long after a command of ours in offboard, PX4's attitude target is only its echo
SILENT_AFTER_S = 0.15  # without odometry for this long estimates are predicted with their uncertainty,
TICK_BEHIND_S = 0.1  # and the filter itself to this long before now
FELT_WITHIN_S = 0.06  # of where the filter stands: an accelerometer's sample further away says nothing
LONGEST_GAP_S = 5.0  # a longer gap is not bridged: the filter starts again
EXPECTED_WITHIN_S = 0.5  # of where the filter stands: beyond it nothing is said about where a marker is to be seen
GLIDE_AFTER_S, GLIDE_FOR_S = 1.0, 5.0  # without a sighting for so long, what the next ones correct is told gradually
THRUST_SHOWS_S = 0.05  # in the velocity, over so long: for what carries the vehicle
FORCE_SHOWS_S = 0.5  # the force is what thrust left over in about so long


class Observer:
    """Estimates position, velocity, attitude, wind force, GNSS bias and marker poses.

    The filter stands at the newest measurement; `estimate` extrapolates from there by the model alone, which costs next
    to nothing. A measurement that comes late is put in where it belongs and the filter runs again from there.

    Args:
        airframe: model and noise.
        prepared_markers: for how many markers the functions are compiled at once; more are generated in flight when
            seen, which takes some tenths of a second each.

    Attributes:
        counters: what was refused. statistics: of the last innovation, by sensor.
        retakes_moved: whether a marker that has been moved is forgotten here, and taken anew where it is seen then; it
            is otherwise left to whoever flies by it (`marker`, `trust`, `forget`).
    """

    def __init__(self, airframe: Airframe, prepared_markers: int = 0) -> None:
        self.counters = Counters()
        self.statistics: dict[str, tuple[float, int]] = {}  # sensor: last normalised innovation squared, its dof
        self._thrust = hover_thrust_history(airframe)
        self._rotors = RotorThrust(airframe, self._thrust)
        self._turns = airframe.model.hover_rotor_rad_s is not None
        self._stepper = Stepper(airframe, self._rotors if self._turns else self._thrust)
        for markers in range(1, prepared_markers + 1):
            self._stepper.prepare(markers, in_flight=False)
        self._k_thrust_m_s2 = airframe.model.k_thrust_m_s2
        self._timeline: Timeline | None = None
        self._journal = Journal()
        self._sightings = SightingLog()
        self._drift = DriftWatch(airframe.observer.gnss_bias_density)
        self._agreement = Agreement()
        self._glide = Glide()
        self._contact = GroundContact()
        self._regained_s = -math.inf
        self._moves = MoveWatch()
        self.retakes_moved = False
        self._outage = Outage(airframe.observer.velocity_sigma_m_s)
        self._bias = BiasWatch()
        self._feels = airframe.observer.accelerometer_sigma_m_s2 is not None
        self._in_air = False
        self._in_air_s = -math.inf
        self._own_command_s = -math.inf
        self._clock = ClockWatch()

    def add(self, sample: Sample) -> None:
        """Take in a sample, whenever it comes; kinds that say nothing about the state are ignored."""
        if isinstance(sample, OdometrySample):
            odometry = checked_odometry(sample)
            if odometry is None or not odometry.complete:
                self.counters.non_finite += 1
            if odometry is not None:
                self._look_for_contact(odometry)
                self._bias.move(odometry)
                self._measure(self._outage.usable(odometry) if self._in_air and self._outage.active else odometry)
        elif isinstance(sample, AccelerometerSample):
            self._feel(sample)
        elif isinstance(sample, RotorSample):
            self._turn(sample)
        elif isinstance(sample, MarkerSample):
            sighting = checked_sighting(sample)
            if sighting is None:
                self.counters.non_finite += 1
            else:
                self._measure(sighting)
        elif isinstance(sample, AttitudeTargetSample):
            if abs(sample.time_s - self._own_command_s) > OWN_COMMAND_S:
                self._command(sample.time_s, sample.thrust)
        elif isinstance(sample, HealthSample):
            self._outage.hear(sample)
        elif isinstance(sample, VehicleSample):
            self._hear(sample)

    def sent(self, setpoint: Setpoint, in_offboard: bool) -> None:
        """A setpoint left at its `time_s`; it drives the model only while PX4 follows it (`in_offboard`)."""
        if in_offboard and self._command(setpoint.time_s, setpoint.thrust):
            self._own_command_s = setpoint.time_s

    def set_k_thrust(self, k_thrust_m_s2: float) -> None:
        """Thrust acceleration at full thrust [m/s^2], for commands from now on (it falls with the battery)."""
        if math.isfinite(k_thrust_m_s2) and k_thrust_m_s2 > 0.0:
            self._k_thrust_m_s2 = k_thrust_m_s2
        else:
            self.counters.non_finite += 1

    def correct_thrust(self, commands: float, rotors: float = 1.0) -> None:
        """Commands and rotors so far gave so many times the thrust reckoned with; the force makes up for what acts.

        Thrust and force together, and with them motion and attitude, stay what they were: nothing is learnt again.
        Commands to come go by `set_k_thrust`, as ever.
        """
        timeline = self._timeline
        if timeline is not None:
            now_s = timeline.newest.time_s
            ratio = rotors if self._rotors.fresh(now_s) else commands
            more = (ratio - 1.0) * self._rotors.mean(now_s - FORCE_SHOWS_S, now_s)
            up_in_world = rotation_matrix(timeline.newest.packed[s.QUATERNION])[:, 2]
            timeline.shift_force(-more * up_in_world)
        self._rotors.rescale(commands, rotors)

    @property
    def rotor_ratio(self) -> float | None:
        """Thrust by rotor speeds over thrust by commands, over seconds; None where the filter flies by commands."""
        timeline = self._timeline
        return self._rotors.ratio if timeline is not None and self._rotors.fresh(timeline.newest.time_s) else None

    @property
    def rotor_excess_m_s2(self) -> float:
        """By how much the thrust is just now more than commanded, by the rotors; nil where that is not known."""
        return 0.0 if self.rotor_ratio is None else self._rotors.excess_m_s2

    def estimate(self, time_s: float) -> StateEstimate | None:
        """State at `time_s`; the sigmas are those of the newest measurement, or of `time_s` after SILENT_AFTER_S.

        Returns:
            None before the first odometry sample, and where the filter stands more than LONGEST_GAP_S back.
        """
        timeline = self._timeline
        if timeline is None or not time_s - timeline.newest.time_s < LONGEST_GAP_S:
            return None
        if time_s - timeline.newest.odometry_s > SILENT_AFTER_S:
            if time_s - timeline.newest.time_s > SILENT_AFTER_S:
                timeline.append(time_s - TICK_BEHIND_S, None, self._flies)
            moment, _ = self._stepper.advance(timeline.newest, time_s, None, self._flies)
            core = moment.packed[: s.CORE_NOMINAL].copy()
        else:
            moment = timeline.at(time_s)
            core = self._stepper.extrapolated(moment, max(time_s, moment.time_s))
        if self._glide.active(time_s):
            core[s.POSITION] += self._glide.offset(time_s)
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
        drift_m_s, agrees = self._drift.speed_m_s, self._agreement.agrees
        return self._journal.diagnose(time_s, moment, window_s, drift_m_s, agrees, self.counters.restarts)

    def expected(self, time_s: float, marker_id: int) -> MarkerPrediction | None:
        """Where a marker is to be seen at `time_s`; None where the filter does not know it, or stands far from then."""
        timeline = self._timeline
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
        return marker_estimate(moment, wanted, self._sightings.contradiction(wanted, time_s))

    def trust(self, marker_id: int, trusted: bool) -> None:
        """Whether sightings of a marker are used; where not, they are still looked at, see `marker`."""
        if trusted:
            self._stepper.distrusted.discard(marker_id)
        else:
            self._stepper.distrusted.add(marker_id)

    def forget(self, marker_id: int) -> None:
        """Take a marker out of the filter: its next sighting is the first."""
        if self._timeline is not None:
            self._timeline.forget(marker_id)
        self._sightings.forget(marker_id)

    def take_moved(self) -> list[tuple[int, float]]:
        """Markers that have been moved since the last call, and how far [m] each was away from its place."""
        return self._moves.take()

    @property
    def moment(self) -> Moment | None:
        """The filter where it stands (nominal state, markers, time); None before the first odometry sample."""
        return self._timeline.newest if self._timeline else None

    @property
    def accelerometer_bias(self) -> tuple[float, float]:
        """Bias of the accelerometer as learnt, along the body's x and y [m/s^2]."""
        return self._bias.x, self._bias.y

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

    def _hear(self, vehicle: VehicleSample) -> None:
        if not math.isfinite(vehicle.time_s):
            self.counters.non_finite += 1
        elif vehicle.time_s >= self._in_air_s:
            self._in_air, self._in_air_s = vehicle.in_air, vehicle.time_s
            if vehicle.mode is not FlightMode.OFFBOARD:
                self._own_command_s = -math.inf  # PX4 flies by its own target now

    @property
    def _flies(self) -> bool:
        return self._in_air and not self._contact.stands

    def _look_for_contact(self, odometry: Odometry) -> None:
        if self._in_air and odometry.use[s.VELOCITY_SENSOR]:
            thrust_m_s2 = self._thrust.newest_m_s2
            if thrust_m_s2 <= LIGHT_M_S2:
                thrust_m_s2 = self._thrust.mean(odometry.time_s - THRUST_SHOWS_S, odometry.time_s)
            self._contact.look(odometry.time_s, odometry.velocity[2], thrust_m_s2)

    def _command(self, time_s: float, thrust: float) -> bool:
        if not (math.isfinite(time_s) and math.isfinite(thrust)):
            self.counters.non_finite += 1
            return False
        self._thrust.add(time_s, self._k_thrust_m_s2 * min(max(thrust, 0.0), 1.0))
        return True

    def _measure(self, measured: Odometry | Sighting) -> None:
        """Put a measurement in its place in time."""
        timeline = self._timeline
        if timeline is None:
            self._start(measured)
            return
        time_s, newest_s = measured.time_s, timeline.newest.time_s
        if time_s > newest_s + JUMP_AHEAD_S and not self._clock.believes(time_s):
            self.counters.ahead += 1
            return
        self._clock.not_ahead()
        if time_s - newest_s > LONGEST_GAP_S:
            self._restart(measured)
        elif time_s < timeline.oldest.time_s:
            self.counters.dropped += 1
            if self._clock.was_set_back(time_s):
                self._restart(measured)
        elif timeline.holds(measured):
            self.counters.duplicates += 1
        else:
            self._clock.in_order()
            if isinstance(measured, Sighting):
                self._sight(timeline, measured)
            elif time_s >= newest_s:
                self._agreement.look(measured, timeline.newest.position_sigma_m)
                self._stepper.agrees = self._agreement.agrees
                verdicts = timeline.append(time_s, measured, self._flies)
                self._note(measured, verdicts)
                self._drift.look(measured, verdicts)
                self._stepper.bias_free = self._drift.runs_away
                self._journal.follow(time_s, timeline.newest)
            else:
                self.counters.late += 1
                self._note(measured, timeline.insert(measured))

    def _feel(self, sample: AccelerometerSample) -> None:
        """A sample of the accelerometer: used in the air, where the filter stands; it never moves the filter's time."""
        timeline = self._timeline
        if timeline is None or not (self._feels and self._flies):
            return
        felt = checked_accelerometer(sample)
        if felt is None:
            self.counters.non_finite += 1
            return
        felt = self._bias.corrected(felt)
        if felt is None:
            self.counters.rejected[s.ACCELEROMETER_SENSOR] += 1
            return
        behind_s = timeline.newest.time_s - felt.time_s
        if not abs(behind_s) < FELT_WITHIN_S or felt.time_s < timeline.oldest.time_s:
            self.counters.dropped += 1
        elif timeline.holds(felt):
            self.counters.duplicates += 1
        else:
            verdict = (timeline.insert(felt) if behind_s > 0.0 else timeline.append(felt.time_s, felt, True))[0]
            self.statistics[verdict.sensor] = (verdict.nis, verdict.dof)
            self.counters.rejected[verdict.sensor] += not verdict.accepted

    def _turn(self, sample: RotorSample) -> None:
        """A sample of the rotors: thrust of steps to come, where it belongs to the filter's time."""
        timeline = self._timeline
        if timeline is not None and self._turns:
            near = abs(timeline.newest.time_s - sample.time_s) < EXPECTED_WITHIN_S
            self.counters.non_finite += not (near and self._rotors.add(sample, self._flies))

    def _sight(self, timeline: Timeline, sighting: Sighting) -> None:
        """A sighting, mostly late; the first after a while may move the filter, and what is told then glides there."""
        before = timeline.newest
        if sighting.time_s >= before.time_s:
            verdicts = timeline.append(sighting.time_s, sighting, self._flies)
        else:
            self.counters.late += 1
            verdicts = timeline.insert(sighting)
        self._note(sighting, verdicts)
        after = timeline.newest
        if before.sighted_s and sighting.time_s - max(before.sighted_s) > GLIDE_AFTER_S:
            self._regained_s = sighting.time_s
        if sighting.time_s - self._regained_s < GLIDE_FOR_S:
            was = self._stepper.extrapolated(before, after.time_s)[s.POSITION]
            self._glide.stepped(after.time_s, after.packed[s.POSITION] - was)
        if self.retakes_moved and verdicts and self._moves.look(sighting.marker_id, verdicts[0]):
            self.forget(sighting.marker_id)

    def _start(self, measured: Odometry | Sighting) -> None:
        if isinstance(measured, Odometry) and measured.complete:
            self._timeline = Timeline(self._stepper, self._stepper.start(measured, self._flies))
            self._clock.in_order()

    def _restart(self, measured: Odometry | Sighting) -> None:
        if isinstance(measured, Odometry) and measured.complete:
            self.counters.restarts += 1
            self._start(measured)

    def _note(self, measured: Odometry | Sighting, verdicts: tuple[Verdict, ...]) -> None:
        time_s = measured.time_s
        for verdict in verdicts:
            if isinstance(measured, Sighting):
                self._sightings.note(time_s, measured.marker_id, verdict)
            self.statistics[verdict.sensor] = (verdict.nis, verdict.dof)
            self._journal.note(time_s, verdict)
            if not verdict.accepted:
                self.counters.rejected[verdict.sensor] += 1
