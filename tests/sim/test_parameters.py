from __future__ import annotations

import math

import pytest

from uasfly.sim.parameters import ParameterTable


def test_recorded_values_are_the_defaults() -> None:
    """Names, types and values are those that the recorded vehicle gave."""
    table = ParameterTable()
    recorded = {
        "COM_OF_LOSS_T": (float, 1.0),
        "COM_OBL_RC_ACT": (int, 5),
        "COM_RCL_EXCEPT": (int, 0),
        "COM_RC_IN_MODE": (int, 1),
        "NAV_RCL_ACT": (int, 2),
        "NAV_DLL_ACT": (int, 0),
        "MPC_THR_HOVER": (float, 0.5),
        "EKF2_GPS_CTRL": (int, 7),
        "COM_LOW_BAT_ACT": (int, 3),
    }
    assert {name: table[name] for name in recorded} == recorded
    assert "NO_SUCH_PARAM" not in table


def test_a_change_keeps_the_type_and_counts() -> None:
    """Assigning and `set` change the value, keep the type, and make the version grow."""
    table = ParameterTable({"MC_ROLL_P": 7})
    assert table["MC_ROLL_P"] == (float, 7.0)
    before = table.version
    table["COM_OBL_RC_ACT"] = (int, 4)
    table.set("MIS_TAKEOFF_ALT", 3)
    assert table.version == before + 2
    assert table["COM_OBL_RC_ACT"] == (int, 4)
    assert isinstance(table.value("MIS_TAKEOFF_ALT"), float)


def test_what_is_no_parameter_is_refused() -> None:
    """Unknown names, other types and numbers that are none raise."""
    table = ParameterTable()
    with pytest.raises(KeyError, match="NO_SUCH"):
        table.set("NO_SUCH", 1.0)
    with pytest.raises(KeyError):
        table["NO_SUCH"] = (float, 1.0)
    with pytest.raises(TypeError, match="is of type float, found int"):
        table["MC_ROLL_P"] = (int, 4)
    with pytest.raises(ValueError, match="must be finite"):
        table["MC_ROLL_P"] = (float, math.nan)


def test_senseless_values_stay_countable() -> None:
    """A value beyond all meaning is kept at a million."""
    table = ParameterTable()
    table["MC_ROLL_P"] = (float, 3e38)
    assert table.value("MC_ROLL_P") == 1e6
