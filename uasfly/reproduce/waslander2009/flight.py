"""One flight: plant, autopilot, pilot and link as in a rehearsal, with the paper's sensors aboard."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.controller import Controller, ControlResult, NmpcController, PidController, PidDdController
from uasfly.control.protocol import ReferenceAt
from uasfly.drivers.simulated_flight import SimulatedFlight
from uasfly.errors import UasflyError
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.messages import Array, Phase, Setpoint, StateEstimate
from uasfly.mission import Mission
from uasfly.observer.observer import Observer
from uasfly.reproduce.waslander2009.onboard import Onboard, Winds
from uasfly.reproduce.waslander2009.sensors import IMU_PERIOD_S
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

STANDS_S = 5.0  # on the ground before uasfly begins: the accelerometer shows gravity alone
LONGEST_S = 600.0
_IMU_STEPS = round(IMU_PERIOD_S / SimulatedVehicle.step_s)

MakeOnboard = Callable[[Array, np.random.Generator], Onboard]  # from the attitude at rest and a source of noise


@dataclass(frozen=True, slots=True)
class PaperFlight:
    """What flies.

    Attributes:
        airframe, plant, scenario, mission, seed: as in any rehearsal.
        controller: nmpc, pid, waslander_pid, pid_dd or pid_dd_wind.
        onboard: sensors that ride along, by name.
        flies_by: the one of them that tells the controller acceleration and wind; None: uasfly's own observer does.
        moves_by: whether position, velocity and attitude come from there too, or from uasfly's observer.
    """

    airframe: Airframe
    plant: Plant
    scenario: Scenario
    mission: Mission
    controller: str
    seed: int
    onboard: Mapping[str, MakeOnboard]
    flies_by: str | None
    moves_by: bool = False


@dataclass(frozen=True, slots=True)
class Record:
    """The legs of a flight, a row a control cycle.

    Attributes:
        time_s: (n,) from the first leg on. position, reference: (n, 3) m, true and wanted.
        quaternion: (n, 4) true, body to world. wind: (n, 3) m/s, true, at the vehicle.
        estimates: by name of the sensors and of the estimate (the fields of `Winds`), (n, 3) each.
        true_bias: by name of the sensors, (3,) m/s^2.
    """

    time_s: Array
    position: Array
    reference: Array
    quaternion: Array
    wind: Array
    estimates: Mapping[str, Mapping[str, Array]]
    true_bias: Mapping[str, Array]

    @property
    def error(self) -> Array:
        """(n, 3) m, true minus wanted."""
        return self.position - self.reference

    def largest(self) -> Array:
        """Largest deviation (3,) of each axis [m]."""
        return np.asarray(np.abs(self.error).max(axis=0))

    def rms(self, axes: slice = slice(0, 3)) -> float:
        """Root mean square distance from the reference [m], of all axes or some."""
        return float(np.sqrt((self.error[:, axes] ** 2).sum(axis=1).mean()))


class _Fed:
    """A controller that flies by the paper's sensors once they know where they are, by the observer's until then."""

    def __init__(self, controller: Controller, onboard: Onboard, *, moves_by: bool) -> None:
        self._controller, self._onboard, self._moves_by = controller, onboard, moves_by

    @property
    def fallback_steps(self) -> dict[str, int]:
        return self._controller.fallback_steps

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        return self._controller.k_thrust_m_s2(battery_voltage_v)

    def trim_thrust(self, trim: float) -> float:
        return self._controller.trim_thrust(trim)

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:
        self._controller.reset(time_s, setpoint)

    def step(
        self, time_s: float, estimate: StateEstimate, reference_at: ReferenceAt, battery_voltage_v: float | None
    ) -> ControlResult:
        if self._onboard.flying:
            estimate = replace(estimate, force_in_world=self._onboard.force())
            if self._moves_by:
                estimate = self._onboard.with_motion(estimate)
        return self._controller.step(time_s, estimate, reference_at, battery_voltage_v)


class _Aboard:
    """Feeds the sensors from the plant's steps."""

    def __init__(self, vehicle: SimulatedVehicle, onboard: Sequence[Onboard]) -> None:
        self._vehicle, self._onboard = vehicle, onboard
        self._steps = 0
        self._velocity = np.zeros(3)

    def __call__(self, time_s: float, state: Sequence[float], engaged_s: float | None) -> None:  # noqa: ARG002
        self._steps += 1
        velocity = np.array(state[3:6])
        if self._steps % _IMU_STEPS == 0:
            acceleration = (velocity - self._velocity) / SimulatedVehicle.step_s
            command, voltage_v = self._vehicle.attitude_target().thrust, self._vehicle.battery().voltage_v
            armed = self._vehicle.condition[1]
            for one in self._onboard:
                one.sample(time_s, state, acceleration, command if armed else 0.0, voltage_v, armed)
        self._velocity = velocity


def make_controller(name: str, airframe: Airframe, onboard: Onboard | None) -> Controller:
    """A controller by name; with sensors aboard, the double derivative is their accelerometer's."""
    if name == "nmpc":
        return NmpcController(airframe, deadline_s=math.inf)
    if name == "pid":
        return PidController(airframe)
    measured = None if onboard is None else onboard.measured_acceleration
    return PidDdController(
        airframe,
        double_derivative=name != "waslander_pid",
        wind=name == "pid_dd_wind",
        measured_acceleration=measured,
    )


def fly(plan: PaperFlight) -> Record:
    """Fly a plan's legs. The same plan gives the same record.

    Raises:
        UasflyError: the legs were not flown to their end.
    """
    vehicle = SimulatedVehicle(plan.plant, plan.scenario, plan.seed)
    at_rest = vehicle.truth().quaternion_body_to_world
    onboard = {
        name: make(at_rest, np.random.default_rng([plan.seed, 11, number]))
        for number, (name, make) in enumerate(plan.onboard.items())
    }
    vehicle.watcher = _Aboard(vehicle, tuple(onboard.values()))
    chosen = None if plan.flies_by is None else onboard[plan.flies_by]
    controller = make_controller(plan.controller, plan.airframe, chosen)
    flown: Controller = controller if chosen is None else _Fed(controller, chosen, moves_by=plan.moves_by)
    pilot = Pilot(plan.airframe, plan.mission, Observer(plan.airframe, 0), flown, Engage.AUTO)
    rate_hz = plan.airframe.controller.rate_hz
    flight = SimulatedFlight(vehicle, plan.scenario.link, pilot, rate_hz, plan.seed, begins_s=STANDS_S)
    log = _Log(onboard)
    while not flight.lasted(LONGEST_S):
        cycle = flight.cycle()
        status, truth = cycle.result.status, cycle.truth
        if status.phase is Phase.LEGS and status.leg_started and status.reference_position_in_world is not None:
            log.add(cycle.now_s, truth.position_in_world, status.reference_position_in_world)
            log.air(truth.quaternion_body_to_world, truth.wind_in_world)
        elif log.times or pilot.done:
            break
    if status.phase not in (Phase.ENDING, Phase.DONE) or status.reason:
        raise UasflyError(
            f"{plan.mission.name} with {plan.controller}: expected the legs to be flown to their end, "
            f"found phase {status.phase.value}: {status.reason or 'no reason given'}"
        )
    return log.record()


class _Log:
    def __init__(self, onboard: Mapping[str, Onboard]) -> None:
        self._onboard = onboard
        self.times: list[float] = []
        self._rows: list[tuple[Array, Array]] = []
        self._air: list[tuple[Array, Array]] = []
        self._winds: dict[str, list[Winds]] = {name: [] for name in onboard}

    def add(self, time_s: float, position: Array, reference: Array) -> None:
        self.times.append(time_s)
        self._rows.append((position, np.array(reference)))

    def air(self, quaternion: Array, wind: Array) -> None:
        self._air.append((quaternion, wind))
        for name, one in self._onboard.items():
            self._winds[name].append(one.winds())

    def record(self) -> Record:
        times = np.array(self.times)
        estimates = {
            name: {
                "inverted": np.array([wind.inverted for wind in winds]),
                "inverted_after_ground": np.array([wind.inverted_after_ground for wind in winds]),
                "filtered": np.array([wind.filtered for wind in winds]),
                "bias": np.array([wind.bias for wind in winds]),
            }
            for name, winds in self._winds.items()
        }
        return Record(
            time_s=times - times[0],
            position=np.array([position for position, _ in self._rows]),
            reference=np.array([reference for _, reference in self._rows]),
            quaternion=np.array([quaternion for quaternion, _ in self._air]),
            wind=np.array([wind for _, wind in self._air]),
            estimates=estimates,
            true_bias={name: one.sensors.bias for name, one in self._onboard.items()},
        )
