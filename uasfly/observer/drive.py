"""What drives the model: the thrust that was commanded or that the rotors give, and whether the vehicle flies."""

from __future__ import annotations

import math

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.messages import AttitudeTargetSample, FlightMode, RotorSample, Setpoint, VehicleSample
from uasfly.observer import states as s
from uasfly.observer.contact import LIGHT_M_S2, GroundContact
from uasfly.observer.counters import Counters
from uasfly.observer.door import Odometry
from uasfly.observer.rotors import RotorThrust
from uasfly.observer.thrust import ThrustHistory

OWN_COMMAND_S = 0.5  # for this long after a command of ours in offboard, PX4's attitude target is only its echo
THRUST_SHOWS_S = 0.05  # in the velocity, over so long: for what carries the vehicle
FORCE_SHOWS_S = 0.5  # the force is what thrust left over in about so long
ROTORS_WITHIN_S = 0.5  # of where the filter stands: speeds further away have a wrong time


class Drive:
    """Collects what says how the vehicle is driven.

    Args:
        airframe: delay of commands, thrust at full command, number and hover speed of the rotors.
        counters: where unusable numbers are counted.

    Attributes:
        thrust: which acceleration along the body z axis acts when; for the filter's steps.
        in_air: whether PX4 says that the vehicle is in the air.
    """

    def __init__(self, airframe: Airframe, counters: Counters) -> None:
        self._counters = counters
        self._commands = hover_thrust_history(airframe)
        self._rotors = RotorThrust(airframe, self._commands)
        self._turns = airframe.model.hover_rotor_rad_s is not None
        self.thrust: ThrustHistory | RotorThrust = self._rotors if self._turns else self._commands
        self._k_thrust_m_s2 = airframe.model.k_thrust_m_s2
        self._contact = GroundContact()
        self.in_air = False
        self._in_air_s = -math.inf
        self._own_command_s = -math.inf

    @property
    def flies(self) -> bool:
        """Whether nothing but thrust and air carries the vehicle."""
        return self.in_air and not self._contact.stands

    @property
    def carried(self) -> bool:
        """Whether something carries the vehicle, or has just done so, although PX4 calls it in the air."""
        return self.in_air and self._contact.stood_lately

    def hear(self, vehicle: VehicleSample) -> None:
        """Whether it is in the air and who flies it."""
        if not math.isfinite(vehicle.time_s):
            self._counters.non_finite += 1
        elif vehicle.time_s >= self._in_air_s:
            self.in_air, self._in_air_s = vehicle.in_air, vehicle.time_s
            if vehicle.mode is not FlightMode.OFFBOARD:
                self._own_command_s = -math.inf  # PX4 flies by its own target now

    def hear_target(self, target: AttitudeTargetSample) -> None:
        """What PX4 tells that it aims at: the command, where it is not only the echo of ours."""
        if abs(target.time_s - self._own_command_s) > OWN_COMMAND_S:
            self._command(target.time_s, target.thrust)

    def sent(self, setpoint: Setpoint) -> None:
        """A setpoint that PX4 follows left at its `time_s`."""
        if self._command(setpoint.time_s, setpoint.thrust):
            self._own_command_s = setpoint.time_s

    def set_k_thrust(self, k_thrust_m_s2: float) -> None:
        """Thrust acceleration at full thrust [m/s^2], for commands from now on."""
        if math.isfinite(k_thrust_m_s2) and k_thrust_m_s2 > 0.0:
            self._k_thrust_m_s2 = k_thrust_m_s2
        else:
            self._counters.non_finite += 1

    def turn(self, sample: RotorSample, filter_s: float) -> None:
        """A sample of the rotors: thrust of steps to come, where it belongs to the filter's time."""
        if self._turns:
            near = abs(filter_s - sample.time_s) < ROTORS_WITHIN_S
            self._counters.non_finite += not (near and self._rotors.add(sample, self.flies))

    def look_for_contact(self, odometry: Odometry) -> None:
        """Whether something carries the vehicle, by an odometry sample."""
        if self.in_air and odometry.use[s.VELOCITY_SENSOR]:
            thrust_m_s2 = self._commands.newest_m_s2
            if thrust_m_s2 <= LIGHT_M_S2:
                thrust_m_s2 = self._commands.mean(odometry.time_s - THRUST_SHOWS_S, odometry.time_s)
            self._contact.look(odometry.time_s, odometry.velocity[2], thrust_m_s2)

    def missing_thrust(self, filter_s: float, commands: float, rotors: float) -> float:
        """By how much more [m/s^2] pushed than was reckoned with, where commands and rotors gave so many times that."""
        ratio = rotors if self._rotors.fresh(filter_s) else commands
        return (ratio - 1.0) * self._rotors.mean(filter_s - FORCE_SHOWS_S, filter_s)

    def rescale(self, commands: float, rotors: float) -> None:
        """Commands so far, and rotors for good, give so many times the thrust reckoned with."""
        self._rotors.rescale(commands, rotors)

    def rotor_ratio(self, filter_s: float) -> float | None:
        """Thrust by rotor speeds over thrust by commands, over seconds; None where the filter flies by commands."""
        return self._rotors.ratio if self._rotors.fresh(filter_s) else None

    @property
    def rotor_excess_m_s2(self) -> float:
        """By how much the thrust is just now more than commanded, by the rotors."""
        return self._rotors.excess_m_s2

    def _command(self, time_s: float, thrust: float) -> bool:
        if not (math.isfinite(time_s) and math.isfinite(thrust)):
            self._counters.non_finite += 1
            return False
        self._commands.add(time_s, self._k_thrust_m_s2 * min(max(thrust, 0.0), 1.0))
        return True


def hover_thrust_history(airframe: Airframe) -> ThrustHistory:
    """Empty thrust history of an airframe: before the first command it hovers."""
    return ThrustHistory(airframe.model.thrust_acts_after_s, GRAVITY_M_S2)
