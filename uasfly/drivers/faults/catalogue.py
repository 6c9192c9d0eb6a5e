"""The faults that are flown, and what has to happen in each. All begin six seconds after offboard."""

from __future__ import annotations

from typing import Any

from uasfly.drivers.faults.case import HEIGHT_M, HOVER, HOVER_S, TRACK, Act, FaultCase

Faults = tuple[dict[str, Any], ...]

LANDS = ("asks hold", "asks land", "aborted")  # the mission is left: hold, then its ending
COMPLETES = ("asks land", "completed")
WALL = (f"mission.legs=[{{type: hover, position_m: [2.4, 0, {HEIGHT_M}], duration_s: {HOVER_S}}}]",)
LOW_CEILING = (*HOVER, f"mission.limits.altitude_max_m={HEIGHT_M + 0.1}", "mission.monitors.altitude.margin_m=0.2")


def _fault(kind: str, **fields: Any) -> Faults:
    return ({"kind": kind, **fields},)


GNSS = (
    FaultCase("gnss_off", "GNSS off for 20 s", ("hold", "land", *LANDS), 0.6, 2.5, _fault("gnss_lost", duration_s=20)),
    FaultCase(
        "gnss_jump",
        "GNSS jumps by 8 m",
        ("hold", "flies on", *COMPLETES),
        0.3,
        1.0,
        _fault("gnss_jump", offset_m=[8, 0, 0]),
    ),
    FaultCase(
        "gnss_drift",
        "GNSS drifts away with 1 m/s",
        ("hold", "end", *LANDS),
        0.6,
        3.5,
        _fault("gnss_drift", velocity_m_s=[1, 0, 0]),
    ),
    FaultCase(
        "gnss_degraded",
        "5 m accuracy and 4 satellites for 8 s",
        ("slow down", "flies on", *COMPLETES),
        0.3,
        4.0,
        _fault("gnss_degraded", accuracy_m=5, satellites=4, duration_s=8),
    ),
)

TELEMETRY = (
    FaultCase(
        "velocity_spike",
        "velocity wrong by 5 m/s for 0.1 s",
        COMPLETES,
        0.3,
        None,
        _fault("velocity_spike", offset_m_s=[5, 0, 0]),
    ),
    FaultCase(
        "velocity_wrong",
        "velocity wrong by 2 m/s for 30 s",
        ("back off", "hand over", "aborted"),
        3.0,
        2.5,
        _fault("velocity_spike", offset_m_s=[2, 0, 0], duration_s=30),
        settings=TRACK,
    ),
    FaultCase(
        "attitude_spike",
        "attitude wrong by 30 deg for 0.1 s",
        COMPLETES,
        0.3,
        None,
        _fault("attitude_spike", rotation_deg=[30, 0, 0]),
    ),
    FaultCase(
        "nan_position",
        "position not finite for 1 s",
        COMPLETES,
        0.3,
        None,
        _fault("odometry_nan", part="position"),
    ),
    FaultCase(
        "nan_telemetry",
        "nothing in the telemetry is finite for 0.6 s",
        ("silent", "streams", *COMPLETES),
        0.5,
        0.4,
        _fault("odometry_nan", part="all", duration_s=0.6),
    ),
    FaultCase(
        "silence_2s",
        "no telemetry and no setpoints for 2 s",
        ("silent", "streams", *COMPLETES),
        1.5,
        0.4,
        _fault("silence", direction="both", duration_s=2),
        live=True,
    ),
    FaultCase(
        "silence_10s",
        "no telemetry and no setpoints for 10 s",
        ("silent", *LANDS),
        2.0,
        0.4,
        _fault("silence", direction="both", duration_s=10),
    ),
    FaultCase("loss", "30 % of all packets lost", COMPLETES, 0.3, None, _fault("loss", share=0.3, direction="both")),
    FaultCase("duplicates", "half of all packets come twice", COMPLETES, 0.3, None, _fault("duplicates", share=0.5)),
    FaultCase(
        "reorder",
        "30 % of all packets come 30 ms late",
        COMPLETES,
        0.3,
        None,
        _fault("reorder", share=0.3, delay_s=0.03),
    ),
    FaultCase(
        "garbage",
        "200 bursts of random bytes a second",
        COMPLETES,
        0.3,
        None,
        _fault("garbage", rate_hz=200),
        live=True,
    ),
    FaultCase(
        "clock_jump",
        "the vehicle's clock jumps by 3 s",
        COMPLETES,
        1.0,
        None,
        _fault("clock_jump", step_s=3),
        live=True,
    ),
)

VEHICLE = (
    FaultCase("reboot", "the vehicle restarts in flight", ("silent", "aborted"), 3.0, 0.4, _fault("reboot"), live=True),
    FaultCase("battery_low", "battery at 25 %", ("warn", *COMPLETES), 0.3, 3.0, _fault("battery", charge=0.25)),
    FaultCase("battery_empty", "battery at 18 %", ("end", *LANDS), 0.3, 3.0, _fault("battery", charge=0.18)),
    FaultCase("motor_weak", "a motor at 70 %", COMPLETES, 0.5, None, _fault("motor", motor=0, effectiveness=0.7)),
    FaultCase(
        "arming_refused",
        "the vehicle does not arm",
        ("aborted",),
        0.0,
        None,
        ({"kind": "refuse_arming", "at_s": 0.0, "after": "boot"},),
    ),
    FaultCase(
        "offboard_refused",
        "the vehicle does not take offboard",
        (*LANDS,),
        0.0,
        None,
        ({"kind": "refuse_offboard", "at_s": 0.0, "after": "boot"},),
    ),
    FaultCase(
        "odd_acknowledgement",
        "a command is answered with result 10",
        COMPLETES,
        0.3,
        None,
        ({"kind": "odd_acknowledgement", "result": 10, "count": 1},),
        live=True,
    ),
    FaultCase(
        "switched_away_and_back",
        "the pilot switches to position and, 6 s later, back to offboard",
        ("taken over", "taken up", *COMPLETES),
        1.0,
        1.5,
        ({"kind": "mode", "mode": "position"}, {"kind": "mode", "mode": "offboard", "at_s": 12.0}),
    ),
    FaultCase(
        "pilot_lands",
        "the pilot switches to land",
        ("taken over", "aborted"),
        2.5,
        1.5,
        _fault("mode", mode="land"),
    ),
    FaultCase("setpoints_halved", "every second setpoint is lost", COMPLETES, 0.3, None, _fault("setpoints_halved")),
)

WIND = (
    FaultCase(
        "wind_strong",
        "wind of 11 m/s for 8 s",
        ("warn", *COMPLETES),
        0.5,
        None,
        _fault("wind", velocity_m_s=[11, 0, 0], ramp_s=4, duration_s=8),
        scenario="calm",
    ),
    FaultCase(
        "wind_twice_the_limit",
        "wind of 28 m/s, rising for 4 s",
        ("warn", "land", *LANDS),
        8.0,
        3.5,
        _fault("wind", velocity_m_s=[28, 0, 0], ramp_s=4, duration_s=10),
        scenario="calm",
    ),
    FaultCase(
        "geofence",
        "a gust of 16 m/s pushes it over the fence",
        ("end", *LANDS),
        2.5,
        2.5,
        _fault("wind", velocity_m_s=[16, 0, 0], ramp_s=0.2, duration_s=1.5),
        settings=(
            *WALL,
            "mission.limits.geofence={radius_m: 2.5}",
            "mission.monitors.geofence={margin_m: 0.2, after_s: 0.1}",
        ),
        scenario="calm",
    ),
    FaultCase(
        "altitude",
        "an updraught of 8 m/s pushes it over the ceiling",
        ("end", *LANDS),
        2.0,
        3.0,
        _fault("wind", velocity_m_s=[0, 0, 8], ramp_s=0.1, duration_s=3),
        settings=LOW_CEILING,
        scenario="calm",
    ),
    FaultCase(
        "sinks",
        "GNSS drifts upwards with 0.3 m/s: it sinks to the ground",
        ("back off", "land", *LANDS),
        1.6,
        7.0,
        _fault("gnss_drift", velocity_m_s=[0, 0, 0.3]),
        scenario="calm",
    ),
    FaultCase(
        "tracking",
        "a gust of 16 m/s for 1.5 s pushes it away",
        ("hold", "flies on", *COMPLETES),
        5.0,
        3.0,
        _fault("wind", velocity_m_s=[16, 0, 0], ramp_s=0.2, duration_s=1.5),
        settings=(*HOVER, "mission.monitors.tracking.error_m=0.5", "mission.monitors.tracking.after_s=0.2"),
        scenario="calm",
    ),
    FaultCase(
        "tilt",
        "a motor stops: it tips over",
        ("hand over", "aborted"),
        3.0,
        2.0,
        _fault("motor", motor=0, effectiveness=0.0),
        airframe="iris",
        scenario="calm",
    ),
)

PROGRAM = (
    FaultCase("ctrl_c", "Ctrl-C", LANDS, 0.3, 0.5, act=Act.CTRL_C),
    FaultCase("ctrl_c_twice", "Ctrl-C twice, 0.5 s apart", ("asks hold", "aborted"), 0.3, 0.5, act=Act.CTRL_C_TWICE),
    FaultCase("terminated", "SIGTERM", LANDS, 0.3, 0.5, act=Act.TERMINATE),
    FaultCase("terminal_closed", "SIGHUP", LANDS, 0.3, 0.5, act=Act.HANG_UP),
    FaultCase(
        "frozen",
        "SIGSTOP for 3 s",
        ("stands still", "streams", *COMPLETES),
        2.5,  # a second of its last setpoint, then PX4's own hold, in gusts
        0.25,
        act=Act.FREEZE,
    ),
    FaultCase("killed", "SIGKILL", ("killed", "vehicle in hold"), 2.5, 0.2, act=Act.KILL),
    FaultCase(
        "cycle_hangs",
        "one control cycle takes 3 s",
        ("stands still", "streams", *COMPLETES),
        2.5,  # a second of its last setpoint, then PX4's own hold, in gusts
        0.25,
        act=Act.HANG,
    ),
    FaultCase(
        "solver_fails", "every solve fails", ("warn", "end", *LANDS), 0.5, 2.0, act=Act.FAILING_SOLVER, act_s=60.0
    ),
    FaultCase("disk_full", "the disk is full", ("completed",), 0.3, None, act=Act.DISK_FULL),
    FaultCase("log_folder_gone", "the log's folder is removed", COMPLETES, 0.3, 2.0, act=Act.FOLDER_GONE),
)

CATALOGUE: tuple[FaultCase, ...] = (*GNSS, *TELEMETRY, *VEHICLE, *WIND, *PROGRAM)
