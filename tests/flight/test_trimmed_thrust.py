"""Observer and controller reckon with the trimmed thrust, and the flight tells of it."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
import pytest

from tests.winds import wind_estimate
from uasfly.airframe import GRAVITY_M_S2
from uasfly.control.controller import Controller
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.flight.tracking_errors import MarkerDatum
from uasfly.flight.trimmed_thrust import INTERVAL_S, OFF_THE_GROUND_S, TrimmedThrust
from uasfly.frames import quaternion_from_euler
from uasfly.messages import Sample, StateEstimate, Status, TruthSample
from uasfly.observer import Observer
from uasfly.wind_messages import WindEstimate

PERIOD_S = 0.02
LEVEL, ZERO, SIGMA = np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3), np.full(3, 0.1)


class Reckoning:
    """Stands for observer and controller; `force` is what it takes to balance a thrust that is `true` shares off."""

    def __init__(self, true: float, *, takes: bool = True) -> None:
        self.true, self.takes = true, takes
        self.scale = 1.0  # of the observer's thrust
        self.trims: list[float] = []
        self.wind: WindEstimate | None = None
        self.trimmed = TrimmedThrust(cast(Observer, self), cast(Controller, self))
        self.texts: list[str] = []
        self.rotor_ratio: float | None = None  # as the observer tells it
        self.rotor_scale = 1.0
        self.rotor_excess_m_s2 = 0.0

    def correct_thrust(self, commands: float, rotors: float = 1.0) -> None:
        """As the observer does."""
        self.scale *= commands
        self.rotor_scale *= rotors
        if self.rotor_ratio is not None:
            self.rotor_ratio *= rotors / commands

    def trim_thrust(self, trim: float) -> float:
        """As the controller does."""
        self.trims.append(trim if self.takes else 0.0)
        return self.trims[-1]

    def k_thrust_m_s2(self, _: float | None) -> float:
        """As the controller does."""
        return 28.5 * (1.0 + (self.trims[-1] if self.trims else 0.0))

    def fly(self, start_s: float, end_s: float, *, in_air: bool = True, up: float | None = None) -> None:
        """Hover; with `up` [m/s^2] that is the force."""
        for cycle in range(round(start_s / PERIOD_S), round(end_s / PERIOD_S)):
            left = GRAVITY_M_S2 * (1.0 - self.scale / (1.0 + self.true)) if up is None else up
            force = np.array((0.0, 0.0, left))
            time_s = cycle * PERIOD_S
            estimate = StateEstimate(time_s, ZERO, ZERO, LEVEL, ZERO, force, ZERO, SIGMA, SIGMA, SIGMA)
            text = self.trimmed.step(time_s, estimate, in_air, self.wind)
            if text:
                self.texts.append(text)


def test_both_are_told_the_same_five_times_a_second() -> None:
    """And the force goes to zero."""
    reckoning = Reckoning(-0.08)
    reckoning.fly(0.0, 60.0)
    assert reckoning.trims[-1] == reckoning.trimmed.trim == pytest.approx(-0.08, abs=0.005)
    assert reckoning.scale == pytest.approx(1.0 + reckoning.trims[-1])
    assert len(reckoning.trims) == pytest.approx((60.0 - OFF_THE_GROUND_S) / INTERVAL_S, abs=2)
    assert not reckoning.texts


@pytest.mark.parametrize("takes", [True, False])
def test_the_observer_has_the_trim_whatever_the_controller_takes(takes: bool) -> None:
    """The PIDs' integral needs none."""
    reckoning = Reckoning(-0.08, takes=takes)
    reckoning.fly(0.0, 60.0)
    assert reckoning.trimmed.k_thrust_m_s2(None) == pytest.approx(28.5 * reckoning.scale)
    assert reckoning.scale == pytest.approx(0.92, abs=0.005)


def test_it_is_frozen_on_the_ground_and_just_above() -> None:
    """What was learnt stays there."""
    reckoning = Reckoning(-0.08)
    reckoning.fly(0.0, 20.0, in_air=False)
    reckoning.fly(20.0, 20.0 + OFF_THE_GROUND_S)
    assert not reckoning.trims
    reckoning.fly(20.0 + OFF_THE_GROUND_S, 60.0)
    learnt = reckoning.trimmed.trim
    reckoning.true = 0.0
    reckoning.fly(60.0, 80.0, in_air=False)
    reckoning.fly(80.0, 80.0 + OFF_THE_GROUND_S)
    assert reckoning.trimmed.trim == learnt
    reckoning.fly(80.0 + OFF_THE_GROUND_S, 100.0)
    assert abs(reckoning.trimmed.trim) < 0.01


@pytest.mark.parametrize(("true", "told"), [(-0.12, "12 % less"), (0.12, ""), (0.23, "23 % more")])
def test_much_is_told_once(true: float, told: str) -> None:
    """Less from a tenth on, more from a fifth on, which wind across the rotors may be."""
    reckoning = Reckoning(true)
    reckoning.fly(0.0, 120.0)
    assert len(reckoning.texts) == bool(told)
    if told:
        size, unit, kind = told.split()
        words = reckoning.texts[0].split()
        assert words[:2] == ["thrust", "is"] and words[3:5] == [unit, kind]
        assert abs(int(words[2]) - int(size)) <= 3


def air(east_m_s: float, gust_m_s: float) -> WindEstimate:
    """A wind to the east."""
    return wind_estimate(velocity_in_world=np.array((east_m_s, 0.0)), gust_m_s=gust_m_s)


def test_rotors_tell_the_commands_trim_at_once() -> None:
    """A sag of 8 %: taken with the first look, and the force has no part in it."""
    reckoning = Reckoning(-0.08)
    reckoning.rotor_ratio = 0.92
    reckoning.fly(0.0, OFF_THE_GROUND_S + 2.0 * INTERVAL_S, up=0.0)
    assert reckoning.trimmed.trim == reckoning.trims[-1] == pytest.approx(-0.08)
    assert reckoning.scale == pytest.approx(0.92)
    assert reckoning.rotor_scale == 1.0


@pytest.mark.parametrize(("speed", "gust", "learns"), [(0.5, 1.0, True), (5.0, 5.0, False), (0.5, 5.0, False)])
def test_what_stays_in_the_force_of_still_air_is_the_rotors(speed: float, gust: float, learns: bool) -> None:
    """A payload of 5 % goes into both thrusts; lift by wind across the rotors stays in the force, in lulls too."""
    reckoning = Reckoning(0.0)
    reckoning.rotor_ratio, reckoning.wind = 1.0, air(speed, gust)
    for second in range(60):
        force = GRAVITY_M_S2 * (1.0 - reckoning.rotor_scale / 0.95)
        reckoning.fly(float(second), second + 1.0, up=force)
    assert reckoning.trimmed.rotor_trim == pytest.approx(-0.05 if learns else 0.0, abs=0.01)
    assert reckoning.trimmed.trim == pytest.approx(reckoning.trimmed.rotor_trim, abs=1e-9)


def test_a_controller_sees_what_is_missing_of_its_thrust_as_a_force() -> None:
    """Along the body's z; without rotors the estimate goes through as it is."""
    reckoning = Reckoning(0.0)
    tilted = quaternion_from_euler(0.3, 0.0, 0.0)
    estimate = StateEstimate(0.0, ZERO, ZERO, tilted, ZERO, np.array((0.1, 0.2, 0.3)), ZERO, SIGMA, SIGMA, SIGMA)
    assert reckoning.trimmed.as_commanded(estimate) is estimate
    reckoning.rotor_excess_m_s2 = -0.5
    seen = reckoning.trimmed.as_commanded(estimate).force_in_world
    np.testing.assert_allclose(seen, (0.1, 0.2 + 0.5 * math.sin(0.3), 0.3 - 0.5 * math.cos(0.3)))


def test_when_rotors_fall_silent_the_force_takes_over_from_their_trim() -> None:
    """No jump, and it goes on learning."""
    reckoning = Reckoning(-0.08)
    reckoning.rotor_ratio = 0.92
    reckoning.fly(0.0, 10.0, up=0.0)
    reckoning.rotor_ratio = None
    reckoning.fly(10.0, 11.0)
    assert reckoning.trimmed.trim == pytest.approx(-0.08, abs=1e-3)
    reckoning.true = -0.12
    reckoning.fly(11.0, 120.0)
    assert reckoning.trimmed.trim == pytest.approx(-0.12, abs=0.01)


def test_with_rotors_a_sag_in_gusts_is_no_downdraft() -> None:
    """15 % less thrust than the file says, in gusts: the force is the air's to 0.1 m/s^2."""
    errors: list[float] = []

    def see(status: Status, samples: tuple[Sample, ...], _: MarkerDatum | None) -> None:
        truths = [sample for sample in samples if isinstance(sample, TruthSample)]
        if status.leg_started and status.estimate is not None and truths:
            errors.append(float(status.estimate.force_in_world[2] - truths[-1].force_in_world[2]))

    settings = [
        "mission.legs[0].duration_s=10",
        "scenario.sensors.rotor_speeds=true",
        "airframe.battery.thrust_exponent=0",
        "plant.battery.open_circuit=[[0.0, 12.5], [1.0, 15.2]]",
    ]
    summary = rehearse(load_plan("hover", "f550", scenario="gusty", seed=1, settings=settings), witness=see)
    assert summary["outcome"] == "completed"
    means = [float(np.mean(part)) for part in np.array_split(np.array(errors), 2)]
    assert np.abs(means).max() < 0.1  # 0.7 without rotor speeds
    assert -0.17 < summary["thrust_trim"] < -0.11


def test_a_payload_and_a_silent_sag_show_no_downdraft() -> None:
    """12 % more mass, a voltage that is not believed, and 2 % of sag a minute: no force, the height held, and told."""
    forces: list[tuple[float, float]] = []
    heights: list[float] = []  # m, true above reference

    def see(status: Status, samples: tuple[Sample, ...], _: MarkerDatum | None) -> None:
        reference = status.reference_position_in_world
        if status.leg_started and status.estimate is not None and reference is not None:
            forces.append((status.time_s, float(status.estimate.force_in_world[2])))
            truths = [sample for sample in samples if isinstance(sample, TruthSample)]
            heights.extend(float(truth.position_in_world[2] - reference[2]) for truth in truths)

    settings = [
        "mission.legs[0].duration_s=45",
        "plant.mass_kg=2.016",
        "airframe.battery.thrust_exponent=0",
        "plant.battery.open_circuit=[[0.0, 12.5], [1.0, 16.4]]",
    ]
    plan = load_plan("hover", "f550", scenario="calm", seed=1, settings=settings)
    summary = rehearse(plan, witness=see)
    assert summary["outcome"] == "completed"
    times, force = np.array(forces).T
    low, share, value = np.empty(len(force)), 1.0 - math.exp(-PERIOD_S / 5.0), force[0]
    for index, new in enumerate(force.tolist()):
        value += share * (new - value)
        low[index] = value
    assert np.abs(low[times > times[0] + 20.0]).max() < 0.1
    assert np.abs(heights[round(20.0 / PERIOD_S) :]).max() < 0.02
    assert -0.16 < summary["thrust_trim"] < -0.11
    assert any("less than the airframe file says" in text for text in summary["warnings"])
