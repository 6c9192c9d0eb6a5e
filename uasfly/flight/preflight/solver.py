"""Does the solver keep up on this computer?"""

from __future__ import annotations

import numpy as np

from uasfly.control.nmpc_controller import DEADLINE_SHARE
from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.preflight_messages import PreflightCheck

LATE_WARNING = 0.02  # share of late steps: more than a busy moment of the computer
BUSY_SHARE = 0.5  # of the deadline, median: camera, log and a hot processor want the rest

_SOLVER = Subject("solver", "a solve that is late is replaced by the last plan, then by the backup PIDs")


def solver_check(gathered: Gathered) -> PreflightCheck:
    """Times of warm steps against the controller's period."""
    if gathered.facts is None:
        return _SOLVER.warning("not measured", "fly `uasfly rehearse` on this computer and look at its solver times")
    times = np.array(gathered.facts.solve_ms)
    if not len(times):
        return _SOLVER.ok("none, the PIDs fly")
    period_ms = 1e3 / gathered.airframe.controller.rate_hz
    deadline_ms = DEADLINE_SHARE * period_ms
    median, high = np.percentile(times, (50.0, 99.0)).tolist()
    late = float(np.mean(times > deadline_ms))
    value = f"median {median:.2f} ms, 99 % within {high:.2f} ms, of a period of {period_ms:.0f} ms"
    remedy = "install a C compiler (ten times as fast), lower controller.rate_hz or controller.nodes"
    if late > gathered.mission.monitors.solver.backup_share:
        return _SOLVER.stop(value, remedy)
    if late > LATE_WARNING or median > BUSY_SHARE * deadline_ms:
        return _SOLVER.warning(value, remedy)
    return _SOLVER.ok(value)
