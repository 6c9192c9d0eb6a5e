"""Shape of the responses to what PX4 was told: roll and pitch steps, a push of thrust, yaw ramps.

Both vehicles get the same setpoints at the same times of their clocks; times count from the setpoint that makes the
step, as ATTITUDE_TARGET stamps it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.conformance.recording import Received, Recording, contents
from tests.conformance.replay import RAMP_WITH_RATE, Flight, Setpoint, setpoints
from tests.conformance.rows import Row, apart, close
from uasfly.frames import euler_from_quaternion
from uasfly.messages import Array

STEPS = (("roll +10 deg", 0), ("roll -10 deg", 0), ("pitch +10 deg", 1), ("pitch -10 deg", 1))
STEP_S, STEP_AND_RETURN_S = 1.0, 2.0
THRUST = "thrust +0.1"
RAMP_WITHOUT_RATE = "yaw ramp 0.5 rad/s, mask 7"
RAMP_S = 3.0
_RISE = 0.632
_ANGLE_DEG = 0.25
_ANGLE_REASON = "noise of the estimate: 0.11 deg white, 0.11 deg wandering"
_TIME_S = 0.012
_TIME_REASON = "0.3 deg of noise at 25 deg/s: one sample of ATTITUDE"
_YAW_DEG = 0.35
_YAW_REASON = "noise of the estimate: 0.11 deg wandering, three sigma"
_TAKE_OFF_REASON = "known difference: lifts off 0.2 s earlier, brakes more gently before the height is reached"
_SPEED_M_S = 0.05
_SPEED_REASON = "noise of the estimate: 0.02 m/s white and 0.01 m/s wandering"


def response_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Every response."""
    told = setpoints(recording)
    sides = recording.received, flight.received
    attitudes = [_series(side, "ATTITUDE", ("roll", "pitch", "yaw")) for side in sides]
    for series in attitudes:
        series[:, 1:] = np.degrees(series[:, 1:])
    rows = []
    for phase, axis in STEPS:
        rows += _step(phase, axis, told, attitudes, recording.phase(phase)[0])
    velocities = [_series(side, "LOCAL_POSITION_NED", ("z", "vz")) for side in sides]
    rows += _take_off(recording, velocities)
    rows += _push(told, velocities, recording.phase(THRUST))
    rows += _ramp(RAMP_WITHOUT_RATE, told, attitudes, recording.phase(RAMP_WITHOUT_RATE)[0])
    return rows + _ramp(RAMP_WITH_RATE, told, attitudes, recording.phase(RAMP_WITH_RATE)[0])


def _series(received: list[Received], name: str, fields: Sequence[str]) -> Array:
    """Time stamps [s] and fields of a message, one row each; two messages of one stamp are one."""
    messages = {m.time_boot_ms: m for m in contents(received, name)}
    return np.array([(stamp * 1e-3, *(getattr(m, field) for field in fields)) for stamp, m in messages.items()])


def _step(phase: str, axis: int, told: list[Setpoint], attitudes: list[Array], begin_s: float) -> list[Row]:
    """Rise, overshoot, steady state, return, and the whole phase."""
    near = [one for one in told if begin_s - 0.1 <= one.time_s < begin_s + STEP_AND_RETURN_S]
    angles = [(one.time_s, _angles_deg(one)[axis]) for one in near]
    up_s, size = next((time_s, angle) for time_s, angle in angles if abs(angle) > 5.0)
    down_s = next(time_s for time_s, angle in angles if time_s > up_s and abs(angle) < 5.0)
    end_s = up_s + STEP_AND_RETURN_S
    shares = [np.column_stack((series[:, 0], series[:, 1 + axis] / size)) for series in attitudes]
    rise = [_reaches(share, up_s, _RISE) for share in shares]
    back = [_reaches(np.column_stack((s[:, 0], 1.0 - s[:, 1])), down_s, _RISE) for s in shares]
    peaks = [abs(size) * (_smooth(_between(share, up_s, down_s))[:, 1].max() - 1.0) for share in shares]
    steady = [size * _between(share, down_s - 0.3, down_s)[:, 1].mean() for share in shares]
    rms = _rms(attitudes[0][:, [0, 1 + axis]], attitudes[1][:, [0, 1 + axis]], up_s, end_s)
    return [
        close("response", f"{phase}: 63 % after", rise, _TIME_S, "s", _TIME_REASON, 3),
        close("response", f"{phase}: back by 63 % after", back, _TIME_S, "s", _TIME_REASON, 3),
        close("response", f"{phase}: greatest angle beyond the setpoint", peaks, _ANGLE_DEG, "deg", _ANGLE_REASON),
        close("response", f"{phase}: mean of the last 0.3 s", steady, _ANGLE_DEG, "deg", _ANGLE_REASON),
        apart("response", f"{phase}: RMS of the difference over 2 s", rms, _ANGLE_DEG, "deg", _ANGLE_REASON),
    ]


def _take_off(recording: Recording, velocities: list[Array]) -> list[Row]:
    """Heights after the command, and the greatest speed on the way."""
    commands = [event for event in recording.of_kind("command") if event.values["params"][:3] == [1, 4, 2]]
    begin_s = commands[0].time_s
    climbs = [_between(series, begin_s, begin_s + 8.0) for series in velocities]
    heights = [np.column_stack((climb[:, 0], climb[0, 1] - climb[:, 1])) for climb in climbs]
    low, high = ([_reaches(height, begin_s, level) for height in heights] for level in (1.0, 2.0))
    peaks = [-_smooth(climb)[:, 2].min() for climb in climbs]
    return [
        close("take-off", "1 m above the ground after", low, 0.3, "s", _TAKE_OFF_REASON),
        close("take-off", "2 m above the ground after", high, 0.3, "s", _TAKE_OFF_REASON),
        close("take-off", "greatest climb speed", peaks, 0.2, "m/s", _TAKE_OFF_REASON),
    ]


def _push(told: list[Setpoint], velocities: list[Array], phase: tuple[float, float]) -> list[Row]:
    """Vertical acceleration and velocity after the thrust has grown."""
    begin_s, end_s = phase
    before = [one.thrust for one in told if one.time_s < begin_s - 0.1][-1]
    up_s = next(one.time_s for one in told if one.time_s >= begin_s - 0.1 and one.thrust > before + 0.05)
    climbs = [np.column_stack((series[:, 0], -series[:, 2])) for series in velocities]
    start = [_between(climb, up_s - 0.3, up_s)[:, 1].mean() for climb in climbs]
    slopes = [_slope(_between(climb, up_s + 0.05, up_s + 0.35)) for climb in climbs]
    gains = [np.column_stack((c[:, 0], c[:, 1] - s)) for c, s in zip(climbs, start, strict=True)]
    peaks = [_smooth(_between(gain, up_s, up_s + 1.5))[:, 1].max() for gain in gains]
    half = [_reaches(gain, up_s, 0.5 * peaks[0]) for gain in gains]
    heights = [-series[:, 1] for series in velocities]
    ends = [
        float(np.interp(end_s, v[:, 0], h) - np.interp(up_s, v[:, 0], h))
        for v, h in zip(velocities, heights, strict=True)
    ]
    rms = _rms(gains[0], gains[1], up_s, end_s)
    return [
        close(
            "response",
            f"{THRUST}: acceleration, 0.05 to 0.35 s",
            slopes,
            0.1,
            "m/s2",
            "noise of the velocity over 0.3 s",
        ),
        close(
            "response",
            f"{THRUST}: half of the climb speed after",
            half,
            0.04,
            "s",
            "0.02 m/s of noise at 1 m/s2, and a period",
            3,
        ),
        close("response", f"{THRUST}: greatest gain of climb speed", peaks, _SPEED_M_S, "m/s", _SPEED_REASON),
        close(
            "response", f"{THRUST}: height gained", ends, 0.05, "m", "speed's wander over 2.6 s, noise of the height"
        ),
        apart("response", f"{THRUST}: RMS of the difference in speed", rms, _SPEED_M_S, "m/s", _SPEED_REASON, 3),
    ]


def _ramp(phase: str, told: list[Setpoint], attitudes: list[Array], begin_s: float) -> list[Row]:
    """How far the yaw lags behind the ramp in its last second, and at most."""
    end_s = begin_s + RAMP_S - 0.05
    wanted = np.array([(one.time_s, _angles_deg(one)[2]) for one in told])
    sign = np.sign(np.interp(end_s, *wanted.T) - np.interp(begin_s + 0.1, *wanted.T))
    yaws = [np.column_stack((series[:, 0], np.degrees(np.unwrap(np.radians(series[:, 3]))))) for series in attitudes]
    lags = []
    for yaw in yaws:
        during = _between(yaw, begin_s, end_s)
        lags.append(np.column_stack((during[:, 0], sign * (np.interp(during[:, 0], *wanted.T) - during[:, 1]))))
    late = [float(_between(lag, end_s - 1.0, end_s)[:, 1].mean()) for lag in lags]
    most = [float(_smooth(lag)[:, 1].max()) for lag in lags]
    rms = _rms(yaws[0], yaws[1], begin_s, end_s)
    return [
        close("response", f"{phase}: lag in the last second", late, _YAW_DEG, "deg", _YAW_REASON),
        close("response", f"{phase}: greatest lag", most, _YAW_DEG, "deg", _YAW_REASON),
        apart("response", f"{phase}: RMS of the difference", rms, _YAW_DEG, "deg", _YAW_REASON),
    ]


def _angles_deg(setpoint: Setpoint) -> Array:
    return np.degrees(euler_from_quaternion(np.array(setpoint.quaternion)))


def _between(series: Array, begin_s: float, end_s: float) -> Array:
    return series[(series[:, 0] >= begin_s) & (series[:, 0] < end_s)]


def _reaches(series: Array, begin_s: float, level: float) -> float:
    """Seconds until a series first crosses a level upwards, between two samples by a straight line."""
    later = series[series[:, 0] >= begin_s]
    index = int(np.argmax(later[:, 1] >= level))
    (t0, v0), (t1, v1) = later[index - 1, :2], later[index, :2]
    return float(t0 + (level - v0) / (v1 - v0) * (t1 - t0) - begin_s)


def _slope(series: Array) -> float:
    """Slope of the straight line through a series."""
    return float(np.polyfit(series[:, 0], series[:, 1], 1)[0])


def _smooth(series: Array) -> Array:
    """Mean of five samples (50 ms), so that a peak is not one of noise."""
    kernel = np.full(5, 0.2)
    return np.column_stack([np.convolve(column, kernel, "valid") for column in series.T])


def _rms(recorded: Array, simulated: Array, begin_s: float, end_s: float) -> float:
    """RMS of the difference of two series, at the times of the first."""
    theirs = _between(recorded, begin_s, end_s)
    difference = np.interp(theirs[:, 0], *simulated[:, :2].T) - theirs[:, 1]
    return float(np.sqrt((difference**2).mean()))
