"""Dead time: where the vehicle will be when the command acts that is computed now."""

from __future__ import annotations

import itertools
import math
from collections import deque
from functools import lru_cache

import casadi as ca
import numpy as np

from uasfly import native
from uasfly.airframe import GRAVITY_M_S2, ModelParameters
from uasfly.control.stagewise import Stagewise
from uasfly.control.transcription import interval_function
from uasfly.messages import Array, Setpoint
from uasfly.model import INPUTS, PARAMETER_K_THRUST, PARAMETERS, PITCH, ROLL, STATES

LONGEST_PREDICTION_S = 0.5
KEPT = 256  # setpoints

Command = tuple[float, float, float]  # inputs of the controller's model: thrust, roll and pitch command


@lru_cache(maxsize=1)
def _compiled_interval() -> ca.Function:
    return native.compiled([interval_function()], "interval")[0]


class DelayPredictor:
    """Predicts with the model of the controller and the setpoints that were sent, each acting `command_delay_s` later.

    The attitude loops are solved exactly from the measured attitude, position and velocity with the same step as in
    the transcription, so controller and prediction agree.
    """

    def __init__(self, model: ModelParameters) -> None:
        self._model = model
        # One row a piece of constant command; what one step ends with is what the next one starts from.
        self._states, self._inputs = np.zeros((KEPT + 1, STATES)), np.zeros((KEPT, INPUTS))
        self._parameters, self._yaw_rate = np.zeros(PARAMETERS), np.zeros(1)
        self._yaws, self._durations = np.zeros((KEPT, 1)), np.zeros((KEPT, 1))
        self._steps = Stagewise(
            _compiled_interval(),
            [self._states[:-1], self._inputs, self._parameters, self._yaws, self._yaw_rate, self._durations],
            [self._states[1:]],
        )
        # Commands and from when each acts [s]; the first one acts since ever, None where it is not known.
        self._commands: deque[Command | None] = deque((None,), maxlen=KEPT)
        self._acts_s: deque[float] = deque((-math.inf,), maxlen=KEPT)

    def reset(self, setpoint: Setpoint | None) -> None:
        """Forget what was sent; `setpoint` is what the vehicle was being told so far, if that is known."""
        self._commands.clear()
        self._acts_s.clear()
        self._commands.append(None if setpoint is None else inputs_of(setpoint))
        self._acts_s.append(-math.inf)

    def sent(self, setpoint: Setpoint) -> None:
        """Remember a setpoint, sent at its `time_s`."""
        self._commands.append(inputs_of(setpoint))
        self._acts_s.append(setpoint.time_s + self._model.command_delay_s)

    def predict(
        self, state: Array, yaw_rad: float, yaw_rate_rad_s: float, parameters: Array, from_s: float, to_s: float
    ) -> tuple[Array, float]:
        """State (8,) and yaw [rad] at `to_s` from those at `from_s`.

        Args:
            state: (8,) of the controller's model at `from_s`.
            yaw_rad: at `from_s`.
            yaw_rate_rad_s: taken as constant.
            parameters: (11,) of the model, with the force.
            from_s: time of the estimate.
            to_s: when the next command acts; at most 0.5 s are predicted.
        """
        to_s = min(to_s, from_s + LONGEST_PREDICTION_S)
        commands, acts_s = self._commands, self._acts_s
        while len(acts_s) > 1 and acts_s[1] <= from_s:
            commands.popleft()
            acts_s.popleft()
        at, ends_s = from_s, itertools.chain(itertools.islice(acts_s, 1, None), (to_s,))
        inputs: list[Command] = []
        yaws: list[float] = []
        durations: list[float] = []
        for command, end_s in zip(commands, ends_s, strict=True):
            end = end_s if end_s < to_s else to_s
            if end <= at:
                continue
            inputs.append(self._unknown_inputs(state, parameters) if command is None else command)
            yaws.append(yaw_rad + yaw_rate_rad_s * (at - from_s))
            durations.append(end - at)
            at = end
        count = len(inputs)
        self._states[0], self._parameters[:], self._yaw_rate[0] = state, parameters, yaw_rate_rad_s
        if count:
            self._inputs[:count], self._yaws[:count, 0], self._durations[:count, 0] = inputs, yaws, durations
            for step in self._steps.calls[:count]:
                step()
        return self._states[count].copy(), yaw_rad + yaw_rate_rad_s * max(to_s - from_s, 0.0)

    def _unknown_inputs(self, state: Array, parameters: Array) -> Command:
        """Thrust, roll and pitch command (3,) that keep attitude and height: the guess where nothing is known."""
        model, roll, pitch = self._model, float(state[ROLL]), float(state[PITCH])
        level = max(math.cos(roll) * math.cos(pitch), 0.5)
        hover = GRAVITY_M_S2 / float(parameters[PARAMETER_K_THRUST])
        return min(hover / level, 1.0), roll / model.roll.gain, pitch / model.pitch.gain


def inputs_of(setpoint: Setpoint) -> Command:
    """Inputs (3,) of the controller's model: thrust, roll and pitch command."""
    return setpoint.thrust, setpoint.roll_rad, setpoint.pitch_rad


def state_of(position: Array, velocity: Array, roll_rad: float, pitch_rad: float) -> Array:
    """State (8,) of the controller's model."""
    state = np.empty(STATES)
    state[:3], state[3:6], state[ROLL], state[PITCH] = position, velocity, roll_rad, pitch_rad
    return state
