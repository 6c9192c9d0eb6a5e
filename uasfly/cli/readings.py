"""The values of a scene as rows, each with its colour: how they read, not where they stand."""

from __future__ import annotations

import math

from uasfly.cli.blocks import Row, row
from uasfly.cli.gauges import GREEN, RED, UNKNOWN, YELLOW, bar, graded, length, number
from uasfly.cli.scene import Scene
from uasfly.messages import Authority, Phase, Status
from uasfly.wind_messages import WindEstimate

LABEL = "cyan"
_LABEL_WIDTH = 10


def label(text: str) -> tuple[str, str]:
    """The name of a value."""
    return text.ljust(_LABEL_WIDTH), LABEL


def offset_m(status: Status) -> list[float] | None:
    """From the reference to where the vehicle is, None where one of them is not known."""
    estimate, reference = status.estimate, status.reference_position_in_world
    if estimate is None or reference is None:
        return None
    return [a - b for a, b in zip(estimate.position_in_world.tolist(), reference.tolist(), strict=True)]


def error_m(status: Status) -> float:
    """Distance from the reference, NaN where there is none."""
    offset = offset_m(status)
    return math.nan if offset is None else length(offset)


def distance(value_m: float) -> tuple[str, str]:
    """A distance in few digits, and its unit: centimetres below a metre."""
    if not value_m >= 1.0:
        return number(value_m * 100.0, ".1f"), "cm"
    return number(value_m, ".2f" if value_m < 10.0 else ".0f"), "m"


def error_colour(value_m: float) -> str:
    """Of a tracking error; no reference is no fault."""
    return graded(value_m, 0.1, 0.3) if not math.isnan(value_m) else ""


def force(status: Status) -> tuple[float, float, float]:
    """Of the wind, NaN where it is not known."""
    if status.estimate is None:
        return math.nan, math.nan, math.nan
    east, north, up = status.estimate.force_in_world.tolist()
    return east, north, up


def wind_from(wind: WindEstimate) -> str:
    """Where the wind comes from, "" where it is too weak to say."""
    return f"from {wind.mean_from_deg:.0f}°" if math.isfinite(wind.mean_from_deg) else ""


def wind_in_words(wind: WindEstimate | None) -> str:
    """Speed, direction and gusts in a line."""
    if wind is None:
        return "unknown"
    words = f"{number(wind.mean_speed_m_s, '.1f')} m/s {wind_from(wind)}".rstrip()
    return f"{words}, gusts {number(wind.gust_m_s, '.1f')}"


def pushes(wind: WindEstimate) -> tuple[float, float]:
    """Where the wind pushes, east and north; NaN where it is too weak to say."""
    if not math.isfinite(wind.mean_from_deg):
        return math.nan, math.nan
    east, north = wind.mean_in_world.tolist()
    return east, north


def margin(authority: Authority | None) -> tuple[float, str]:
    """What the wind leaves of tilt and thrust, 0..1 or NaN, and its colour."""
    peak = math.nan if authority is None else authority.peak
    left = 1.0 - peak if math.isfinite(peak) else 0.0 if peak == math.inf else math.nan
    return min(max(left, 0.0), 1.0) if not math.isnan(left) else left, graded(peak, 0.75, 0.95) if authority else ""


def cannot_hold(authority: Authority | None) -> bool:
    """Whether the wind takes all there is."""
    return authority is not None and authority.peak >= 1.0


def homeward(authority: Authority | None) -> Row:
    """How much flying home takes."""
    if authority is None:
        return row(("way home  ", LABEL), UNKNOWN)
    share = authority.homeward
    if share >= 1.0:
        return row(("cannot return", f"bold {RED}"))
    return row(("way home  ", LABEL), (f"takes {number(share * 100.0, '.0f')} %", graded(share, 0.75, 0.95)))


def sigmas(status: Status) -> tuple[Row, Row]:
    """How well position and velocity are known: the worst axis."""
    position = velocity = math.nan
    if status.estimate is not None:
        position = max(status.estimate.position_sigma_m.tolist())
        velocity = max(status.estimate.velocity_sigma_m_s.tolist())
    number_of, unit = distance(position)
    known = status.estimate is not None
    return (
        row(("position ", LABEL), (f"± {number_of} {unit}", graded(position, 0.5, 1.5) if known else "")),
        row(
            ("velocity ", LABEL),
            (f"± {number(velocity * 100.0, '.1f')} cm/s", graded(velocity, 0.15, 0.5) if known else ""),
        ),
    )


def axes(name: str, values: list[float] | None, unit: str, form: str = "+.2f", scale: float = 1.0) -> Row:
    """East, north and up."""
    x, y, z = values if values is not None else (math.nan,) * 3
    texts = [number(v * scale, form, width=8) for v in (x, y, z)]
    return row((name.ljust(9), LABEL), "".join(texts), (f" {unit}", "dim"))


def where(status: Status) -> list[Row]:
    """Position, velocity, reference and the error of each axis."""
    estimate, reference = status.estimate, status.reference_position_in_world
    return [
        axes("position", None if estimate is None else estimate.position_in_world.tolist(), "m"),
        axes("reference", None if reference is None else reference.tolist(), "m"),
        axes("error", offset_m(status), "cm", "+.1f", 100.0),
        axes("velocity", None if estimate is None else estimate.velocity_in_world.tolist(), "m/s"),
    ]


def battery(status: Status, width: int) -> Row:
    """Charge and voltage."""
    share = status.battery_remaining
    colour = GREEN if share >= 0.3 else YELLOW if share >= 0.2 else RED if share < 0.2 else "dim"
    filled, rest = bar(share, width)
    volts = number(status.battery_voltage_v, ".1f")
    return row(
        label("battery"),
        (filled, colour),
        (rest, "dim"),
        (f" {number(share * 100.0, '.0f')} %", colour),
        f"  {volts} V",
    )


def telemetry(status: Status) -> Row:
    """Age of the last odometry, and of the last sighting of the marker that the mission hangs on."""
    age_s, marker_s = status.telemetry_age_s, status.marker_age_s
    if not math.isfinite(age_s):
        return row(label("telemetry"), ("none yet", YELLOW))
    text = f"{age_s * 1e3:.0f} ms old" if age_s < 1.0 else f"{age_s:.1f} s old"
    marker = row((", marker ", "dim"), (f"{marker_s:.1f} s", graded(marker_s, 1.0, 5.0))) if marker_s >= 0.0 else []
    return [*row(label("telemetry"), (text, graded(age_s, 0.1, 0.2))), *marker]


def rates(scene: Scene) -> Row:
    """Control cycles and setpoints a second; a cycle that is late is a fault, a pause of the setpoints need not be."""
    planned_hz = 1e3 / scene.period_ms if scene.period_ms > 0.0 else math.nan
    short = scene.cycle_hz < 0.9 * planned_hz and scene.clock_s > 1.0
    return row(
        label("control"),
        (number(scene.cycle_hz, ".0f"), RED if short else ""),
        (" Hz, setpoints ", "dim"),
        number(scene.sent_hz, ".0f"),
        (" Hz", "dim"),
    )


def solver(scene: Scene) -> Row:
    """Time of the last and of the middle solve, its share of the period, and what replaced its answer."""
    share = scene.solve_ms / scene.period_ms if scene.period_ms > 0.0 else math.nan
    if scene.status.fallback:
        return row(label("solver"), (f"fallback: {scene.status.fallback}", f"bold {RED}"))
    return row(
        label("solver"),
        f"{_short(scene.last_solve_ms)} ms",
        (", median ", "dim"),
        (_short(scene.solve_ms), graded(share, 0.5, 0.8) if math.isfinite(share) else ""),
        (f", {number(share * 100.0, '.0f')} %", "dim"),
    )


def _short(milliseconds: float) -> str:
    """A time in three digits at most."""
    return number(milliseconds, ".2f" if milliseconds < 1.0 else ".1f" if milliseconds < 10.0 else ".0f")


def leg(scene: Scene) -> str:
    """Number and name of the leg."""
    index, count = scene.status.leg, len(scene.legs)
    if index < 0:
        return "between legs" if scene.status.phase is Phase.LEGS else scene.status.phase.value
    name = f" · {scene.legs[index]}" if index < count else ""
    return f"leg {index + 1}" + (f" of {count}" if count else "") + name


def clock(seconds: float) -> str:
    """Minutes and seconds."""
    if not math.isfinite(seconds):
        return UNKNOWN
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def severity_style(severity: int) -> str:
    """Colour of a text: errors, warnings, notices and small talk."""
    return f"bold {RED}" if severity <= 3 else YELLOW if severity == 4 else "" if severity == 5 else "dim"
