"""The in-process end: what arrives when, what acts when, and the same each time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler
from uasfly.link.in_process import ANSWER_LATENCY_S, InProcessLink
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    OdometrySample,
    Request,
    RequestKind,
    RequestResult,
    RotorSample,
    Sample,
    Setpoint,
    TextSample,
    TruthSample,
    VehicleSample,
)
from uasfly.sim.link_faults import LinkFaults

STEP_S = 0.004
ZERO = np.zeros(3)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
SETPOINT = Setpoint(0.0, 0.1, -0.05, 0.7, 0.2, 0.4)


@dataclass
class ClockworkVehicle:
    """Its time, and what was done to it when; its position is its time, so that a sample tells when it was read."""

    time_s: float = 0.0
    refusal: str = ""
    done: list[tuple[float, object]] = field(default_factory=list)
    targets: list[tuple[float, Array, float, float | None]] = field(default_factory=list)
    texts: list[TextSample] = field(default_factory=list)
    boots: int = 1
    tells_rotors: bool = False
    link_faults: LinkFaults = field(default_factory=lambda: LinkFaults(np.random.default_rng(0)))

    def truth(self) -> TruthSample:
        """Where it is."""
        return TruthSample(self.time_s, np.full(3, self.time_s), ZERO, LEVEL, ZERO, ZERO)

    def advance_to(self, time_s: float) -> None:
        """Whole steps only, never back."""
        self.time_s = max(self.time_s, math.floor(time_s / STEP_S + 1e-6) * STEP_S)

    def set_attitude_target(self, quaternion_body_to_world: Array, thrust: float, yaw_rate_rad_s: float | None) -> None:
        """Remember."""
        self.targets.append((self.time_s, quaternion_body_to_world, thrust, yaw_rate_rad_s))

    def set_mode(self, mode: FlightMode) -> tuple[bool, str]:
        """Remember, and say so as PX4 does."""
        self.texts.append(TextSample(self.time_s, 6, f"mode {mode.value}"))
        return self._do(mode)

    def set_takeoff_height(self, height_m: float) -> None:
        """Remember."""
        self.done.append((self.time_s, height_m))

    def arm(self) -> tuple[bool, str]:
        """Remember."""
        return self._do("arm")

    def disarm(self) -> tuple[bool, str]:
        """Remember."""
        return self._do("disarm")

    def odometry(self) -> OdometrySample:
        """Where it is."""
        return OdometrySample(self.time_s, np.full(3, self.time_s), ZERO, LEVEL, ZERO)

    def attitude_target(self) -> AttitudeTargetSample:
        """Level."""
        return AttitudeTargetSample(self.time_s, LEVEL, 0.3)

    def accelerometer(self) -> AccelerometerSample:
        """Carries its time."""
        return AccelerometerSample(self.time_s, np.array((self.time_s, 0.0, 9.8)))

    def rotors(self) -> RotorSample | None:
        """Carries its time, too."""
        return RotorSample(self.time_s, np.full(6, self.time_s)) if self.tells_rotors else None

    def battery(self) -> BatterySample:
        """Full."""
        return BatterySample(self.time_s, 16.8, 1.0)

    @property
    def condition(self) -> tuple[FlightMode, bool, bool]:
        """On the ground."""
        return FlightMode.HOLD, False, False

    def state(self) -> VehicleSample:
        """On the ground."""
        return VehicleSample(self.time_s, FlightMode.HOLD, armed=False, in_air=False)

    def health(self) -> HealthSample:
        """Well."""
        return HealthSample(self.time_s, True, True, True, 3, 12, 0.5)

    def take_texts(self) -> list[TextSample]:
        """Texts since the last call."""
        texts, self.texts = self.texts, []
        return texts

    def _do(self, what: object) -> tuple[bool, str]:
        self.done.append((self.time_s, what))
        return not self.refusal, self.refusal


def _link(
    vehicle: ClockworkVehicle, telemetry_s: float = 0.0, command_s: float = 0.0, jitter_s: float = 0.0, seed: int = 1
) -> InProcessLink:
    return InProcessLink(vehicle, telemetry_s, command_s, jitter_s, np.random.default_rng(seed))


def _fly(link: InProcessLink, seconds: float, period_s: float = 0.02) -> list[tuple[float, Sample]]:
    """Poll once a cycle; samples with the time of the poll."""
    arrived: list[tuple[float, Sample]] = []
    for k in range(1, round(seconds / period_s) + 1):
        link.advance_to(k * period_s)
        arrived += [(k * period_s, sample) for sample in link.poll()]
    return arrived


def test_streams_come_at_the_rates_that_px4_is_asked_for() -> None:
    """Odometry 100, attitude target, accelerometer and rotors 50, state 2, battery 1, health 5 Hz; no rotors: none."""
    vehicle = ClockworkVehicle()
    kinds = [type(sample) for _, sample in _fly(_link(vehicle), 10.0)]
    assert RotorSample not in kinds
    vehicle = ClockworkVehicle()
    vehicle.tells_rotors = True
    kinds = [type(sample) for _, sample in _fly(_link(vehicle), 10.0)]
    counts = {kind: kinds.count(kind) for kind in set(kinds)}
    assert counts == {
        OdometrySample: 1000,
        AttitudeTargetSample: 500,
        AccelerometerSample: 500,
        RotorSample: 500,
        VehicleSample: 20,
        BatterySample: 10,
        HealthSample: 50,
    }


@pytest.mark.parametrize("latency_s", [0.0, 0.01, 0.035, 0.2])
def test_a_sample_arrives_its_latency_after_it_was_true(latency_s: float) -> None:
    """Never earlier, and with the next poll after it; it carries the time it was true, and the state of that time."""
    for now, sample in _fly(_link(ClockworkVehicle(), telemetry_s=latency_s), 2.0):
        assert sample.time_s + latency_s <= now + 1e-9
        assert now - sample.time_s - latency_s < 0.02 + 1e-9
        if isinstance(sample, OdometrySample):
            assert float(sample.position_in_world[0]) == sample.time_s


def test_each_stream_keeps_its_order() -> None:
    """Without jitter everything arrives in the order in which it was true, ties in a fixed order."""
    arrived = [sample for _, sample in _fly(_link(ClockworkVehicle(), telemetry_s=0.03), 3.0)]
    times = [sample.time_s for sample in arrived]
    assert times == sorted(times)


def test_jitter_delays_by_a_random_share() -> None:
    """With a fast poll: delays spread evenly over the jitter, above the latency."""
    latency, jitter = 0.02, 0.008
    link = _link(ClockworkVehicle(), telemetry_s=latency, jitter_s=jitter)
    delays = [now - s.time_s for now, s in _fly(link, 10.0, 0.0005) if isinstance(s, OdometrySample)]
    assert min(delays) >= latency - 1e-9
    assert max(delays) <= latency + jitter + 0.0005 + 1e-9
    assert float(np.mean(delays)) == pytest.approx(latency + 0.5 * jitter + 0.00025, abs=0.0004)


@pytest.mark.parametrize("latency_s", [0.0, 0.012, 0.04])
def test_a_setpoint_acts_its_latency_after_it_was_sent(latency_s: float) -> None:
    """On the vehicle's first step grid at or before that time, with attitude, thrust and yaw rate unchanged."""
    vehicle = ClockworkVehicle()
    link = _link(vehicle, command_s=latency_s)
    link.advance_to(1.0)
    link.send(SETPOINT)
    assert vehicle.targets == []
    link.advance_to(1.0 + latency_s)
    ((time_s, quaternion, thrust, yaw_rate),) = vehicle.targets
    assert time_s == pytest.approx(1.0 + latency_s, abs=STEP_S)
    np.testing.assert_array_equal(quaternion, quaternion_from_euler(0.1, -0.05, 0.7))
    assert (thrust, yaw_rate) == (0.4, 0.2)


def test_setpoints_act_in_the_order_in_which_they_were_sent() -> None:
    """Also two of the same cycle."""
    vehicle = ClockworkVehicle()
    link = _link(vehicle, command_s=0.01)
    for k in range(20):
        link.advance_to(0.02 * (k // 2))
        link.send(replace(SETPOINT, thrust=0.01 * k))
    link.advance_to(1.0)
    assert [thrust for _, _, thrust, _ in vehicle.targets] == [0.01 * k for k in range(20)]


@pytest.mark.parametrize(
    "change",
    [
        *({name: value} for name in ("roll_rad", "pitch_rad", "yaw_rad", "yaw_rate_rad_s") for value in (math.nan,)),
        {"roll_rad": math.inf},
        {"thrust": math.nan},
        {"thrust": -0.01},
        {"thrust": 1.01},
    ],
    ids=str,
)
def test_a_setpoint_that_must_not_leave_does_not(change: dict[str, float]) -> None:
    """Not finite, or thrust outside 0..1: an error, and the vehicle never sees it."""
    vehicle = ClockworkVehicle()
    link = _link(vehicle)
    with pytest.raises(ValueError, match=r"finite|thrust"):
        link.send(replace(SETPOINT, **change))
    link.advance_to(1.0)
    assert vehicle.targets == []


@pytest.mark.parametrize(
    ("kind", "done"),
    [
        (RequestKind.ARM, "arm"),
        (RequestKind.DISARM, "disarm"),
        (RequestKind.TAKEOFF, FlightMode.TAKEOFF),
        (RequestKind.OFFBOARD, FlightMode.OFFBOARD),
        (RequestKind.HOLD, FlightMode.HOLD),
        (RequestKind.LAND, FlightMode.LAND),
        (RequestKind.RETURN, FlightMode.RETURN),
    ],
)
@pytest.mark.parametrize("refusal", ["", "not now"])
def test_every_request_reaches_the_vehicle_and_is_answered(kind: RequestKind, done: object, refusal: str) -> None:
    """The answer names the request, whether it was accepted, and the vehicle's words; it comes after the way back."""
    vehicle = ClockworkVehicle(refusal=refusal)
    link = _link(vehicle, command_s=0.02)
    link.advance_to(1.0)
    request = Request(kind, 2.5 if kind is RequestKind.TAKEOFF else 0.0)
    link.request(request)
    arrived = _fly(link, 2.0)
    (result,) = [sample for _, sample in arrived if isinstance(sample, RequestResult)]
    assert (result.request, result.accepted, result.text) == (request, not refusal, refusal)
    assert result.time_s == pytest.approx(1.02)
    assert next(now for now, sample in arrived if sample is result) >= 1.02 + ANSWER_LATENCY_S - 1e-9
    expected = [2.5, done] if kind is RequestKind.TAKEOFF else [done]  # the height is set first
    assert [what for _, what in vehicle.done] == expected


def test_texts_travel_as_samples_do() -> None:
    """What the vehicle says to a command arrives after the telemetry's latency."""
    vehicle = ClockworkVehicle()
    link = _link(vehicle, telemetry_s=0.1)
    link.request(Request(RequestKind.HOLD))
    ((now, text),) = [(now, sample) for now, sample in _fly(link, 1.0) if isinstance(sample, TextSample)]
    assert text.text == "mode hold"
    assert now >= text.time_s + 0.1 - 1e-9


def test_the_same_seed_gives_the_same_flight() -> None:
    """With jitter on both ways: equal seeds, equal arrivals and effects; another seed, others."""

    def fly(seed: int) -> tuple[list[tuple[float, str, float]], list[float]]:
        vehicle = ClockworkVehicle()
        link = _link(vehicle, 0.02, 0.015, 0.02, seed)
        arrived: list[tuple[float, str, float]] = []
        for k in range(1, 200):
            link.advance_to(0.02 * k)
            arrived += [(0.02 * k, type(sample).__name__, sample.time_s) for sample in link.poll()]
            link.send(SETPOINT)
        return arrived, [time_s for time_s, *_ in vehicle.targets]

    assert fly(1) == fly(1)
    assert fly(1) != fly(2)
