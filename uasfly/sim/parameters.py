"""PX4's parameters as far as the simulated vehicle has them: names, types and values.

Defaults and types are PX4's (main of August 2026); COM_OBL_RC_ACT is 5 (Hold), as in the recorded vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

Parameter = tuple[type[int] | type[float], float]

# A whole number with a point is a float parameter (MAV_PARAM_TYPE_REAL32), one without is an integer (INT32).
_DEFAULTS: dict[str, int | float] = {
    # attitude and rate control
    "MC_ROLL_P": 4.0,
    "MC_PITCH_P": 4.0,
    "MC_YAW_P": 2.8,
    "MC_YAW_WEIGHT": 0.4,
    "MC_REF_W_N": 50.0,
    "MC_ROLLRATE_P": 0.15,
    "MC_ROLLRATE_I": 0.2,
    "MC_ROLLRATE_D": 0.003,
    "MC_ROLLRATE_MAX": 220.0,
    "MC_PITCHRATE_P": 0.15,
    "MC_PITCHRATE_I": 0.2,
    "MC_PITCHRATE_D": 0.003,
    "MC_PITCHRATE_MAX": 220.0,
    "MC_YAWRATE_P": 0.2,
    "MC_YAWRATE_I": 0.1,
    "MC_YAWRATE_D": 0.0,
    "MC_YAWRATE_MAX": 200.0,
    "MC_YAW_TQ_CUTOFF": 2.0,
    "MC_RR_INT_LIM": 0.3,
    "MC_PR_INT_LIM": 0.3,
    "MC_YR_INT_LIM": 0.3,
    "IMU_GYRO_CUTOFF": 40.0,
    "IMU_DGYRO_CUTOFF": 20.0,
    # position control
    "MPC_XY_P": 0.95,
    "MPC_Z_P": 1.0,
    "MPC_XY_VEL_P_ACC": 1.8,
    "MPC_XY_VEL_I_ACC": 0.4,
    "MPC_XY_VEL_D_ACC": 0.2,
    "MPC_Z_VEL_P_ACC": 4.0,
    "MPC_Z_VEL_I_ACC": 2.0,
    "MPC_Z_VEL_D_ACC": 0.0,
    "MPC_VELD_LP": 5.0,
    "MPC_THR_HOVER": 0.5,
    "MPC_THR_MIN": 0.12,
    "MPC_THR_MAX": 1.0,
    "MPC_THR_XY_MARG": 0.3,
    "MPC_MANTHR_MIN": 0.08,
    "MPC_TILTMAX_AIR": 45.0,
    "MPC_TILTMAX_LND": 12.0,
    "MPC_XY_CRUISE": 5.0,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_ACC_HOR": 3.0,
    "MPC_ACC_UP_MAX": 4.0,
    "MPC_ACC_DOWN_MAX": 3.0,
    "MPC_JERK_AUTO": 4.0,
    "MPC_Z_V_AUTO_UP": 3.0,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_TKO_SPEED": 1.5,
    "MPC_TKO_RAMP_T": 3.0,
    "MPC_LAND_SPEED": 0.7,
    "MPC_LAND_CRWL": 0.3,
    "MPC_LAND_ALT1": 10.0,
    "MPC_LAND_ALT2": 5.0,
    "MPC_LAND_ALT3": 1.0,
    "MIS_TAKEOFF_ALT": 2.5,
    "NAV_MC_ALT_RAD": 0.8,
    "RTL_RETURN_ALT": 30.0,
    "RTL_DESCEND_ALT": 10.0,
    "RTL_MIN_DIST": 10.0,
    # commander
    "COM_OF_LOSS_T": 1.0,
    "COM_OBL_RC_ACT": 5,
    "COM_RCL_EXCEPT": 0,
    "COM_DLL_EXCEPT": 0,
    "COM_RC_IN_MODE": 1,
    "COM_DISARM_PRFLT": 10.0,
    "COM_DISARM_LAND": 2.0,
    "COM_SPOOLUP_TIME": 1.0,
    "COM_FAIL_ACT_T": 5.0,
    "COM_LOW_BAT_ACT": 3,
    "COM_POS_FS_EPH": 5.0,
    "NAV_RCL_ACT": 2,
    "NAV_DLL_ACT": 0,
    "BAT_LOW_THR": 0.15,
    "BAT_CRIT_THR": 0.07,
    "BAT_EMERGEN_THR": 0.05,
    "BAT1_N_CELLS": 4,
    "GF_ACTION": 2,
    "LNDMC_Z_VEL_MAX": 0.25,
    "LNDMC_XY_VEL_MAX": 1.5,
    "LNDMC_ROT_MAX": 20.0,
    # estimator and system
    "EKF2_GPS_CTRL": 7,
    "EKF2_EV_CTRL": 0,
    "EKF2_NOAID_TOUT": 5000000,
    "CA_ROTOR_COUNT": 4,
    "MAV_SYS_ID": 1,
    "MAV_TYPE": 2,
    "SYS_AUTOSTART": 10040,
}

_LARGEST = 1e6  # far beyond every meaning, and small enough for no product of two to overflow
_LARGEST_INTEGER = 2**31 - 1


class ParameterTable(dict[str, Parameter]):
    """Name -> (type, value); `version` grows with every change, so that users of a value know when to read it again.

    Like PX4 the table takes any finite value, however senseless; one beyond +-1e6 is kept at that.

    Raises:
        KeyError: an unknown name is assigned.
        TypeError: the type is not the parameter's.
        ValueError: the value is not finite.
    """

    def __init__(self, changes: Mapping[str, float] | None = None) -> None:
        super().__init__({name: (type(value), value) for name, value in _DEFAULTS.items()})
        self.version = 0
        for name, value in (changes or {}).items():
            self.set(name, value)

    def __setitem__(self, name: str, parameter: Parameter) -> None:
        kind, value = parameter
        if name not in self:
            raise KeyError(f"unknown parameter {name!r}")
        if kind is not self[name][0]:
            raise TypeError(f"{name} is of type {self[name][0].__name__}, found {kind.__name__}")
        if not math.isfinite(value):
            raise ValueError(f"{name} must be finite, found {value}")
        bound = _LARGEST if kind is float else _LARGEST_INTEGER
        super().__setitem__(name, (kind, kind(max(-bound, min(bound, value)))))
        self.version += 1

    def set(self, name: str, value: float) -> None:
        """Give a parameter a new value, keeping its type."""
        if name not in self:
            raise KeyError(f"unknown parameter {name!r}")
        self[name] = (self[name][0], value)

    def value(self, name: str) -> float:
        """Value of a parameter."""
        return self[name][1]
