"""The autopilot's fast loop: estimated attitude and gyro to rotor speed targets, compiled once a build.

One call is what PX4 does on every gyro sample: reference model, attitude feedback, rate PID, mixer and thrust curve.
It is symbolic (CasADi) for speed alone: 250 calls for each simulated second would cost more in Python than the plant.
"""

from __future__ import annotations

import math
from array import array
from functools import lru_cache

import casadi as ca

from uasfly import native
from uasfly.sim.attitude_control import follow_reference_model, rate_setpoint
from uasfly.sim.body import ANGULAR_RATE, ATTITUDE, BODY_STATES, normalised, quaternion_product
from uasfly.sim.compiled import BoundFunction
from uasfly.sim.mixer import THRUST, YAW, mix_commands, mixing_matrix
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.plant import Rotors
from uasfly.sim.rate_control import (
    RateGains,
    butterworth_coefficients,
    filter_gyro,
    low_pass_share,
    next_integral,
    rate_pid,
)

# Memory of the loop between calls.
REFERENCE = slice(0, 4)  # attitude of the reference model
REFERENCE_RATE = slice(4, 7)  # rad/s, its own axes
GYRO_MEMORY = slice(7, 13)
RATE = slice(13, 16)  # rad/s, filtered
ACCELERATION = slice(16, 19)  # rad/s^2, filtered
INTEGRAL = slice(19, 22)  # normalised torque
YAW_TORQUE = 22  # normalised, filtered
SATURATION = slice(23, 26)  # -1, 0, 1
MEMORY = 26

# Setpoint and measurement errors, written before each call.
SETPOINT_ATTITUDE = slice(0, 4)
SETPOINT_THRUST = 4  # 0..1
SETPOINT_YAW_RATE = 5  # rad/s, feed-forward about the vertical
ATTITUDE_ERROR = slice(6, 9)  # rad, small rotation in the body, estimate minus truth
GYRO_ERROR = slice(9, 12)  # rad/s
ARMED = 12  # 1 or 0: motors turn
FLYING = 13  # 1 or 0: integrators work
FULL_SPEED = 14  # rad/s, rotor speed at full command
INPUTS = 15

# Gains, refreshed when parameters change.
_ATTITUDE_GAIN = slice(0, 3)
_RATE_LIMIT = slice(3, 6)
_YAW_WEIGHT = 6
_MODEL_FREQUENCY = 7
_RATE_P = slice(8, 11)
_RATE_I = slice(11, 14)
_RATE_D = slice(14, 17)
_INTEGRAL_LIMIT = slice(17, 20)
_GYRO_FILTER = slice(20, 23)
_DERIVATIVE_SHARE = 23
_YAW_SHARE = 24
_GAINS = 25

_SLOWEST_MODEL_RAD_S, _FASTEST_MODEL_RAD_S = 0.1, 1000.0


class InnerLoop:
    """The fast loop and its memory; write `inputs`, call `step`, read the targets that it was given to write."""

    def __init__(
        self,
        rotors: Rotors,
        parameters: ParameterTable,
        plant_state: array[float],
        targets: array[float],
        step_s: float,
    ) -> None:
        self.memory = array("d", [0.0] * MEMORY)
        self.inputs = array("d", [0.0] * INPUTS)
        self._gains = array("d", [0.0] * _GAINS)
        self._next_memory = array("d", self.memory)
        self._parameters = parameters
        self._step_s = step_s
        self.read_parameters()
        matrix = array("d", mixing_matrix(rotors).ravel(order="F").tolist())
        inputs = (plant_state, self.memory, self.inputs, self._gains, matrix)
        function = _function(rotors.count, rotors.speed_exponent, step_s)
        self._function = BoundFunction(function, inputs, (self._next_memory, targets))
        self.reset((1.0, 0.0, 0.0, 0.0))

    def step(self) -> None:
        """One cycle: rotor targets from the plant's present attitude and rate."""
        self._function.evaluate()
        self.memory[:] = self._next_memory

    def reset(self, attitude: tuple[float, float, float, float]) -> None:
        """Forget integrals, and start the reference model at an attitude (4,)."""
        kept = self.memory[GYRO_MEMORY.start : ACCELERATION.stop]
        self.memory[:] = array("d", [0.0] * MEMORY)
        self.memory[GYRO_MEMORY.start : ACCELERATION.stop] = kept
        self.memory[REFERENCE] = array("d", attitude)

    def read_parameters(self) -> None:
        """Take gains and filters over from the parameter table."""
        value = self._parameters.value
        rate_share = low_pass_share(value("IMU_DGYRO_CUTOFF"), self._step_s)
        yaw_share = low_pass_share(value("MC_YAW_TQ_CUTOFF"), self._step_s)
        axes = ("MC_ROLLRATE_", "MC_PITCHRATE_", "MC_YAWRATE_")
        self._gains[:] = array(
            "d",
            (
                *(value(name) for name in ("MC_ROLL_P", "MC_PITCH_P", "MC_YAW_P")),
                *(math.radians(value(axis + "MAX")) for axis in axes),
                value("MC_YAW_WEIGHT"),
                min(max(value("MC_REF_W_N"), _SLOWEST_MODEL_RAD_S), _FASTEST_MODEL_RAD_S),
                *(value(axis + term) for term in "PID" for axis in axes),
                *(value(name) for name in ("MC_RR_INT_LIM", "MC_PR_INT_LIM", "MC_YR_INT_LIM")),
                *butterworth_coefficients(value("IMU_GYRO_CUTOFF"), self._step_s),
                rate_share,
                yaw_share,
            ),
        )


@lru_cache(maxsize=8)
def _function(count: int, speed_exponent: int, step_s: float) -> ca.Function:
    """The loop for `count` rotors, compiled where that can be had."""
    plant = ca.SX.sym("plant", BODY_STATES + count)
    matrix = ca.SX.sym("matrix", count, THRUST + 1)
    memory = ca.SX.sym("memory", MEMORY)
    inputs = ca.SX.sym("inputs", INPUTS)
    gains = ca.SX.sym("gains", _GAINS)

    attitude = normalised(quaternion_product(plant[ATTITUDE], ca.vertcat(1.0, 0.5 * inputs[ATTITUDE_ERROR])))
    yaw_rate = inputs[SETPOINT_YAW_RATE]
    reference, reference_rate = follow_reference_model(
        memory[REFERENCE], memory[REFERENCE_RATE], inputs[SETPOINT_ATTITUDE], yaw_rate, gains[_MODEL_FREQUENCY], step_s
    )
    wanted_rate = rate_setpoint(
        attitude, reference, yaw_rate, gains[_ATTITUDE_GAIN], gains[_YAW_WEIGHT], gains[_RATE_LIMIT]
    )

    measured = plant[ANGULAR_RATE] + inputs[GYRO_ERROR]
    rate, gyro_memory = filter_gyro(memory[GYRO_MEMORY], measured, gains[_GYRO_FILTER])
    raw_acceleration = (rate - memory[RATE]) / step_s
    acceleration = memory[ACCELERATION] + gains[_DERIVATIVE_SHARE] * (raw_acceleration - memory[ACCELERATION])

    pid = RateGains(gains[_RATE_P], gains[_RATE_I], gains[_RATE_D], gains[_INTEGRAL_LIMIT])
    error = wanted_rate - rate
    torque = rate_pid(error, acceleration, memory[INTEGRAL], pid)
    yaw_torque = memory[YAW_TORQUE] + gains[_YAW_SHARE] * (torque[YAW] - memory[YAW_TORQUE])
    torque = ca.vertcat(torque[:YAW], yaw_torque)
    armed = inputs[ARMED]
    integral = armed * next_integral(error, memory[INTEGRAL], memory[SATURATION], pid, inputs[FLYING], step_s)

    mix = mix_commands(matrix, torque, ca.fmax(0.0, ca.fmin(1.0, inputs[SETPOINT_THRUST])))
    # The speed controllers take speed, the mixer gives thrust: PX4's THR_MDL_FAC of 1.
    curve = ca.sqrt(mix.motors) if speed_exponent == 2 else mix.motors
    saturation = ca.sign(torque) * (mix.kept < 1.0)
    function = ca.Function(
        "inner_loop",
        [plant, memory, inputs, gains, matrix],
        ca.cse(
            [
                ca.vertcat(
                    reference, reference_rate, gyro_memory, rate, acceleration, integral, yaw_torque, saturation
                ),
                armed * inputs[FULL_SPEED] * curve,
            ]
        ),
    )
    return native.compiled([function], f"inner_loop{count}")[0]
