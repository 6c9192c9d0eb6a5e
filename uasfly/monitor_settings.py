"""The mission file's section `monitors`: what is watched in flight, from which value on, and what is done about it.

Every monitor has a default, so that a mission without the section is watched too. A finding counts when it lasts
`after_s` and is over when it has been gone for `clear_s`; where it lasts `then_after_s` longer, `then` follows.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from uasfly.airframe import FileModel, NonNegative, Positive

ActionName = Literal["warn", "slow_down", "hold", "back_off", "end", "return", "land", "hand_over"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Seconds = Annotated[float, Field(ge=0.0, le=600.0)]


class Monitor(FileModel):
    """What every monitor has."""

    action: Annotated[ActionName, Field(description="what is done when it is found")] = "warn"
    after_s: Annotated[Seconds, Field(description="it must last so long to count")] = 0.5
    clear_s: Annotated[Seconds, Field(description="it must be gone so long to be over")] = 2.0
    then: Annotated[ActionName | None, Field(description="what follows where it lasts")] = None
    then_after_s: Annotated[Seconds, Field(description="time from action to then")] = 10.0


class TelemetryMonitor(FileModel):
    """Silence: without fresh odometry no setpoint leaves, whatever the action is."""

    stale_s: Annotated[float, Field(gt=0.05, le=0.5, description="older odometry stops the setpoints")] = 0.2
    resume_within_s: Annotated[Seconds, Field(description="after a longer silence the mission is not taken up")] = 5.0
    give_up_s: Annotated[Seconds, Field(description="after so long nobody waits for the vehicle any more")] = 60.0
    heartbeat_s: Annotated[Positive, Field(description="a longer silence of the heartbeat is told")] = 3.0

    @model_validator(mode="after")
    def _in_order(self) -> TelemetryMonitor:
        if not self.stale_s < self.resume_within_s <= self.give_up_s:
            raise ValueError(
                "stale_s, resume_within_s and give_up_s must grow in this order, found "
                f"{self.stale_s}, {self.resume_within_s} and {self.give_up_s}"
            )
        return self


class EstimateMonitor(Monitor):
    """The estimate is uncertain: away from the structure along the way it came (named future work of the paper)."""

    action: ActionName = "back_off"
    then: ActionName | None = "hand_over"
    position_sigma_m: Annotated[Positive, Field(description="largest axis, GNSS bias left out")] = 0.5
    velocity_sigma_m_s: Positive = 0.5
    window_s: Annotated[Positive, Field(description="window of the innovations")] = 1.0
    rejected_share: Annotated[Share, Field(description="of a sensor's measurements in the window")] = 0.5


class GnssLostMonitor(Monitor):
    """PX4 has no GNSS fix, or calls its position or velocity invalid.

    PX4 refuses its own landing once it has given up its position (5 s, EKF2_NOAID_TOUT), so the landing comes before.
    """

    action: ActionName = "hold"
    then: ActionName | None = "land"
    then_after_s: Seconds = 3.0


class GnssDegradedMonitor(Monitor):
    """GNSS is poor."""

    action: ActionName = "slow_down"
    after_s: Seconds = 2.0
    accuracy_m: Annotated[Positive, Field(description="PX4's horizontal accuracy")] = 3.0
    satellites: Annotated[int, Field(ge=0, le=40, description="fewer are too few")] = 6


class GnssJumpMonitor(Monitor):
    """The position from GNSS jumps while the velocity does not: taken as an error of GNSS."""

    action: ActionName = "hold"
    after_s: Seconds = 0.0
    clear_s: Seconds = 3.0
    jump_m: Positive = 1.0


class GnssDriftMonitor(Monitor):
    """The position from GNSS wanders off, against the velocity."""

    action: ActionName = "hold"
    after_s: Seconds = 1.5
    clear_s: Seconds = 3.0
    then: ActionName | None = "end"
    then_after_s: Seconds = 3.0
    rate_m_s: Annotated[Positive, Field(description="mean over a second")] = 0.6


class MarkerLostMonitor(Monitor):
    """The marker that the mission hangs on is not seen: GNSS and the model alone hold the vehicle in its frame."""

    action: ActionName = "hold"
    after_s: Annotated[Seconds, Field(description="since the last sighting")] = 5.0
    clear_s: Seconds = 1.0


class MarkerMovedMonitor(Monitor):
    """The marker is seen where it cannot be: it was moved, and is not flown after, as if it were lost."""

    after_s: Seconds = 0.3
    away_m: Annotated[Positive, Field(description="mean of the last sightings")] = 0.3
    turned_deg: Annotated[Positive, Field(description="mean of the last sightings")] = 15.0


class FenceMonitor(Monitor):
    """The vehicle is beyond the mission's limits; these bound the reference, so the vehicle has a margin."""

    action: ActionName = "end"
    margin_m: NonNegative = 0.5


class TrackingMonitor(Monitor):
    """The vehicle is far from its reference."""

    action: ActionName = "hold"
    after_s: Seconds = 1.0
    then: ActionName | None = "end"
    error_m: Positive = 1.0


class ContactMonitor(Monitor):
    """Something carries the vehicle on its way: the ground or a structure, where the height or the place is wrong.

    Flying on there would tip it over; PX4's landing finds the ground and disarms.
    """

    action: ActionName = "land"
    after_s: Annotated[Seconds, Field(description="beyond 0.15 s at rest with less thrust than half its weight")] = 0.0


class TiltMonitor(Monitor):
    """The vehicle tilts far beyond what it is ever asked to."""

    action: ActionName = "hand_over"
    after_s: Seconds = 0.2
    excess_deg: Annotated[Positive, Field(description="beyond the airframe's limit")] = 20.0


class BatteryMonitor(Monitor):
    """The battery is low: by charge, by voltage, or by the time that flying home and landing takes."""

    action: ActionName = "end"
    after_s: Seconds = 1.0
    warn_remaining: Share = 0.3
    remaining: Annotated[Share, Field(description="the action follows below")] = 0.2
    voltage_v: Annotated[Positive | None, Field(description="the action follows below, where given")] = None
    reserve: Annotated[Share, Field(description="charge that is to be left after landing at home")] = 0.1


class WindMonitor(Monitor):
    """The wind takes most of what tilt and thrust can give ("cannot hold", "cannot return")."""

    action: ActionName = "land"
    after_s: Seconds = 0.5
    warn_share: Annotated[Share, Field(description="of the authority, expected soon: told")] = 0.75
    share: Annotated[Share, Field(description="of the authority, expected soon: the action follows")] = 0.95


class SolverMonitor(Monitor):
    """The solver is late or fails: the backup flies."""

    action: ActionName = "end"
    after_s: Seconds = 0.0
    window_s: Positive = 2.0
    late_share: Annotated[Share, Field(description="of the steps in the window: told")] = 0.1
    backup_share: Annotated[Share, Field(description="of the steps in the window: the action follows")] = 0.5


class MonitorSettings(FileModel):
    """All monitors of a mission."""

    telemetry: TelemetryMonitor = TelemetryMonitor()
    estimate: EstimateMonitor = EstimateMonitor()
    gnss_lost: GnssLostMonitor = GnssLostMonitor()
    gnss_degraded: GnssDegradedMonitor = GnssDegradedMonitor()
    gnss_jump: GnssJumpMonitor = GnssJumpMonitor()
    gnss_drift: GnssDriftMonitor = GnssDriftMonitor()
    marker_lost: MarkerLostMonitor = MarkerLostMonitor()
    marker_moved: MarkerMovedMonitor = MarkerMovedMonitor()
    geofence: FenceMonitor = FenceMonitor()
    altitude: FenceMonitor = FenceMonitor()
    tracking: TrackingMonitor = TrackingMonitor()
    contact: ContactMonitor = ContactMonitor()
    tilt: TiltMonitor = TiltMonitor()
    battery: BatteryMonitor = BatteryMonitor()
    wind: WindMonitor = WindMonitor()
    solver: SolverMonitor = SolverMonitor()
    slow_pace: Annotated[float, Field(ge=0.1, le=1.0, description="pace of slow_down")] = 0.5
    back_off_m: Annotated[Positive, Field(description="way back along the path")] = 3.0
    longest_hold_s: Annotated[Seconds, Field(description="held longer, the mission ends")] = 60.0
