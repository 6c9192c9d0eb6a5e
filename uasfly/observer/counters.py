"""What the observer counts of what it refuses."""

from __future__ import annotations

from dataclasses import dataclass, field

from uasfly.observer import states as s


@dataclass(slots=True)
class Counters:
    """What the observer refused, since it was made.

    Attributes:
        rejected: measurements outside their gate, by sensor.
        late: put back in time. dropped: too old for the buffer. duplicates: sensor and time already there.
        ahead: alone far ahead in time. non_finite: samples or parts of samples with unusable numbers.
        restarts: times the filter started again after a gap or a clock that was set back.
    """

    rejected: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys((*s.SENSORS, s.MARKER_SENSOR, s.ACCELEROMETER_SENSOR), 0)
    )
    late: int = 0
    dropped: int = 0
    duplicates: int = 0
    ahead: int = 0
    non_finite: int = 0
    restarts: int = 0
