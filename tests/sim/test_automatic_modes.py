from __future__ import annotations

import pytest

from uasfly.messages import FlightMode
from uasfly.sim.automatic_modes import AutomaticModes
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.position_control import MotionSetpoint

STEP = 0.008
STILL = (0.0, 0.0, 0.0)
Vector = tuple[float, float, float]


def modes(**changes: float) -> AutomaticModes:
    """Modes with home at the origin."""
    return AutomaticModes(ParameterTable(changes), STEP)


def ideal(automatic: AutomaticModes, start: Vector, seconds: float) -> list[MotionSetpoint]:
    """Setpoints of a vehicle that follows them without error."""
    position, velocity, setpoints = start, STILL, []
    for _ in range(round(seconds / STEP)):
        setpoint = automatic.update(position, velocity, False, True)
        position, velocity = setpoint.position, setpoint.velocity
        setpoints.append(setpoint)
    return setpoints


def test_hold_brakes_and_stays() -> None:
    """Entered at speed, hold comes to rest ahead of where it began."""
    automatic = modes()
    automatic.enter(FlightMode.HOLD, (0.0, 0.0, 5.0), (3.0, 0.0, 0.0), 0.5, False)
    setpoints = ideal(automatic, (0.0, 0.0, 5.0), 20.0)
    assert setpoints[0].velocity[0] == pytest.approx(3.0, abs=0.1)
    assert setpoints[-1].position == pytest.approx((1.5, 0.0, 5.0), abs=1e-2)
    assert setpoints[-1].yaw_rad == 0.5


def test_land_slows_down_with_height() -> None:
    """From 12 m it sinks with 1.5 m/s, below 5 m with 0.7, below 1 m with 0.3."""
    automatic = modes()
    automatic.enter(FlightMode.LAND, (0.0, 0.0, 14.0), STILL, 0.0, False)
    setpoints = ideal(automatic, (0.0, 0.0, 14.0), 25.0)
    speed_at = {
        height: next(-s.velocity[2] for s in setpoints if s.position[2] <= height) for height in (11.0, 4.0, 0.3)
    }
    assert speed_at[11.0] == pytest.approx(1.5, abs=0.02)
    assert speed_at[4.0] == pytest.approx(0.7, abs=0.02)
    assert speed_at[0.3] == pytest.approx(0.3, abs=0.02)


def test_take_off_ramps_up_then_climbs_and_reports() -> None:
    """The limit rises to MPC_Z_VEL_MAX_UP, the climb once it is positive; then the path; near its height it is done."""
    automatic = modes(MIS_TAKEOFF_ALT=3.0)
    automatic.enter(FlightMode.TAKEOFF, STILL, STILL, 0.0, True)
    assert automatic.update(STILL, STILL, True, False).idle
    ramp = [automatic.update(STILL, STILL, True, True) for _ in range(round(3.0 / STEP))]
    limits, wishes = [s.climb_limit_m_s for s in ramp], [s.velocity[2] for s in ramp]
    assert limits[0] < -2.4
    assert limits == sorted(limits)
    assert limits[-1] == pytest.approx(3.0, abs=0.02)
    assert max(wish for limit, wish in zip(limits, wishes, strict=True) if limit < 0.0) == 0.0
    assert wishes == sorted(wishes)
    assert wishes[-1] == pytest.approx(0.48 * 1.65, abs=0.02)
    assert not automatic.ramping
    assert not automatic.takeoff_done
    setpoints = ideal(automatic, STILL, 15.0)
    assert automatic.takeoff_done
    assert setpoints[-1].position[2] == pytest.approx(3.0, abs=0.02)
    automatic.enter(FlightMode.HOLD, (0.0, 0.0, 2.3), STILL, 0.0, False)
    assert ideal(automatic, (0.0, 0.0, 2.3), 5.0)[-1].position[2] == pytest.approx(3.0, abs=0.02)


def test_a_take_off_height_can_be_given() -> None:
    """A height with the command takes the place of MIS_TAKEOFF_ALT."""
    automatic = modes()
    automatic.takeoff_height_m = 7.0
    automatic.enter(FlightMode.TAKEOFF, (0.0, 0.0, 1.0), STILL, 0.0, False)
    assert ideal(automatic, (0.0, 0.0, 1.0), 20.0)[-1].position[2] == pytest.approx(7.0, abs=0.05)


def test_return_climbs_flies_home_and_lands() -> None:
    """From 20 m away it climbs to RTL_RETURN_ALT first, never leaves the cone, and ends landing at home."""
    automatic = modes(RTL_RETURN_ALT=15.0, RTL_DESCEND_ALT=5.0)
    automatic.enter(FlightMode.RETURN, (20.0, 0.0, 3.0), STILL, 0.0, False)
    setpoints = ideal(automatic, (20.0, 0.0, 3.0), 60.0)
    assert max(s.position[2] for s in setpoints) == pytest.approx(15.0, abs=0.3)
    assert all(s.position[2] > 13.5 for s in setpoints if 2.0 < s.position[0] < 18.0)
    assert setpoints[-1].position[0] == pytest.approx(0.0, abs=0.05)
    assert setpoints[-1].position[2] < 0.0


def test_return_near_home_stays_low() -> None:
    """Close to home the cone asks for no more than twice the distance, far below RTL_RETURN_ALT."""
    automatic = modes()
    automatic.enter(FlightMode.RETURN, (1.5, 0.0, 2.0), STILL, 0.0, False)
    setpoints = ideal(automatic, (1.5, 0.0, 2.0), 20.0)
    assert 2.0 < max(s.position[2] for s in setpoints) <= 3.0
    assert setpoints[-1].position[2] < 0.0


def test_descend_asks_for_no_position() -> None:
    """Descend sinks with MPC_LAND_SPEED, level."""
    automatic = modes()
    automatic.enter(FlightMode.DESCEND, (0.0, 0.0, 5.0), STILL, 0.0, False)
    setpoint = automatic.update((3.0, 1.0, 4.0), STILL, False, True)
    assert (setpoint.track_horizontal, setpoint.track_height) == (False, False)
    assert setpoint.velocity == (0.0, 0.0, -0.7)


def test_on_the_ground_nothing_turns() -> None:
    """Hold on the ground idles."""
    automatic = modes()
    automatic.enter(FlightMode.HOLD, STILL, STILL, 0.0, True)
    assert automatic.update(STILL, STILL, True, True).idle


def test_a_jump_of_the_estimate_moves_the_path() -> None:
    """When the estimate jumps, hold stays where the vehicle is."""
    automatic = modes()
    automatic.enter(FlightMode.HOLD, (0.0, 0.0, 5.0), STILL, 0.0, False)
    automatic.jump((2.0, -1.0, 0.0))
    assert ideal(automatic, (2.0, -1.0, 5.0), 2.0)[-1].position == pytest.approx((2.0, -1.0, 5.0))
