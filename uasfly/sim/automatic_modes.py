"""What the automatic modes want: hold, take-off, land, return and descend, each a path for the position controller.

After PX4's navigator: take-off ramps thrust up over MPC_TKO_RAMP_T and climbs; land slows down with height; return
climbs by the cone rule, flies home and lands; descend sinks without a horizontal position.
"""

from __future__ import annotations

import math
from dataclasses import replace

from uasfly.messages import FlightMode
from uasfly.sim.approach import Approach, MotionLimits, Vector, braking_point
from uasfly.sim.body import GRAVITY_M_S2
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.position_control import MotionSetpoint

_ARRIVED_M = 1.0
_FAR_BELOW_M = 1000.0
_RETURN_CONE_PER_M = 2.0  # height above home over distance to it, near home
_NEAR_HOME_M = 10.0  # NAV_ACC_RAD
_TAKEOFF_ACCELERATION_M_S2 = 0.48  # of the climb that is asked for while the thrust ramps up (recording)


class AutomaticModes:
    """The path of the present automatic mode.

    Attributes:
        home: (x, y, z) [m] where the vehicle was armed.
        takeoff_done: the take-off has reached its height.
        takeoff_height_m: height above home of the next take-off, None for MIS_TAKEOFF_ALT.
        ramping: a take-off ramps its thrust up.
    """

    def __init__(self, parameters: ParameterTable, duration_s: float) -> None:
        self._parameters = parameters
        self._duration_s = duration_s
        self._mode = FlightMode.HOLD
        self._path = Approach((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._target: Vector = (0.0, 0.0, 0.0)
        self._yaw_rad = 0.0
        self._climb_first = True
        self._ramp = 1.0
        self._climb_wish = 0.0
        self.read_parameters()
        self.home: Vector = (0.0, 0.0, 0.0)
        self.takeoff_done = False
        self.takeoff_height_m: float | None = None
        self.ramping = False

    def read_parameters(self) -> None:
        """Take speed and acceleration limits over from the parameter table."""
        value = self._parameters.value
        vertical = min(value("MPC_ACC_UP_MAX"), value("MPC_ACC_DOWN_MAX"))
        self._cruise = MotionLimits(
            value("MPC_XY_CRUISE"),
            value("MPC_Z_V_AUTO_UP"),
            value("MPC_Z_V_AUTO_DN"),
            max(value("MPC_ACC_HOR"), 0.1),
            max(vertical, 0.1),
        )
        self._takeoff = replace(self._cruise, climb_m_s=value("MPC_TKO_SPEED"))

    def enter(self, mode: FlightMode, position: Vector, velocity: Vector, yaw_rad: float, on_ground: bool) -> None:
        """Start a mode from the present estimate [m], [m/s], [rad]."""
        continues = mode is FlightMode.HOLD and self._mode is FlightMode.TAKEOFF and self.takeoff_done
        self._mode = mode
        if continues:
            return  # hold where the take-off was going to
        self._yaw_rad = yaw_rad
        self._path = Approach(position, velocity)
        self._target = braking_point(position, velocity, self._cruise)
        self.takeoff_done = False
        self.ramping = mode is FlightMode.TAKEOFF and on_ground
        self._ramp = 0.0 if self.ramping else 1.0
        self._climb_wish = 0.0
        if mode is FlightMode.TAKEOFF:
            asked = self.takeoff_height_m
            height = self._parameters.value("MIS_TAKEOFF_ALT") if asked is None else asked
            self._target = (position[0], position[1], max(self.home[2] + height, position[2]))
        elif mode is FlightMode.RETURN:
            self._climb_first = True
            self._target = (self._target[0], self._target[1], self._return_height(position))

    def jump(self, by: Vector) -> None:
        """Move path and target along with a jump of the position estimate [m]."""
        x, y, z = self._path.position
        self._path.position = (x + by[0], y + by[1], z + by[2])
        self._target = (self._target[0] + by[0], self._target[1] + by[1], self._target[2] + by[2])

    def update(self, position: Vector, velocity: Vector, on_ground: bool, may_take_off: bool) -> MotionSetpoint:
        """Setpoint of the present mode.

        Args:
            position: the estimate [m].
            velocity: the estimate [m/s].
            on_ground: the vehicle stands on the ground (or touches it while landing).
            may_take_off: rotors have had their time to spin up.
        """
        if self._mode is FlightMode.TAKEOFF and self.ramping:
            return self._ramp_up(position, velocity, may_take_off)
        if on_ground:
            self._path = Approach(position, (0.0, 0.0, 0.0))
            if self._mode is not FlightMode.TAKEOFF:
                self._target = position
            return MotionSetpoint(position, (0.0, 0.0, 0.0), self._yaw_rad, idle=True)
        if self._mode is FlightMode.DESCEND:
            sink = -self._parameters.value("MPC_LAND_SPEED")
            return MotionSetpoint(position, (0.0, 0.0, sink), self._yaw_rad, track_horizontal=False, track_height=False)
        if self._mode is FlightMode.RETURN:
            self._plan_return(position)
        limits = self._takeoff if self._mode is FlightMode.TAKEOFF else self._cruise
        target = self._target
        if self._mode is FlightMode.LAND:
            target = (target[0], target[1], self._path.position[2] - _FAR_BELOW_M)
            limits = replace(limits, sink_m_s=self._landing_speed(position[2] - self.home[2]))
        self._path.advance(target, limits, self._duration_s)
        if self._mode is FlightMode.TAKEOFF:
            radius = self._parameters.value("NAV_MC_ALT_RAD")
            self.takeoff_done = abs(position[2] - self._target[2]) < radius
        return MotionSetpoint(self._path.position, self._path.velocity, self._yaw_rad)

    def _ramp_up(self, position: Vector, velocity: Vector, may_take_off: bool) -> MotionSetpoint:
        value = self._parameters.value
        if not may_take_off:
            return MotionSetpoint(position, (0.0, 0.0, 0.0), self._yaw_rad, idle=True)
        self._ramp += self._duration_s / max(value("MPC_TKO_RAMP_T"), self._duration_s)
        # The ramp starts at the velocity whose error takes all of the hover thrust away.
        lowest = -GRAVITY_M_S2 / max(value("MPC_Z_VEL_P_ACC"), 0.01)
        limit = lowest + min(self._ramp, 1.0) * (max(value("MPC_Z_VEL_MAX_UP"), 0.1) - lowest)
        if limit > 0.0:
            self._climb_wish += _TAKEOFF_ACCELERATION_M_S2 * self._duration_s
        climb = min(self._climb_wish, value("MPC_TKO_SPEED"))
        if self._ramp >= 1.0:
            self.ramping = False
            self._path = Approach(position, (0.0, 0.0, max(climb, velocity[2])))
        anchor = (self._target[0], self._target[1], position[2])
        return MotionSetpoint(anchor, (0.0, 0.0, climb), self._yaw_rad, track_height=False, climb_limit_m_s=limit)

    def _plan_return(self, position: Vector) -> None:
        home_x, home_y, home_z = self.home
        if self._climb_first and self._target[2] - position[2] < _ARRIVED_M:
            self._climb_first = False
            self._target = (home_x, home_y, self._target[2])
        if not self._climb_first and math.hypot(position[0] - home_x, position[1] - home_y) < _ARRIVED_M:
            descended = home_z + self._parameters.value("RTL_DESCEND_ALT")
            height = min(self._target[2], descended)
            self._target = (home_x, home_y, height)
            if position[2] - height < _ARRIVED_M:
                self._mode = FlightMode.LAND

    def _return_height(self, position: Vector) -> float:
        value = self._parameters.value
        distance = math.hypot(position[0] - self.home[0], position[1] - self.home[1])
        height = value("RTL_RETURN_ALT")
        if distance <= _NEAR_HOME_M:
            height = min(height, _RETURN_CONE_PER_M * distance)
        return max(position[2], self.home[2] + height)

    def _landing_speed(self, height_m: float) -> float:
        value = self._parameters.value
        slow, fast = value("MPC_LAND_SPEED"), value("MPC_Z_V_AUTO_DN")
        low, high = value("MPC_LAND_ALT2"), value("MPC_LAND_ALT1")
        if height_m <= value("MPC_LAND_ALT3"):
            return value("MPC_LAND_CRWL")
        share = min(1.0, max(0.0, (height_m - low) / max(high - low, 0.1)))
        return slow + share * (fast - slow)
