"""Vehicle time to host time, from TIMESYNC exchanges whose round trips vary."""

from __future__ import annotations

import math
from collections import deque

# A quartz drifts by 50e-6. PX4's simulator runs up to 5 % slow on a busy host, and changes its pace within a second.
STAMP_SIGMA_S = 3e-4  # time stamps of an undisturbed exchange
DRIFT_SIGMA = 0.03  # initial standard deviation of the clocks' relative drift
DRIFT_DENSITY_STEADY = 1e-4  # [1/sqrt(s)]
DRIFT_DENSITY_UNSTEADY = 5e-3  # [1/sqrt(s)]
GATE_SIGMAS = 5.0
GATE_FLOOR_S = 30e-3
SURPRISE_S = 2e-3  # a residual above this means that the pace has changed
STEADY_EXCHANGES = 20  # in a row without surprise: enough for the smallest round trips and the drift
STEP_COUNT = 3  # consecutive exchanges outside the gate mean that a clock has stepped
FLOOR_WINDOW = 64  # exchanges among which the smallest round trip counts as undisturbed

REBOOT_STEP_S = 1.0
REBOOT_COUNT = 3
OLDEST_SAMPLE_S = 60.0  # a process that was stopped finds old samples in its buffers: they must not pass for new ones


class ClockMap:
    """Maps the vehicle's clock to the host's: host = vehicle + offset + drift * (vehicle - epoch).

    A Kalman filter over [offset, drift]. An exchange measures the offset as (sent + received) / 2 - vehicle time;
    what its round trip takes beyond the smallest recent one may lie on either leg: half of that is its standard
    deviation. The drift is taken as all but constant until an exchange comes as a surprise.
    Three consecutive exchanges far outside restart the filter: one of the clocks has stepped.
    """

    def __init__(self) -> None:
        self.restarts = 0
        self._exchanges = 0
        self._outside = 0
        self._round_trips: deque[float] = deque(maxlen=FLOOR_WINDOW)
        self._epoch_s = self._offset_s = self._drift = 0.0
        self._p_offset = self._p_cross = self._p_drift = 0.0
        self._calm = 0
        self._newest_s = -math.inf
        self._behind = 0

    @property
    def synchronised(self) -> bool:
        """Whether at least one exchange has been answered since the start or the last restart."""
        return self._exchanges > 0

    @property
    def exchanges(self) -> int:
        """Exchanges since the start or the last restart."""
        return self._exchanges

    @property
    def steady(self) -> bool:
        """Whether the last 20 exchanges came out as predicted: the clocks' relative pace is known."""
        return self._calm >= STEADY_EXCHANGES

    @property
    def offset_s(self) -> float | None:
        """Host time minus vehicle time [s] at the last exchange, None before the first."""
        return self._offset_s if self._exchanges else None

    @property
    def drift(self) -> float:
        """Change of the offset per second of vehicle time."""
        return self._drift

    @property
    def offset_sigma_s(self) -> float:
        """Standard deviation of the offset [s] as the filter sees it; inf before the first exchange."""
        return math.sqrt(self._p_offset) if self._exchanges else math.inf

    @property
    def round_trip_s(self) -> float:
        """Smallest recent round trip [s]; NaN before the first exchange."""
        return min(self._round_trips, default=math.nan)

    def exchange(self, sent_s: float, vehicle_s: float, received_s: float) -> None:
        """Take one exchange: sent and received on the host's clock, answered in between on the vehicle's."""
        round_trip = received_s - sent_s
        if round_trip < 0.0:
            return
        self._round_trips.append(round_trip)
        measured = 0.5 * (sent_s + received_s) - vehicle_s
        excess = 0.5 * (round_trip - min(self._round_trips))
        variance = STAMP_SIGMA_S**2 + excess * excess
        if not self._exchanges:
            self._begin(vehicle_s, measured, variance)
            return
        self._predict(vehicle_s)
        residual = measured - self._offset_s
        total = self._p_offset + variance
        if abs(residual) > GATE_SIGMAS * math.sqrt(total) + GATE_FLOOR_S:
            self._outside += 1
            self._calm = 0
            if self._outside >= STEP_COUNT:
                self.restart()
                self._begin(vehicle_s, measured, variance)
            return
        self._outside = 0
        self._exchanges += 1
        self._calm = self._calm + 1 if abs(residual) - excess < SURPRISE_S else 0
        self._correct(residual, total)

    def restart(self) -> None:
        """Forget everything: the vehicle has a new clock."""
        self.restarts += 1
        self._exchanges = self._outside = self._calm = self._behind = 0
        self._round_trips.clear()
        self._newest_s = -math.inf

    def watch(self, vehicle_s: float) -> bool:
        """Look at a time of the vehicle's clock that should only rise; restarts when it has gone back.

        Returns:
            Whether the vehicle has restarted: three times in a row its clock was more than 1 s behind.
        """
        if vehicle_s >= self._newest_s - REBOOT_STEP_S:
            self._newest_s = max(vehicle_s, self._newest_s)
            self._behind = 0
            return False
        self._behind += 1
        if self._behind < REBOOT_COUNT:  # one late packet is not a reboot
            return False
        self.restart()
        self._newest_s = vehicle_s
        return True

    def to_host(self, vehicle_s: float, arrival_s: float) -> float:
        """Host time [s] at which the vehicle's clock showed `vehicle_s`, for a message that arrived at `arrival_s`.

        Arrival time where nothing better is known: before the first exchange, and for times that cannot be
        the vehicle's clock (older than a minute). Never later than the arrival.
        """
        if not self._exchanges:
            return arrival_s
        host_s = vehicle_s + self._offset_s + self._drift * (vehicle_s - self._epoch_s)
        if not arrival_s - OLDEST_SAMPLE_S <= host_s <= arrival_s:
            return arrival_s
        return host_s

    def to_vehicle(self, host_s: float) -> float:
        """Vehicle time [s] of a host time; 0 before the first exchange."""
        if not self._exchanges:
            return 0.0
        elapsed = (host_s - self._offset_s - self._epoch_s) / (1.0 + self._drift)
        return self._epoch_s + elapsed

    def _begin(self, vehicle_s: float, measured_s: float, variance: float) -> None:
        self._epoch_s, self._offset_s, self._drift = vehicle_s, measured_s, 0.0
        self._p_offset, self._p_cross, self._p_drift = variance, 0.0, DRIFT_SIGMA**2
        self._exchanges = 1

    def _predict(self, vehicle_s: float) -> None:
        step = vehicle_s - self._epoch_s
        self._epoch_s = vehicle_s
        self._offset_s += self._drift * step
        self._p_offset += step * (2.0 * self._p_cross + step * self._p_drift)
        self._p_cross += step * self._p_drift
        density = DRIFT_DENSITY_STEADY if self.steady else DRIFT_DENSITY_UNSTEADY
        self._p_drift += density**2 * abs(step)

    def _correct(self, residual_s: float, total: float) -> None:
        gain_offset, gain_drift = self._p_offset / total, self._p_cross / total
        self._offset_s += gain_offset * residual_s
        self._drift += gain_drift * residual_s
        self._p_drift -= gain_drift * self._p_cross
        self._p_cross -= gain_offset * self._p_cross
        self._p_offset -= gain_offset * self._p_offset
