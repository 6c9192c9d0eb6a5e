"""The simulated vehicle: plant, wind, sensors and a PX4-like autopilot, advanced step by step.

Everything below MAVLink: who wants to talk to it as to PX4 puts a server or a link on top. The same seed and the same
calls give the same flight bit for bit; reading a sample changes nothing.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from uasfly.errors import UasflyError
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    OdometrySample,
    RotorSample,
    TextSample,
    TruthSample,
    VehicleSample,
)
from uasfly.sim.autopilot import Autopilot
from uasfly.sim.battery import Battery
from uasfly.sim.dynamics import STEP_S, PlantDynamics
from uasfly.sim.estimate import Estimate
from uasfly.sim.fault_board import FaultBoard, check_motors
from uasfly.sim.faults import Fault
from uasfly.sim.link_faults import LinkFaults
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.sensors import GnssSample, InertialSample, RawSensors
from uasfly.sim.wind.field import WindField

_OUTER_STEPS = 2  # position control at 125 Hz, as PX4's local position
_BEYOND = 1e9  # m, m/s, rad/s: no vehicle is there
_STILL = (0.0, 0.0, 0.0)
_SLOW_STEPS = 10  # commander, land detector and battery at 25 Hz


class SimulatedVehicle:
    """One vehicle in one scenario. Times are its own, in seconds since boot; world ENU, body FLU.

    Args:
        plant: what it is made of.
        scenario: the wind and the sensors that it meets.
        seed: of everything random.
        start_position: (x, y, z) [m] where it stands; the ground is at z = 0.
        start_yaw_rad: its heading there.

    Raises:
        UasflyError: a fault of the scenario is none of this vehicle; while it runs, where the figures of plant or
            scenario are so odd that the state runs away.

    Attributes:
        step_s: length of a step. parameters: PX4's parameters, name -> (type, value). boots: how often it has started.
        watcher: called after each step with the time since the simulation began, the true state (see
            `dynamics.PlantDynamics`) and the time since the first offboard, None before; for a camera on the vehicle.
    """

    step_s = STEP_S

    def __init__(
        self,
        plant: Plant,
        scenario: Scenario,
        seed: int,
        start_position: tuple[float, float, float] = (0.0, 0.0, 0.0),
        start_yaw_rad: float = 0.0,
    ) -> None:
        self._seeds = np.random.SeedSequence(seed)
        wind_seed, estimate_seed, sensor_seed, fault_seed = self._seeds.spawn(4)
        self.parameters = ParameterTable(plant.parameters)
        self._dynamics = PlantDynamics(plant, STEP_S)
        self._dynamics.place(start_position, math.cos(0.5 * start_yaw_rad), math.sin(0.5 * start_yaw_rad))
        check_motors(scenario.faults, len(self._dynamics.targets))
        self._state = self._dynamics.state
        self._state_view, self._wind_view = np.frombuffer(self._state), np.frombuffer(self._dynamics.wind)
        self._wind = WindField(scenario.wind, np.random.default_rng(wind_seed), STEP_S)
        self._battery = Battery(plant)
        self._plant = plant
        self._scenario = scenario
        self._steps = self._boot_steps = 0
        self._jumped_s = 0.0
        self._quality: tuple[float, int] | None = None
        self.boots = 0
        self.watcher: Callable[[float, Sequence[float], float | None], None] | None = None
        self._faults = FaultBoard(self, scenario.faults, np.random.default_rng(fault_seed))
        self._boot(estimate_seed, sensor_seed)

    def _boot(self, estimate_seed: np.random.SeedSequence, sensor_seed: np.random.SeedSequence) -> None:
        """Start the autopilot with what it does not keep: estimate, modes, biases of its sensors."""
        self.boots += 1
        self._boot_steps, self._jumped_s = self._steps, 0.0
        self._estimate = Estimate(self._scenario.sensors, np.random.default_rng(estimate_seed), self._state, STEP_S)
        self._sensors = RawSensors(
            np.random.default_rng(sensor_seed),
            self._state,
            self._dynamics.acceleration,
            self._estimate,
            self._scenario.sensors,
            self._plant.hover_speed_rad_s,
            np.random.default_rng(sensor_seed.spawn(1)[0]),
        )
        self._autopilot = Autopilot(
            self._plant.rotors,
            self.parameters,
            self._dynamics,
            self._estimate,
            _OUTER_STEPS * STEP_S,
            _SLOW_STEPS * STEP_S,
        )

    @property
    def time_s(self) -> float:
        """Vehicle time of the last step."""
        return self._since_boot_s + self._jumped_s

    @property
    def _since_boot_s(self) -> float:
        """What the autopilot reckons with; a jump of the clock moves only what it tells."""
        return (self._steps - self._boot_steps) * STEP_S

    @property
    def link_faults(self) -> LinkFaults:
        """What the link does to messages now."""
        return self._faults.link

    def inject(self, fault: Fault) -> None:
        """Let a fault begin now.

        Raises:
            UasflyError: it is none of this vehicle.
        """
        check_motors((fault,), len(self._dynamics.targets))
        self._faults.begin(fault)

    def advance_to(self, time_s: float) -> None:
        """Simulate up to the last whole step at or before `time_s`; does nothing for times past."""
        target = self._boot_steps + math.floor((time_s - self._jumped_s) / STEP_S + 1e-6)
        while self._steps < target:
            self._step()

    def _step(self) -> None:
        if self._steps % _SLOW_STEPS == 0 and not self._faults.idle:
            engaged = self._autopilot.engaged_at_s
            boot_s = self._boot_steps * STEP_S
            self._faults.update(self._steps * STEP_S, None if engaged is None else engaged + boot_s)
        steps, state, dynamics, autopilot = self._steps, self._state, self._dynamics, self._autopilot
        now = self._since_boot_s
        if steps % _SLOW_STEPS == 0:
            self._battery.draw(state[13:], _SLOW_STEPS * STEP_S)
            autopilot.full_speed_rad_s = self._battery.full_speed_rad_s()
            autopilot.look_after(now, self._battery.charge)
        if steps % _OUTER_STEPS == 0:
            autopilot.steer(now)
        autopilot.stabilise()
        x, y, z, vx, vy, vz = state[0:6]
        engaged = autopilot.engaged_at_s
        engaged_for_s = None if engaged is None else now - engaged
        air = self._wind.step((x, y, z), (vx, vy, vz), engaged_for_s)
        free = air.free_in_world
        if self._faults.wind != _STILL:
            east, north, up = self._faults.wind
            free = (free[0] + east, free[1] + north, free[2] + up)
        dynamics.wind[:] = array("d", free + air.jet_in_world)
        dynamics.step()
        if not -_BEYOND < sum(state) < _BEYOND:
            raise UasflyError(self._run_away())
        self._steps = steps + 1
        self._estimate.engaged_for_s = engaged_for_s
        self._estimate.advance()
        self._sensors.advance()
        if self.watcher is not None:
            self.watcher((steps + 1) * STEP_S, state, None if engaged is None else now + STEP_S - engaged)

    def _run_away(self) -> str:
        return (
            f"the simulation of plant {self._plant.name} in scenario {self._scenario.name} has run away at "
            f"{self._steps * STEP_S:.2f} s: expected a state that steps of {STEP_S:g} s can follow; check mass, "
            "inertia, thrust and drag of the plant, and wind and faults of the scenario"
        )

    def set_attitude_target(self, quaternion_body_to_world: Array, thrust: float, yaw_rate_rad_s: float | None) -> None:
        """Take a setpoint as SET_ATTITUDE_TARGET carries it; it acts in offboard.

        Args:
            quaternion_body_to_world: (4,), normalised here.
            thrust: 0..1, clipped as PX4's mixer does.
            yaw_rate_rad_s: feed-forward about the world's vertical, None for none.

        Raises:
            ValueError: a number is not finite, or the quaternion has no length; PX4 would not survive them either.
        """
        w, x, y, z = (float(value) for value in quaternion_body_to_world)
        length = math.sqrt(w * w + x * x + y * y + z * z)
        yaw_rate = 0.0 if yaw_rate_rad_s is None else yaw_rate_rad_s
        if not (math.isfinite(length) and length > 1e-3 and math.isfinite(thrust) and math.isfinite(yaw_rate)):
            raise ValueError(
                f"expected a finite attitude target, found {quaternion_body_to_world}, {thrust}, {yaw_rate_rad_s}"
            )
        attitude = (w / length, x / length, y / length, z / length)
        self._autopilot.take_setpoint(self._since_boot_s, attitude, min(1.0, max(0.0, thrust)), yaw_rate)

    def set_mode(self, mode: FlightMode) -> tuple[bool, str]:
        """Ask for a mode; whether it was granted, and why not."""
        return self._autopilot.set_mode(mode, self._since_boot_s, self._battery.charge)

    def arm(self) -> tuple[bool, str]:
        """Ask to arm; whether it was granted, and why not."""
        return self._autopilot.arm(self._since_boot_s, self._battery.charge)

    def disarm(self, forced: bool = False) -> tuple[bool, str]:
        """Ask to disarm; in the air only when `forced`."""
        return self._autopilot.disarm(self._since_boot_s, self._battery.charge, forced)

    def set_takeoff_height(self, height_m: float) -> None:
        """Set the height above home that the next take-off climbs to, in the place of MIS_TAKEOFF_ALT."""
        self._autopilot.modes.takeoff_height_m = height_m

    def set_gnss(self, available: bool) -> None:
        """Take the source of positions (GNSS, motion capture) away, or give it back."""
        self._autopilot.set_gnss(available)

    def set_gnss_offset(self, offset_in_world: tuple[float, float, float]) -> None:
        """Shift all positions that the source gives from now on [m]."""
        self._estimate.gnss_offset = offset_in_world

    def set_gnss_quality(self, quality: tuple[float, int] | None) -> None:
        """Let GNSS tell this horizontal accuracy [m] and number of satellites, None for what they are."""
        self._quality = quality

    def set_motor_effectiveness(self, motor: int, effectiveness: float) -> None:
        """Let a motor (0 is the first) give this share of its thrust, 1 when it is sound."""
        self._dynamics.effectiveness[motor] = effectiveness

    def set_battery_charge(self, charge: float) -> None:
        """Set the battery's charge, 0..1."""
        self._battery.charge = charge

    def refuse(self, arming: bool, offboard: bool) -> None:
        """Let the vehicle refuse to arm, or to enter offboard, whatever its state."""
        self._autopilot.commander.refuse_arming = arming
        self._autopilot.commander.refuse_offboard = offboard

    def reboot(self) -> None:
        """Start the autopilot again, in flight too: the motors stop, its clock is at zero, its parameters stay."""
        estimate_seed, sensor_seed = self._seeds.spawn(2)
        self._boot(estimate_seed, sensor_seed)
        self._dynamics.targets[:] = array("d", [0.0] * len(self._dynamics.targets))

    def jump_clock(self, step_s: float) -> None:
        """Move the clock that stamps telemetry; nothing else notices."""
        self._jumped_s += step_s

    def odometry(self) -> OdometrySample:
        """The estimate of position, velocity, attitude and rates."""
        sample = self._estimate.odometry(self.time_s)
        return self._faults.distorted(sample) if self._faults.distorts else sample

    def truth(self) -> TruthSample:
        """The true state, and what the wind does."""
        state, wind = self._state_view, self._wind_view
        return TruthSample(
            self.time_s,
            state[0:3].copy(),
            state[3:6].copy(),
            state[6:10].copy(),
            np.array(self._dynamics.wind_force()),
            wind[0:3] + wind[3:6],
        )

    def battery(self) -> BatterySample:
        """Voltage and charge."""
        return BatterySample(self.time_s, self._battery.voltage_v, self._battery.charge)

    def state(self) -> VehicleSample:
        """Mode, arming and landed state."""
        return VehicleSample(self.time_s, *self.condition)

    @property
    def condition(self) -> tuple[FlightMode, bool, bool]:
        """Mode, whether it is armed, whether it is in the air."""
        commander = self._autopilot.commander
        return commander.mode, commander.armed, not self._autopilot.land_detector.landed

    def health(self) -> HealthSample:
        """Estimator and GNSS."""
        estimate = self._estimate
        fix, satellites = (3, 10) if estimate.gnss_available else (0, 0)
        ok, accuracy = estimate.position_ok, estimate.horizontal_accuracy_m
        if self._quality is not None and fix:
            accuracy, satellites = max(accuracy, self._quality[0]), self._quality[1]
        return HealthSample(self.time_s, ok, ok, estimate.attitude_ok, fix, satellites, accuracy)

    def attitude_target(self) -> AttitudeTargetSample:
        """What the attitude controller is asked for, by whichever mode flies."""
        target = self._autopilot.target
        return AttitudeTargetSample(self.time_s, np.array(target.attitude), target.thrust)

    def accelerometer(self) -> AccelerometerSample | None:
        """Mean of the accelerometer's last readings; None while a fault keeps it silent."""
        return self._faults.accelerometer(self._sensors.accelerometer(self.time_s))

    def rotors(self) -> RotorSample | None:
        """Speeds of the rotors; None where the scenario's speed controllers do not tell them."""
        sample = self._sensors.rotors(self.time_s)
        return None if sample is None else self._faults.rotors(sample)

    def inertial(self) -> InertialSample | None:
        """Accelerometer, gyro, magnetometer and barometer; None while a fault keeps them silent."""
        sample = self._sensors.inertial(self.time_s)
        told = self._faults.accelerometer(AccelerometerSample(sample.time_s, sample.acceleration_in_body))
        return None if told is None else replace(sample, acceleration_in_body=told.specific_force_in_body)

    def gnss(self) -> GnssSample:
        """GNSS receiver."""
        sample = self._sensors.gnss(self.time_s)
        if self._quality is None or not sample.fix:
            return sample
        accuracy, satellites = self._quality
        return replace(
            sample, satellites=satellites, horizontal_accuracy_m=accuracy, vertical_accuracy_m=2.0 * accuracy
        )

    def take_texts(self) -> list[TextSample]:
        """Status texts since the last call, oldest first."""
        return self._autopilot.commander.take_texts()
