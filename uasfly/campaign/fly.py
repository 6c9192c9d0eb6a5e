"""Flies one flight of a campaign and boils its summary down to one flat row; this is what runs on the workers."""

from __future__ import annotations

import json
import os
import pickle
import socket
import threading
from typing import Any

TIMING = "timing_"  # columns that begin like this tell of the machine, and differ from run to run
ERROR = "error"

_one_at_a_time = threading.Lock()  # a worker with several threads: Python would only make them wait for each other

Result = dict[str, Any]


def fly(pickled_plan: bytes, code: str) -> Result:
    """Fly a plan.

    Args:
        pickled_plan: a `FlightPlan`: workers need not see the files that it came from.
        code: digest of the code that must fly it; a worker may have joined late, with another.

    Returns:
        What `flat` makes of the summary; where the flight raised, its outcome is "error" and its reason the error.
    """
    from uasfly.campaign.identity import code_digest
    from uasfly.drivers.rehearse import rehearse
    from uasfly.errors import describe_error

    with _one_at_a_time:
        try:
            if code_digest() != code:
                return error_result(f"the worker on {socket.gethostname()} has another uasfly; install the same there")
            return flat(rehearse(pickle.loads(pickled_plan)))
        except Exception as error:
            return error_result(describe_error(error))


def error_result(reason: str) -> Result:
    """The row of a flight that came to no end."""
    return {"outcome": ERROR, "reason": reason}


def flat(summary: dict[str, Any]) -> Result:
    """One row from a flight's summary: what was flown is left out, units are in the names."""
    row: Result = {key: summary[key] for key in ("outcome", "reason", "duration_s")}
    tracking = summary["tracking_rms_m"] or {}
    for axis in ("x", "y", "z"):
        row[f"tracking_rms_{axis}_m"] = tracking.get(axis)
    row["tracking_rms_m"] = tracking.get("total")
    row["tracking_max_m"] = summary["tracking_max_m"]
    row["estimate_rms_m"] = (summary["estimate_rms_m"] or {}).get("total")
    row["gnss_rms_m"] = (summary["gnss_rms_m"] or {}).get("total")
    row["fallback_steps"] = summary["fallback_steps"]
    row["rejected"] = sum(summary["rejected"].values())
    row["rejected_by_kind"] = json.dumps(summary["rejected"], sort_keys=True)
    for axis, force in zip(("x", "y", "z"), summary["force_m_s2"], strict=True):
        row[f"force_{axis}_m_s2"] = force
    row["warnings"] = "; ".join(summary["warnings"])
    for name in ("solve_ms", "cycle_ms"):
        for quantile, value in (summary[name] or {}).items():
            row[f"{TIMING}{name.removesuffix('_ms')}_{quantile}_ms"] = value
    factor = summary["real_time_factor"]
    row[f"{TIMING}real_time_factor"] = factor
    row[f"{TIMING}wall_s"] = round(summary["duration_s"] / factor, 4) if factor else None
    row[f"{TIMING}worker"] = f"{socket.gethostname()}:{os.getpid()}"
    return row
