"""Trims the thrust of observer and controller, and tells when it is far from the airframe file's."""

from __future__ import annotations

import math
from dataclasses import replace

from uasfly.control.controller import Controller
from uasfly.control.thrust_trim import LIMIT, ROTOR_WALK_DENSITY, WALK_DENSITY, ThrustTrim
from uasfly.frames import rotation_matrix
from uasfly.messages import StateEstimate
from uasfly.observer.observer import Observer
from uasfly.wind_messages import WindEstimate

INTERVAL_S = 0.2
OFF_THE_GROUND_S = 3.0  # until then the ground carries a part, or the force still forgets that it did
SURE_SIGMA = 0.03  # of the trim, before anything is told
LESS_TOLD, MORE_TOLD = 0.1, 0.2  # wind across the rotors lifts: in 8 m/s the thrust is 7 % more on a sound vehicle
TOLD_AGAIN = 0.05
STILL_M_S = 2.0  # of airspeed: faster air across the rotors changes their thrust by more than half a percent


class TrimmedThrust:
    """The thrust trim of one flight.

    Where rotor speeds tell the thrust, they tell the commands' trim too, in seconds; the vertical force then says, over
    minutes of still air, what is wrong with the thrust by rotors. Without them it says that of the commands, in all
    air: wind across the rotors lifts, which then goes into the trim.

    Args:
        observer, controller: who reckon with it.

    Attributes:
        trim: share by which the thrust is more (negative: less) than the airframe file says for command and voltage.
        rotor_trim: the same for rotor speeds.
    """

    def __init__(self, observer: Observer, controller: Controller) -> None:
        self._observer, self._controller = observer, controller
        self._estimator = ThrustTrim()
        self._due_s = -math.inf
        self._flies = False
        self._told = 0.0
        self.trim = self.rotor_trim = self._taken = 0.0

    def step(self, time_s: float, estimate: StateEstimate | None, in_air: bool, wind: WindEstimate | None) -> str:
        """Before the observer is asked for `time_s`; frozen on the ground.

        Args:
            time_s: now.
            estimate: of the cycle before.
            in_air: whether the vehicle flies.
            wind: of the cycle before, None where it is not known.

        Returns:
            What is to be told; "" nearly always.
        """
        if in_air is not self._flies:
            self._flies = in_air
            self._estimator.lift_off()
            self._due_s = time_s + OFF_THE_GROUND_S
        if not in_air or estimate is None or time_s < self._due_s:
            return ""
        self._due_s = time_s + INTERVAL_S - 1e-6
        ratio = self._observer.rotor_ratio
        before, rotors_before = self.trim, self.rotor_trim
        if ratio is None:
            trim = self._ask_force(time_s, estimate, before, WALK_DENSITY)
        else:
            if wind is not None and _fastest_air_m_s(estimate, wind) < STILL_M_S:
                self.rotor_trim = self._ask_force(time_s, estimate, rotors_before, ROTOR_WALK_DENSITY)
            share = (1.0 + before) * ratio * (1.0 + self.rotor_trim) / (1.0 + rotors_before)
            trim = min(max(share - 1.0, -LIMIT), LIMIT)
        if trim == before and self.rotor_trim == rotors_before:
            return ""
        self.trim, self._taken = trim, self._controller.trim_thrust(trim)
        self._observer.correct_thrust((1.0 + trim) / (1.0 + before), (1.0 + self.rotor_trim) / (1.0 + rotors_before))
        return self._tell(trim)

    def _ask_force(self, time_s: float, estimate: StateEstimate, trim: float, walk_density: float) -> float:
        """The trim of whichever thrust the observer has flown by, after one more estimate."""
        up, estimator = 2, self._estimator
        estimator.trim, estimator.walk_density = trim, walk_density
        return estimator.update(
            time_s,
            float(estimate.force_in_world[up]),
            float(estimate.force_sigma_m_s2[up]),
            float(estimate.velocity_in_world[up]),
        )

    def as_commanded(self, estimate: StateEstimate) -> StateEstimate:
        """The estimate for a controller that takes thrust for what it commands: what is missing of it is a force."""
        excess_m_s2 = self._observer.rotor_excess_m_s2
        if excess_m_s2 == 0.0:
            return estimate
        up_in_world = rotation_matrix(estimate.quaternion_body_to_world)[:, 2]
        return replace(estimate, force_in_world=estimate.force_in_world + excess_m_s2 * up_in_world)

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        """Thrust acceleration at full command [m/s^2], whatever of the trim the controller takes."""
        return self._controller.k_thrust_m_s2(battery_voltage_v) * (1.0 + self.trim) / (1.0 + self._taken)

    def _tell(self, trim: float) -> str:
        size = abs(trim)
        if size < max(LESS_TOLD if trim < 0.0 else MORE_TOLD, self._told) or self._estimator.sigma > SURE_SIGMA:
            return ""
        self._told = size + TOLD_AGAIN
        kind = "less" if trim < 0.0 else "more"
        return f"thrust is {size * 100.0:.0f} % {kind} than the airframe file says; payload, battery, propellers?"


def _fastest_air_m_s(estimate: StateEstimate, wind: WindEstimate) -> float:
    """Airspeed, or the strongest gust so far: in gusty air a lull is no time to learn."""
    (east, north), (vx, vy, _) = wind.velocity_in_world.tolist(), estimate.velocity_in_world.tolist()
    return max(math.hypot(east - vx, north - vy), wind.gust_m_s)
