"""Is everything as it has to be, before anything is armed?

Pure: what was gathered goes in, a list of checks comes out.
"""

from uasfly.flight.preflight.judging import announcements, as_pilot_flies, judge, stop_reason
from uasfly.flight.preflight.parameters import PARAMETERS
from uasfly.flight.preflight.preflight import Preflight

__all__ = ["PARAMETERS", "Preflight", "announcements", "as_pilot_flies", "judge", "stop_reason"]
