import pytest

from uasfly.messages import FlightMode
from uasfly.sim.mavlink.modes import asked_mode, base_mode, custom_mode, standard_mode


@pytest.mark.parametrize(
    ("mode", "number"),
    [
        (FlightMode.HOLD, 50593792),
        (FlightMode.TAKEOFF, 33816576),
        (FlightMode.OFFBOARD, 393216),
        (FlightMode.LAND, 100925440),
        (FlightMode.DESCEND, 335806464),
    ],
)
def test_custom_mode_is_what_px4_sent(mode: FlightMode, number: int) -> None:
    """The custom modes are those of the recording."""
    assert custom_mode(mode) == number


@pytest.mark.parametrize(
    ("mode", "armed", "setpoints", "flags"),
    [
        (FlightMode.HOLD, False, False, 29),
        (FlightMode.HOLD, True, False, 157),
        (FlightMode.OFFBOARD, False, False, 1),
        (FlightMode.OFFBOARD, True, True, 145),
        (FlightMode.DESCEND, True, False, 157),
    ],
)
def test_base_mode_is_what_px4_sent(mode: FlightMode, armed: bool, setpoints: bool, flags: int) -> None:
    """The flags are those of the recording; in offboard without setpoints nothing is stabilised."""
    assert base_mode(mode, armed, setpoints) == flags


def test_only_modes_that_px4_enters_on_demand_can_be_asked_for() -> None:
    """Every other mode comes back from its own numbers; Descend is PX4's own decision; missions are not simulated."""
    for mode in set(FlightMode) - {FlightMode.DESCEND, FlightMode.OTHER}:
        number = custom_mode(mode)
        assert asked_mode(number >> 16 & 0xFF, number >> 24 & 0xFF) is mode
    assert asked_mode(4, 20) is None
    assert asked_mode(4, 4) is None
    assert asked_mode(1, 0) is None


def test_the_sub_mode_counts_in_auto_only() -> None:
    """PX4 looks at the sub mode of offboard no more than at that of Position."""
    assert asked_mode(6, 3) is FlightMode.OFFBOARD


def test_standard_modes_are_those_of_the_recording() -> None:
    """Hold and offboard are no standard modes to PX4, take-off is 8, landing 7."""
    modes = (FlightMode.HOLD, FlightMode.OFFBOARD, FlightMode.TAKEOFF, FlightMode.LAND)
    assert [standard_mode(mode) for mode in modes] == [0, 0, 8, 7]
