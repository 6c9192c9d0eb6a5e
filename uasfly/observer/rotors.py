"""Thrust by the rotors' speeds: what acts really, whatever battery and speed controllers make of the command.

A propeller's thrust in still air is rho C_T A R^2 w^2 (Leishman, Principles of Helicopter Aerodynamics, 2.7), so that

    T = g * mean(w^2) / hover^2,

with `hover` the root mean square of the speeds that carry the weight (`model.hover_rotor_rad_s`). What inflow changes
of it counts as force of the wind. Between two samples the thrust is a straight line; after the newest it goes over to
what the commands promise. Where the rotors say nothing, or nothing that can be believed, the commands' thrust acts
alone.
"""

from __future__ import annotations

import math
from bisect import bisect_right

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.messages import RotorSample
from uasfly.observer.thrust import ThrustHistory

FRESH_S = 0.1  # a sample tells the thrust for no longer
FROZEN_S = 0.5  # a rotor whose speed is the same to the last digit for so long is not measured any more
SET_BACK_S = 1.0
_KEPT_S, _PRUNE_AT = 3.0, 512
MEAN_TIME_S = 3.0  # of the means whose ratio is told
EXCESS_TIME_S = 0.5  # well above the rotors' lag, which the commands' dead time only stands for
TOLD_AFTER_S = 1.0  # of flight with rotor data
LARGEST_RATIO = 1.4  # of thrust by rotors over commands, and of its inverse: beyond, pole count or units are wrong
FASTEST_SQUARED = 3.0  # mean square over that in hover: no multirotor's thrust is so much more than its weight


class RotorThrust:
    """Thrust acceleration along the body z axis [m/s^2] over time, by rotor speeds where they are known.

    Args:
        airframe: number and hover speed of the rotors; without the speed the commands' thrust is all there is.
        commands: what the commands promise.

    Attributes:
        excess_m_s2: by how much the thrust is more (negative: less) than the commands promise, low-passed; where the
            attitude takes of it, or the voltage sags under load.

    """

    def __init__(self, airframe: Airframe, commands: ThrustHistory) -> None:
        hover = airframe.model.hover_rotor_rad_s
        self._per_square = 0.0 if hover is None else GRAVITY_M_S2 / (hover * hover * airframe.rotors)
        self._count = airframe.rotors
        self._most = FASTEST_SQUARED * GRAVITY_M_S2
        self._commands = commands
        self._scale = 1.0
        self._believed = True
        self._times: list[float] = []
        self._thrusts: list[float] = []  # of the file's hover speed
        self._speeds: list[float] = []  # of the sample before
        self._changed_s: list[float] = []  # when each of them was last another
        self.excess_m_s2 = 0.0
        self._commanded = 0.0  # thrust that the commands promised before the last sample
        self._by_rotors = self._by_commands = self._weight_s = 0.0  # means, both over the same time

    def add(self, sample: RotorSample, flies: bool) -> bool:
        """Take in a sample; whether it can be used.

        One that is not newer than the last cannot, one that is far older begins anew: the clock was set back.

        Args:
            sample: the speeds.
            flies: whether the vehicle flies, so that commands and speeds belong together.
        """
        time_s, times = sample.time_s, self._times
        if times and time_s < times[-1] - SET_BACK_S:
            times.clear()
            self._thrusts.clear()
        thrust = self._thrust(time_s, sample.speeds_rad_s.tolist()[: self._count])
        if thrust is None:
            return False
        if not flies:
            self._by_rotors = self._by_commands = self._weight_s = self.excess_m_s2 = 0.0
        elapsed_s = time_s - times[-1] if times else FRESH_S
        times.append(time_s)
        self._thrusts.append(thrust)
        if flies and 0.0 < elapsed_s <= FRESH_S:
            kept, commanded = math.exp(-elapsed_s / MEAN_TIME_S), self._commands.mean(time_s - elapsed_s, time_s)
            self._by_rotors = kept * self._by_rotors + elapsed_s * thrust
            self._by_commands = kept * self._by_commands + elapsed_s * commanded
            self._weight_s += elapsed_s
            share = 1.0 - math.exp(-elapsed_s / EXCESS_TIME_S)
            self.excess_m_s2 += share * (self._scale * thrust - commanded - self.excess_m_s2)
            self._commanded = commanded
        if len(times) > _PRUNE_AT:
            keep_from = max(bisect_right(times, time_s - _KEPT_S) - 1, 0)
            del times[:keep_from], self._thrusts[:keep_from]
        self._compare()
        return True

    def fresh(self, time_s: float) -> bool:
        """Whether rotor speeds tell the thrust at about `time_s`."""
        return bool(self._times) and abs(time_s - self._times[-1]) < 2.0 * FRESH_S and self._believed

    @property
    def ratio(self) -> float | None:
        """Mean thrust by rotors over that by commands, low-passed; None where it is not known."""
        if self._weight_s < TOLD_AFTER_S or not self._believed:
            return None
        return self._scale * self._by_rotors / self._by_commands

    def rescale(self, commands: float, rotors: float) -> None:
        """Commands so far, and rotors for good (payload, density of the air), give so many times what was thought."""
        self._commands.rescale(commands)
        if self._thrusts:
            self.excess_m_s2 += (rotors - 1.0) * self._scale * self._thrusts[-1] - (commands - 1.0) * self._commanded
        self._commanded *= commands
        self._by_commands *= commands
        self._scale *= rotors
        self._compare()

    def mean(self, start_s: float, end_s: float) -> float:
        """Mean acceleration [m/s^2] over a short time [start_s, end_s]: by rotors as it is in its middle."""
        times = self._times
        middle_s = 0.5 * (start_s + end_s)
        if not times or middle_s - times[-1] > FRESH_S or not self._believed:
            return self._commands.mean(start_s, end_s)
        after = bisect_right(times, middle_s)
        if after == 0:
            return self._commands.mean(start_s, end_s)
        before_s, before = times[after - 1], self._scale * self._thrusts[after - 1]
        if after < len(times):
            step_s = times[after] - before_s
            if step_s <= FRESH_S:
                return before + (middle_s - before_s) / step_s * (self._scale * self._thrusts[after] - before)
        share = 1.0 - (middle_s - before_s) / FRESH_S
        commanded = self._commands.mean(start_s, end_s)
        if share <= 0.0:
            return commanded
        # About the first-order lag of rotors that go over to the command, with half of FRESH_S as time constant.
        return commanded + share * share * (before - self._commands.mean(before_s, before_s))

    def _compare(self) -> None:
        """Whether speeds and commands agree as far as they must; without a mean they are believed."""
        by_rotors, by_commands = self._scale * self._by_rotors, self._by_commands
        self._believed = by_rotors <= LARGEST_RATIO * by_commands and by_commands <= LARGEST_RATIO * by_rotors

    def _thrust(self, time_s: float, speeds: list[float]) -> float | None:
        """Thrust of a sample, None where it cannot be used.

        A rotor at nil stands, or its speed controller has fallen silent: neither tells the thrust.
        """
        last_s = self._times[-1] if self._times else -math.inf
        if len(speeds) < self._count or not last_s < time_s < math.inf:
            return None
        if len(self._speeds) != len(speeds):
            self._speeds, self._changed_s = speeds, [time_s] * len(speeds)
        changed_s = self._changed_s
        total, oldest_s = 0.0, time_s
        for index, (speed, old) in enumerate(zip(speeds, self._speeds, strict=True)):
            if speed != old:
                changed_s[index] = time_s
            elif changed_s[index] < oldest_s:
                oldest_s = changed_s[index]
            if not speed > 0.0:
                total = math.nan
            total += speed * speed
        self._speeds = speeds
        thrust = total * self._per_square
        return thrust if time_s - oldest_s < FROZEN_S and thrust < self._most else None
