"""What the step has to say: the status of each cycle."""

from __future__ import annotations

import math

from uasfly.control.protocol import ControlResult
from uasfly.flight.course import NOT_BEGUN, Course
from uasfly.flight.marker_guide import MarkerGuide
from uasfly.flight.sequencer import Sequencer
from uasfly.flight.supervisor import Supervisor
from uasfly.flight.trimmed_thrust import TrimmedThrust
from uasfly.flight.view import VehicleView
from uasfly.messages import Array, Phase, StateEstimate, Status
from uasfly.wind_messages import WindEstimate


class Reporter:
    """Reports on one flight.

    Args:
        view, sequencer, course, supervisor, thrust: whom it asks; it takes the sequencer's announcements.
        guide: to the marker that the mission hangs on; None where it hangs on none.
    """

    def __init__(
        self,
        view: VehicleView,
        sequencer: Sequencer,
        course: Course,
        supervisor: Supervisor,
        thrust: TrimmedThrust,
        guide: MarkerGuide | None,
    ) -> None:
        self._view = view
        self._sequencer = sequencer
        self._course = course
        self._supervisor = supervisor
        self._thrust = thrust
        self._guide = guide
        self._leg_started = False

    def status(
        self,
        time_s: float,
        estimate: StateEstimate | None,
        reference: Array | None,
        wind: WindEstimate | None,
        control: ControlResult | None,
    ) -> Status:
        """The status at the end of a cycle.

        Args:
            time_s: now.
            estimate: for now, None where not known.
            reference: (3,) m, world: where the vehicle should be now, None where nobody has asked yet.
            wind: for now, None where not known.
            control: what the controller gave, None where it was not asked.
        """
        sequencer, course, view, supervisor = self._sequencer, self._course, self._view, self._supervisor
        in_legs = sequencer.phase is Phase.LEGS
        progress = course.progress(time_s) if in_legs or sequencer.phase is Phase.ENGAGE else NOT_BEGUN
        leg = progress.leg if in_legs else -1
        self._leg_started |= leg >= 0
        if not (in_legs and (course.begun or self._guide is not None)):
            reference = None
        elif reference is None:
            reference = course.place_at(time_s)
        announcements = tuple(sequencer.announcements)
        sequencer.announcements.clear()
        battery = view.battery
        return Status(
            time_s=time_s,
            phase=sequencer.phase,
            leg=leg,
            leg_started=self._leg_started and in_legs,
            progress=1.0 if sequencer.phase in (Phase.ENDING, Phase.DONE) else progress.share,
            estimate=estimate,
            reference_position_in_world=reference,
            fallback=control.fallback if control is not None else "",
            reason=sequencer.reason,
            announcements=announcements,
            mode=view.mode,
            armed=view.armed,
            battery_remaining=math.nan if battery is None else battery.remaining,
            battery_voltage_v=view.voltage_v or math.nan,
            telemetry_age_s=view.odometry_age_s(time_s),
            authority=None if estimate is None else supervisor.authority,
            alarms=() if estimate is None else supervisor.alarms,
            action=supervisor.action,
            pace=progress.pace if in_legs else 0.0,
            pilot_flies=sequencer.pilot_flies,
            marker_age_s=math.nan if self._guide is None else self._guide.age_s,
            waits_for="the marker" if in_legs and self._guide is not None and not course.begun else "",
            wind=wind,
            thrust_trim=self._thrust.trim,
        )
