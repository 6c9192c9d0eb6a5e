"""The autopilot: commander, land detector, automatic modes, position control and inner loop, tied together."""

from __future__ import annotations

import math
from array import array

from uasfly.messages import FlightMode
from uasfly.sim.automatic_modes import AutomaticModes
from uasfly.sim.body import GRAVITY_M_S2
from uasfly.sim.commander import INFO, Commander
from uasfly.sim.dynamics import STEP_S, PlantDynamics
from uasfly.sim.estimate import Estimate
from uasfly.sim.failsafe import Situation
from uasfly.sim.inner_loop import (
    ARMED,
    ATTITUDE_ERROR,
    FLYING,
    FULL_SPEED,
    GYRO_ERROR,
    SETPOINT_ATTITUDE,
    SETPOINT_THRUST,
    SETPOINT_YAW_RATE,
    InnerLoop,
)
from uasfly.sim.land_detector import LandDetector, LandEvidence
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.plant import Rotors
from uasfly.sim.position_control import AttitudeSetpoint, HoverThrust, MotionSetpoint, PositionControl, Quaternion

_WIDEST_TILT_DEG = 80.0
_LAND_DESCENT = 1.1  # times LNDMC_Z_VEL_MAX: a mode that sinks faster than this wants to land
_LEARNING_HEIGHT_M = 0.3  # above home; lower, the ground may carry some of the weight
_TILT_LIMIT_RATE_RAD_S = 0.2  # how fast the limit opens after take-off (recording: 12 to 45 deg in 2.9 s)


class Autopilot:
    """Everything between commands and rotor targets.

    Attributes:
        commander, land_detector, modes: its parts.
        target: what the attitude controller is asked for.
        engaged_at_s: when offboard first began, None before.
        full_speed_rad_s: rotor speed at full command and the present voltage, set from outside.
    """

    def __init__(
        self,
        rotors: Rotors,
        parameters: ParameterTable,
        dynamics: PlantDynamics,
        estimate: Estimate,
        outer_period_s: float,
        slow_period_s: float,
    ) -> None:
        self._parameters = parameters
        self._version = parameters.version
        self._dynamics = dynamics
        self._estimate = estimate
        self._outer_period_s = outer_period_s
        self._slow_period_s = slow_period_s
        self._inner = InnerLoop(rotors, parameters, dynamics.state, dynamics.targets, STEP_S)
        self._position_control = PositionControl(parameters, outer_period_s)
        self._hover = HoverThrust(parameters.value("MPC_THR_HOVER"))
        self.commander = Commander(parameters)
        self.land_detector = LandDetector(parameters)
        self.modes = AutomaticModes(parameters, outer_period_s)
        self.target = AttitudeSetpoint()
        self.engaged_at_s: float | None = None
        self.full_speed_rad_s = rotors.full_speed_rad_s
        self._offboard = AttitudeSetpoint()
        self._setpoint_at_s = -math.inf
        self._mode = self.commander.mode
        self._armed = False
        self._flying = False
        self._wants_down = False
        self._tilt_limit_rad = math.radians(parameters.value("MPC_TILTMAX_LND"))

    def take_setpoint(self, now_s: float, attitude: Quaternion, thrust: float, yaw_rate_rad_s: float) -> None:
        """Take an attitude setpoint of the offboard stream."""
        self._offboard = AttitudeSetpoint(attitude, thrust, yaw_rate_rad_s)
        self._setpoint_at_s = now_s
        if self._mode is FlightMode.OFFBOARD:
            self._apply(self._offboard)

    def set_mode(self, mode: FlightMode, now_s: float, battery_remaining: float) -> tuple[bool, str]:
        """Ask the commander for a mode."""
        answer = self.commander.set_mode(mode, self._situation(now_s, battery_remaining))
        self._follow_commander(now_s)
        return answer

    def arm(self, now_s: float, battery_remaining: float) -> tuple[bool, str]:
        """Ask the commander to arm."""
        answer = self.commander.arm(self._situation(now_s, battery_remaining))
        self._follow_commander(now_s)
        return answer

    def disarm(self, now_s: float, battery_remaining: float, forced: bool) -> tuple[bool, str]:
        """Ask the commander to disarm."""
        answer = self.commander.disarm(self._situation(now_s, battery_remaining), forced)
        self._follow_commander(now_s)
        return answer

    def set_gnss(self, available: bool) -> None:
        """Take the source of positions away or give it back; automatic modes move with the jump that this may bring."""
        estimate = self._estimate
        estimate.refresh()
        before, counter = estimate.position, estimate.reset_counter
        estimate.set_gnss(available)
        if estimate.reset_counter != counter:
            estimate.refresh()
            after = estimate.position
            self.modes.jump((after[0] - before[0], after[1] - before[1], after[2] - before[2]))

    def look_after(self, now_s: float, battery_remaining: float) -> None:
        """The slow part: parameters, land detector, commander, hover thrust."""
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._inner.read_parameters()
            self._position_control.read_parameters()
            self.modes.read_parameters()
        self._detect_land(now_s)
        if self._flying and self._estimate.position[2] > self.modes.home[2] + _LEARNING_HEIGHT_M:
            acceleration = self._dynamics.acceleration[2]
            self._hover.learn(self.target.thrust, self._tilt_cosine(), acceleration, self._slow_period_s)
        self.commander.update(self._situation(now_s, battery_remaining), self.modes.takeoff_done)
        self._follow_commander(now_s)
        self._inner.inputs[FULL_SPEED] = self.full_speed_rad_s

    def steer(self, now_s: float) -> None:
        """The outer loop: position control of the automatic modes."""
        if self._mode is FlightMode.OFFBOARD or not self._armed:
            return
        estimate, detector = self._estimate, self.land_detector
        estimate.refresh()
        spun_up = now_s - self.commander.armed_at_s >= self._parameters.value("COM_SPOOLUP_TIME")
        on_ground = not self._flying or detector.landed or detector.ground_contact
        setpoint = self.modes.update(estimate.position, estimate.velocity, on_ground, spun_up)
        self._flying |= not setpoint.idle
        if not setpoint.idle:
            self._wants_down = setpoint.velocity[2] <= -_LAND_DESCENT * self._parameters.value("LNDMC_Z_VEL_MAX")
        self._apply(self._control(setpoint))

    def stabilise(self) -> None:
        """The inner loop: rotor targets for the present step."""
        inputs = self._inner.inputs
        inputs[ATTITUDE_ERROR] = self._estimate.attitude_error
        inputs[GYRO_ERROR] = self._estimate.gyro_error
        self._inner.step()

    def _control(self, setpoint: MotionSetpoint) -> AttitudeSetpoint:
        ramping = self.modes.ramping
        widest = self._parameters.value("MPC_TILTMAX_LND" if ramping else "MPC_TILTMAX_AIR")
        step = _TILT_LIMIT_RATE_RAD_S * self._outer_period_s
        self._tilt_limit_rad += max(
            -step, min(step, math.radians(min(max(widest, 0.0), _WIDEST_TILT_DEG)) - self._tilt_limit_rad)
        )
        hover = self._parameters.value("MPC_THR_HOVER") if ramping else self._hover.value
        estimate = self._estimate
        return self._position_control.update(
            setpoint, estimate.position, estimate.velocity, hover, self._tilt_limit_rad
        )

    def _apply(self, setpoint: AttitudeSetpoint) -> None:
        self.target = setpoint
        inputs = self._inner.inputs
        inputs[SETPOINT_ATTITUDE] = array("d", setpoint.attitude)
        inputs[SETPOINT_THRUST] = setpoint.thrust
        inputs[SETPOINT_YAW_RATE] = setpoint.yaw_rate_rad_s

    def _follow_commander(self, now_s: float) -> None:
        """Start what the commander has changed: motors, mode."""
        commander = self.commander
        if commander.armed != self._armed:
            self._armed = commander.armed
            self._switch_motors()
            if self._armed:
                self._enter(commander.mode, now_s)
        if commander.mode is not self._mode:
            self._enter(commander.mode, now_s)

    def _switch_motors(self) -> None:
        self._flying = self._wants_down = False
        inputs, estimate = self._inner.inputs, self._estimate
        inputs[ARMED] = float(self._armed)
        inputs[FLYING] = 0.0
        if self._armed:
            estimate.refresh()
            self.modes.home = estimate.position
            self._hover.value = self._parameters.value("MPC_THR_HOVER")
            self._position_control.reset()
        level = _heading_only(self._dynamics.state)
        self._inner.reset(level)
        self._apply(AttitudeSetpoint(level))

    def _enter(self, mode: FlightMode, now_s: float) -> None:
        was, self._mode = self._mode, mode
        if mode is FlightMode.OFFBOARD:
            if self._armed and self.engaged_at_s is None:
                self.engaged_at_s = now_s
            if self._setpoint_at_s > -math.inf:
                self._apply(self._offboard)
            return
        if was is FlightMode.OFFBOARD:
            self._position_control.reset()
            self._flying |= self._armed and not self.land_detector.landed
        estimate = self._estimate
        estimate.refresh()
        if mode is FlightMode.TAKEOFF and self._armed and self.modes.takeoff_height_m is None:
            height = self._parameters.value("MIS_TAKEOFF_ALT")
            self.commander.say(now_s, INFO, f"Using default takeoff altitude: {height:.1f} m")
        yaw = _yaw(self._dynamics.state)
        self.modes.enter(mode, estimate.position, estimate.velocity, yaw, self.land_detector.landed)

    def _detect_land(self, now_s: float) -> None:
        estimate, state, acceleration = self._estimate, self._dynamics.state, self._dynamics.acceleration
        estimate.refresh()
        detector, offboard = self.land_detector, self._mode is FlightMode.OFFBOARD
        detector.update(
            now_s,
            LandEvidence(
                self._armed,
                self.target.thrust,
                self._hover.value,
                estimate.velocity,
                math.hypot(state[10], state[11]),
                math.sqrt(acceleration[0] ** 2 + acceleration[1] ** 2 + (acceleration[2] + GRAVITY_M_S2) ** 2),
                not offboard,
                self._wants_down,
            ),
        )
        if offboard:
            self._flying = not detector.landed
        elif detector.landed and not self.modes.ramping:
            self._flying = False
        integrating = self._armed and not detector.landed and not detector.maybe_landed
        self._inner.inputs[FLYING] = float(integrating)

    def _situation(self, now_s: float, battery_remaining: float) -> Situation:
        return Situation(
            now_s,
            now_s - self._setpoint_at_s,
            self._estimate.position_trusted,
            battery_remaining,
            self.land_detector.landed,
        )

    def _tilt_cosine(self) -> float:
        x, y = self._dynamics.state[7:9]
        return 1.0 - 2.0 * (x * x + y * y)


def _yaw(state: array[float]) -> float:
    w, x, y, z = state[6:10]
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _heading_only(state: array[float]) -> Quaternion:
    half = 0.5 * _yaw(state)
    return math.cos(half), 0.0, 0.0, math.sin(half)
